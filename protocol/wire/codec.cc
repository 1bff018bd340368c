// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/codec.h"

#include <google/protobuf/arena.h>
#include <google/protobuf/stubs/logging.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "core/base/arithmetic.h"
#include "protocol/limits.h"
#include "tendon.pb.h"

namespace tendon {
namespace {

namespace pb = tendon::v1;

constexpr std::byte kMagic{0x54};  // 'T'

// ---- little-endian integers ----

template <class Unsigned>
void put_le(Unsigned value, std::byte* to) noexcept {
  for (std::size_t i = 0; i < sizeof(Unsigned); ++i) to[i] = static_cast<std::byte>(value >> (8 * i));
}

template <class Unsigned>
Unsigned get_le(const std::byte* from) noexcept {
  Unsigned value = 0;
  for (std::size_t i = 0; i < sizeof(Unsigned); ++i) {
    value = static_cast<Unsigned>(value | static_cast<Unsigned>(std::to_integer<Unsigned>(from[i]) << (8 * i)));
  }
  return value;
}

void put_header(const Header& header, std::byte* to) noexcept {
  to[0] = kMagic;
  to[1] = static_cast<std::byte>(kProtocolVersion << 4 | static_cast<std::uint32_t>(header.type));
  to[2] = static_cast<std::byte>(header.epoch);
  to[3] = static_cast<std::byte>(header.suite);
  put_le(header.connection_id, to + 4);
  put_le(header.packet_number, to + 8);
}

std::uint8_t* bytes(std::byte* p) noexcept { return reinterpret_cast<std::uint8_t*>(p); }

// ---- text ----

/// Length of the UTF-8 character at the front of `text`; 0 when there is none (RFC 3629, table 3-7 of
/// the Unicode standard: no overlong forms, no surrogates, nothing above U+10FFFF).
std::size_t utf8_character(std::string_view text) noexcept {
  const auto at = [&](std::size_t i) {
    return i < text.size() ? static_cast<unsigned>(static_cast<unsigned char>(text[i])) : 0U;
  };
  const auto follows = [&](std::size_t i) { return (at(i) & 0xC0U) == 0x80U; };
  const unsigned first = at(0);
  if (text.empty()) return 0;
  if (first < 0x80) return 1;
  if (first >= 0xC2 && first <= 0xDF) return follows(1) ? 2 : 0;
  if (first >= 0xE0 && first <= 0xEF) {
    const bool overlong = first == 0xE0 && at(1) < 0xA0;
    const bool surrogate = first == 0xED && at(1) > 0x9F;
    return follows(1) && follows(2) && !overlong && !surrogate ? 3 : 0;
  }
  if (first >= 0xF0 && first <= 0xF4) {
    const bool overlong = first == 0xF0 && at(1) < 0x90;
    const bool too_high = first == 0xF4 && at(1) > 0x8F;
    return follows(1) && follows(2) && follows(3) && !overlong && !too_high ? 4 : 0;
  }
  return 0;
}

/// The front of `text`, as far as it is UTF-8 and not longer than `limit` bytes. Protobuf parsers refuse
/// a whole datagram for one bad character.
std::string clip(std::string_view text, std::size_t limit) {
  std::size_t size = 0;
  while (size < text.size()) {
    const std::size_t next = utf8_character(text.substr(size));
    if (next == 0 || size + next > limit) break;
    size += next;
  }
  return std::string(text.substr(0, size));
}

// ---- single values; `read` is false when the value is out of bounds ----

bool bounded(double value) noexcept { return std::abs(value) <= limits::kMaxValue; }  // false for NaN
bool in_time(Duration d) noexcept { return d >= -limits::kMaxTime && d <= limits::kMaxTime; }

bool read(const pb::Vec3& from, Vec3& to) noexcept {
  to = {from.x(), from.y(), from.z()};
  return bounded(from.x()) && bounded(from.y()) && bounded(from.z());
}

void write(const Vec3& from, pb::Vec3& to) {
  to.set_x(from.x());
  to.set_y(from.y());
  to.set_z(from.z());
}

template <class Time>
bool read(std::int64_t ns, Time& to) noexcept {
  to = Time{Duration{ns}};
  return ns >= -limits::kMaxTime.count() && ns <= limits::kMaxTime.count();
}

/// A length of time, which is never below zero.
bool read(std::uint64_t ns, Duration& to) noexcept {
  to = Duration{static_cast<Duration::rep>(ns)};
  return ns <= static_cast<std::uint64_t>(limits::kMaxTime.count());
}
std::uint64_t unsigned_ns(Duration d) noexcept { return static_cast<std::uint64_t>(d.count()); }

/// Our enums have the numbers of the wire: first is 1, all up to `last` are used.
template <class Enum>
bool read_enum(int from, Enum last, Enum& to) noexcept {
  if (from < 1 || from > static_cast<int>(last)) return false;
  to = static_cast<Enum>(from);
  return true;
}
bool read(pb::Mode from, Mode& to) noexcept { return read_enum(from, Mode::kFault, to); }
bool read(pb::Role from, Role& to) noexcept { return read_enum(from, Role::kController, to); }
bool read(pb::Code from, Code& to) noexcept { return read_enum(from, Code::kReplaced, to); }
bool read(pb::Safety from, Safety& to) noexcept { return read_enum(from, Safety::kUnguarded, to); }
bool read(pb::ChannelRule from, ChannelRule& to) noexcept { return read_enum(from, ChannelRule::kPriority, to); }

bool read_device(std::uint32_t from, std::uint32_t& to) noexcept { return (to = from) < limits::kMaxDevices; }
bool read_channel(std::uint32_t from, std::uint32_t& to) noexcept { return (to = from) < limits::kMaxChannels; }

bool read_ms(std::uint32_t from, Duration& to) noexcept {
  to = std::chrono::milliseconds(from);
  return to <= limits::kMaxTimeout;
}
/// Rounded up: who waits for so long has waited long enough.
std::uint32_t in_ms(Duration from) noexcept {
  const auto ms = std::chrono::ceil<std::chrono::milliseconds>(std::clamp(from, Duration::zero(), limits::kMaxTimeout));
  return static_cast<std::uint32_t>(ms.count());
}

/// A number that is 0 when it is not known.
bool read_size(double from, double& to) noexcept { return bounded(to = from) && from >= 0; }

bool read(const std::string& from, std::size_t limit, std::string& to) {
  if (from.size() > limit) return false;
  to = from;
  return true;
}

using Texts = google::protobuf::RepeatedPtrField<std::string>;

bool read_features(const Texts& from, std::vector<std::string>& to) {
  if (from.size() > limits::kMaxFeatures) return false;
  to.assign(from.begin(), from.end());
  return std::all_of(to.begin(), to.end(), [](const auto& text) { return text.size() <= limits::kMaxFeature; });
}

void write_features(const std::vector<std::string>& from, Texts& to) {
  for (const std::string& feature : from) {
    if (to.size() == limits::kMaxFeatures) break;
    *to.Add() = clip(feature, limits::kMaxFeature);
  }
}

// ---- frames ----

bool read(const pb::DeviceState& from, DeviceState& to) noexcept {
  to.tick = from.tick();
  to.energy = from.energy_j();
  to.permitted_force = from.permitted_force_n();
  to.reasons = from.reasons();
  to.force_sequence = from.force_sequence();
  const bool unbounded_force = to.permitted_force == std::numeric_limits<double>::infinity();
  to.force_wanted.reset();
  if (from.has_force_wanted_n() && !read(from.force_wanted_n(), to.force_wanted.emplace())) return false;
  return read(from.sampled_ns(), to.sampled) && read(from.position_m(), to.position) &&
         read(from.velocity_mps(), to.velocity) && read(from.force_applied_n(), to.force_applied) &&
         bounded(to.energy) && (unbounded_force || bounded(to.permitted_force)) && to.permitted_force >= 0 &&
         read(from.force_age_ns(), to.force_age) && read(from.mode(), to.mode) &&
         read_device(from.device(), to.device) && read_channel(from.channel(), to.channel);
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
  if (from.force_wanted) {
    write(*from.force_wanted, *to.mutable_force_wanted_n());
  } else {
    to.clear_force_wanted_n();
  }
}

bool all_bounded(const auto& numbers) noexcept { return (numbers.array().abs() <= limits::kMaxValue).all(); }

bool in_bounds(const ForceTable& table) noexcept {
  return table.size >= ForceTable::kMinEntries && table.size <= ForceTable::kMaxEntries && bounded(table.first) &&
         bounded(table.step) && table.step > 0 &&
         std::all_of(table.force.begin(), table.force.begin() + table.size, [](double f) { return bounded(f); });
}

bool in_bounds(const Contact& contact) noexcept {
  return std::abs(contact.normal.norm() - 1) <= Contact::kUnitTolerance && bounded(contact.gap) &&
         (!contact.table || in_bounds(*contact.table));
}

bool in_bounds(const LocalModel& model) noexcept {
  const bool anywhere = model.valid_radius == std::numeric_limits<double>::infinity();
  return all_bounded(model.at) && all_bounded(model.stiffness) && (anywhere || bounded(model.valid_radius)) &&
         model.valid_radius >= 0 && (!model.contact || in_bounds(*model.contact));
}

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
  const auto& k = from.stiffness_npm();
  switch (k.size()) {
    case 1:
      to.stiffness = k.Get(0) * Mat3::Identity();
      break;
    case 3:
      to.stiffness = Vec3(k.Get(0), k.Get(1), k.Get(2)).asDiagonal();
      break;
    case 9:
      to.stiffness = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(k.data());
      break;
    default:
      return false;
  }
  read(from.at_m(), to.at);
  if (from.has_valid_radius_m()) to.valid_radius = from.valid_radius_m();
  return !from.has_contact() || read(from.contact(), to.contact.emplace());
}

/// The shortest of the three forms that says the same.
void write(const LocalModel& from, pb::LocalModel& to) {
  write(from.at, *to.mutable_at_m());
  const Mat3& k = from.stiffness;
  to.clear_valid_radius_m();
  if (from.valid_radius != std::numeric_limits<double>::infinity()) to.set_valid_radius_m(from.valid_radius);
  to.clear_contact();
  if (from.contact) write(*from.contact, *to.mutable_contact());
  auto& out = *to.mutable_stiffness_npm();
  out.Clear();
  const bool diagonal = k(0, 1) == 0 && k(0, 2) == 0 && k(1, 0) == 0 && k(1, 2) == 0 && k(2, 0) == 0 && k(2, 1) == 0;
  if (diagonal && k(0, 0) == k(1, 1) && k(0, 0) == k(2, 2)) {
    out.Add(k(0, 0));
  } else if (diagonal) {
    for (int i = 0; i < 3; ++i) out.Add(k(i, i));
  } else {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) out.Add(k(row, column));
    }
  }
}

