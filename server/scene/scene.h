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

/// Everything that a server runs for one device, as plain values in SI units. They are checked: the constructors of the
/// device and of the loops accept them.
struct Scene {
  struct Network {
    Address listen = parse_address("127.0.0.1:47100");
    std::optional<std::filesystem::path> unix_path{};  ///< see UnixSocket; relative to the current directory
    std::optional<std::filesystem::path> keys;         ///< folder; empty: anybody on this machine may come in
    /// By which those with a key may seal their sessions. The server speaks those of them that its processor can.
    Suites suites = all_suites();
    std::size_t max_observers = NetworkLoop::Config{}.max_observers;
    Duration controller_timeout = NetworkLoop::Config{}.controller_timeout;
    Duration observer_timeout = NetworkLoop::Config{}.observer_timeout;
    bool adapt_state_rate = NetworkLoop::Config{}.adapt_state_rate;
    std::vector<std::string> takeover{};     ///< see NetworkLoop
    bool busy = false;                       ///< its thread never sleeps (BusyLink)
    std::optional<std::uint32_t> threads{};  ///< see Shard; empty: as the server finds right
  };
  struct Channel {
    std::string name = "main";
    ChannelRule rule = ChannelRule::kSum;
    Duration lease{};  ///< 0: its holder stays until it leaves
  };

  /// Every kind of device. A new one needs the overloads of devices/driver.h, and its keys in device_keys.cc.
  using AnyDevice = std::variant<SimulatedDevice::Config, falcon::Config, ReplayDevice::Config, spacemouse::Config,
                                 woodenhaptics::Config>;

  /// How the server records, and where; see PartRecorder and DatagramSieve.
  struct Recording {
    std::filesystem::path path;  ///< relative to the current directory
    double rotate_bytes = 4e9;
    double rotate_after = 4 * 3600;        ///< s
    std::optional<double> budget_bytes{};  ///< empty: nothing is ever deleted
    Keep keep = Keep::kAll;
    std::optional<std::uint64_t> one_in{};  ///< empty: none stays for its number
    double datagram_bytes_per_s = 4e6;
  };

  /// How clients find this device by name (DNS-SD); see Announcer.
  struct Discovery {
    bool announce = false;
    std::string name;  ///< empty: "NAME at HOST", of the device and the machine
  };

  /// How this device finds the one that it is coupled to; the law is loop.control.coupling.
  struct Teleoperation {
    std::optional<Address> dial;               ///< empty: the peer dials this server
    std::optional<std::filesystem::path> key;  ///< of this server, for the peer; empty: in the clear
    std::string device;                        ///< of the peer; empty: its first
    std::string channel;                       ///< of it; empty: its first
    /// Of a follower.
    struct Leader {
      std::string channel;  ///< of this device
      double share = 0;     ///< α at first
    };
    std::vector<Leader> leaders{};  ///< loop.control.leaders has them by number; empty: one, by any channel
  };

  std::string name;         ///< of the device, as clients claim it
  std::uint32_t count = 1;  ///< above 1: so many such simulated devices, NAME-0, NAME-1 …
  AnyDevice device;
  std::string axes;   ///< of its base frame, "right=x up=y user=z"; empty: not known
  std::string group;  ///< devices of one body have the same; empty: by itself
  Hand hand = Hand::kAny;
  std::optional<SafeDevice::Config> safety;  ///< empty: no safety layer; never for a real device
  HapticLoop::Config loop;
  std::optional<std::uint32_t> cpu;  ///< on which the haptic thread stays; empty: anywhere
  std::vector<Channel> channels = {Channel{}};
  Network network;
  bool has_network = false;                    ///< the file has a table [network]
  std::optional<Teleoperation> teleoperation;  ///< empty: the device is not coupled
  std::optional<Recording> recording;          ///< empty: nothing is recorded
  std::optional<Discovery> discovery{};        ///< empty: nothing is announced
  std::string text;  ///< for the recording: the file, whole; with settings, the scene that they make

