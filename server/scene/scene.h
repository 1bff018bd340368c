// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/base/time.h"
#include "devices/driver.h"
#include "devices/falcon/falcon_device.h"
#include "devices/replay/replay_device.h"
#include "devices/safety/safe_device.h"
#include "devices/simulated/simulated_device.h"
#include "devices/spacemouse/spacemouse_device.h"
#include "devices/woodenhaptics/woodenhaptics_device.h"
#include "protocol/link.h"
#include "server/haptic_loop.h"
#include "server/network_loop.h"
#include "server/recording/keep.h"

namespace tendon {

/// The configuration of a device and its server in SI units. The values have been checked, so they are accepted by the
/// constructors of the device and of the loops.
struct Scene {
  struct Network {
    Address listen = parse_address("127.0.0.1:47100");
    std::optional<std::filesystem::path> unix_path{};  ///< see UnixSocket; relative to the current directory
    std::optional<std::filesystem::path> keys;         ///< directory; if empty, no keys are required on this machine
    /// The cipher suites that are allowed for clients with a key. Only those that are supported by the processor are
    /// used.
    Suites suites = all_suites();
    std::size_t max_observers = NetworkLoop::Config{}.max_observers;
    Duration controller_timeout = NetworkLoop::Config{}.controller_timeout;
    Duration observer_timeout = NetworkLoop::Config{}.observer_timeout;
    bool adapt_state_rate = NetworkLoop::Config{}.adapt_state_rate;
    std::vector<std::string> takeover{};     ///< see NetworkLoop
    bool busy = false;                       ///< the network thread does not sleep (BusyLink)
    std::optional<std::uint32_t> threads{};  ///< see Shard; empty for the default
  };
  struct Channel {
    std::string name = "main";
    ChannelRule rule = ChannelRule::kSum;
    Duration lease{};  ///< if 0, the channel cannot be taken from its holder
  };

  /// All kinds of devices. To add one, implement the overloads in devices/driver.h and declare its keys in
  /// device_keys.cc.
  using AnyDevice = std::variant<SimulatedDevice::Config, falcon::Config, ReplayDevice::Config, spacemouse::Config,
                                 woodenhaptics::Config>;

  /// See PartRecorder and DatagramSieve.
  struct Recording {
    std::filesystem::path path;  ///< relative to the current directory
    double rotate_bytes = 4e9;
    double rotate_after = 4 * 3600;        ///< s
    std::optional<double> budget_bytes{};  ///< if empty, no recordings are deleted
    Keep keep = Keep::kAll;
    std::optional<std::uint64_t> one_in{};  ///< if empty, no parts are kept because of their number
    double datagram_bytes_per_s = 4e6;
  };

  /// Announces the device by DNS-SD, see Announcer.
  struct Discovery {
    bool announce = false;
    std::string name;  ///< if empty, "NAME at HOST"
  };

  /// The connection to the peer of the coupling. Its law is in loop.control.coupling.
  struct Teleoperation {
    std::optional<Address> dial;               ///< if empty, the peer connects to this server
    std::optional<std::filesystem::path> key;  ///< if empty, the session is not encrypted
    std::string device;                        ///< of the peer; if empty, the first one
    std::string channel;                       ///< of the peer; if empty, the first one
    /// One of several leaders of a follower.
    struct Leader {
      std::string channel;  ///< of this device
      double share = 0;     ///< initial value of α
    };
    /// In the same order as loop.control.leaders. If this is empty, there is one leader, which can use any channel.
    std::vector<Leader> leaders{};
  };

  std::string name;         ///< name of the device in claims
  std::uint32_t count = 1;  ///< if above 1, there are several devices NAME-0, NAME-1 …
  AnyDevice device;
  std::string axes;   ///< of the base frame, for example "right=x up=y user=z"; empty if unknown
  std::string group;  ///< shared by devices of one body
  Hand hand = Hand::kAny;
  std::optional<SafeDevice::Config> safety;  ///< empty if there is no safety layer; required for real motors
  HapticLoop::Config loop;
  std::optional<std::uint32_t> cpu;  ///< pins the haptic thread
  std::vector<Channel> channels = {Channel{}};
  Network network;
  bool has_network = false;                    ///< the file has a table [network]
  std::optional<Teleoperation> teleoperation;  ///< empty if the device is not coupled
  std::optional<Recording> recording;          ///< empty if nothing is recorded
  std::optional<Discovery> discovery{};        ///< empty if the device is not announced
  std::string text;                            ///< the complete file for the recording, including the settings

