// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "core/haptic_controller.h"
#include "server/recording/records.h"

namespace tendon::replay {

/// Recorded steps with a new controller.
///
///     kRecorded   accounts each interval with the recorded force: the same law gives identical bits
///     kOwn        accounts each interval with the force of this law, for another law; the hand still moves as recorded
///
/// Thread-safe: no. Realtime-safe: no.
class Rerun {
 public:
  enum class Held { kRecorded, kOwn };

  /// Throws as HapticController does.
  Rerun(const HapticController::Config& control, Held held)
      : controller_(alone(control)), max_missed_(control.max_missed), held_(held) {}

  /// Adds the energy that a coupling's tank settles in the next step, if that has the tick of `port`. Couplings of a
  /// step are passed in their recorded order. All their other effects are in the recorded requested force.
  void settled(const PortRecord& port) {
    if (std::exchange(settled_at_, port.tick) != port.tick) settled_ = {};
    settled_.credit += port.settled.credit;
    settled_.withdraw += port.settled.withdraw;
    grip_settled_ = port.grip_settled;
  }

  /// If kOwn is set, `applied` is the force of this controller. Otherwise, it is the recorded force.
  StepRecord step(const StepRecord& recorded);

 private:
  /// The forces of couplings and fields, and the energy from their tanks, are recorded.
  static HapticController::Config alone(HapticController::Config control) {
    control.hold.field.reset();
    control.coupling.reset();
    control.leaders.clear();
    return control;
  }
  Step take(const StepRecord& recorded, const Effort& held);

  HapticController controller_;
  std::uint32_t max_missed_;
  std::uint32_t missed_ = 0;  ///< consecutive readings
  Held held_;
  Effort own_;
  EnergyTank::Settlement settled_;       ///< sum over all couplings
  EnergyTank::Settlement grip_settled_;  ///< grip part, used by a single coupling only
  std::uint64_t settled_at_ = 0;         ///< tick; 0: none yet
};

/// The first result that is not bitwise identical, for example "energy_j: recorded 0.1, again 0.2", or empty.
std::string difference(const StepRecord& recorded, const StepRecord& again);

}  // namespace tendon::replay
