// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/haptic_controller.h"
#include "protocol/link.h"

namespace tendon {

/// What the loop knows of a step besides the controller.
struct LoopStep {
  std::uint64_t tick = 0;
  LocalTime scheduled{};        ///< when the step was due
  Vec3 applied = Vec3::Zero();  ///< N, really given out by the device (`force` is what it was told)
  bool rearmed = false;         ///< the controller was rearmed since the step before
  bool disarmed = false;        ///< the operator had disarmed the device
  std::uint32_t buttons = 0;    ///< bit i is set while button i of the handle was held
};

/// One haptic step, as it is recorded: all inputs that are needed to repeat it, and what the device did.
struct StepRecord : Step, LoopStep {};

/// What a coupling did in one haptic step: with the StepRecord of the same tick, and the other couplings of that tick
/// in their order, enough to repeat it.
struct PortRecord {
  std::uint64_t tick = 0;
  std::uint32_t channel = 0;         ///< of the device, by which the leader comes; 0 where there is one coupling
  LocalTime at{};                    ///< of the step's position
  Purse::Settlement settled{};       ///< J, what the limiter was credited with, and what was withdrawn
  Purse::Settlement grip_settled{};  ///< J, likewise that of the gripper
  double stiffness = 0;              ///< N/m, K in use
  Duration round_trip{};             ///< in use; 0: not known
  PortState sent{};                  ///< to the peer
  std::optional<PortState> peer{};   ///< that came since the step before; the newest
  LocalTime peer_arrived{};          ///< by which it had come; of use with `peer` only
};

/// How far the follower's clock was ahead of the leader's.
struct ClockRecord {
  Duration offset{};
  Duration error{};  ///< the true offset lies within ± this
};

/// One datagram that went in or out.
struct DatagramRecord {
  enum class Direction : std::uint8_t { kIn = 1, kOut = 2 };
  LocalTime at{};
  Direction direction = Direction::kIn;
  Address peer;
  std::uint32_t size = 0;  ///< bytes on the wire; `bytes` holds at most kMaxDatagram of them
  std::array<std::byte, kMaxDatagram> bytes;
};

}  // namespace tendon