bool read(const pb::ForceCommand& from, ForceCommand& to) noexcept {
  to.sequence = from.sequence();
  to.based_on_tick = from.based_on_tick();
  to.valid_for = std::chrono::microseconds(from.valid_for_us());
  to.model.reset();
  if (from.has_model() && !read(from.model(), to.model.emplace())) return false;
  to.topology_changed = from.topology_changed();
  to.error.reset();
  if (from.has_error_n()) to.error = from.error_n();
  read(from.force_n(), to.force);
  return to.sequence > 0 && in_bounds(to) && to.valid_for > Duration::zero() && to.valid_for <= limits::kMaxValidFor &&
         read_device(from.device(), to.device) && read_channel(from.channel(), to.channel);
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
  // Out-of-range durations become 0, which the receiver refuses; a cast would make them look valid.
  const bool possible = from.valid_for > Duration::zero() && from.valid_for <= limits::kMaxValidFor;
  const auto us = std::chrono::ceil<std::chrono::microseconds>(possible ? from.valid_for : Duration::zero());
  to.set_valid_for_us(static_cast<std::uint32_t>(us.count()));
  to.set_device(from.device);
  to.set_channel(from.channel);
  to.set_topology_changed(from.topology_changed);
  to.clear_error_n();
  if (from.error) to.set_error_n(*from.error);
}

