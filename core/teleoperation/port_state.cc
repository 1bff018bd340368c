// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/port_state.h"

#include "core/base/rotation.h"
#include "core/teleoperation/energy_tank.h"
#include "core/teleoperation/port_values.h"

namespace tendon {

namespace {

bool is_scale(double scale) noexcept { return scale == 0 || within(scale, 0.01, 100); }

}  // namespace

std::string_view to_string(PortPhase phase) noexcept {
  switch (phase) {
    case PortPhase::kAlone:
      return "alone: nothing received from the other end";
    case PortPhase::kCoupled:
      return "coupled: waiting for the leader to engage";
    case PortPhase::kAligning:
      return "aligning";
    case PortPhase::kEngaged:
      return "engaged";
    case PortPhase::kClutched:
      return "clutched";
    case PortPhase::kLost:
      return "lost: nothing received from the other end any more";
    case PortPhase::kFault:
      return "waiting until the device exerts forces";
  }
  return "unknown";
}

bool is_sound(const PortSurface& surface) noexcept {
  return within(surface.normal.norm(), 0.999, 1.001) && within(surface.offset, -1e12, 1e12) &&
         within(surface.stiffness, 0, 1e12);
}

bool is_sound(const PortTurn& turn) noexcept {
  return is_rotation(turn.turn) && within(turn.angular_velocity) && within(turn.torque);
}

bool is_sound(const PortGrip& grip) noexcept {
  constexpr double kAccount = EnergyTankMessage::kMostAccount;
  constexpr double kTotal = EnergyTankMessage::kMostTotal;
  return within(grip.opening, -1e12, 1e12) && within(grip.velocity, -1e12, 1e12) && within(grip.force, -1e12, 1e12) &&
         within(grip.account, -kAccount, kAccount) && within(grip.need, 0, kAccount) && within(grip.given, 0, kTotal) &&
         within(grip.taken, 0, kTotal);
}

bool is_sound(const PortState& state) noexcept {
  constexpr Duration kMostTime = std::chrono::nanoseconds(std::int64_t{1} << 60);
  constexpr double kAccount = EnergyTankMessage::kMostAccount;
  constexpr double kTotal = EnergyTankMessage::kMostTotal;
  return state.epoch > 0 && state.sequence > 0 && state.time >= -kMostTime && state.time <= kMostTime &&
         state.round_trip >= Duration::zero() && state.round_trip <= PortState::kMostRoundTrip &&
         state.phase >= PortPhase::kAlone && state.phase <= PortPhase::kFault && within(state.position) &&
         within(state.velocity) && within(state.force) && (!state.contact_force || within(*state.contact_force)) &&
         within(state.account, -kAccount, kAccount) && within(state.need, 0, kAccount) &&
         within(state.given, 0, kTotal) && within(state.taken, 0, kTotal) && within(state.wave_integral) &&
         within(state.wave_energy, 0, kTotal) && (!state.surface || is_sound(*state.surface)) &&
         (!state.turn || is_sound(*state.turn)) && (!state.grip || is_sound(*state.grip)) &&
         within(state.energy_in, 0, kTotal) && (!state.share || within(*state.share, 0, 1)) &&
         is_scale(state.position_scale) && is_scale(state.force_scale);
}

}  // namespace tendon
