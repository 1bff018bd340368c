// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "core/teleoperation/port_state.h"

namespace tendon {

/// Inputs of the phase machine. In each period, the caller checks them in this order and calls `next` if one is true.
enum class PhaseInput : std::uint8_t {
  kNotReady,  ///< The device is not connected, is disarmed, or has a fault.
  kReady,     ///< The device is ready.
  kGone,      ///< The link is lost (LossStages).
  kHeard,     ///< The peer is fresh and knows about the loss.
  kAlign,     ///< The operator of a leader with an absolute map engages.
  kAct,       ///< The operator engages, the alignment is done, or the follower receives a new act.
  kClutch,    ///< The clutch of the leader is on.
  kRelease,   ///< The clutch of the leader is off.
  kEnd,       ///< The act ends: see Coupling.
  kRenew,     ///< The peer of the channel was replaced.
};
inline constexpr std::size_t kPhaseInputs = 10;

/// Returns the next phase of one end of a coupling, by this table (`–`: no change):
///                  alone     coupled   aligning  engaged   clutched  lost      fault
///     kNotReady    fault     fault     fault     fault     fault     fault     fault
///     kReady       –         –         –         –         –         –         alone
///     kGone        –         alone     alone     lost      lost      –         –
///     kHeard       coupled   –         –         –         –         coupled   –
///     kAlign       –         aligning  –         –         –         –         –
///     kAct         –         engaged   engaged   –         –         –         –
///     kClutch      –         –         –         clutched  –         –         –
///     kRelease     –         –         –         –         engaged   –         –
///     kEnd         –         –         coupled   coupled   coupled   –         –
///     kRenew       alone     alone     alone     alone     alone     alone     –
/// A port in the phase `lost` can only engage again after a new act. Thread-safe: yes. Realtime-safe: yes.
PortPhase next(PortPhase phase, PhaseInput input) noexcept;

constexpr bool is_in_act(PortPhase phase) noexcept {
  return phase == PortPhase::kEngaged || phase == PortPhase::kClutched;
}

}  // namespace tendon
