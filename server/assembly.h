// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "core/exchange/spsc_ring.h"
#include "devices/device.h"
#include "devices/safety/heartbeat.h"
#include "devices/safety/safe_device.h"
#include "protocol/link.h"
#include "protocol/messages.h"
#include "server/haptic_loop.h"
#include "server/log_loop.h"
#include "server/mailboxes.h"
#include "server/network_loop.h"
#include "server/scene/scene.h"

namespace tendon {

std::uint32_t loop_hz(const Scene& scene);

/// Creates and connects the loops of a server. It uses no threads, sockets or clocks: `Server` calls the loops from its
/// threads, and simulated worlds and tests call them in virtual time.
/// Thread-safe: each haptic group, each network loop and the log loop can be used in a separate thread (THREADS.md).
/// Realtime-safe: only HapticGroup.
class Assembly {
 public:
  /// The pointers and references must outlive the assembly.
  struct Part {
    Scene scene;
    Device& device;
    SafeDevice* safe = nullptr;  ///< a layer around `device`; null if the scene has none
    Heartbeat* heart = nullptr;
    std::optional<Key> dial_key{};  ///< for the server that the scene dials; empty: not encrypted
    Seed dial_seed{};
    std::optional<HandleDescription> handle{};  ///< replaces the description of the handle
  };

  struct Config {
    /// The values that are not in a scene. The constructor sets the devices, the shard and the values of the first
    /// scene, and removes the suites that it does not allow.
    NetworkLoop::Config network{};
    LocalTime now{};
    std::uint64_t epoch = 1;  ///< must be higher than in all previous runs (EnergyTank)
    /// If this is set, the mailboxes have this size, the caller must empty them instead of the LogLoop, and nothing is
    /// recorded. They store datagrams if there is space for more than one.
    std::optional<Mailboxes::Capacities> watched{};
  };

  struct DeviceLoop {
    DeviceLoop(const Part& part, const Mailboxes::Capacities& capacities);
    Scene scene;
    Device& device;
    SafeDevice* safe;
    Mailboxes mail;
    HapticLoop haptic;
  };

  /// The devices of one haptic thread, which have the same period.
  struct HapticGroup {
    std::vector<DeviceLoop*> devices{};
    std::vector<std::size_t> networks{};
    std::atomic<bool> not_realtime{false};  ///< true if the thread did not get its priority

    LocalTime turn(LocalTime now) noexcept;  ///< steps each device; returns the time of the next call
    void stop() noexcept;
    /// Sets all forces to zero. Devices with a safety layer must be armed again.
    void stand_still() noexcept;
  };

  /// Creates a network loop for each link. The number of links must be a power of two, and they must outlive the
  /// assembly. The recording is opened last. Throws std::invalid_argument if the processor does not support any suite
  /// of the scene, and the errors of the loops.
  Assembly(std::vector<Part> parts, const Config& config, const std::vector<Link*>& links);
  Assembly(const Assembly&) = delete;  // its loops refer to each other
  Assembly& operator=(const Assembly&) = delete;

  /// Calls a network loop and exchanges Hellos with the others. Returns the latest time of the next call.
  LocalTime turn_network(std::size_t number, LocalTime now);

  std::deque<DeviceLoop>& devices() noexcept { return devices_; }
  std::deque<HapticGroup>& haptic_groups() noexcept { return groups_; }
  std::size_t networks() const noexcept { return networks_.size(); }
  NetworkLoop& network(std::size_t number = 0) { return networks_.at(number).loop; }
  LogLoop& log() noexcept { return *log_; }
  const LogLoop& log() const noexcept { return *log_; }

  std::size_t first_device(std::size_t network) const noexcept;

 private:
  struct Network {
    Network(const NetworkLoop::Config& config, Link& link, LocalTime now) : loop(config, link, now) {}
    NetworkLoop loop;
    SpscRing<HandedHello> hellos{16};  ///< from the first network loop
  };

  void add_devices(std::vector<Part>& parts, const Config& config, std::size_t networks);
  void add_group_of(DeviceLoop& device, std::size_t network);
  void add_networks(const std::vector<Part>& parts, const Config& config, const std::vector<Link*>& links);
  void open_log(const Config& config);

  std::deque<DeviceLoop> devices_;
  std::deque<HapticGroup> groups_;
  std::deque<Network> networks_;
  std::optional<LogLoop> log_;
};

}  // namespace tendon
