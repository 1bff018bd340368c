// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <optional>

#include "core/base/rotation.h"
#include "protocol/limits.h"
#include "protocol/wire/bounds.h"
#include "protocol/wire/frame_codec.h"

// The frames of a coupling.

namespace tendon::wire {

namespace {

using wire::read;
using wire::write;

bool read(pb::PortPhase from, PortPhase& to) noexcept {
  to = static_cast<PortPhase>(from);
  return from != pb::PORT_PHASE_UNSPECIFIED && pb::PortPhase_IsValid(from);
}

bool within(double value, double least, double most) noexcept { return value >= least && value <= most; }

bool read(bool there, const pb::PortSurface& from, std::optional<PortSurface>& to) noexcept {
  to.reset();
  if (!there) return true;
  to = {.offset = from.offset_m(), .stiffness = from.stiffness_npm()};
  return read(from.normal(), to->normal);
}

bool read(bool there, const pb::PortTurn& from, std::optional<PortTurn>& to) noexcept {
  to.reset();
  if (!there) return true;
  to.emplace();
  return read(from.turn(), to->turn) && read(from.angular_velocity_radps(), to->angular_velocity) &&
         read(from.torque_nm(), to->torque);
}

void read(bool there, const pb::PortGrip& from, std::optional<PortGrip>& to) noexcept {
  to.reset();
  if (!there) return;
  to = {.opening = from.opening_m(),
        .velocity = from.velocity_mps(),
        .force = from.force_n(),
        .account = from.account_j(),
        .need = from.need_j(),
        .given = from.given_j(),
        .taken = from.taken_j()};
}

void write(const PortTurn& from, pb::PortTurn& to) {
  write(from.turn, *to.mutable_turn());
  write(from.angular_velocity, *to.mutable_angular_velocity_radps());
  write(from.torque, *to.mutable_torque_nm());
}

void write(const PortGrip& from, pb::PortGrip& to) {
  to.set_opening_m(from.opening);
  to.set_velocity_mps(from.velocity);
  to.set_force_n(from.force);
  to.set_account_j(from.account);
  to.set_need_j(from.need);
  to.set_given_j(from.given);
  to.set_taken_j(from.taken);
}

bool read(bool there, const pb::RateControl& from, std::optional<RateControl>& to) noexcept {
  to.reset();
  if (!there) return true;
  to = {.dead_zone = from.dead_zone_m(), .gain = from.gain_per_s(), .max_speed = from.max_speed_mps()};
  return within(to->dead_zone, 0, limits::kMaxValue) && to->gain > 0 && within(to->gain, 0, limits::kMaxValue) &&
         to->max_speed > 0 && within(to->max_speed, 0, limits::kMaxValue);
}

}  // namespace

bool read(const pb::PortState& from, PortFrame& to) noexcept {
  to.epoch = from.epoch();
  to.sequence = from.sequence();
  to.answers_epoch = from.answers_epoch();
  to.answers = from.answers();
  to.time = Duration(from.time_ns());
  to.engagement = from.engagement();
  to.buttons = from.buttons();
  to.account = from.account_j();
  to.need = from.need_j();
  to.given = from.given_j();
  to.taken = from.taken_j();
  to.wave_energy = from.wave_energy_j();
  to.energy_in = from.energy_in_j();
  to.of_peer = from.of_peer();
  to.share = from.has_share() ? std::optional(from.share()) : std::nullopt;
  to.position_scale = from.position_scale();
  to.force_scale = from.force_scale();
  read(from.has_grip(), from.grip(), to.grip);
  return read_device(from.device(), to.device) && read_channel(from.channel(), to.channel) &&
         read(from.round_trip_ns(), to.round_trip) && read(from.phase(), to.phase) &&
         read(from.position_m(), to.position) && read(from.velocity_mps(), to.velocity) &&
         read(from.force_n(), to.force) && read(from.wave_integral(), to.wave_integral) &&
         read(from.has_surface(), from.surface(), to.surface) && read(from.has_turn(), from.turn(), to.turn) &&
         read(from.has_contact_force_n(), from.contact_force_n(), to.contact_force) && is_sound(to);
}

void write(const PortFrame& from, pb::PortState& to) {
  to.set_device(from.device);
  to.set_channel(from.channel);
  to.set_epoch(from.epoch);
  to.set_sequence(from.sequence);
  to.set_answers_epoch(from.answers_epoch);
  to.set_answers(from.answers);
  to.set_time_ns(from.time.count());
  to.set_round_trip_ns(unsigned_ns(from.round_trip));
  to.set_phase(static_cast<pb::PortPhase>(from.phase));
  to.set_engagement(from.engagement);
  to.set_buttons(from.buttons);
  write(from.position, *to.mutable_position_m());
  write(from.velocity, *to.mutable_velocity_mps());
  write(from.force, *to.mutable_force_n());
  to.clear_contact_force_n();
  if (from.contact_force) write(*from.contact_force, *to.mutable_contact_force_n());
  to.set_account_j(from.account);
  to.set_need_j(from.need);
  to.set_given_j(from.given);
  to.set_taken_j(from.taken);
  to.clear_wave_integral();
  if (!from.wave_integral.isZero(0)) write(from.wave_integral, *to.mutable_wave_integral());
  to.set_wave_energy_j(from.wave_energy);
  to.clear_surface();
  if (from.surface) {
    write(from.surface->normal, *to.mutable_surface()->mutable_normal());
    to.mutable_surface()->set_offset_m(from.surface->offset);
    to.mutable_surface()->set_stiffness_npm(from.surface->stiffness);
  }
  to.clear_turn();
  if (from.turn) write(*from.turn, *to.mutable_turn());
  to.clear_grip();
  if (from.grip) write(*from.grip, *to.mutable_grip());
  to.set_energy_in_j(from.energy_in);
  to.clear_share();
  if (from.share) to.set_share(*from.share);
  to.set_position_scale(from.position_scale);
  to.set_force_scale(from.force_scale);
  to.set_of_peer(from.of_peer);
}

bool read(const pb::Couple& from, Couple& to) noexcept {
  if (from.role() == pb::PORT_ROLE_UNSPECIFIED || !pb::PortRole_IsValid(from.role())) return false;
  if (from.method() == pb::COUPLING_METHOD_UNSPECIFIED || !pb::CouplingMethod_IsValid(from.method())) return false;
  to.role = from.role() == pb::PORT_ROLE_LEADER ? PortRole::kLeader : PortRole::kFollower;
  to.method = static_cast<CouplingMethod>(from.method());
  to.position_scale = from.position_scale();
  to.force_scale = from.force_scale();
  to.axes = from.axes();
  to.stiffness = from.stiffness_npm();
  to.mutual_damping = from.mutual_damping_nspm();
  to.damping = from.damping_nspm();
  to.adapt_to_delay = from.adapt_to_delay();
  to.purse = from.purse();
  to.period = std::chrono::microseconds(from.period_us());
  to.absolute = from.absolute();
  to.turn_stiffness = from.turn_stiffness_nmprad();
  to.turn_damping = from.turn_damping_nmsprad();
  to.grip_stiffness = from.grip_stiffness_npm();
  to.grip_damping = from.grip_damping_nspm();
  to.drift_rate = from.drift_rate_per_s();
  const auto sound = [](double value) { return within(value, 0, limits::kMaxValue); };
  return read_device(from.device(), to.device) && read_channel(from.channel(), to.channel) &&
         within(to.position_scale, 0.01, 100) && within(to.force_scale, 0.01, 100) &&
         read(from.rotation(), to.rotation) && to.axes >= 1 && to.axes <= 7 && sound(to.stiffness) &&
         sound(to.mutual_damping) && sound(to.damping) && to.period > Duration::zero() &&
         to.period <= limits::kMaxValidFor && sound(to.turn_stiffness) && sound(to.turn_damping) &&
         sound(to.grip_stiffness) && sound(to.grip_damping) && sound(to.drift_rate) &&
         read(from.has_rate(), from.rate(), to.rate);
}

void write(const Couple& from, pb::Couple& to) {
  to.set_device(from.device);
  to.set_channel(from.channel);
  to.set_role(from.role == PortRole::kLeader ? pb::PORT_ROLE_LEADER : pb::PORT_ROLE_FOLLOWER);
  to.set_method(static_cast<pb::CouplingMethod>(from.method));
  to.set_position_scale(from.position_scale);
  to.set_force_scale(from.force_scale);
  write(from.rotation, *to.mutable_rotation());
  to.set_axes(from.axes);
  to.set_stiffness_npm(from.stiffness);
  to.set_mutual_damping_nspm(from.mutual_damping);
  to.set_damping_nspm(from.damping);
  to.set_adapt_to_delay(from.adapt_to_delay);
  to.set_purse(from.purse);
  // Out of range becomes 0, which the receiver refuses.
  const bool possible = from.period > Duration::zero() && from.period <= limits::kMaxValidFor;
  const auto us = std::chrono::ceil<std::chrono::microseconds>(possible ? from.period : Duration::zero());
  to.set_period_us(static_cast<std::uint32_t>(us.count()));
  to.set_absolute(from.absolute);
  to.set_turn_stiffness_nmprad(from.turn_stiffness);
  to.set_turn_damping_nmsprad(from.turn_damping);
  to.set_grip_stiffness_npm(from.grip_stiffness);
  to.set_grip_damping_nspm(from.grip_damping);
  to.set_drift_rate_per_s(from.drift_rate);
  if (from.rate) {
    to.mutable_rate()->set_dead_zone_m(from.rate->dead_zone);
    to.mutable_rate()->set_gain_per_s(from.rate->gain);
    to.mutable_rate()->set_max_speed_mps(from.rate->max_speed);
  }
}

}  // namespace tendon::wire