bool read(const pb::SetStateRate& from, SetStateRate& to) noexcept {
  to.hz = from.hz();
  return read_device(from.device(), to.device);
}
bool read(const pb::Rearm& from, Rearm& to) noexcept { return read_device(from.device(), to.device); }
bool read(const pb::Disarm& from, Disarm& to) noexcept { return read_device(from.device(), to.device); }
bool read(const pb::Describe& from, Describe& to) noexcept { return read_device(from.device(), to.device); }
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
    case pb::Control::OP_NOT_SET:
      break;
  }
  to.request.reset();
  return true;
}

void write_request(const SetStateRate& from, pb::Control& to) {
  to.mutable_set_state_rate()->set_hz(from.hz);
  to.mutable_set_state_rate()->set_device(from.device);
}
void write_request(const Rearm& from, pb::Control& to) { to.mutable_rearm()->set_device(from.device); }
void write_request(const Disarm& from, pb::Control& to) { to.mutable_disarm()->set_device(from.device); }
void write_request(const Describe& from, pb::Control& to) { to.mutable_describe()->set_device(from.device); }
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
void write_request(const SetStateDeadband& from, pb::Control& to) {
  auto& out = *to.mutable_set_state_deadband();
  out.set_share(from.share);
  out.set_floor_mps(from.floor);
  // What is out of range becomes what the server does not grant; a cast could make it look like something else.
  const bool possible = from.max_silence >= Duration::zero() && from.max_silence <= limits::kMaxStateSilence;
  const auto us = std::chrono::ceil<std::chrono::microseconds>(from.max_silence).count();
  out.set_max_silence_us(possible ? static_cast<std::uint32_t>(us) : std::numeric_limits<std::uint32_t>::max());
}

