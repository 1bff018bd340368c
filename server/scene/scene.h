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

#include "clients/cpp/dscp.h"
#include "core/base/time.h"
#include "devices/driver.h"
#include "devices/falcon/falcon_device.h"
#include "devices/replay/replay_device.h"
#include "devices/safety/safe_device.h"
#include "devices/simulated/simulated_device.h"
#include "devices/spacemouse/spacemouse_device.h"
#include "devices/woodenhaptics/woodenhaptics_device.h"
#include "protocol/field/brick_store.h"
#include "protocol/link.h"
#include "server/haptic_loop.h"
#include "server/network_loop.h"
#include "server/recording/keep.h"
#include "server/scene/scene_error.h"

namespace tendon {

/// The checked configuration of a device and its server in SI units.
struct Scene {
  struct Network {
    Address listen = parse_address("127.0.0.1:47100");
    std::optional<std::filesystem::path> unix_path{};  ///< see UnixSocket; relative to the current directory
    std::optional<std::filesystem::path> keys;         ///< directory; if empty, no keys are required on this machine
    Suites suites = all_suites();  ///< for clients with a key; only those that the processor supports
    std::size_t max_observers = NetworkLoop::Config{}.max_observers;
    Duration controller_timeout = NetworkLoop::Config{}.controller_timeout;
    Duration observer_timeout = NetworkLoop::Config{}.observer_timeout;
    bool adapt_state_rate = NetworkLoop::Config{}.adapt_state_rate;
    std::vector<std::string> takeover{};
    bool busy = false;                       ///< the network thread does not sleep (BusyLink)
    std::optional<Dscp> dscp{};              ///< if empty, datagrams are not marked
    std::optional<std::uint32_t> threads{};  ///< see Shard; empty for the default
  };
  struct Channel {
    std::string name = "main";
    ChannelRule rule = ChannelRule::kSum;
    Duration lease{};  ///< if 0, the channel cannot be taken from its holder
  };

  /// To add a kind, implement the overloads in devices/driver.h and declare its keys in device_keys.cc.
  using AnyDevice = std::variant<SimulatedDevice::Config, falcon::Config, ReplayDevice::Config, spacemouse::Config,
                                 woodenhaptics::Config>;

  struct Recording {
    std::filesystem::path path;  ///< relative to the current directory
    double rotate_bytes = 4e9;
    double rotate_after = 4 * 3600;        ///< s
    std::optional<double> budget_bytes{};  ///< if empty, no recordings are deleted
    Keep keep = Keep::kAll;
    std::optional<std::uint64_t> one_in{};  ///< if empty, no parts are kept because of their number
    double datagram_bytes_per_s = 4e6;
  };

  struct Discovery {
    bool announce = false;
    std::string name;  ///< if empty, "NAME at HOST"
  };

  /// Only used if loop.control.hold.field is set.
  struct Fields {
    std::vector<std::string> channels{};  ///< that can use fields; if empty, all of them
    double cache_bytes = static_cast<double>(BrickStore::Config{}.bytes);  ///< for each network thread
  };

  /// The law is in loop.control.coupling.
  struct Teleoperation {
    std::optional<Address> dial;               ///< if empty, the peer connects to this server
    std::optional<std::filesystem::path> key;  ///< if empty, the session is not encrypted
    std::string device;                        ///< of the peer; if empty, the first one
    std::string channel;                       ///< of the peer; if empty, the first one
    struct Leader {
      std::string channel;
      double share = 0;  ///< initial value of α
    };
    /// In the order of loop.control.leaders. If empty, there is one leader, which can use any channel.
    std::vector<Leader> leaders{};
  };

  std::string name;         ///< name of the device in claims
  std::uint32_t count = 1;  ///< if above 1, there are several devices NAME-0, NAME-1 …
  AnyDevice device;
  std::string axes;  ///< of the base frame, for example "right=x up=y user=z"; empty if unknown
  std::string group;
  Hand hand = Hand::kAny;
  std::optional<SafeDevice::Config> safety;  ///< empty if there is none; always set for real motors
  HapticLoop::Config loop;
  std::optional<std::uint32_t> cpu;  ///< pins the haptic thread
  std::vector<Channel> channels = {Channel{}};
  Fields fields;
  Network network;
  bool has_network = false;
  std::optional<Teleoperation> teleoperation;
  std::optional<Recording> recording;
  std::optional<Discovery> discovery{};
  std::string text;  ///< including the settings

  std::string name_of(std::uint32_t index) const;
  const Driver& driver() const;
  bool shares_thread() const { return driver().ids.empty(); }  ///< USB devices may block, so they have their own
  bool has_fields() const { return loop.control.hold.field.has_value(); }
  bool may_use_fields(const Channel& channel) const;
  bool dials() const { return teleoperation && teleoperation->dial; }
  /// For devices other than SimulatedDevice, for measuring the cost of a step.
  SimulatedDevice::Config simulated() const;
};

/// Returns the key that prevents several network threads, or an empty string. A busy thread requires its own processor.
/// The kernel cannot distribute datagrams from a Unix socket or a dialled server (UdpLink::several).
std::string_view needs_one_network_thread(const std::vector<Scene>& scenes);

const std::vector<const Driver*>& drivers();  ///< in the order of Scene::AnyDevice

/// Thrown if a scene file, or a file that is used by a scene, cannot be read.
class SceneFileError : public SceneError {
 public:
  using SceneError::SceneError;
};

/// Throws SceneError if the scene is not valid, and SceneFileError if the file cannot be read or is not a regular file.
/// Reports the first error, and missing keys only if there are no others, as a misspelled key is also missing.
Scene read_scene(const std::filesystem::path& file);

/// Reads the scenes of a server. `loop.device` is set to the index of the first device of each scene. Only the first
/// scene can have tables [network] and [recording]. Device names must be unique. There can be kMostDevices, and USB
/// devices must be among the first limits::kMaxDevices. `overrides` returns settings for parse_scene().
using Overrides = std::function<std::vector<std::string>(const Scene&)>;
std::vector<Scene> read_scenes(const std::vector<std::filesystem::path>& files, const Overrides& overrides = {});

std::vector<Scene> each_device(const std::vector<Scene>& scenes);

/// Parses a scene. `name` is used in error messages. Recorded motions are loaded relative to `directory`.
///
/// Each of the `settings` is "TABLE.KEY=VALUE", where the value is in TOML or is a word without quotes. Without a
/// value, the key or the table is removed. `Scene::text` then contains the resulting scene without comments.
Scene parse_scene(std::string_view text, const std::string& name, const std::filesystem::path& directory,
                  std::span<const std::string> settings = {});

/// Replaces the limiter by `law` without any parts. The friction bounds of `control` are not changed.
std::vector<std::string> limiter_settings(std::string_view law, const HapticController::Config& control);

struct ScenePart {
  std::string key;
  std::string_view what;
};

const std::vector<ScenePart>& scene_parts();

/// Everything that depends on it is also removed. The device must be simulated. Returns false if it does not exist.
bool take_out(Scene& scene, std::string_view key);

std::string scene_reference();

/// Documents a table, such as "limiter" or "device.hand". Throws std::invalid_argument with the closest name.
std::string scene_reference(std::string_view table);

std::string scene_tables();

}  // namespace tendon
