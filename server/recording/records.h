// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/field/field_pose.h"
#include "core/field/fixture.h"
#include "core/field/material.h"
#include "core/haptic_controller.h"
#include "protocol/link.h"

namespace tendon {

struct LoopStep {
  std::uint64_t tick = 0;
  LocalTime scheduled{};        ///< when the step was due
  Vec3 applied = Vec3::Zero();  ///< N, actual force of the device; `force` is the command
  bool rearmed = false;
  bool disarmed = false;      ///< disarmed by the operator
  std::uint32_t buttons = 0;  ///< bit i: button i is pressed
};

/// A haptic step with all inputs that are required to replay it.
struct StepRecord : Step, LoopStep {};

/// The state of a coupling in a haptic step. To be replayed with the StepRecord and the other couplings of this tick.
struct PortRecord {
  std::uint64_t tick = 0;
  std::uint32_t channel = 0;              ///< used by the leader; 0 if there is one coupling
  LocalTime at{};                         ///< of the step's position
  EnergyTank::Settlement settled{};       ///< J, transfers to and from the account of the limiter
  EnergyTank::Settlement grip_settled{};  ///< J
  double stiffness = 0;                   ///< N/m, current value of K
  Duration round_trip{};                  ///< current value; 0 if unknown
  PortState sent{};
  std::optional<PortState> peer{};  ///< the newest since the previous step, if any
  LocalTime peer_arrived{};
};

/// A message for the field of a channel that was received before the haptic step `tick`. To be replayed with the
/// StepRecord of this step.
struct FieldInput {
  enum class Kind : std::uint8_t {
    kUse = 1,      ///< a field, whose FieldData has the same channel, source and generation
    kStop = 2,     ///< the source stops using its field
    kRelease = 3,  ///< the source has disconnected
    kPose = 4,
    kTruth = 5,  ///< RemoteForce::field
  };
  std::uint64_t tick = 0;
  LocalTime at{};  ///< time when the haptic thread received it
  Kind kind = Kind::kUse;
  std::uint32_t channel = 0;
  std::uint32_t source = 0;
  std::uint32_t generation = 0;    ///< kUse, kTruth
  std::uint64_t answers_tick = 0;  ///< kTruth
  LocalTime received{};            ///< kTruth
  Vec3 truth = Vec3::Zero();       ///< kTruth, N
  field::TimedPose pose{};         ///< kPose
};

/// A field that a client has uploaded (core/field/field.h).
struct FieldData {
  LocalTime at{};
  std::uint32_t channel = 0;
  std::uint32_t source = 0;
  std::uint32_t generation = 0;
  std::vector<std::byte> manifest{};  ///< protocol/field/manifest.h
  /// Weights of all bricks, in the order of the manifest. Empty if the previous FieldData of the channel has the same
  /// manifest.
  std::vector<std::byte> weights{};
  std::vector<field::Material> materials{};
  std::vector<field::Fixture> fixtures{};
};

/// Offset of the follower's clock from the leader's clock.
struct ClockRecord {
  Duration offset{};
  Duration error{};  ///< the true offset is in the range ± error
};

struct DatagramRecord {
  enum class Direction : std::uint8_t { kIn = 1, kOut = 2 };
  LocalTime at{};
  Direction direction = Direction::kIn;
  Address peer;
  std::uint32_t size = 0;  ///< on the wire; `bytes` is truncated to kMaxDatagram
  std::array<std::byte, kMaxDatagram> bytes;
};

}  // namespace tendon