void write(const Control& from, pb::Control& to) {
  to.set_id(from.id);
  to.clear_op();
  if (from.request) std::visit([&](const auto& request) { write_request(request, to); }, *from.request);
}

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

bool read(const pb::ControlAck& from, ControlAck& to) {
  to.id = from.id();
  if (from.has_device() && !read(from.device(), to.device.emplace())) return false;
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
}

bool read(const pb::Delays& from, Delays& to) noexcept {
  to = {.median = Duration{from.median_ns()}, .p99 = Duration{from.p99_ns()}};
  return in_time(to.median) && in_time(to.p99);
}

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
         from.has_link() && read(from.link(), to.link);
}

void write(const PeerReport& from, pb::PeerReport& to) {
  to.set_device(from.device);
  to.set_channel(from.channel);
  to.set_name(clip(from.name, limits::kMaxName));
  to.set_state_one_in(from.state_one_in);
  to.set_forces_refused(from.forces_refused);
  write(from.link, *to.mutable_link());
}

bool read(const pb::Bye& from, Bye& to) {
  return read(from.code(), to.code) && read(from.reason(), limits::kMaxDetail, to.reason);
}

void write(const Bye& from, pb::Bye& to) {
  to.set_code(static_cast<pb::Code>(from.code));
  to.set_reason(clip(from.reason, limits::kMaxDetail));
}

bool read(const pb::Echo& from, IncomingEcho& to) noexcept {
  to.packet_number = from.peer_packet_number();
  to.received_mask = from.received_mask();
  return read(from.peer_tx_time_ns(), to.sent) && read(from.rx_time_ns(), to.received);
}

/// Appends the frame to `content`, or counts it.
template <class Value, class Message>
void take(const Message& from, DataContent& content) {
  Frame& frame = content.frames.emplace_back(std::in_place_type<Value>);
  if (read(from, std::get<Value>(frame))) return;
  content.frames.pop_back();
  ++content.invalid;
}

// ---- handshake ----

bool read(const pb::Claim& from, Claim& to) {
  return read(from.device(), limits::kMaxLabel, to.device) && read(from.channel(), limits::kMaxLabel, to.channel) &&
         read(from.role(), to.role);
}
bool read(const pb::Grant& from, Grant& to) noexcept {
  return read_device(from.device(), to.device) && read_channel(from.channel(), to.channel) &&
         read(from.role(), to.role);
}

/// Claims, or grants.
template <class Messages, class Value>
bool read_claims(const Messages& from, std::vector<Value>& to) {
  if (from.size() > limits::kMaxClaims) return false;
  to.resize(static_cast<std::size_t>(from.size()));
  return std::equal(from.begin(), from.end(), to.begin(),
                    [](const auto& one, Value& value) { return read(one, value); });
}

bool read(const pb::Hello& from, Hello& to) {
  to.version_min = from.version_min();
  to.version_max = from.version_max();
  return read_claims(from.claims(), to.claims) && to.version_min >= 1 && to.version_min <= to.version_max &&
         read(from.role(), to.role) && read(from.name(), limits::kMaxName, to.name) &&
         read_features(from.features(), to.features);
}