  /// Returns the name of the device with this index, which must be less than `count`.
  std::string name_of(std::uint32_t index) const;
  /// Returns the driver of the device.
  const Driver& driver() const;
  /// Returns true if the device is not connected by USB. Such devices never block, so several of them can share a
  /// haptic thread.
  bool shares_thread() const { return driver().ids.empty(); }
  /// Returns true if this server connects to the peer of the coupling.
  bool dials() const { return teleoperation && teleoperation->dial; }
  /// Returns the simulated device. For other devices, this is the simulation that is used for measuring the cost of a
  /// step.
  SimulatedDevice::Config simulated() const;
};

/// Returns the key that prevents the use of several network threads, or an empty string if there is none. A busy thread
/// requires its own processor. Datagrams from a Unix socket, and from a server that this server has connected to,
/// cannot be distributed by the kernel (UdpLink::several).
std::string_view needs_one_network_thread(const std::vector<Scene>& scenes);

/// Returns the drivers for all kinds of devices, in the order of Scene::AnyDevice.
const std::vector<const Driver*>& drivers();

/// An error in a scene. The message is "FILE:LINE: KEY: expected …, found …". The line is omitted if it is unknown, for
/// example because a table is missing. The key is omitted for syntax errors.
class SceneError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Thrown if a scene file, or a file that is used by a scene, cannot be read.
class SceneFileError : public SceneError {
 public:
  using SceneError::SceneError;
};

/// The maximum size of a scene file. It is larger than any reasonable scene, and protects against files of other types.
/// With deeply nested tables, a file of 4 times this size causes a stack overflow in toml++ if the stack has 8 MiB.
inline constexpr std::size_t kMaxSceneBytes = 16'384;

/// Reads a scene file and the recorded motion that it refers to. For a list of the keys, see scene_reference(). Throws
/// SceneError if the scene is not valid, and SceneFileError if the file cannot be read or is not a regular file.
///
/// If there are several errors, the first one in the file is reported. Missing keys are only reported if there are no
/// other errors, because a misspelled key is both unknown and missing.
Scene read_scene(const std::filesystem::path& file);

/// Reads the scenes of a server. `loop.device` is set to the index of the first device of each scene. Only the first
/// scene can have tables [network] and [recording]. Throws an error if another scene has one of these tables, if two
/// devices have the same name, if there are more than kMostDevices, or if a USB device is not among the first
/// limits::kMaxDevices. `overrides` returns the settings from the command line for a scene, see parse_scene().
using Overrides = std::function<std::vector<std::string>(const Scene&)>;
std::vector<Scene> read_scenes(const std::vector<std::filesystem::path>& files, const Overrides& overrides = {});

/// Returns one scene for each device. A scene with a count of N results in N scenes with different names and indices.
std::vector<Scene> each_device(const std::vector<Scene>& scenes);

/// Parses a scene from a string. `name` is used in error messages. Recorded motions are loaded relative to `directory`.
///
/// Each of the `settings` is "TABLE.KEY=VALUE", where the value is in TOML or is a word without quotes. If there is no
/// value, the key or the table is removed. `Scene::text` then contains the resulting scene without comments. If this
/// text is parsed again, the result is the same scene.
Scene parse_scene(std::string_view text, const std::string& name, const std::filesystem::path& directory,
                  std::span<const std::string> settings = {});

/// Returns the settings that replace the limiter by `law` without any parts. The friction bounds of `control` are not
/// changed because they are properties of the device.
std::vector<std::string> limiter_settings(std::string_view law, const HapticController::Config& control);

struct ScenePart {
  std::string key;
  std::string_view what;  ///< a description in one line
};

/// Returns all parts in the order of scene_reference().
const std::vector<ScenePart>& scene_parts();

/// Removes a part, and everything that depends on it, from a scene with a simulated device. Returns false if the scene
/// does not have this part.
bool take_out(Scene& scene, std::string_view key);

/// Returns the documentation of all keys with their meanings, valid values, units and defaults.
std::string scene_reference();

/// Returns the documentation of a table, such as "limiter" or "device.hand", and the tables inside it. If there is no
/// such table, it throws std::invalid_argument and suggests the closest name.
std::string scene_reference(std::string_view table);

/// Returns a list of all tables with the number of keys in each table.
std::string scene_tables();

}  // namespace tendon