  /// As clients claim its device of that index, below `count`.
  std::string name_of(std::uint32_t index) const;
  /// The row of its device.
  const Driver& driver() const;
  /// Its device has no plug, so that it computes and never waits: one haptic thread may step several of them.
  bool shares_thread() const { return driver().ids.empty(); }
  /// It is the server that looks for the other end of its coupling.
  bool dials() const { return teleoperation && teleoperation->dial; }
  /// The simulated device itself; for any other, the simulation that stands in where the cost of a step is measured.
  SimulatedDevice::Config simulated() const;
};

/// The key for which a server of these scenes has one network thread only; empty: it may have several. A thread that
/// never sleeps takes a processor. Datagrams through a Unix socket, and those of a server that we have dialled, are not
/// told apart by the kernel (UdpLink::several).
std::string_view needs_one_network_thread(const std::vector<Scene>& scenes);

/// The rows of all kinds of devices, in the order of Scene::AnyDevice.
const std::vector<const Driver*>& drivers();

/// A sentence for the operator about a scene: "FILE:LINE: KEY: expected …, found …". The line is left out when no line
/// of the file is to blame (a table is missing), the key when there is none (a syntax error).
class SceneError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A scene file, or a file that is used by a scene, cannot be read. This is not an error in the scene.
class SceneFileError : public SceneError {
 public:
  using SceneError::SceneError;
};

/// No scene that a person writes comes near this size, and a wrong path may lead to any file. Every second byte can
/// nest one table deeper, and toml++ recurses: a file of 4 times this size overflows a stack of 8 MiB.
inline constexpr std::size_t kMaxSceneBytes = 16'384;

/// Reads a scene file, and the recorded motion that it names. `scene_reference()` lists its keys. Throws SceneError,
/// and SceneFileError: "cannot read FILE: No such file or directory" when there is no such file, likewise for a
/// directory, a named pipe or a device.
///
/// Of several mistakes, the first in the file is reported. A missing key is reported only when every key in the file is
/// right, because a misspelt key is both unknown and missing.
Scene read_scene(const std::filesystem::path& file);

/// The scenes that one server runs; `loop.device` is the place of a scene's first device. Only the first may have
/// [network] and [recording]; a later scene with such a table is refused, and so are two devices with one name, more
/// than kMostDevices, and a device with a plug that is not among the first limits::kMaxDevices. `overrides` returns the
/// settings (parse_scene) that the command line makes in a scene which has been read.
using Overrides = std::function<std::vector<std::string>(const Scene&)>;
std::vector<Scene> read_scenes(const std::vector<std::filesystem::path>& files, const Overrides& overrides = {});

/// A scene for each device of those: of one with a count of N there are N, which differ in name and place.
std::vector<Scene> each_device(const std::vector<Scene>& scenes);

/// The same for a scene in memory. `name` is what errors call it; a recorded motion is looked for
/// relative to `directory`.
///
/// `settings` change what the text says, each "TABLE.KEY=VALUE" with a value in TOML or a word that needs no quotes;
/// without a value the key, or the whole table, is taken out. `Scene::text` is then the scene that they make, without
/// comments: parsed alone, it gives the same scene.
Scene parse_scene(std::string_view text, const std::string& name, const std::filesystem::path& directory,
                  std::span<const std::string> settings = {});

/// The settings that put `law` in place of the scene's limiter, without its parts. The friction bounds of `control`
/// stay: they are the device's.
std::vector<std::string> limiter_settings(std::string_view law, const HapticController::Config& control);

/// A removable part of a scene.
struct ScenePart {
  std::string key;
  std::string_view what;  ///< the purpose in one line
};

/// Returns all parts in the order of scene_reference().
const std::vector<ScenePart>& scene_parts();

/// Removes a part from a scene of a simulated device, together with everything that depends on it. Returns false if the
/// scene does not have the part.
bool take_out(Scene& scene, std::string_view key);

/// Every key that a scene may have: meaning, what is accepted in which unit, and what holds without it.
std::string scene_reference();

/// Describes the keys of one table, such as "limiter" or "device.hand", and of the tables inside it. Throws
/// std::invalid_argument if there is no such table, and suggests the closest name.
std::string scene_reference(std::string_view table);

/// Lists the tables of a scene, with the number of keys in each table.
std::string scene_tables();

}  // namespace tendon