void write(const Hello& from, pb::Hello& to) {
  to.set_version_min(from.version_min);
  to.set_version_max(from.version_max);
  to.set_role(static_cast<pb::Role>(from.role));
  to.set_name(clip(from.name, limits::kMaxName));
  write_features(from.features, *to.mutable_features());
  for (const Claim& claim : from.claims) {
    if (to.claims_size() == limits::kMaxClaims) break;
    pb::Claim& out = *to.add_claims();
    out.set_device(clip(claim.device, limits::kMaxLabel));
    out.set_channel(clip(claim.channel, limits::kMaxLabel));
    out.set_role(static_cast<pb::Role>(claim.role));
  }
}

bool read(const pb::Welcome& from, Welcome& to) {
  to.version = from.version();
  to.max_force = from.max_force_n();
  to.position_resolution = from.position_resolution_m();
  to.loop_hz = from.loop_hz();
  to.timeout = std::chrono::milliseconds(from.timeout_ms());
  return to.version >= 1 && read_claims(from.grants(), to.grants) && read_features(from.features(), to.features) &&
         read(from.role(), to.role) && read(from.device_name(), limits::kMaxName, to.device_name) &&
         bounded(to.max_force) && to.max_force >= 0 && bounded(to.position_resolution) && to.position_resolution >= 0 &&
         to.loop_hz >= 1 && to.loop_hz <= limits::kMaxLoopHz && to.timeout > Duration::zero() &&
         to.timeout <= limits::kMaxTimeout && read(from.server(), limits::kMaxName, to.server);
}

void write(const Welcome& from, pb::Welcome& to) {
  to.set_version(from.version);
  write_features(from.features, *to.mutable_features());
  to.set_role(static_cast<pb::Role>(from.role));
  to.set_device_name(clip(from.device_name, limits::kMaxName));
  to.set_max_force_n(from.max_force);
  to.set_position_resolution_m(from.position_resolution);
  to.set_loop_hz(from.loop_hz);
  to.set_timeout_ms(
      static_cast<std::uint32_t>(std::chrono::duration_cast<std::chrono::milliseconds>(from.timeout).count()));
  to.set_server(clip(from.server, limits::kMaxName));
  for (const Grant& grant : from.grants) {
    if (to.grants_size() == limits::kMaxClaims) break;
    pb::Grant& out = *to.add_grants();
    out.set_device(grant.device);
    out.set_channel(grant.channel);
    out.set_role(static_cast<pb::Role>(grant.role));
  }
}

bool read(const pb::Refused& from, Refused& to) {
  to.version_min = from.version_min();
  to.version_max = from.version_max();
  return read(from.code(), to.code) && read(from.detail(), limits::kMaxDetail, to.detail);
}

void write(const Refused& from, pb::Refused& to) {
  to.set_code(static_cast<pb::Code>(from.code));
  to.set_detail(clip(from.detail, limits::kMaxDetail));
  to.set_version_min(from.version_min);
  to.set_version_max(from.version_max);
}

void write_answer(const Welcome& from, pb::Answer& to) { write(from, *to.mutable_welcome()); }
void write_answer(const Refused& from, pb::Answer& to) { write(from, *to.mutable_refused()); }

/// Parses without a word: protobuf prints a line for every text that is not UTF-8, and a stranger must
/// not be able to fill our log.
template <class Message>
bool parse(std::span<const std::byte> from, Message& to) {
  const google::protobuf::LogSilencer silence;
  return to.ParseFromArray(from.data(), static_cast<int>(from.size()));
}

template <class Message>
std::vector<std::byte> serialized(const Message& message) {
  std::vector<std::byte> out(message.ByteSizeLong());
  message.SerializeWithCachedSizesToArray(bytes(out.data()));
  return out;
}

// Bytes of the handshake datagrams, after the header.
constexpr std::size_t kRandomAt = kHeaderSize;
constexpr std::size_t kCookieAt = kRandomAt + sizeof(ClientRandom);
constexpr std::size_t kRetrySize = kCookieAt + sizeof(Cookie);
constexpr std::size_t kHelloLengthAt = kRetrySize;
constexpr std::size_t kHelloAt = kHelloLengthAt + 2;
constexpr std::size_t kAnswerAt = kCookieAt;

