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
  return read_device(from.device(), to.device) && read_channel(from.channel(), to.channel) &&
         read(from.round_trip_ns(), to.round_trip) && read(from.phase(), to.phase) &&
         read(from.position_m(), to.position) && read(from.velocity_mps(), to.velocity) &&
         read(from.force_n(), to.force) && read(from.wave_integral(), to.wave_integral) &&
         read(from.has_surface(), from.surface(), to.surface) &&
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
  return read_device(from.device(), to.device) && read_channel(from.channel(), to.channel) &&
         within(to.position_scale, 0.01, 100) && within(to.force_scale, 0.01, 100) &&
         read(from.rotation(), to.rotation) && to.axes >= 1 && to.axes <= 7 &&
         within(to.stiffness, 0, limits::kMaxValue) && within(to.mutual_damping, 0, limits::kMaxValue) &&
         within(to.damping, 0, limits::kMaxValue) && to.period > Duration::zero() && to.period <= limits::kMaxValidFor;
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
}

}  // namespace tendon::wire
