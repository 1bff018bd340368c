// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "core/haptic_controller.h"
#include "server/recording/records.h"

namespace tendon::replay {

/// Takes recorded steps again, one by one: the motion, the sensor and the forces that were wanted come from the record,
/// all else from a controller of its own.
///
///     kRecorded   the interval is booked with the force that the device held then: the same law gives the same bits
///     kOwn        … with the force that this law gave. Another law then keeps its own account. The hand still moves as
///     it
///                 was recorded; with other forces it would have moved otherwise
///
/// Thread-safe: no. Realtime-safe: no.
class Rerun {
 public:
  enum class Held { kRecorded, kOwn };

  /// Throws what HapticController throws.
  Rerun(const HapticController::Config& control, Held held)
      : controller_(without_coupling(control)), max_missed_(control.max_missed), held_(held) {}

  /// What the purse of a coupling settled in the next step, if that has this tick. The couplings of a step follow each
  /// other as they were recorded. The rest of a coupling is in the force that was wanted.
  void settled(const PortRecord& port) {
    if (std::exchange(settled_at_, port.tick) != port.tick) settled_ = {};
    settled_.credit += port.settled.credit;
    settled_.withdraw += port.settled.withdraw;
    grip_settled_ = port.grip_settled;
  }

  /// `recorded` with what this controller makes of it. `applied` is its own force with kOwn, else the recorded one.
  StepRecord step(const StepRecord& recorded);

 private:
  static HapticController::Config without_coupling(HapticController::Config control) {
    control.coupling.reset();
    control.leaders.clear();
    return control;
  }
  Step take(const StepRecord& recorded, const Effort& held);

  HapticController controller_;
  std::uint32_t max_missed_;
  std::uint32_t missed_ = 0;  ///< readings in a row
  Held held_;
  Effort own_;
  Purse::Settlement settled_;       ///< of all couplings
  Purse::Settlement grip_settled_;  ///< of the grippers, which only a single coupling ties
  std::uint64_t settled_at_ = 0;    ///< tick; 0: none yet
};

/// What of a step a law decides, and that is not the same bit for bit: "energy_j: recorded 0.1, again 0.2". Empty when
/// all is.
std::string difference(const StepRecord& recorded, const StepRecord& again);

}  // namespace tendon::replay