std::array<std::byte, 16> get16(std::span<const std::byte> datagram, std::size_t at) noexcept {
  std::array<std::byte, 16> value;
  std::copy_n(datagram.begin() + static_cast<std::ptrdiff_t>(at), value.size(), value.begin());
  return value;
}

void put16(const std::array<std::byte, 16>& value, std::byte* to) noexcept {
  std::copy(value.begin(), value.end(), to);
}

/// The header, when the datagram is a handshake datagram of that type.
std::optional<Header> handshake_header(std::span<const std::byte> datagram, DatagramType type) noexcept {
  const std::optional<Header> header = decode_header(datagram);
  if (!header || header->type != type || header->packet_number != 0) return {};
  if (type != DatagramType::kAnswer && header->connection_id != 0) return {};
  return header;
}

}  // namespace

bool in_bounds(const ForceCommand& command) noexcept {
  return all_bounded(command.force) && (!command.model || in_bounds(*command.model)) &&
         (!command.error || (bounded(*command.error) && *command.error >= 0));
}

std::array<std::byte, kHeaderSize> encode_header(const Header& header) noexcept {
  std::array<std::byte, kHeaderSize> bytes;
  put_header(header, bytes.data());
  return bytes;
}

std::optional<Header> decode_header(std::span<const std::byte> datagram) noexcept {
  if (datagram.size() < kHeaderSize || datagram.size() > kMaxDatagram) return {};
  const auto version = std::to_integer<std::uint32_t>(datagram[1] >> 4);
  const auto type = std::to_integer<std::uint8_t>(datagram[1] & std::byte{0x0F});
  if (datagram[0] != kMagic || version != kProtocolVersion) return {};
  if (type < 1 || type > static_cast<std::uint8_t>(DatagramType::kAnswer)) return {};
  const auto epoch = std::to_integer<std::uint8_t>(datagram[2]);
  const auto suite = std::to_integer<std::uint8_t>(datagram[3]);
  if (suite > static_cast<std::uint8_t>(Suite::kNoise)) return {};
  const bool renews_keys =
      suite != static_cast<std::uint8_t>(Suite::kPlain) && type == static_cast<std::uint8_t>(DatagramType::kData);
  if (epoch != 0 && !renews_keys) return {};
  return Header{.type = static_cast<DatagramType>(type),
                .suite = static_cast<Suite>(suite),
                .epoch = epoch,
                .connection_id = get_le<std::uint32_t>(datagram.data() + 4),
                .packet_number = get_le<std::uint64_t>(datagram.data() + 8)};
}

// ---- Data ----

/// One small Datagram per kind of frame. Protobuf defines the concatenation of two messages as their
/// merge, so a datagram with several frames is written piece after piece, and each piece keeps its
/// objects for the next time.
struct DataWriter::Pieces {
  pb::Datagram head, state, force, control, ack, bye, report, device_report, peer_report;
  pb::Frame& state_frame = *state.add_frames();
  pb::Frame& force_frame = *force.add_frames();
  pb::Frame& control_frame = *control.add_frames();
  pb::Frame& ack_frame = *ack.add_frames();
  pb::Frame& bye_frame = *bye.add_frames();
  pb::Frame& report_frame = *report.add_frames();
  pb::Frame& device_report_frame = *device_report.add_frames();
  pb::Frame& peer_report_frame = *peer_report.add_frames();
};

DataWriter::DataWriter() : pieces_(std::make_unique<Pieces>()) {}
DataWriter::~DataWriter() = default;
DataWriter::DataWriter(DataWriter&&) noexcept = default;
DataWriter& DataWriter::operator=(DataWriter&&) noexcept = default;

template <class Piece>
bool DataWriter::append(const Piece& piece) {
  const std::size_t size = piece.ByteSizeLong();
  if (size > buffer_.size() - size_ || frames_ + piece.frames_size() > limits::kMaxFrames) return false;
  piece.SerializeWithCachedSizesToArray(bytes(buffer_.data() + size_));
  size_ += size;
  frames_ += piece.frames_size();
  return true;
}

