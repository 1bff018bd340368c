// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "clients/plug/chai3d/shared_hand.h"
#include "clients/plug/plug.h"
#include "clients/plug/view.h"

namespace tendon::plug::chai3d {

/// tendon-plug's end of the memory that it shares with a CHAI3D program: what a plug knows goes to the program in
/// CHAI3D's frame, and what the program asks for goes to the plug. It has no socket, clock or thread.
///
/// A force that the program asked for at t is fresh until t + Config::stale, however late it is read here: a program
/// that renders its last frame for a second must not be felt for a second.
///
/// Thread-safe: no. Realtime-safe: no.
class Host {
 public:
  struct Config {
    Duration stale = std::chrono::milliseconds(50);
    std::string model{};  ///< what CHAI3D takes limits and quirks from; empty: the device's own; at most 254 bytes
  };
  /// In CHAI3D a device without a described workspace has this radius, m.
  static constexpr double kWorkspaceRadius = 0.1;

  /// `hands` must outlive this object, and have its number of devices.
  Host(SharedHands& hands, Config config) : hands_(hands), config_(std::move(config)) {}

  /// Takes over what is new on either side of device `i`. True when the program has asked for something: turn the plug
  /// again, so that it leaves at once.
  bool exchange(std::size_t i, Plug& plug, LocalTime now);

  /// After all devices: tells the program that there is news. True when one of its threads sleeps on it: wake it.
  bool announce();

 private:
  struct Device {
    std::optional<View> view;
    std::uint64_t states = 0;  ///< of the plug, that the program has been told
    std::uint64_t asked = 0;   ///< of the program, that the plug has been told
    bool described = false;
  };
  void describe(std::size_t i, Plug& plug);

  SharedHands& hands_;
  Config config_;
  std::array<Device, SharedHands::kMaxDevices> devices_;
  bool news_ = false;
};

}  // namespace tendon::plug::chai3d
