// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/phases/phase_machine.h"

namespace tendon {

namespace {

using PhaseRow = std::array<PortPhase, 7>;

/// Columns: the phases in their order. Rows: the inputs in theirs.
constexpr std::array<PhaseRow, kPhaseInputs> phase_table() {
  using enum PortPhase;
  return {PhaseRow{kFault, kFault, kFault, kFault, kFault, kFault, kFault},                // kNotReady
          PhaseRow{kAlone, kCoupled, kAligning, kEngaged, kClutched, kLost, kAlone},       // kReady
          PhaseRow{kAlone, kAlone, kAlone, kLost, kLost, kLost, kFault},                   // kGone
          PhaseRow{kCoupled, kCoupled, kAligning, kEngaged, kClutched, kCoupled, kFault},  // kHeard
          PhaseRow{kAlone, kAligning, kAligning, kEngaged, kClutched, kLost, kFault},      // kAlign
          PhaseRow{kAlone, kEngaged, kEngaged, kEngaged, kClutched, kLost, kFault},        // kAct
          PhaseRow{kAlone, kCoupled, kAligning, kClutched, kClutched, kLost, kFault},      // kClutch
          PhaseRow{kAlone, kCoupled, kAligning, kEngaged, kEngaged, kLost, kFault},        // kRelease
          PhaseRow{kAlone, kCoupled, kCoupled, kCoupled, kCoupled, kLost, kFault},         // kEnd
          PhaseRow{kAlone, kAlone, kAlone, kAlone, kAlone, kAlone, kFault}};               // kRenew
}

}  // namespace

PortPhase next(PortPhase phase, PhaseInput input) noexcept {
  static constexpr std::array<PhaseRow, kPhaseInputs> kTable = phase_table();
  return kTable[static_cast<std::size_t>(input)][static_cast<std::size_t>(phase) - 1];
}

}  // namespace tendon