void DataWriter::begin(std::span<std::byte> buffer, const Header& header, LocalTime sent,
                       const std::optional<OutgoingEcho>& echo) {
  buffer_ = buffer;
  put_header(header, buffer_.data());
  size_ = kHeaderSize;
  frames_ = 0;

  pb::Datagram& head = pieces_->head;
  head.set_tx_time_ns(sent.time_since_epoch().count());
  if (echo) {
    pb::Echo& out = *head.mutable_echo();
    out.set_peer_tx_time_ns(echo->sent.time_since_epoch().count());
    out.set_rx_time_ns(echo->received.time_since_epoch().count());
    out.set_peer_packet_number(echo->packet_number);
    out.set_received_mask(echo->received_mask);
  } else {
    head.clear_echo();
  }
  append(head);
}

bool DataWriter::add(const DeviceState& state) {
  write(state, *pieces_->state_frame.mutable_state());
  return append(pieces_->state);
}
bool DataWriter::add(const ForceCommand& command) {
  write(command, *pieces_->force_frame.mutable_force());
  return append(pieces_->force);
}
bool DataWriter::add(const Control& control) {
  write(control, *pieces_->control_frame.mutable_control());
  return append(pieces_->control);
}
bool DataWriter::add(const ControlAck& ack) {
  write(ack, *pieces_->ack_frame.mutable_control_ack());
  return append(pieces_->ack);
}
bool DataWriter::add(const Bye& bye) {
  write(bye, *pieces_->bye_frame.mutable_bye());
  return append(pieces_->bye);
}
bool DataWriter::add(const LinkReport& report) {
  write(report, *pieces_->report_frame.mutable_report());
  return append(pieces_->report);
}
bool DataWriter::add(const DeviceReport& report) {
  write(report, *pieces_->device_report_frame.mutable_device_report());
  return append(pieces_->device_report);
}
bool DataWriter::add(const PeerReport& report) {
  write(report, *pieces_->peer_report_frame.mutable_peer_report());
  return append(pieces_->peer_report);
}

/// Parsed objects live in an arena whose first block is ours: no heap for a state or a force, and one
/// `Reset` frees what a hostile datagram made of its 1200 bytes.
struct DataReader::Memory {
  alignas(16) std::array<char, 8192> block;
  google::protobuf::Arena arena{block.data(), block.size()};
  DataContent content;
};

DataReader::DataReader() : memory_(std::make_unique<Memory>()) {}
DataReader::~DataReader() = default;
DataReader::DataReader(DataReader&&) noexcept = default;
DataReader& DataReader::operator=(DataReader&&) noexcept = default;

const DataContent* DataReader::read(std::span<const std::byte> body) {
  memory_->arena.Reset();
  auto& datagram = *google::protobuf::Arena::CreateMessage<pb::Datagram>(&memory_->arena);
  DataContent& content = memory_->content;
  if (body.size() > kMaxDatagram || !parse(body, datagram) || datagram.frames_size() > limits::kMaxFrames) {
    return nullptr;
  }
  if (!tendon::read(datagram.tx_time_ns(), content.sent)) return nullptr;

  content.frames.clear();
  content.invalid = 0;
  content.echo.reset();
  if (datagram.has_echo() && !tendon::read(datagram.echo(), content.echo.emplace())) {
    content.echo.reset();
    ++content.invalid;
  }
  for (const pb::Frame& frame : datagram.frames()) {
    switch (frame.body_case()) {
      case pb::Frame::kState:
        take<DeviceState>(frame.state(), content);
        break;
      case pb::Frame::kForce:
        take<ForceCommand>(frame.force(), content);
        break;
      case pb::Frame::kControl:
        take<Control>(frame.control(), content);
        break;
      case pb::Frame::kControlAck:
        take<ControlAck>(frame.control_ack(), content);
        break;
      case pb::Frame::kBye:
        take<Bye>(frame.bye(), content);
        break;
      case pb::Frame::kReport:
        take<LinkReport>(frame.report(), content);
        break;
      case pb::Frame::kDeviceReport:
        take<DeviceReport>(frame.device_report(), content);
        break;
      case pb::Frame::kPeerReport:
        take<PeerReport>(frame.peer_report(), content);
        break;
      case pb::Frame::BODY_NOT_SET:
        break;  // a frame of a newer peer
    }
  }
  return &content;
}

