// SPDX-License-Identifier: Apache-2.0
#include "server/recording/recording_codec.h"

#include <google/protobuf/descriptor.pb.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <limits>
#include <span>
#include <stdexcept>
#include <vector>

#include "protocol/link.h"
#include "protocol/wire/fields/writer.h"
#include "protocol/wire/header.h"
#include "recording.pb.h"

namespace tendon::recording {
namespace {

namespace pb = tendon::recording::v1;

void put(pb::Vec3* out, const Vec3& v) {
  out->set_x(v.x());
  out->set_y(v.y());
  out->set_z(v.z());
}

Vec3 vec3(const pb::Vec3& v) { return {v.x(), v.y(), v.z()}; }

void put(pb::Quat* out, const Quat& q) {
  out->set_w(q.w);
  out->set_x(q.x);
  out->set_y(q.y);
  out->set_z(q.z);
}

Quat quat(const pb::Quat& q) { return {q.w(), q.x(), q.y(), q.z()}; }

TurnStep turn_step(const pb::Turn& in) {
  return {.hand = {.orientation = quat(in.orientation()), .angular_velocity = vec3(in.angular_velocity_radps())},
          .was_applied = vec3(in.torque_held_nm()),
          .wanted = vec3(in.torque_wanted_nm()),
          .torque = vec3(in.torque_commanded_nm()),
          .applied = vec3(in.torque_applied_nm())};
}

GripStep grip_step(const pb::Grip& in) {
  return {.hand = {.opening = in.opening_rad(), .velocity = in.velocity_radps()},
          .was_applied = in.force_held_n(),
          .wanted = in.force_wanted_n(),
          .force = in.force_commanded_n(),
          .applied = in.force_applied_n(),
          .permitted = in.permitted_n(),
          .energy = in.energy_j()};
}

FieldStep field_step(const pb::Field& in) {
  return {.generation = in.generation(),
          .channel = static_cast<std::uint8_t>(in.channel()),
          .swapping = in.swapping(),
          .depth = in.depth_m(),
          .proxy = vec3(in.proxy_m()),
          .force = vec3(in.force_n()),
          .stored = in.stored_j(),
          .refused = in.refused_j(),
          .credit = in.credited_j()};
}

void put(pb::PortState* out, const PortState& state) {
  out->set_epoch(state.epoch);
  out->set_sequence(state.sequence);
  out->set_answers_epoch(state.answers_epoch);
  out->set_answers(state.answers);
  out->set_time_ns(state.time.count());
  out->set_round_trip_ns(state.round_trip.count());
  out->set_phase(static_cast<std::uint32_t>(state.phase));
  out->set_engagement(state.engagement);
  out->set_buttons(state.buttons);
  put(out->mutable_displacement_m(), state.position);
  put(out->mutable_velocity_mps(), state.velocity);
  put(out->mutable_force_n(), state.force);
  if (state.contact_force) put(out->mutable_contact_force_n(), *state.contact_force);
  out->set_account_j(state.account);
  out->set_need_j(state.need);
  out->set_given_j(state.given);
  out->set_taken_j(state.taken);
  if (state.surface) {
    put(out->mutable_surface()->mutable_normal(), state.surface->normal);
    out->mutable_surface()->set_offset_m(state.surface->offset);
    out->mutable_surface()->set_stiffness_n_per_m(state.surface->stiffness);
  }
  if (!state.wave_integral.isZero(0)) put(out->mutable_wave_integral(), state.wave_integral);
  out->set_wave_energy_j(state.wave_energy);
  if (state.turn) {
    put(out->mutable_turn()->mutable_turn(), state.turn->turn);
    put(out->mutable_turn()->mutable_angular_velocity_radps(), state.turn->angular_velocity);
    put(out->mutable_turn()->mutable_torque_nm(), state.turn->torque);
  }
  if (state.grip) {
    out->mutable_grip()->set_opening_m(state.grip->opening);
    out->mutable_grip()->set_velocity_mps(state.grip->velocity);
    out->mutable_grip()->set_force_n(state.grip->force);
    out->mutable_grip()->set_account_j(state.grip->account);
    out->mutable_grip()->set_need_j(state.grip->need);
    out->mutable_grip()->set_given_j(state.grip->given);
    out->mutable_grip()->set_taken_j(state.grip->taken);
  }
  out->set_energy_in_j(state.energy_in);
  if (state.share) out->set_share(*state.share);
  out->set_position_scale(state.position_scale);
  out->set_force_scale(state.force_scale);
}

PortState port_state(const pb::PortState& in) {
  if (in.phase() < static_cast<std::uint32_t>(PortPhase::kAlone) ||
      in.phase() > static_cast<std::uint32_t>(PortPhase::kFault)) {
    throw std::invalid_argument("a port has the unknown phase " + std::to_string(in.phase()));
  }
  PortState out;
  out.epoch = in.epoch();
  out.sequence = in.sequence();
  out.answers_epoch = in.answers_epoch();
  out.answers = in.answers();
  out.time = Duration(in.time_ns());
  out.round_trip = Duration(in.round_trip_ns());
  out.phase = static_cast<PortPhase>(in.phase());
  out.engagement = in.engagement();
  out.buttons = in.buttons();
  out.position = vec3(in.displacement_m());
  out.velocity = vec3(in.velocity_mps());
  out.force = vec3(in.force_n());
  if (in.has_contact_force_n()) out.contact_force = vec3(in.contact_force_n());
  out.account = in.account_j();
  out.need = in.need_j();
  out.given = in.given_j();
  out.taken = in.taken_j();
  if (in.has_surface()) {
    out.surface = {.normal = vec3(in.surface().normal()),
                   .offset = in.surface().offset_m(),
                   .stiffness = in.surface().stiffness_n_per_m()};
  }
  out.wave_integral = vec3(in.wave_integral());
  out.wave_energy = in.wave_energy_j();
  if (in.has_turn()) {
    out.turn = {.turn = quat(in.turn().turn()),
                .angular_velocity = vec3(in.turn().angular_velocity_radps()),
                .torque = vec3(in.turn().torque_nm())};
  }
  if (in.has_grip()) {
    out.grip = {.opening = in.grip().opening_m(),
                .velocity = in.grip().velocity_mps(),
                .force = in.grip().force_n(),
                .account = in.grip().account_j(),
                .need = in.grip().need_j(),
                .given = in.grip().given_j(),
                .taken = in.grip().taken_j()};
  }
  out.energy_in = in.energy_in_j();
  if (in.has_share()) out.share = in.share();
  out.position_scale = in.position_scale();
  out.force_scale = in.force_scale();
  return out;
}

// There are thousands of steps and datagrams per second, so they are encoded without protobuf. The fields must be
// written in the order of their numbers.

using wire::field;
using wire::Writer;

constexpr std::size_t kMostOfAStep = 1005;     // without the force_way
constexpr std::size_t kMostOfADatagram = 100;  // without the payload
constexpr wire::Entries kAllBytes{.least = 1, .most = std::numeric_limits<std::size_t>::max()};

std::size_t size_of(const Writer& out, const std::string& message) {
  return static_cast<std::size_t>(reinterpret_cast<const char*>(out.at()) - message.data());
}

void put(Writer& out, Reasons reasons) {
  const auto put = [&]<unsigned kNumber>(wire::Field<kNumber> number, wire::Name name, Reason reason) {
    out.flag(number, name, reasons.has(reason));
  };
  put(field<1>, "energy", Reason::kEnergy);
  put(field<2>, "max_force", Reason::kMaxForce);
  put(field<3>, "slew", Reason::kSlew);
  put(field<4>, "ramp_in", Reason::kRampIn);
  put(field<5>, "held", Reason::kHeld);
  put(field<6>, "decaying", Reason::kDecaying);
  put(field<7>, "safe_stop", Reason::kSafeStop);
  put(field<8>, "not_finite", Reason::kNotFinite);
  put(field<9>, "fault", Reason::kFault);
  put(field<10>, "device_clamp", Reason::kDeviceClamp);
  put(field<11>, "overrun", Reason::kOverrun);
  put(field<12>, "watchdog", Reason::kWatchdog);
  put(field<13>, "unseen", Reason::kUnseen);
  put(field<14>, "disarmed", Reason::kDisarmed);
  put(field<15>, "damped", Reason::kDamped);
  put(field<16>, "acceleration", Reason::kAcceleration);
}

void put(Writer& out, const TurnStep& turn) {
  out.rotation(field<1>, "orientation", turn.hand.orientation);
  out.vector(field<2>, "angular_velocity_radps", turn.hand.angular_velocity);
  out.vector(field<3>, "torque_held_nm", turn.was_applied);
  out.vector(field<4>, "torque_wanted_nm", turn.wanted);
  out.vector(field<5>, "torque_commanded_nm", turn.torque);
  out.vector(field<6>, "torque_applied_nm", turn.applied);
  out.number(field<7>, "torque_wanted_norm_nm", turn.wanted.norm());
  out.number(field<8>, "torque_applied_norm_nm", turn.applied.norm());
}

void put(Writer& out, const GripStep& grip) {
  out.number(field<1>, "opening_rad", grip.hand.opening);
  out.number(field<2>, "velocity_radps", grip.hand.velocity);
  out.number(field<3>, "force_held_n", grip.was_applied);
  out.number(field<4>, "force_wanted_n", grip.wanted);
  out.number(field<5>, "force_commanded_n", grip.force);
  out.number(field<6>, "force_applied_n", grip.applied);
  out.number(field<7>, "permitted_n", grip.permitted);
  out.number(field<8>, "energy_j", grip.energy);
}

void put(Writer& out, const FieldStep& step) {
  out.count(field<1>, "generation", step.generation);
  out.count(field<2>, "channel", step.channel);
  out.flag(field<3>, "swapping", step.swapping);
  out.number(field<4>, "depth_m", step.depth);
  out.vector(field<5>, "proxy_m", step.proxy);
  out.number(field<6>, "stored_j", step.stored);
  out.number(field<7>, "refused_j", step.refused);
  out.number(field<8>, "credited_j", step.credit);
  out.vector(field<9>, "force_n", step.force);
}

/// For Writer::message.
constexpr auto kAll = [](Writer& out, const auto& value) { put(out, value); };

template <class Message>
Message parse(std::string_view bytes) {
  Message message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
    throw std::invalid_argument("the data are not a " + message.GetTypeName());
  return message;
}

Joints joints_in(const pb::Step& in) {
  const auto count = static_cast<std::size_t>(in.joint_rad_size());
  if (count > Joints::kMost || in.joint_velocity_radps_size() != in.joint_rad_size())
    throw std::invalid_argument("step " + std::to_string(in.tick()) + " has " + std::to_string(count) + " joints and " +
                                std::to_string(in.joint_velocity_radps_size()) + " velocities of joints");
  Joints joints{.count = count};
  std::copy(in.joint_rad().begin(), in.joint_rad().end(), joints.angle.begin());
  std::copy(in.joint_velocity_radps().begin(), in.joint_velocity_radps().end(), joints.velocity.begin());
  return joints;
}

std::string text_of(const std::vector<std::byte>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::vector<std::byte> bytes_of(const std::string& text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

}  // namespace

std::string schema_data() {
  google::protobuf::FileDescriptorSet set;
  pb::Step::descriptor()->file()->CopyTo(set.add_file());  // it has no imports
  return set.SerializeAsString();
}

std::string encode(const SceneRecord& scene) {
  pb::Scene out;
  out.set_text(scene.text);
  out.set_seed(scene.seed);
  out.set_version(scene.version);
  out.set_commit(scene.commit);
  out.set_unix_offset_ns(scene.unix_offset.count());
  out.set_part(scene.part);
  out.set_budget_bytes(scene.budget_bytes);
  out.set_first_part(scene.first_part);
  return out.SerializeAsString();
}

std::string encode(const StepRecord& step, std::string_view force_way) {
  std::string message(kMostOfAStep + force_way.size(), '\0');
  Writer out(reinterpret_cast<wire::Byte*>(message.data()));
  out.count(field<1>, "tick", step.tick);
  out.difference(field<2>, "late_ns", step.hand.at - step.scheduled);
  out.difference(field<3>, "interval_ns", step.held);
  out.vector(field<4>, "position_m", step.hand.position);
  out.vector(field<5>, "velocity_mps", step.hand.velocity);
  out.vector(field<6>, "force_held_n", step.was_applied);
  out.vector(field<7>, "force_wanted_n", step.wanted);
  out.vector(field<8>, "force_commanded_n", step.force);
  out.vector(field<9>, "force_applied_n", step.applied);
  out.number(field<10>, "force_wanted_norm_n", step.wanted.norm());
  out.number(field<11>, "force_applied_norm_n", step.applied.norm());
  out.number(field<12>, "permitted_n", step.permitted);
  out.number(field<13>, "energy_j", step.energy);
  out.count(field<14>, "reason_bits", step.reasons.bits());
  out.message(field<15>, "reason", step.reasons, kAll);
  out.count(field<16>, "mode", static_cast<std::uint8_t>(step.mode));
  out.count(field<17>, "force_sequence", step.force_sequence);
  out.difference(field<18>, "force_age_ns", step.force_age);
  out.difference(field<19>, "loop_age_ns", step.loop_age);
  out.maybe(field<20>, "hand_force_n", step.hand_force);
  out.count(field<21>, "channel", step.channel);
  out.maybe(field<22>, "force_error_n", step.force_error);
  if (!step.stiffness.isZero(0)) {
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> rows = step.stiffness;
    out.numbers(field<23>, "stiffness_wanted_n_per_m", std::span(rows.data(), 9), 9);
  }
  out.flag(field<24>, "rearmed", step.rearmed);
  out.flag(field<25>, "disarmed", step.disarmed);
  out.difference(field<26>, "longest_hold_ns", step.longest_hold);
  out.bits(field<28>, "buttons", step.buttons);
  if (step.handle) {
    out.message(field<29>, "turn", step.handle->turn, kAll);
    out.message(field<30>, "grip", step.handle->grip, kAll);
    out.joints(field<31>, field<32>, "joint_rad", step.handle->joints);
  }
  out.bytes(field<33>, "force_way", std::as_bytes(std::span(force_way)), kAllBytes);
  out.message(field<34>, "field", step.field, kAll);
  message.resize(size_of(out, message));
  return message;
}

std::string encode(const PortRecord& port) {
  pb::Port out;
  out.set_tick(port.tick);
  out.set_channel(port.channel);
  out.set_credited_j(port.settled.credit);
  out.set_withdrawn_j(port.settled.withdraw);
  out.set_grip_credited_j(port.grip_settled.credit);
  out.set_grip_withdrawn_j(port.grip_settled.withdraw);
  out.set_stiffness_n_per_m(port.stiffness);
  out.set_round_trip_ns(port.round_trip.count());
  put(out.mutable_sent(), port.sent);
  if (port.peer) {
    put(out.mutable_peer(), *port.peer);
    out.set_peer_arrived_ns((port.peer_arrived - port.at).count());
  }
  return out.SerializeAsString();
}

std::string encode(const FieldInput& input) {
  pb::FieldInput out;
  out.set_tick(input.tick);
  out.set_kind(static_cast<pb::FieldInputKind>(input.kind));
  out.set_channel(input.channel);
  out.set_source(input.source);
  out.set_generation(input.generation);
  if (input.kind == FieldInput::Kind::kTruth) {
    out.set_answers_tick(input.answers_tick);
    out.set_received_ns((input.received - input.at).count());
    put(out.mutable_force_n(), input.truth);
  }
  if (input.kind == FieldInput::Kind::kPose) {
    out.set_pose_ns((input.pose.at - input.at).count());
    put(out.mutable_position_m(), input.pose.pose.position);
    put(out.mutable_orientation(), input.pose.pose.turn);
    put(out.mutable_velocity_mps(), input.pose.velocity);
    put(out.mutable_angular_velocity_radps(), input.pose.angular_velocity);
  }
  return out.SerializeAsString();
}

std::string encode(const FieldData& data) {
  pb::FieldData out;
  out.set_channel(data.channel);
  out.set_source(data.source);
  out.set_generation(data.generation);
  out.set_manifest(text_of(data.manifest));
  out.set_weights(text_of(data.weights));
  for (const field::Material& material : data.materials) {
    pb::FieldMaterial& one = *out.add_materials();
    one.set_stiffness_npm(material.stiffness);
    one.set_branch_stiffness_npm(material.branch);
    one.set_relaxation_s(material.tau);
    one.set_friction(material.friction);
    if (!material.table.used) continue;
    one.set_table_step_m(material.table.step);
    const auto corrections = std::span(material.table.force).subspan(1);
    one.mutable_table_force_n()->Add(corrections.begin(), corrections.end());
  }
  for (const field::Fixture& fixture : data.fixtures) {
    pb::FieldFixture& one = *out.add_fixtures();
    one.set_kind(static_cast<std::uint32_t>(fixture.kind));
    put(one.mutable_at_m(), fixture.at);
    put(one.mutable_direction(), fixture.direction);
    one.set_stiffness_npm(fixture.stiffness);
    one.set_most_force_n(fixture.most_force);
  }
  return out.SerializeAsString();
}

std::string encode(const ClockRecord& clock) {
  pb::Clock out;
  out.set_offset_ns(clock.offset.count());
  out.set_error_ns(clock.error.count());
  return out.SerializeAsString();
}

std::string encode(const DatagramRecord& datagram) {
  const auto payload = std::span(datagram.bytes).first(std::min<std::size_t>(datagram.size, datagram.bytes.size()));
  const std::string peer = to_string(datagram.peer);
  std::string message(kMostOfADatagram + payload.size(), '\0');
  Writer out(reinterpret_cast<wire::Byte*>(message.data()));
  out.count(field<1>, "direction", static_cast<std::uint8_t>(datagram.direction));
  out.bytes(field<2>, "peer", std::as_bytes(std::span(peer)), kAllBytes);
  out.count(field<3>, "size_bytes", datagram.size);
  out.bytes(field<4>, "payload", payload, kAllBytes);
  // If the payload is truncated, the datagram is not of this protocol.
  if (const auto header = payload.size() == datagram.size ? decode_header(payload) : std::nullopt) {
    out.count(field<5>, "type", static_cast<std::uint8_t>(header->type));
    out.count(field<6>, "connection_id", header->connection_id);
    out.count(field<7>, "packet_number", header->packet_number);
  }
  message.resize(size_of(out, message));
  return message;
}

std::string encode(const LossRecord& loss) {
  pb::Lost out;
  out.set_steps(loss.steps);
  out.set_datagrams(loss.datagrams);
  out.set_cause(static_cast<pb::LossCause>(loss.cause));
  out.set_strangers(loss.unauthenticated);
  return out.SerializeAsString();
}

SceneRecord decode_scene(std::string_view message) {
  const auto in = parse<pb::Scene>(message);
  return {.text = in.text(),
          .seed = in.seed(),
          .version = in.version(),
          .commit = in.commit(),
          .unix_offset = Duration(in.unix_offset_ns()),
          .part = in.part(),
          .budget_bytes = in.budget_bytes(),
          .first_part = in.first_part()};
}

StepRecord decode_step(std::string_view message, LocalTime at, SolverPaths& ways) {
  const auto in = parse<pb::Step>(message);
  if (in.mode() == pb::MODE_UNSPECIFIED || !pb::Mode_IsValid(in.mode()))
    throw std::invalid_argument("step " + std::to_string(in.tick()) + " has the unknown mode " +
                                std::to_string(in.mode()));
  StepRecord out;
  out.tick = in.tick();
  out.scheduled = at - Duration(in.late_ns());
  out.hand = {.at = at, .position = vec3(in.position_m()), .velocity = vec3(in.velocity_mps())};
  out.held = Duration(in.interval_ns());
  out.was_applied = vec3(in.force_held_n());
  out.wanted = vec3(in.force_wanted_n());
  out.permitted = in.permitted_n();
  out.force = vec3(in.force_commanded_n());
  out.applied = vec3(in.force_applied_n());
  out.energy = in.energy_j();
  out.reasons = Reasons::from_bits(in.reason_bits());
  out.mode = static_cast<Mode>(in.mode());
  out.force_sequence = in.force_sequence();
  out.force_age = Duration(in.force_age_ns());
  out.loop_age = Duration(in.loop_age_ns());
  out.channel = in.channel();
  if (in.has_hand_force_n()) out.hand_force = vec3(in.hand_force_n());
  if (in.has_force_error_n()) out.force_error = in.force_error_n();
  out.force_way = ways.number_of(in.force_way());
  out.rearmed = in.rearmed();
  out.disarmed = in.disarmed();
  out.longest_hold = Duration(in.longest_hold_ns());
  if (in.assumption_broken()) out.reasons |= Reason::kAcceleration;  // from old recordings
  out.buttons = in.buttons();
  if (in.has_turn() || in.has_grip() || in.joint_rad_size() > 0) out.handle.emplace();
  if (in.has_turn()) out.handle->turn = turn_step(in.turn());
  if (in.has_grip()) out.handle->grip = grip_step(in.grip());
  if (in.joint_rad_size() > 0) out.handle->joints = joints_in(in);
  if (in.has_field()) out.field = field_step(in.field());
  if (const int entries = in.stiffness_wanted_n_per_m_size(); entries > 0) {
    if (entries != 9)
      throw std::invalid_argument("step " + std::to_string(in.tick()) + " has a stiffness of " +
                                  std::to_string(entries) + " numbers instead of 9");
    for (int i = 0; i < entries; ++i) out.stiffness(i / 3, i % 3) = in.stiffness_wanted_n_per_m(i);
  }
  return out;
}

PortRecord decode_port(std::string_view message, LocalTime at) {
  const auto in = parse<pb::Port>(message);
  PortRecord out;
  out.tick = in.tick();
  out.channel = in.channel();
  out.at = at;
  out.settled = {.credit = in.credited_j(), .withdraw = in.withdrawn_j()};
  out.grip_settled = {.credit = in.grip_credited_j(), .withdraw = in.grip_withdrawn_j()};
  out.stiffness = in.stiffness_n_per_m();
  out.round_trip = Duration(in.round_trip_ns());
  out.sent = port_state(in.sent());
  if (in.has_peer()) out.peer = port_state(in.peer());
  out.peer_arrived = at + Duration(in.peer_arrived_ns());
  return out;
}

FieldInput decode_field_input(std::string_view message, LocalTime at) {
  const auto in = parse<pb::FieldInput>(message);
  if (in.kind() == pb::FIELD_INPUT_KIND_UNSPECIFIED || !pb::FieldInputKind_IsValid(in.kind()))
    throw std::invalid_argument("an input of a field has the unknown kind " + std::to_string(in.kind()));
  FieldInput out{.tick = in.tick(),
                 .at = at,
                 .kind = static_cast<FieldInput::Kind>(in.kind()),
                 .channel = in.channel(),
                 .source = in.source(),
                 .generation = in.generation(),
                 .answers_tick = in.answers_tick(),
                 .received = at + Duration(in.received_ns()),
                 .truth = vec3(in.force_n())};
  if (out.kind != FieldInput::Kind::kPose) return out;
  out.pose = {.at = at + Duration(in.pose_ns()),
              .pose = {.position = vec3(in.position_m()), .turn = quat(in.orientation())},
              .velocity = vec3(in.velocity_mps()),
              .angular_velocity = vec3(in.angular_velocity_radps())};
  return out;
}

FieldData decode_field_data(std::string_view message, LocalTime at) {
  const auto in = parse<pb::FieldData>(message);
  FieldData out{.at = at,
                .channel = in.channel(),
                .source = in.source(),
                .generation = in.generation(),
                .manifest = bytes_of(in.manifest()),
                .weights = bytes_of(in.weights())};
  for (const pb::FieldMaterial& one : in.materials()) {
    out.materials.push_back({.stiffness = one.stiffness_npm(),
                             .branch = one.branch_stiffness_npm(),
                             .tau = one.relaxation_s(),
                             .friction = one.friction()});
    const std::span corrections(one.table_force_n().data(), static_cast<std::size_t>(one.table_force_n_size()));
    if (!corrections.empty()) out.materials.back().table = field::DepthTable::of(one.table_step_m(), corrections);
  }
  for (const pb::FieldFixture& one : in.fixtures()) {
    if (one.kind() > static_cast<std::uint32_t>(field::Fixture::Kind::kPlane))
      throw std::invalid_argument("a fixture has the unknown kind " + std::to_string(one.kind()));
    out.fixtures.push_back({.kind = static_cast<field::Fixture::Kind>(one.kind()),
                            .at = vec3(one.at_m()),
                            .direction = vec3(one.direction()),
                            .stiffness = one.stiffness_npm(),
                            .most_force = one.most_force_n()});
  }
  return out;
}

DatagramRecord decode_datagram(std::string_view message, LocalTime at) {
  const auto in = parse<pb::Datagram>(message);
  if (in.direction() == pb::DIRECTION_UNSPECIFIED || !pb::Direction_IsValid(in.direction()))
    throw std::invalid_argument("a datagram has the unknown direction " + std::to_string(in.direction()));
  if (in.payload().size() != std::min<std::size_t>(in.size_bytes(), kMaxDatagram))
    throw std::invalid_argument("a datagram of " + std::to_string(in.size_bytes()) + " bytes has a payload of " +
                                std::to_string(in.payload().size()));
  DatagramRecord out{.at = at,
                     .direction = static_cast<DatagramRecord::Direction>(in.direction()),
                     .peer = parse_address(in.peer()),
                     .size = in.size_bytes(),
                     .bytes = {}};
  std::memcpy(out.bytes.data(), in.payload().data(), in.payload().size());
  return out;
}

LossRecord decode_loss(std::string_view message, LocalTime at) {
  const auto in = parse<pb::Lost>(message);
  if (!pb::LossCause_IsValid(in.cause()))
    throw std::invalid_argument("a loss has the unknown cause " + std::to_string(in.cause()));
  return {.at = at,
          .steps = in.steps(),
          .datagrams = in.datagrams(),
          .cause = static_cast<LossRecord::Cause>(in.cause()),
          .unauthenticated = in.strangers()};
}

}  // namespace tendon::recording
