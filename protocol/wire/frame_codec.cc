// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/frame_codec.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <limits>
#include <utility>

#include "protocol/limits.h"
#include "protocol/wire/bounds.h"
#include "protocol/wire/text.h"

namespace tendon::wire {

namespace {

using wire::read;
using wire::write;

/// What only a client that named kFeatureHandle is sent, but for the buttons. A speed without what it is the speed of
/// says nothing, but has to be possible.
bool read_handle(const pb::DeviceState& from, DeviceState& to) noexcept {
  Turning turning;
  if (!read(from.angular_velocity_radps(), turning.angular_velocity)) return false;
  if (from.has_orientation() && !read(from.orientation(), turning.orientation)) return false;
  to.turning = from.has_orientation() ? std::optional(turning) : std::nullopt;
  const Grip grip{.opening = from.gripper_rad(), .velocity = from.gripper_velocity_radps()};
  if (!bounded(grip.velocity)) return false;
  to.grip = from.has_gripper_rad() ? std::optional(grip) : std::nullopt;
  return read(from.has_torque_applied_nm(), from.torque_applied_nm(), to.torque_applied) &&
         read(from.has_gripper_force_applied_n(), from.gripper_force_applied_n(), to.grip_applied) &&
         read(from.has_hand_force_n(), from.hand_force_n(), to.hand_force);
}

void write_handle(const DeviceState& from, pb::DeviceState& to) {
  to.clear_orientation();
  to.clear_angular_velocity_radps();
  if (from.turning) {
    write(from.turning->orientation, *to.mutable_orientation());
    write(from.turning->angular_velocity, *to.mutable_angular_velocity_radps());
  }
  to.clear_torque_applied_nm();
  if (from.torque_applied) write(*from.torque_applied, *to.mutable_torque_applied_nm());
  to.clear_gripper_rad();
  to.clear_gripper_velocity_radps();
  if (from.grip) {
    to.set_gripper_rad(from.grip->opening);
    to.set_gripper_velocity_radps(from.grip->velocity);
  }
  to.clear_gripper_force_applied_n();
  if (from.grip_applied) to.set_gripper_force_applied_n(*from.grip_applied);
  to.clear_hand_force_n();
  if (from.hand_force) write(*from.hand_force, *to.mutable_hand_force_n());
}

}  // namespace

bool read(const pb::DeviceState& from, DeviceState& to) noexcept {
  to.tick = from.tick();
  to.energy = from.energy_j();
  to.permitted_force = from.permitted_force_n();
  to.reasons = from.reasons();
  to.force_sequence = from.force_sequence();
  to.buttons = from.buttons();
  if (!read(from.has_force_wanted_n(), from.force_wanted_n(), to.force_wanted)) return false;
  to.stiffness_wanted.reset();
  if (!from.stiffness_wanted_npm().empty() && !read(from.stiffness_wanted_npm(), to.stiffness_wanted.emplace())) {
    return false;
  }
  return read_handle(from, to) && read(from.joint_rad(), from.joint_velocity_radps(), to.joints) &&
         read(from.sampled_ns(), to.sampled) && read(from.position_m(), to.position) &&
         read(from.velocity_mps(), to.velocity) && read(from.force_applied_n(), to.force_applied) &&
         read(from.force_age_ns(), to.force_age) && read(from.mode(), to.mode) &&
         read_device(from.device(), to.device) && read_channel(from.channel(), to.channel) && in_bounds(to);
}

void write(const DeviceState& from, pb::DeviceState& to) {
  to.set_tick(from.tick);
  to.set_sampled_ns(from.sampled.time_since_epoch().count());
  write(from.position, *to.mutable_position_m());
  write(from.velocity, *to.mutable_velocity_mps());
  write(from.force_applied, *to.mutable_force_applied_n());
  to.set_energy_j(from.energy);
  to.set_permitted_force_n(from.permitted_force);
  to.set_reasons(from.reasons);
  to.set_force_sequence(from.force_sequence);
  to.set_force_age_ns(unsigned_ns(from.force_age));
  to.set_mode(static_cast<pb::Mode>(from.mode));
  to.set_device(from.device);
  to.set_channel(from.channel);
  to.set_buttons(from.buttons);
  if (from.force_wanted) {
    write(*from.force_wanted, *to.mutable_force_wanted_n());
  } else {
    to.clear_force_wanted_n();
  }
  to.clear_stiffness_wanted_npm();
  if (from.stiffness_wanted) write(*from.stiffness_wanted, *to.mutable_stiffness_wanted_npm());
  write_handle(from, to);
  write(from.joints, *to.mutable_joint_rad(), *to.mutable_joint_velocity_radps());
}

bool read(const pb::DeviceStates& from, const std::function<DeviceState&()>& next) {
  if (from.devices() == 0 || from.devices() >= 1U << limits::kMaxDevices) return false;
  const int count = std::popcount(from.devices());
  const auto has = [&](const auto& column, int entries) { return column.size() == entries * count; };
  const auto may_have = [&](const auto& column) { return column.empty() || has(column, 1); };
  if (!has(from.position_m(), 3) || !has(from.velocity_mps(), 3) || !has(from.force_applied_n(), 3) ||
      !has(from.energy_j(), 1) || !has(from.permitted_force_n(), 1) || !has(from.mode(), 1) ||
      !may_have(from.reasons()) || !may_have(from.force_sequence()) || !may_have(from.force_age_ns()) ||
      !may_have(from.channel()) || !may_have(from.buttons())) {
    return false;
  }
  std::uint32_t left = from.devices();
  for (int i = 0; i < count; ++i, left &= left - 1) {
    DeviceState& to = next();
    const auto vector = [&](const auto& column) {
      return Vec3(column.Get(3 * i), column.Get(3 * i + 1), column.Get(3 * i + 2));
    };
    const auto number = [&](const auto& column) { return column.empty() ? 0 : column.Get(i); };
    to.tick = from.tick();
    to.device = static_cast<std::uint32_t>(std::countr_zero(left));
    to.position = vector(from.position_m());
    to.velocity = vector(from.velocity_mps());
    to.force_applied = vector(from.force_applied_n());
    to.energy = from.energy_j().Get(i);
    to.permitted_force = from.permitted_force_n().Get(i);
    to.reasons = number(from.reasons());
    to.force_sequence = number(from.force_sequence());
    to.channel = number(from.channel());
    to.buttons = number(from.buttons());
    const bool good = read(from.sampled_ns(), to.sampled) && read(number(from.force_age_ns()), to.force_age) &&
                      read(static_cast<pb::Mode>(from.mode().Get(i)), to.mode) && in_bounds(to);
    if (!good) return false;
  }
  return true;
}

void write(std::span<const DeviceState* const> from, pb::DeviceStates& to) {
  to.Clear();
  to.set_tick(from.front()->tick);
  to.set_sampled_ns(from.front()->sampled.time_since_epoch().count());
  std::uint32_t devices = 0;
  const auto single = [](double number) { return static_cast<float>(number); };
  for (const DeviceState* state : from) {
    devices |= 1U << state->device;
    for (const double x : state->position) to.add_position_m(x);
    for (const double v : state->velocity) to.add_velocity_mps(single(v));
    for (const double f : state->force_applied) to.add_force_applied_n(single(f));
    to.add_energy_j(single(state->energy));
    to.add_permitted_force_n(single(state->permitted_force));
    to.add_mode(static_cast<pb::Mode>(state->mode));
  }
  to.set_devices(devices);
  const auto column = [&](auto value, auto add) {
    if (std::ranges::all_of(from, [&](const DeviceState* state) { return value(*state) == 0; })) return;
    for (const DeviceState* state : from) add(value(*state));
  };
  column([](const DeviceState& s) { return s.reasons; }, [&](auto value) { to.add_reasons(value); });
  column([](const DeviceState& s) { return s.force_sequence; }, [&](auto value) { to.add_force_sequence(value); });
  column([](const DeviceState& s) { return unsigned_ns(s.force_age); }, [&](auto age) { to.add_force_age_ns(age); });
  column([](const DeviceState& s) { return s.channel; }, [&](auto value) { to.add_channel(value); });
  column([](const DeviceState& s) { return s.buttons; }, [&](auto value) { to.add_buttons(value); });
}

namespace {

/// Whether all of `from` fits; the values are for in_bounds.
bool read(const pb::ForceTable& from, ForceTable& to) noexcept {
  to.first = from.first_depth_m();
  to.step = from.step_m();
  const auto& force = from.force_n();
  const auto size = static_cast<std::size_t>(force.size());
  if (size > ForceTable::kMaxEntries) return false;
  to.size = static_cast<std::uint32_t>(size);
  std::copy(force.begin(), force.end(), to.force.begin());
  return true;
}

void write(const ForceTable& from, pb::ForceTable& to) {
  to.set_first_depth_m(from.first);
  to.set_step_m(from.step);
  to.clear_force_n();
  const auto size = std::min<std::size_t>(from.size, ForceTable::kMaxEntries);
  for (std::size_t i = 0; i < size; ++i) to.add_force_n(from.force[i]);
}

bool read(const pb::Contact& from, Contact& to) noexcept {
  read(from.normal(), to.normal);
  to.gap = from.gap_m();
  return !from.has_table() || read(from.table(), to.table.emplace());
}

void write(const Contact& from, pb::Contact& to) {
  write(from.normal, *to.mutable_normal());
  to.set_gap_m(from.gap);
  to.clear_table();
  if (from.table) write(*from.table, *to.mutable_table());
}

bool read(const pb::LocalModel& from, LocalModel& to) noexcept {
  if (!read(from.stiffness_npm(), to.stiffness)) return false;
  read(from.at_m(), to.at);
  if (from.has_valid_radius_m()) to.valid_radius = from.valid_radius_m();
  return !from.has_contact() || read(from.contact(), to.contact.emplace());
}

void write(const LocalModel& from, pb::LocalModel& to) {
  write(from.at, *to.mutable_at_m());
  to.clear_valid_radius_m();
  if (from.valid_radius != std::numeric_limits<double>::infinity()) to.set_valid_radius_m(from.valid_radius);
  to.clear_contact();
  if (from.contact) write(*from.contact, *to.mutable_contact());
  write(from.stiffness, *to.mutable_stiffness_npm());
}

/// Whether all of the torque fits; the values are for in_bounds.
bool read_torque(const pb::ForceCommand& from, std::optional<RemoteTorque>& to) noexcept {
  to.reset();
  if (!from.has_torque_nm() && !from.has_rotation_model()) return true;
  RemoteTorque& torque = to.emplace();
  read(from.torque_nm(), torque.torque);
  if (!from.has_rotation_model()) return true;
  RotationModel& model = torque.model.emplace();
  read(from.rotation_model().at_orientation(), model.at);
  return read(from.rotation_model().angular_stiffness_nmprad(), model.stiffness);
}

void write_torque(const std::optional<RemoteTorque>& from, pb::ForceCommand& to) {
  to.clear_torque_nm();
  if (from) write(from->torque, *to.mutable_torque_nm());
  to.clear_rotation_model();
  if (!from || !from->model) return;
  pb::RotationModel& model = *to.mutable_rotation_model();
  write(from->model->at, *model.mutable_at_orientation());
  write(from->model->stiffness, *model.mutable_angular_stiffness_nmprad());
}

}  // namespace

bool read(const pb::ForceCommand& from, ForceCommand& to) noexcept {
  to.sequence = from.sequence();
  to.based_on_tick = from.based_on_tick();
  to.valid_for = std::chrono::microseconds(from.valid_for_us());
  to.model.reset();
  if (from.has_model() && !read(from.model(), to.model.emplace())) return false;
  to.topology_changed = from.topology_changed();
  to.error.reset();
  if (from.has_error_n()) to.error = from.error_n();
  if (!read_torque(from, to.torque)) return false;
  to.grip_force = from.has_gripper_force_n() ? std::optional(from.gripper_force_n()) : std::nullopt;
  read(from.force_n(), to.force);
  to.device = from.device();
  to.channel = from.channel();
  to.way = from.way();
  return is_receivable(to);
}

void write(const ForceCommand& from, pb::ForceCommand& to) {
  to.set_sequence(from.sequence);
  to.set_based_on_tick(from.based_on_tick);
  write(from.force, *to.mutable_force_n());
  if (from.model) {
    write(*from.model, *to.mutable_model());
  } else {
    to.clear_model();
  }
  to.set_valid_for_us(validity_us(from.valid_for));
  to.set_device(from.device);
  to.set_channel(from.channel);
  to.set_topology_changed(from.topology_changed);
  to.clear_error_n();
  if (from.error) to.set_error_n(*from.error);
  write_torque(from.torque, to);
  to.clear_gripper_force_n();
  if (from.grip_force) to.set_gripper_force_n(*from.grip_force);
  to.set_way(from.way);
}

namespace {

bool read(const pb::SetStateRate& from, SetStateRate& to) noexcept {
  to.hz = from.hz();
  return read_device(from.device(), to.device);
}
bool read(const pb::Rearm& from, Rearm& to) noexcept { return read_device(from.device(), to.device); }
bool read(const pb::Disarm& from, Disarm& to) noexcept { return read_device(from.device(), to.device); }
bool read(const pb::Engage& from, Engage& to) noexcept { return read_device(from.device(), to.device); }
bool read(const pb::Disengage& from, Disengage& to) noexcept { return read_device(from.device(), to.device); }
bool read(const pb::Describe& from, Describe& to) noexcept {
  to.handle = from.handle();
  return read_device(from.device(), to.device);
}
bool read(const pb::SetScale& from, SetScale& to) noexcept {
  to.position_scale = from.position_scale();
  to.force_scale = from.force_scale();
  return read_device(from.device(), to.device) && in_bounds(to);
}
bool read(const pb::SetShare& from, SetShare& to) noexcept {
  to.share = from.share();
  return read_device(from.device(), to.device) && read_channel(from.channel(), to.channel) && in_bounds(to);
}
/// A setting of neither kind is refused.
bool read(const pb::SetOutput& from, SetOutput& to) noexcept {
  to.output = from.output();
  if (from.setting_case() == pb::SetOutput::kVibration) {
    const pb::Vibration& pulse = from.vibration();
    to.setting = Vibration{.amplitude = pulse.amplitude(),
                           .frequency = pulse.frequency_hz(),
                           .duration = std::chrono::milliseconds(pulse.duration_ms())};
  } else {
    to.setting = LampColour{from.rgb()};
    if (from.setting_case() != pb::SetOutput::kRgb) return false;
  }
  return read_device(from.device(), to.device) && in_bounds(to);
}
template <class Message, class Lease>
bool read_lease(const Message& from, Lease& to) noexcept {
  return read_device(from.device(), to.device) && read_channel(from.channel(), to.channel);
}
bool read(const pb::TakeLease& from, TakeLease& to) noexcept { return read_lease(from, to); }
bool read(const pb::GiveLease& from, GiveLease& to) noexcept { return read_lease(from, to); }
bool read(const pb::LeaseLost& from, LeaseLost& to) {
  return read_lease(from, to) && read(from.to(), limits::kMaxName, to.to);
}

template <class Value, class Message>
bool read_request(const Message& from, Control& to) {
  return read(from, to.request.emplace().emplace<Value>());
}

void write_request(const SetStateRate& from, pb::Control& to) {
  to.mutable_set_state_rate()->set_hz(from.hz);
  to.mutable_set_state_rate()->set_device(from.device);
}
void write_request(const Rearm& from, pb::Control& to) { to.mutable_rearm()->set_device(from.device); }
void write_request(const Disarm& from, pb::Control& to) { to.mutable_disarm()->set_device(from.device); }
void write_request(const Describe& from, pb::Control& to) {
  to.mutable_describe()->set_device(from.device);
  to.mutable_describe()->set_handle(from.handle);
}
template <class Lease, class Message>
void write_lease(const Lease& from, Message& to) {
  to.set_device(from.device);
  to.set_channel(from.channel);
}
void write_request(const TakeLease& from, pb::Control& to) { write_lease(from, *to.mutable_take_lease()); }
void write_request(const GiveLease& from, pb::Control& to) { write_lease(from, *to.mutable_give_lease()); }
void write_request(const LeaseLost& from, pb::Control& to) {
  write_lease(from, *to.mutable_lease_lost());
  to.mutable_lease_lost()->set_to(clip(from.to, limits::kMaxName));
}
void write_request(const Couple& from, pb::Control& to) { write(from, *to.mutable_couple()); }
void write_request(const Engage& from, pb::Control& to) { to.mutable_engage()->set_device(from.device); }
void write_request(const Disengage& from, pb::Control& to) { to.mutable_disengage()->set_device(from.device); }
void write_request(const SetScale& from, pb::Control& to) {
  to.mutable_set_scale()->set_device(from.device);
  to.mutable_set_scale()->set_position_scale(from.position_scale);
  to.mutable_set_scale()->set_force_scale(from.force_scale);
}
void write_request(const SetShare& from, pb::Control& to) {
  to.mutable_set_share()->set_device(from.device);
  to.mutable_set_share()->set_channel(from.channel);
  to.mutable_set_share()->set_share(from.share);
}
void write_request(const SetOutput& from, pb::Control& to) {
  pb::SetOutput& out = *to.mutable_set_output();
  out.set_device(from.device);
  out.set_output(from.output);
  if (const auto* const lamp = std::get_if<LampColour>(&from.setting)) return out.set_rgb(lamp->rgb);
  const Vibration& pulse = std::get<Vibration>(from.setting);
  out.mutable_vibration()->set_amplitude(pulse.amplitude);
  out.mutable_vibration()->set_frequency_hz(pulse.frequency);
  // A value out of range stays one: a cast could make it look valid.
  const bool possible = pulse.duration >= Duration::zero() && pulse.duration <= limits::kMaxVibration;
  const auto ms = std::chrono::ceil<std::chrono::milliseconds>(pulse.duration).count();
  const auto told = possible ? static_cast<std::uint32_t>(ms) : std::numeric_limits<std::uint32_t>::max();
  out.mutable_vibration()->set_duration_ms(told);
}
void write_request(const SetStateDeadband& from, pb::Control& to) {
  auto& out = *to.mutable_set_state_deadband();
  out.set_share(from.share);
  out.set_floor_mps(from.floor);
  // A value out of range becomes one that no server grants; a cast could make it look valid.
  const bool possible = from.max_silence >= Duration::zero() && from.max_silence <= limits::kMaxStateSilence;
  const auto us = std::chrono::ceil<std::chrono::microseconds>(from.max_silence).count();
  out.set_max_silence_us(possible ? static_cast<std::uint32_t>(us) : std::numeric_limits<std::uint32_t>::max());
}

}  // namespace

bool read(const pb::Control& from, Control& to) {
  to.id = from.id();
  if (to.id == 0) return false;
  switch (from.op_case()) {
    case pb::Control::kSetStateRate:
      return read_request<SetStateRate>(from.set_state_rate(), to);
    case pb::Control::kRearm:
      return read_request<Rearm>(from.rearm(), to);
    case pb::Control::kDisarm:
      return read_request<Disarm>(from.disarm(), to);
    case pb::Control::kSetOutput:
      return read_request<SetOutput>(from.set_output(), to);
    case pb::Control::kDescribe:
      return read_request<Describe>(from.describe(), to);
    case pb::Control::kTakeLease:
      return read_request<TakeLease>(from.take_lease(), to);
    case pb::Control::kGiveLease:
      return read_request<GiveLease>(from.give_lease(), to);
    case pb::Control::kLeaseLost:
      return read_request<LeaseLost>(from.lease_lost(), to);
    case pb::Control::kSetStateDeadband: {
      const auto& asked = from.set_state_deadband();
      to.request = SetStateDeadband{.share = asked.share(),
                                    .floor = asked.floor_mps(),
                                    .max_silence = std::chrono::microseconds(asked.max_silence_us())};
      return to.id > 0 && bounded(asked.share()) && bounded(asked.floor_mps());
    }
    case pb::Control::kCouple:
      return read_request<Couple>(from.couple(), to);
    case pb::Control::kEngage:
      return read_request<Engage>(from.engage(), to);
    case pb::Control::kDisengage:
      return read_request<Disengage>(from.disengage(), to);
    case pb::Control::kSetScale:
      return read_request<SetScale>(from.set_scale(), to);
    case pb::Control::kSetShare:
      return read_request<SetShare>(from.set_share(), to);
    case pb::Control::OP_NOT_SET:
      break;
  }
  to.request.reset();
  return true;
}

void write(const Control& from, pb::Control& to) {
  to.set_id(from.id);
  to.clear_op();
  if (from.request) std::visit([&](const auto& request) { write_request(request, to); }, *from.request);
}

namespace {

bool read(const pb::ChannelDescription& from, ChannelDescription& to) {
  return read(from.name(), limits::kMaxLabel, to.name) && read(from.rule(), to.rule) &&
         read_ms(from.lease_ms(), to.lease) && read(from.holder(), limits::kMaxLabel, to.holder);
}

void write(const ChannelDescription& from, pb::ChannelDescription& to) {
  to.set_name(clip(from.name, limits::kMaxLabel));
  to.set_rule(static_cast<pb::ChannelRule>(from.rule));
  to.set_lease_ms(in_ms(from.lease));
  to.set_holder(clip(from.holder, limits::kMaxLabel));
}

bool read(const pb::DeviceDescription& from, DeviceDescription& to) {
  const auto read_dof = [](std::uint32_t dof, std::uint32_t& known) { return (known = dof) >= 1 && dof <= 6; };
  if (from.has_workspace_min_m() != from.has_workspace_max_m()) return false;
  if (from.has_workspace_min_m()) {
    DeviceDescription::Box& box = to.workspace.emplace(DeviceDescription::Box{});
    if (!read(from.workspace_min_m(), box.min) || !read(from.workspace_max_m(), box.max)) return false;
    if ((box.min.array() > box.max.array()).any()) return false;
  }
  const int channels = from.channels_size();
  if (channels < 1 || channels > static_cast<int>(limits::kMaxChannels)) return false;
  for (const auto& channel : from.channels()) {
    if (!read(channel, to.channels.emplace_back())) return false;
  }
  to.loop_hz = from.loop_hz();
  return read_device(from.device(), to.device) && read(from.name(), limits::kMaxLabel, to.name) &&
         read(from.model(), limits::kMaxName, to.model) && read_dof(from.position_dof(), to.position_dof) &&
         read_dof(from.force_dof(), to.force_dof) && read_size(from.max_force_n(), to.max_force) &&
         read_size(from.continuous_force_n(), to.continuous_force) &&
         read_size(from.max_stiffness_npm(), to.max_stiffness) &&
         read_size(from.position_resolution_m(), to.position_resolution) && to.loop_hz >= 1 &&
         to.loop_hz <= limits::kMaxLoopHz;
}

void write(const DeviceDescription& from, pb::DeviceDescription& to) {
  to.set_device(from.device);
  to.set_name(clip(from.name, limits::kMaxLabel));
  to.set_model(clip(from.model, limits::kMaxName));
  to.set_position_dof(from.position_dof);
  to.set_force_dof(from.force_dof);
  if (from.workspace) {
    write(from.workspace->min, *to.mutable_workspace_min_m());
    write(from.workspace->max, *to.mutable_workspace_max_m());
  }
  to.set_max_force_n(from.max_force);
  to.set_continuous_force_n(from.continuous_force);
  to.set_max_stiffness_npm(from.max_stiffness);
  to.set_position_resolution_m(from.position_resolution);
  to.set_loop_hz(from.loop_hz);
  for (const ChannelDescription& channel : from.channels) {
    if (to.channels_size() == static_cast<int>(limits::kMaxChannels)) break;
    write(channel, *to.add_channels());
  }
}

bool read(const pb::HandleDescription& from, HandleDescription& to) {
  const bool has_axes = from.has_operator_from_device();
  if (has_axes && !read(from.operator_from_device(), to.operator_from_device.emplace())) return false;
  if (!read_labels(from.buttons(), limits::kMaxButtons, to.buttons)) return false;
  if (!read_labels(from.joints(), limits::kMaxJoints, to.joints)) return false;
  if (from.outputs_size() > static_cast<int>(limits::kMaxOutputs)) return false;
  for (const pb::OutputDescription& output : from.outputs()) {
    OutputDescription& described = to.outputs.emplace_back();
    if (!read(output.name(), limits::kMaxLabel, described.name) || !read(output.kind(), described.kind)) return false;
  }
  to.orientation_measured = from.orientation_measured();
  if (from.has_gripper_open_rad() && !read_size(from.gripper_open_rad(), to.gripper_open.emplace())) return false;
  if (!read(from.group(), limits::kMaxLabel, to.group)) return false;
  return read_device(from.device(), to.device) && read_size(from.max_torque_nm(), to.max_torque) &&
         read_size(from.max_gripper_force_n(), to.max_gripper_force) && read(from.hand(), to.hand);
}

void write(const HandleDescription& from, pb::HandleDescription& to) {
  to.set_device(from.device);
  if (from.operator_from_device) write(*from.operator_from_device, *to.mutable_operator_from_device());
  write_labels(from.buttons, limits::kMaxButtons, *to.mutable_buttons());
  write_labels(from.joints, limits::kMaxJoints, *to.mutable_joints());
  for (const OutputDescription& output : from.outputs) {
    if (to.outputs_size() == static_cast<int>(limits::kMaxOutputs)) break;
    pb::OutputDescription& described = *to.add_outputs();
    described.set_name(clip(output.name, limits::kMaxLabel));
    described.set_kind(static_cast<pb::OutputKind>(output.kind));
  }
  to.set_orientation_measured(from.orientation_measured);
  to.set_max_torque_nm(from.max_torque);
  if (from.gripper_open) to.set_gripper_open_rad(*from.gripper_open);
  to.set_max_gripper_force_n(from.max_gripper_force);
  to.set_group(clip(from.group, limits::kMaxLabel));
  to.set_hand(static_cast<pb::Hand>(from.hand));
}

}  // namespace

bool read(const pb::ControlAck& from, ControlAck& to) {
  to.id = from.id();
  if (from.has_device() && !read(from.device(), to.device.emplace())) return false;
  if (from.has_handle() && !read(from.handle(), to.handle.emplace())) return false;
  return to.id > 0 && read(from.code(), to.code) && read(from.detail(), limits::kMaxDetail, to.detail) &&
         read_ms(from.wait_ms(), to.wait);
}

void write(const ControlAck& from, pb::ControlAck& to) {
  to.set_id(from.id);
  to.set_code(static_cast<pb::Code>(from.code));
  to.set_detail(clip(from.detail, limits::kMaxDetail));
  to.set_wait_ms(in_ms(from.wait));
  to.clear_device();
  if (from.device) write(*from.device, *to.mutable_device());
  to.clear_handle();
  if (from.handle) write(*from.handle, *to.mutable_handle());
}

namespace {

bool read(const pb::Delays& from, Delays& to) noexcept {
  to = {.median = Duration{from.median_ns()}, .p99 = Duration{from.p99_ns()}};
  return in_time(to.median) && in_time(to.p99);
}

}  // namespace

bool read(const pb::LinkReport& from, LinkReport& to) {
  const auto delays = [](bool there, const pb::Delays& in, std::optional<Delays>& out) {
    out.reset();
    return !there || read(in, out.emplace());
  };
  to.number = from.number();
  to.forces = from.forces();
  to.late_server = from.late_server();
  to.late_network = from.late_network();
  to.late_engine = from.late_engine();
  to.late_unknown = from.late_unknown();
  to.refused = {.not_finite = from.refused_not_finite(),
                .out_of_bounds = from.refused_out_of_bounds(),
                .unknown_tick = from.refused_unknown_tick(),
                .old_sequence = from.refused_old_sequence()};
  to.clock_offset = Duration{from.clock_offset_ns()};
  to.clock_drift_ppm = from.clock_drift_ppm();
  to.received = from.received();
  to.lost = from.lost();
  to.reordered = from.reordered();
  to.duplicated = from.duplicated();
  return to.number > 0 && read(from.until_ns(), to.until) && read(from.span_ns(), to.span) &&
         read(from.worst_late_ns(), to.worst_late) && read(from.longest_gap_ns(), to.longest_gap) &&
         delays(from.has_round_trip(), from.round_trip(), to.round_trip) &&
         delays(from.has_to_server(), from.to_server(), to.to_server) &&
         delays(from.has_to_client(), from.to_client(), to.to_client) && in_time(to.clock_offset) &&
         bounded(to.clock_drift_ppm) && read(from.clock_error_ns(), to.clock_error) &&
         read(from.words(), limits::kMaxDetail, to.words);
}

void write(const LinkReport& from, pb::LinkReport& to) {
  const auto delays = [](const Delays& in, pb::Delays& out) {
    out.set_median_ns(in.median.count());
    out.set_p99_ns(in.p99.count());
  };
  to.Clear();
  to.set_number(from.number);
  to.set_until_ns(from.until.time_since_epoch().count());
  to.set_span_ns(unsigned_ns(from.span));
  to.set_forces(from.forces);
  to.set_late_server(from.late_server);
  to.set_late_network(from.late_network);
  to.set_late_engine(from.late_engine);
  to.set_late_unknown(from.late_unknown);
  to.set_refused_not_finite(from.refused.not_finite);
  to.set_refused_out_of_bounds(from.refused.out_of_bounds);
  to.set_refused_unknown_tick(from.refused.unknown_tick);
  to.set_refused_old_sequence(from.refused.old_sequence);
  to.set_worst_late_ns(unsigned_ns(from.worst_late));
  to.set_longest_gap_ns(unsigned_ns(from.longest_gap));
  if (from.round_trip) delays(*from.round_trip, *to.mutable_round_trip());
  if (from.to_server) delays(*from.to_server, *to.mutable_to_server());
  if (from.to_client) delays(*from.to_client, *to.mutable_to_client());
  to.set_clock_offset_ns(from.clock_offset.count());
  to.set_clock_drift_ppm(from.clock_drift_ppm);
  to.set_clock_error_ns(unsigned_ns(from.clock_error));
  to.set_received(from.received);
  to.set_lost(from.lost);
  to.set_reordered(from.reordered);
  to.set_duplicated(from.duplicated);
  to.set_words(clip(from.words, limits::kMaxDetail));
}

namespace {

/// Zeros at its end are left out.
void write(const LatenessHistogram& from, google::protobuf::RepeatedField<std::uint64_t>& to) {
  to.Clear();
  const auto last = std::find_if(from.rbegin(), from.rend(), [](std::uint64_t count) { return count > 0; });
  to.Add(from.begin(), last.base());
}

/// False when there are too many entries, or they count more than `steps`.
bool read(const google::protobuf::RepeatedField<std::uint64_t>& from, std::uint64_t steps, LatenessHistogram& to) {
  if (from.size() > static_cast<int>(to.size())) return false;
  std::uint64_t uncounted = steps;
  for (const std::uint64_t count : from) {
    if (count > uncounted) return false;
    uncounted -= count;
  }
  std::fill(std::copy(from.begin(), from.end(), to.begin()), to.end(), std::uint64_t{0});
  return true;
}

}  // namespace

bool read(const pb::DeviceReport& from, DeviceReport& to) {
  to.number = from.number();
  to.steps = from.steps();
  to.missed = from.missed();
  to.overruns = from.overruns();
  to.unseen = from.unseen();
  return to.number > 0 && read(from.until_ns(), to.until) && read(from.span_ns(), to.span) &&
         read_device(from.device(), to.device) && to.overruns <= to.steps && to.unseen <= to.steps &&
         read(from.lateness_us_log2(), to.steps, to.lateness) && read(from.safety(), to.safety) &&
         read(from.fault(), limits::kMaxDetail, to.fault) && read(from.degraded(), limits::kMaxDetail, to.degraded);
}

void write(const DeviceReport& from, pb::DeviceReport& to) {
  to.set_number(from.number);
  to.set_until_ns(from.until.time_since_epoch().count());
  to.set_span_ns(unsigned_ns(from.span));
  to.set_device(from.device);
  to.set_steps(from.steps);
  to.set_missed(from.missed);
  to.set_overruns(from.overruns);
  to.set_unseen(from.unseen);
  write(from.lateness, *to.mutable_lateness_us_log2());
  to.set_safety(static_cast<pb::Safety>(from.safety));
  to.set_fault(clip(from.fault, limits::kMaxDetail));
  to.set_degraded(clip(from.degraded, limits::kMaxDetail));
}

bool read(const pb::PeerReport& from, PeerReport& to) {
  to.state_one_in = from.state_one_in();
  to.forces_refused = from.forces_refused();
  return read_device(from.device(), to.device) && read_channel(from.channel(), to.channel) &&
         read(from.name(), limits::kMaxName, to.name) && to.state_one_in >= 1 && to.state_one_in <= limits::kMaxOneIn &&
         from.has_link() && read(from.link(), to.link) && read(from.has_error_n(), from.error_n(), to.error) &&
         (!to.error || *to.error >= 0) && read(from.way(), limits::kMaxLabel, to.way);
}

void write(const PeerReport& from, pb::PeerReport& to) {
  to.set_device(from.device);
  to.set_channel(from.channel);
  to.set_name(clip(from.name, limits::kMaxName));
  to.set_state_one_in(from.state_one_in);
  to.set_forces_refused(from.forces_refused);
  write(from.link, *to.mutable_link());
  to.clear_error_n();
  if (from.error) to.set_error_n(*from.error);
  to.set_way(clip(from.way, limits::kMaxLabel));
}

bool read(const pb::Bye& from, Bye& to) {
  return read(from.code(), to.code) && read(from.reason(), limits::kMaxDetail, to.reason);
}

void write(const Bye& from, pb::Bye& to) {
  to.set_code(static_cast<pb::Code>(from.code));
  to.set_reason(clip(from.reason, limits::kMaxDetail));
}

}  // namespace tendon::wire