// ---- Handshake ----

std::size_t encode(const HelloDatagram& hello, std::span<std::byte, kMaxDatagram> buffer) {
  std::byte* const to = buffer.data();
  put_header({.type = DatagramType::kHello, .suite = hello.suite}, to);
  put16(hello.random, to + kRandomAt);
  put16(hello.cookie, to + kCookieAt);
  put_le(static_cast<std::uint16_t>(hello.body.size()), to + kHelloLengthAt);
  std::byte* const end = std::copy(hello.body.begin(), hello.body.end(), to + kHelloAt);
  std::fill(end, to + kMaxDatagram, std::byte{0});
  return kMaxDatagram;
}

std::size_t encode(const RetryDatagram& retry, std::span<std::byte, kMaxDatagram> buffer) {
  std::byte* const to = buffer.data();
  put_header({.type = DatagramType::kRetry, .suite = retry.suite}, to);
  put16(retry.random, to + kRandomAt);
  put16(retry.cookie, to + kCookieAt);
  return kRetrySize;
}

std::size_t encode(const AnswerDatagram& answer, std::span<std::byte, kMaxDatagram> buffer) {
  std::byte* const to = buffer.data();
  put_header({.type = DatagramType::kAnswer, .suite = answer.suite, .connection_id = answer.connection_id}, to);
  put16(answer.random, to + kRandomAt);
  std::copy(answer.body.begin(), answer.body.end(), to + kAnswerAt);
  return kAnswerAt + answer.body.size();
}

std::optional<HelloDatagram> decode_hello(std::span<const std::byte> datagram) noexcept {
  const std::optional<Header> header = handshake_header(datagram, DatagramType::kHello);
  if (!header || datagram.size() != kMaxDatagram) return {};
  const std::size_t size = get_le<std::uint16_t>(datagram.data() + kHelloLengthAt);
  if (size > kMaxHandshakeBody) return {};
  const auto padding = datagram.subspan(kHelloAt + size);
  if (std::any_of(padding.begin(), padding.end(), [](std::byte b) { return b != std::byte{0}; })) return {};
  return HelloDatagram{.suite = header->suite,
                       .random = get16(datagram, kRandomAt),
                       .cookie = get16(datagram, kCookieAt),
                       .body = datagram.subspan(kHelloAt, size)};
}

std::optional<RetryDatagram> decode_retry(std::span<const std::byte> datagram) noexcept {
  const std::optional<Header> header = handshake_header(datagram, DatagramType::kRetry);
  if (!header || datagram.size() != kRetrySize) return {};
  return RetryDatagram{
      .suite = header->suite, .random = get16(datagram, kRandomAt), .cookie = get16(datagram, kCookieAt)};
}

std::optional<AnswerDatagram> decode_answer(std::span<const std::byte> datagram) noexcept {
  const std::optional<Header> header = handshake_header(datagram, DatagramType::kAnswer);
  if (!header || datagram.size() < kAnswerAt) return {};
  return AnswerDatagram{.suite = header->suite,
                        .connection_id = header->connection_id,
                        .random = get16(datagram, kRandomAt),
                        .body = datagram.subspan(kAnswerAt)};
}

std::vector<std::byte> write_body(const Hello& hello) {
  pb::Hello message;
  write(hello, message);
  return serialized(message);
}

std::vector<std::byte> write_body(const Answer& answer) {
  pb::Answer message;
  std::visit([&](const auto& body) { write_answer(body, message); }, answer);
  return serialized(message);
}

std::optional<Hello> read_hello(std::span<const std::byte> body) {
  pb::Hello message;
  Hello hello;
  if (!parse(body, message) || !read(message, hello)) return {};
  return hello;
}

std::optional<Answer> read_answer(std::span<const std::byte> body) {
  pb::Answer message;
  if (!parse(body, message)) return {};
  Answer answer;
  switch (message.body_case()) {
    case pb::Answer::kWelcome:
      if (!read(message.welcome(), std::get<Welcome>(answer))) return {};
      return answer;
    case pb::Answer::kRefused:
      if (!read(message.refused(), answer.emplace<Refused>())) return {};
      return answer;
    case pb::Answer::BODY_NOT_SET:
      return {};
  }
  return {};
}

}  // namespace tendon
