// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "clients/bridge/bridged_device.h"
#include "clients/bridge/chai3d/shared_hand.h"
#include "clients/bridge/view.h"

namespace tendon::bridge::chai3d {

/// The tendon-bridge side of the memory shared with a CHAI3D program, without sockets, clocks or threads. It transfers
/// states to the program, in the frame of CHAI3D, and requests of the program to the BridgedDevice. A force requested
/// at time t is valid until t + Config::stale, independent of when it is read here, because a program with a low frame
/// rate must not apply its last force for long. Thread-safe: no. Realtime-safe: no.
class Host {
 public:
  struct Config {
    Duration stale = std::chrono::milliseconds(50);
    std::string model{};  ///< CHAI3D derives limits from this device model; at most 254 bytes
  };
  static constexpr double kWorkspaceRadius = 0.1;  ///< m, reported to CHAI3D if the device describes no workspace

  /// `hands` must outlive this object and contain the number of devices.
  Host(SharedHands& hands, Config config) : hands_(hands), config_(std::move(config)) {}

  /// Transfers new data in both directions for device `i`. Returns true if the program has requested something; the
  /// BridgedDevice should then be turned again so that the force is sent immediately.
  bool exchange(std::size_t i, BridgedDevice& bridged, LocalTime now);

  bool announce();  ///< must be called after all devices; true if a thread of the program must be woken

 private:
  struct Device {
    std::optional<View> view;
    std::uint64_t states = 0;  ///< number of BridgedDevice states already passed to the program
    std::uint64_t asked = 0;   ///< number of program requests already passed to the BridgedDevice
    bool described = false;
  };
  void describe(std::size_t i, BridgedDevice& bridged);

  SharedHands& hands_;
  Config config_;
  std::array<Device, SharedHands::kMaxDevices> devices_;
  bool news_ = false;
};

}  // namespace tendon::bridge::chai3d
