// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/codec.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <string_view>

#include "protocol/limits.h"
#include "protocol/wire/bounds.h"
#include "tests/protocol/examples.h"
#include "tests/protocol/wire/read_back.h"

namespace tendon::codec_refusals_test {
namespace {

using examples::data;

struct BadState {
  const char* what;
  void (*spoil)(DeviceState&);
};

TEST(Codec, AStateOutOfBoundsIsLeftOutAndCountedAndTheRestIsRead) {
  const BadState cases[] = {
      {"NaN position", [](DeviceState& s) { s.position.y() = kNan; }},
      {"infinite velocity", [](DeviceState& s) { s.velocity.z() = kInf; }},
      {"huge force", [](DeviceState& s) { s.force_applied.x() = -1.001e12; }},
      {"infinite energy", [](DeviceState& s) { s.energy = -kInf; }},
      {"NaN bound", [](DeviceState& s) { s.permitted_force = kNan; }},
      {"negative bound", [](DeviceState& s) { s.permitted_force = -1; }},
      {"late sample", [](DeviceState& s) { s.sampled = PeerTime{limits::kMaxTime + Duration{1}}; }},
      {"negative age", [](DeviceState& s) { s.force_age = Duration{-1}; }},
      {"mode 0", [](DeviceState& s) { s.mode = Mode{0}; }},
      {"mode 7", [](DeviceState& s) { s.mode = Mode{7}; }},
      {"infinite stiffness wanted", [](DeviceState& s) { s.stiffness_wanted = Mat3::Constant(kInf); }},
      {"NaN wanted", [](DeviceState& s) { s.force_wanted = Vec3(0, 0, kNan); }},
      {"NaN orientation", [](DeviceState& s) { s.turning->orientation.x = kNan; }},
      {"an orientation that is no rotation", [](DeviceState& s) { s.turning->orientation.w = 0.602; }},
      {"no orientation", [](DeviceState& s) { s.turning->orientation = {.w = 0, .x = 0, .y = 0, .z = 0}; }},
      {"infinite angular velocity", [](DeviceState& s) { s.turning->angular_velocity.z() = kInf; }},
      {"NaN torque", [](DeviceState& s) { s.torque_applied->x() = kNan; }},
      {"infinite opening", [](DeviceState& s) { s.grip->opening = kInf; }},
      {"NaN velocity of the grip", [](DeviceState& s) { s.grip->velocity = kNan; }},
      {"huge grip force", [](DeviceState& s) { s.grip_applied = -1.001e12; }},
      {"NaN joint",
       [](DeviceState& s) {
         s.joints = Joints::three({0, kNan, 0}, {0, 0, 0});
       }},
      {"infinite velocity of a joint",
       [](DeviceState& s) {
         s.joints = Joints::three({0, 0, 0}, {0, 0, kInf});
       }},
      {"NaN force of the hand", [](DeviceState& s) { s.hand_force->y() = kNan; }},
  };
  for (const BadState& bad : cases) {
    DeviceState state = examples::state_with_handle();
    bad.spoil(state);
    DataReader reader;
    const auto* content = read(reader, data(1, {}, state, examples::force()));
    ASSERT_NE(content, nullptr) << bad.what;
    EXPECT_EQ(content->invalid, 1U) << bad.what;
    ASSERT_EQ(content->frames.size(), 1U) << bad.what;
    EXPECT_TRUE(std::holds_alternative<ForceCommand>(content->frames[0])) << bad.what;
  }
}

struct BadForce {
  const char* what;
  void (*spoil)(ForceCommand&);
};

TEST(Codec, AForceOutOfBoundsIsLeftOutAndCountedAndTheRestIsRead) {
  const BadForce cases[] = {
      {"NaN force", [](ForceCommand& f) { f.force.x() = kNan; }},
      {"infinite force", [](ForceCommand& f) { f.force.z() = -kInf; }},
      {"NaN stiffness", [](ForceCommand& f) { f.model->stiffness(1, 2) = kNan; }},
      {"infinite stiffness", [](ForceCommand& f) { f.model->stiffness(2, 2) = kInf; }},
      {"infinite position", [](ForceCommand& f) { f.model->at.x() = kInf; }},
      {"NaN radius", [](ForceCommand& f) { f.model->valid_radius = kNan; }},
      {"negative radius", [](ForceCommand& f) { f.model->valid_radius = -0.001; }},
      {"NaN normal", [](ForceCommand& f) { f.model->contact->normal.y() = kNan; }},
      {"no normal", [](ForceCommand& f) { f.model->contact->normal.setZero(); }},
      {"a normal that is no unit vector", [](ForceCommand& f) { f.model->contact->normal *= 1.0011; }},
      {"NaN gap", [](ForceCommand& f) { f.model->contact->gap = kNan; }},
      {"NaN depth", [](ForceCommand& f) { f.model->contact->table->first = kNan; }},
      {"no step", [](ForceCommand& f) { f.model->contact->table->step = 0; }},
      {"negative step", [](ForceCommand& f) { f.model->contact->table->step = -0.001; }},
      {"infinite step", [](ForceCommand& f) { f.model->contact->table->step = kInf; }},
      {"NaN in the table", [](ForceCommand& f) { f.model->contact->table->force[2] = kNan; }},
      {"a table of one", [](ForceCommand& f) { f.model->contact->table->size = 1; }},
      {"negative error", [](ForceCommand& f) { f.error = -0.1; }},
      {"NaN error", [](ForceCommand& f) { f.error = kNan; }},
      {"a ninth way", [](ForceCommand& f) { f.way = limits::kMaxWays + 1; }},
      {"no way at all", [](ForceCommand& f) { f.way = ~0U; }},
      {"NaN torque", [](ForceCommand& f) { f.torque->torque.y() = kNan; }},
      {"infinite torque", [](ForceCommand& f) { f.torque->torque.z() = kInf; }},
      {"NaN orientation", [](ForceCommand& f) { f.torque->model->at.w = kNan; }},
      {"an orientation that is no rotation", [](ForceCommand& f) { f.torque->model->at.w = 0.602; }},
      {"NaN angular stiffness", [](ForceCommand& f) { f.torque->model->stiffness(0, 2) = kNan; }},
      {"huge angular stiffness", [](ForceCommand& f) { f.torque->model->stiffness(0, 2) = 1.001e12; }},
      {"NaN grip force", [](ForceCommand& f) { f.grip_force = kNan; }},
      {"sequence 0", [](ForceCommand& f) { f.sequence = 0; }},
      {"valid for nothing", [](ForceCommand& f) { f.valid_for = Duration{}; }},
      {"valid for less than nothing", [](ForceCommand& f) { f.valid_for = Duration{-1}; }},
      {"valid for too long", [](ForceCommand& f) { f.valid_for = limits::kMaxValidFor + Duration{1}; }},
      {"valid for 2³² µs + 1 s", [](ForceCommand& f) { f.valid_for = std::chrono::microseconds(4'295'967'296); }},
  };
  for (const BadForce& bad : cases) {
    ForceCommand force = examples::force_with_all();
    force.torque = examples::force_with_torque().torque;
    bad.spoil(force);
    DataReader reader;
    const auto* content = read(reader, data(1, {}, force, examples::state()));
    ASSERT_NE(content, nullptr) << bad.what;
    EXPECT_EQ(content->invalid, 1U) << bad.what;
    ASSERT_EQ(content->frames.size(), 1U) << bad.what;
    EXPECT_TRUE(std::holds_alternative<DeviceState>(content->frames[0])) << bad.what;
  }
}

struct BadReport {
  const char* what;
  void (*spoil)(LinkReport&);
};

TEST(Codec, AReportOutOfBoundsIsLeftOutAndCountedAndTheRestIsRead) {
  const BadReport cases[] = {
      {"number 0", [](LinkReport& r) { r.number = 0; }},
      {"from beyond all clocks", [](LinkReport& r) { r.until = PeerTime{-limits::kMaxTime - Duration{1}}; }},
      {"a span below zero", [](LinkReport& r) { r.span = Duration{-1}; }},
      {"an endless span", [](LinkReport& r) { r.span = limits::kMaxTime + Duration{1}; }},
      {"early by less than zero", [](LinkReport& r) { r.worst_late = Duration{-1}; }},
      {"a gap below zero", [](LinkReport& r) { r.longest_gap = Duration{-1}; }},
      {"an endless median", [](LinkReport& r) { r.round_trip->median = limits::kMaxTime + Duration{1}; }},
      {"an endless p99", [](LinkReport& r) { r.to_server->p99 = limits::kMaxTime + Duration{1}; }},
      {"a p99 from before all time", [](LinkReport& r) { r.to_client->p99 = -limits::kMaxTime - Duration{1}; }},
      {"an endless offset", [](LinkReport& r) { r.clock_offset = limits::kMaxTime + Duration{1}; }},
      {"NaN drift", [](LinkReport& r) { r.clock_drift_ppm = kNan; }},
      {"infinite drift", [](LinkReport& r) { r.clock_drift_ppm = -kInf; }},
      {"an error below zero", [](LinkReport& r) { r.clock_error = Duration{-1}; }},
  };
  for (const BadReport& bad : cases) {
    LinkReport report = examples::report();
    bad.spoil(report);
    DataReader reader;
    const auto* content = read(reader, data(1, {}, report, examples::state()));
    ASSERT_NE(content, nullptr) << bad.what;
    EXPECT_EQ(content->invalid, 1U) << bad.what;
    ASSERT_EQ(content->frames.size(), 1U) << bad.what;
    EXPECT_TRUE(std::holds_alternative<DeviceState>(content->frames[0])) << bad.what;
  }
  LinkReport wordy = examples::report();
  wordy.words.assign(limits::kMaxDetail + 1,
                     'w');  // our texts are truncated, but the texts of other senders are rejected
  DataReader reader;
  EXPECT_EQ(read(reader, data(1, {}, wordy))->frames.size(), 1U);
  const RawProtobuf report = RawProtobuf().varint(1, 1).text(20, wordy.words);
  EXPECT_EQ(reader.read(datagram_with(RawProtobuf().message(6, report)))->invalid, 1U);
}

/// Expects that `field` makes the request invalid, and that the state after it is still read.
void expect_refused(const Request& request, std::string_view field, const std::string& what) {
  DataReader reader;
  const auto* content = read(reader, data(1, {}, Control{.id = 7, .request = request}, examples::state()));
  ASSERT_NE(content, nullptr) << what;
  EXPECT_EQ(content->invalid, 1U) << what;
  ASSERT_EQ(content->frames.size(), 2U) << what;
  const auto& control = std::get<Control>(content->frames[0]);
  EXPECT_EQ(control.id, 7U) << what;
  EXPECT_FALSE(control.request.has_value()) << what;
  EXPECT_EQ(control.invalid, field) << what;
  EXPECT_TRUE(std::holds_alternative<DeviceState>(content->frames[1])) << what;
}

/// Expects that `report` is dropped and counted, and that the state in the same datagram is still read.
void expect_left_out(const auto& report, const std::string& what) {
  DataReader reader;
  const auto* content = read(reader, data(1, {}, report, examples::state()));
  ASSERT_NE(content, nullptr) << what;
  EXPECT_EQ(content->invalid, 1U) << what;
  ASSERT_EQ(content->frames.size(), 1U) << what;
  EXPECT_TRUE(std::holds_alternative<DeviceState>(content->frames[0])) << what;
}

/// Returns how many frames with `report` in field `field` are read: 0 or 1.
std::size_t read_raw(unsigned field, const RawProtobuf& report) {
  DataReader reader;
  const auto* content = reader.read(datagram_with(RawProtobuf().message(field, report)));
  if (content == nullptr) return 99;
  EXPECT_EQ(content->frames.size() + content->invalid, 1U);
  return content->frames.size();
}

struct BadDeviceReport {
  const char* what;
  void (*spoil)(DeviceReport&);
};

TEST(Codec, AReportOnADeviceOutOfBoundsIsLeftOutAndCountedAndTheRestIsRead) {
  const BadDeviceReport cases[] = {
      {"number 0", [](DeviceReport& r) { r.number = 0; }},
      {"from beyond all clocks", [](DeviceReport& r) { r.until = PeerTime{limits::kMaxTime + Duration{1}}; }},
      {"a span below zero", [](DeviceReport& r) { r.span = Duration{-1}; }},
      {"an endless span", [](DeviceReport& r) { r.span = limits::kMaxTime + Duration{1}; }},
      {"device 16", [](DeviceReport& r) { r.device = limits::kMaxDevices; }},
      {"more late steps than steps", [](DeviceReport& r) { r.steps = 986; }},
      {"counts that overflow", [](DeviceReport& r) { r.lateness[1] = r.lateness[2] = std::uint64_t{1} << 63; }},
      {"more overruns than steps", [](DeviceReport& r) { r.overruns = r.steps + 1; }},
      {"more unseen than steps", [](DeviceReport& r) { r.unseen = r.steps + 1; }},
      {"safety 0", [](DeviceReport& r) { r.safety = Safety{0}; }},
      {"safety 9", [](DeviceReport& r) { r.safety = Safety{9}; }},
  };
  for (const BadDeviceReport& bad : cases) {
    DeviceReport report = examples::device_report();
    bad.spoil(report);
    expect_left_out(report, bad.what);
  }
  const auto good = [] { return RawProtobuf().varint(1, 1).varint(10, 6); };
  const std::string wordy(limits::kMaxDetail + 1,
                          'w');  // our texts are truncated, but the texts of other senders are rejected
  EXPECT_EQ(there(DeviceReport{.number = 1, .fault = wordy, .degraded = wordy}).degraded.size(), limits::kMaxDetail);
  EXPECT_EQ(read_raw(7, good()), 1U);
  EXPECT_EQ(read_raw(7, good().text(11, wordy)), 0U);
  EXPECT_EQ(read_raw(7, good().text(12, wordy)), 0U);
  EXPECT_EQ(read_raw(7, RawProtobuf().varint(1, 1)), 0U) << "no safety";
  const std::string zeros(limits::kLatenessBuckets, '\0');  // one entry per byte
  EXPECT_EQ(read_raw(7, good().text(9, zeros)), 1U);
  EXPECT_EQ(read_raw(7, good().text(9, zeros + '\0')), 0U) << "25 buckets";
}

TEST(Codec, APortOutOfBoundsIsLeftOutAndCountedAndTheRestIsRead) {
  struct BadPort {
    const char* what;
    void (*spoil)(PortFrame&);
  };
  const BadPort cases[] = {
      {"device 16", [](PortFrame& p) { p.device = limits::kMaxDevices; }},
      {"channel 8", [](PortFrame& p) { p.channel = limits::kMaxChannels; }},
      {"epoch 0", [](PortFrame& p) { p.epoch = 0; }},
      {"sequence 0", [](PortFrame& p) { p.sequence = 0; }},
      {"late time", [](PortFrame& p) { p.time = limits::kMaxTime + Duration{1}; }},
      {"early time", [](PortFrame& p) { p.time = -limits::kMaxTime - Duration{1}; }},
      {"a round trip below zero", [](PortFrame& p) { p.round_trip = Duration{-1}; }},
      {"an endless round trip", [](PortFrame& p) { p.round_trip = PortState::kMostRoundTrip + Duration{1}; }},
      {"phase 0", [](PortFrame& p) { p.phase = PortPhase{0}; }},
      {"phase 8", [](PortFrame& p) { p.phase = PortPhase{8}; }},
      {"NaN position", [](PortFrame& p) { p.position.x() = kNan; }},
      {"infinite velocity", [](PortFrame& p) { p.velocity.y() = kInf; }},
      {"huge force", [](PortFrame& p) { p.force.z() = 1.001e12; }},
      {"NaN contact", [](PortFrame& p) { p.contact_force->z() = kNan; }},
      {"a huge account", [](PortFrame& p) { p.account = 1001; }},
      {"a huge debt", [](PortFrame& p) { p.account = -1001; }},
      {"NaN account", [](PortFrame& p) { p.account = kNan; }},
      {"a need below zero", [](PortFrame& p) { p.need = -1e-9; }},
      {"a huge need", [](PortFrame& p) { p.need = 1001; }},
      {"given less than nothing", [](PortFrame& p) { p.given = -1e-9; }},
      {"a million joules and one", [](PortFrame& p) { p.given = 1'000'001; }},
      {"NaN given", [](PortFrame& p) { p.given = kNan; }},
      {"taken less than nothing", [](PortFrame& p) { p.taken = -1e-9; }},
      {"infinite taken", [](PortFrame& p) { p.taken = kInf; }},
      {"NaN wave", [](PortFrame& p) { p.wave_integral.x() = kNan; }},
      {"waves with less than no energy", [](PortFrame& p) { p.wave_energy = -1e-9; }},
      {"waves of a million joules and one", [](PortFrame& p) { p.wave_energy = 1'000'001; }},
      {"a normal that is too long", [](PortFrame& p) { p.surface->normal *= 1.0011; }},
      {"NaN normal", [](PortFrame& p) { p.surface->normal.y() = kNan; }},
      {"a surface beyond all places", [](PortFrame& p) { p.surface->offset = -1.001e12; }},
      {"a surface that pulls", [](PortFrame& p) { p.surface->stiffness = -1e-9; }},
      {"a rigid surface", [](PortFrame& p) { p.surface->stiffness = kInf; }},
      {"a turn that is no rotation", [](PortFrame& p) { p.turn->turn.w = 0.602; }},
      {"NaN turn", [](PortFrame& p) { p.turn->turn.x = kNan; }},
      {"infinite angular velocity", [](PortFrame& p) { p.turn->angular_velocity.x() = kInf; }},
      {"huge torque", [](PortFrame& p) { p.turn->torque.z() = -1.001e12; }},
      {"NaN opening", [](PortFrame& p) { p.grip->opening = kNan; }},
      {"infinite velocity of the grip", [](PortFrame& p) { p.grip->velocity = kInf; }},
      {"huge grip force", [](PortFrame& p) { p.grip->force = -1.001e12; }},
      {"a huge account of the grip", [](PortFrame& p) { p.grip->account = 1001; }},
      {"a huge debt of the grip", [](PortFrame& p) { p.grip->account = -1001; }},
      {"a grip that needs less than nothing", [](PortFrame& p) { p.grip->need = -1e-9; }},
      {"a huge need of the grip", [](PortFrame& p) { p.grip->need = 1001; }},
      {"a grip that gave less than nothing", [](PortFrame& p) { p.grip->given = -1e-9; }},
      {"a grip that gave too much", [](PortFrame& p) { p.grip->given = 1'000'001; }},
      {"a grip that took less than nothing", [](PortFrame& p) { p.grip->taken = -1e-9; }},
      {"a grip that took too much", [](PortFrame& p) { p.grip->taken = 1'000'001; }},
      {"less than no energy in", [](PortFrame& p) { p.energy_in = -1e-9; }},
      {"a million joules and one in", [](PortFrame& p) { p.energy_in = 1'000'001; }},
      {"NaN energy in", [](PortFrame& p) { p.energy_in = kNan; }},
      {"a share below zero", [](PortFrame& p) { p.share = -1e-9; }},
      {"more than the whole", [](PortFrame& p) { p.share = 1.001; }},
      {"NaN share", [](PortFrame& p) { p.share = kNan; }},
      {"a hundredth is the least scale but 0", [](PortFrame& p) { p.position_scale = 0.0099; }},
      {"a scale below zero", [](PortFrame& p) { p.position_scale = -1; }},
      {"a hundred is the largest scale", [](PortFrame& p) { p.position_scale = 100.1; }},
      {"the same of the forces", [](PortFrame& p) { p.force_scale = 0.0099; }},
      {"NaN scale", [](PortFrame& p) { p.force_scale = kNan; }},
  };
  for (const BadPort& bad : cases) {
    PortFrame port = examples::port_with_all();
    bad.spoil(port);
    expect_left_out(port, bad.what);
  }
}

TEST(Codec, ACoupleOutOfBoundsIsCountedAndNamesItsField) {
  struct BadCouple {
    const char* what;
    const char* field;
    void (*spoil)(Couple&);
  };
  const BadCouple cases[] = {
      {"device 16", "device", [](Couple& c) { c.device = limits::kMaxDevices; }},
      {"channel 8", "channel", [](Couple& c) { c.channel = limits::kMaxChannels; }},
      {"NaN scale", "position_scale", [](Couple& c) { c.position_scale = kNan; }},
      {"a hundredth is the least scale", "position_scale", [](Couple& c) { c.position_scale = 0.0099; }},
      {"a hundred is the largest", "force_scale", [](Couple& c) { c.force_scale = 100.1; }},
      {"no force", "force_scale", [](Couple& c) { c.force_scale = 0; }},
      {"a rotation that is none", "rotation", [](Couple& c) { c.rotation.w = 0.602; }},
      {"NaN rotation", "rotation", [](Couple& c) { c.rotation.x = kNan; }},
      {"no axis", "axes", [](Couple& c) { c.axes = 0; }},
      {"a fourth axis", "axes", [](Couple& c) { c.axes = 8; }},
      {"stiffness below zero", "stiffness_npm", [](Couple& c) { c.stiffness = -1; }},
      {"infinite stiffness", "stiffness_npm", [](Couple& c) { c.stiffness = kInf; }},
      {"NaN damping", "damping_nspm", [](Couple& c) { c.damping = kNan; }},
      {"damping below zero", "damping_nspm", [](Couple& c) { c.damping = -1; }},
      {"mutual damping below zero", "mutual_damping_nspm", [](Couple& c) { c.mutual_damping = -1; }},
      {"no period", "period_us", [](Couple& c) { c.period = Duration{}; }},
      {"a period of more than 10 s", "period_us", [](Couple& c) { c.period = std::chrono::seconds(10) + Duration{1}; }},
      {"method 8", "method", [](Couple& c) { c.method = CouplingMethod{8}; }},
      {"a turn's stiffness below zero", "turn_stiffness_nmprad", [](Couple& c) { c.turn_stiffness = -1e-9; }},
      {"infinite damping of a turn", "turn_damping_nmsprad", [](Couple& c) { c.turn_damping = kInf; }},
      {"NaN stiffness of the grip", "grip_stiffness_npm", [](Couple& c) { c.grip_stiffness = kNan; }},
      {"damping of the grip below zero", "grip_damping_nspm", [](Couple& c) { c.grip_damping = -1e-9; }},
      {"a huge drift rate", "drift_rate_per_s", [](Couple& c) { c.drift_rate = 1.001e12; }},
      {"a dead zone below zero", "rate.dead_zone_m", [](Couple& c) { c.rate->dead_zone = -1e-9; }},
      {"NaN dead zone", "rate.dead_zone_m", [](Couple& c) { c.rate->dead_zone = kNan; }},
      {"no gain", "rate.gain_per_s", [](Couple& c) { c.rate->gain = 0; }},
      {"infinite gain", "rate.gain_per_s", [](Couple& c) { c.rate->gain = kInf; }},
      {"no speed", "rate.max_speed_mps", [](Couple& c) { c.rate->max_speed = 0; }},
      {"a huge speed", "rate.max_speed_mps", [](Couple& c) { c.rate->max_speed = 1.001e12; }},
  };
  for (const BadCouple& bad : cases) {
    Couple couple = examples::couple_with_all();
    bad.spoil(couple);
    expect_refused(couple, bad.field, bad.what);
  }
}

TEST(Codec, AScaleOrAShareOutOfBoundsIsCountedAndNamesItsField) {
  struct Bad {
    const char* what;
    const char* field;
    Request request;
  };
  const Bad cases[] = {
      {"scales of device 16", "device", SetScale{.device = limits::kMaxDevices}},
      {"a hundredth is the least scale", "position_scale", SetScale{.position_scale = 0.0099}},
      {"a hundred is the largest", "position_scale", SetScale{.position_scale = 100.1}},
      {"NaN scale", "position_scale", SetScale{.position_scale = kNan}},
      {"no force", "force_scale", SetScale{.force_scale = 0}},
      {"a huge force", "force_scale", SetScale{.force_scale = kInf}},
      {"a share on device 16", "device", SetShare{.device = limits::kMaxDevices}},
      {"a share on channel 8", "channel", SetShare{.channel = limits::kMaxChannels}},
      {"a share below zero", "share", SetShare{.share = -1e-9}},
      {"more than the whole", "share", SetShare{.share = 1.001}},
      {"NaN share", "share", SetShare{.share = kNan}},
  };
  for (const Bad& bad : cases) expect_refused(bad.request, bad.field, bad.what);
  EXPECT_EQ(refused_field(SetScale{.position_scale = 0.01, .force_scale = 100}), "");
  EXPECT_EQ(refused_field(SetShare{.share = 0}), "");
  EXPECT_EQ(refused_field(SetShare{.share = 1}), "");
}

TEST(Codec, ASettingOutOfBoundsIsCountedAndNamesItsField) {
  struct BadSetting {
    const char* what;
    const char* field;
    std::uint32_t output;
    OutputSetting setting;
  };
  const auto pulse = [](double amplitude, double frequency, Duration duration) {
    return Vibration{.amplitude = amplitude, .frequency = frequency, .duration = duration};
  };
  using namespace std::chrono_literals;
  const BadSetting cases[] = {
      {"output 8", "output", limits::kMaxOutputs, LampColour{1}},
      {"a colour of more than three bytes", "rgb", 0, LampColour{0x1000000}},
      {"amplitude above 1", "vibration.amplitude", 1, pulse(1.01, 0, 1ms)},
      {"amplitude below 0", "vibration.amplitude", 1, pulse(-0.01, 0, 1ms)},
      {"NaN amplitude", "vibration.amplitude", 1, pulse(kNan, 0, 1ms)},
      {"a frequency below 20 Hz", "vibration.frequency_hz", 1, pulse(1, 19.9, 1ms)},
      {"a frequency above 1000 Hz", "vibration.frequency_hz", 1, pulse(1, 1001, 1ms)},
      {"NaN frequency", "vibration.frequency_hz", 1, pulse(1, kNan, 1ms)},
      {"a pulse of more than 10 s", "vibration.duration_ms", 1, pulse(1, 0, 10s + 1ns)},
      {"a pulse of less than nothing", "vibration.duration_ms", 1, pulse(1, 0, -1ms)},
  };
  for (const BadSetting& bad : cases) {
    const SetOutput wanted{.device = 1, .output = bad.output, .setting = bad.setting};
    EXPECT_EQ(refused_field(wanted), bad.field) << bad.what;
    expect_refused(wanted, bad.field, bad.what);
  }
}

TEST(Codec, ARequestWithoutAnIdIsLeftOutWhateverItHolds) {
  for (const std::uint32_t device : {0U, limits::kMaxDevices}) {
    DataReader reader;
    const auto* content = read(reader, data(1, {}, Control{.id = 0, .request = Disarm{.device = device}}));
    EXPECT_EQ(content->invalid, 1U) << device;
    EXPECT_TRUE(content->frames.empty()) << device;
  }
}

TEST(Codec, ACoupleWithoutARoleAMethodOrARotationIsRefused) {
  const auto refused = [](std::uint64_t role, std::uint64_t method, bool rotation) {
    constexpr std::uint64_t kOne = 0x3ff0'0000'0000'0000;  // 1.0
    RawProtobuf raw;
    raw.varint(3, role).varint(4, method).fixed64(5, kOne).fixed64(6, kOne).varint(8, 7).varint(14, 1000);
    if (rotation) raw.message(7, RawProtobuf().fixed64(1, kOne));
    DataReader reader;
    const auto* content =
        reader.read(datagram_with(RawProtobuf().message(3, RawProtobuf().varint(1, 1).message(11, raw))));
    return std::string(std::get<Control>(content->frames.at(0)).invalid);
  };
  EXPECT_EQ(refused(1, 1, true), "");
  EXPECT_EQ(refused(2, 2, true), "");
  EXPECT_EQ(refused(0, 1, true), "role");
  EXPECT_EQ(refused(3, 1, true), "role");
  EXPECT_EQ(refused(1, 0, true), "method");
  EXPECT_EQ(refused(1, 4, true), "");
  EXPECT_EQ(refused(1, 7, true), "");
  EXPECT_EQ(refused(1, 8, true), "method");
  EXPECT_EQ(refused(1, 1, false), "rotation");
}

TEST(Codec, ZerosAtTheEndOfAHistogramDoNotTravel) {
  DeviceReport report = examples::device_report();
  const std::size_t before = data(1, {}, report).size();
  std::swap(report.lateness[13], report.lateness[12]);
  EXPECT_EQ(data(1, {}, report).size(), before - 1);
  report.lateness = {};
  EXPECT_EQ(data(1, {}, report).size(), before - 2 - 15);
}

TEST(Codec, ABucketEndsWithItsPowerOfTwo) {
  using std::chrono::microseconds;
  EXPECT_EQ(lateness_bucket(-std::chrono::seconds(1)), 0U);
  EXPECT_EQ(lateness_bucket(Duration{0}), 0U);
  EXPECT_EQ(lateness_bucket(microseconds(1)), 0U);
  EXPECT_EQ(lateness_bucket(microseconds(1) + Duration{1}), 1U);
  for (std::size_t i = 1; i + 1 < limits::kLatenessBuckets; ++i) {
    const Duration end = microseconds(std::int64_t{1} << i);
    EXPECT_EQ(lateness_bucket(end), i);
    EXPECT_EQ(lateness_bucket(end + Duration{1}), i + 1);
  }
  EXPECT_EQ(lateness_bucket(Duration::max()), limits::kLatenessBuckets - 1);
}

struct BadPeerReport {
  const char* what;
  void (*spoil)(PeerReport&);
};

TEST(Codec, AReportOnAnEngineOutOfBoundsIsLeftOutAndCountedAndTheRestIsRead) {
  const BadPeerReport cases[] = {
      {"device 16", [](PeerReport& r) { r.device = limits::kMaxDevices; }},
      {"channel 8", [](PeerReport& r) { r.channel = limits::kMaxChannels; }},
      {"one state in none", [](PeerReport& r) { r.state_one_in = 0; }},
      {"one state in 1001", [](PeerReport& r) { r.state_one_in = limits::kMaxOneIn + 1; }},
      {"a link out of bounds", [](PeerReport& r) { r.link.number = 0; }},
      {"NaN drift", [](PeerReport& r) { r.link.clock_drift_ppm = kNan; }},
      {"negative error", [](PeerReport& r) { r.error = -0.1; }},
      {"NaN error", [](PeerReport& r) { r.error = kNan; }},
      {"a huge error", [](PeerReport& r) { r.error = 1.001e12; }},
  };
  for (const BadPeerReport& bad : cases) {
    PeerReport report = examples::peer_report();
    bad.spoil(report);
    expect_left_out(report, bad.what);
  }
  const auto good = [] { return RawProtobuf().varint(4, 1).message(6, RawProtobuf().varint(1, 1)); };
  EXPECT_EQ(read_raw(8, good()), 1U);
  EXPECT_EQ(read_raw(8, good().text(3, std::string(limits::kMaxName + 1, 'n'))), 0U);
  EXPECT_EQ(read_raw(8, good().text(8, std::string(limits::kMaxLabel, 'w'))), 1U);
  EXPECT_EQ(read_raw(8, good().text(8, std::string(limits::kMaxLabel + 1, 'w'))), 0U);
  EXPECT_EQ(read_raw(8, RawProtobuf().varint(4, 1)), 0U) << "no link";
}

TEST(Codec, ADeadbandOfNaNIsRefusedAndASenselessOneIsForTheServer) {
  const auto read_back = [](const SetStateDeadband& asked) -> std::optional<SetStateDeadband> {
    DataReader reader;
    const auto* content = read(reader, data(1, {}, Control{.id = 1, .request = asked}));
    return std::get<SetStateDeadband>(*std::get<Control>(content->frames[0]).request);
  };
  expect_refused(SetStateDeadband{.share = kNan}, "share", "NaN share");
  expect_refused(SetStateDeadband{.floor = kInf}, "floor_mps", "infinite floor");
  const auto silly = read_back({.share = -7, .floor = 9, .max_silence = std::chrono::milliseconds(20)});
  EXPECT_EQ(silly->share, -7);
  EXPECT_EQ(silly->floor, 9);
  EXPECT_EQ(silly->max_silence, std::chrono::milliseconds(20));
  for (const Duration impossible : {Duration{-1}, limits::kMaxStateSilence + Duration{1}, Duration::max()}) {
    EXPECT_GT(read_back({.max_silence = impossible})->max_silence, limits::kMaxStateSilence);
  }
}

TEST(Codec, StiffnessHasOneThreeOrNineEntries) {
  for (std::size_t entries = 0; entries <= 10; ++entries) {
    DataReader reader;
    const auto datagram = datagram_with(raw_force(
        [&](RawProtobuf& force) { force.message(4, RawProtobuf().packed(2, std::vector<double>(entries, 2.0))); }));
    const auto* content = reader.read(datagram);
    ASSERT_NE(content, nullptr);
    EXPECT_EQ(content->frames.size(), entries == 1 || entries == 3 || entries == 9 ? 1U : 0U) << entries;
  }
}

TEST(Codec, FramesAndRequestsOfANewerPeerAreNoError) {
  DataReader reader;
  const auto* content = reader.read(datagram_with(RawProtobuf().text(100, "what we do not know")));
  ASSERT_NE(content, nullptr);
  EXPECT_EQ(content->invalid, 0U);
  EXPECT_TRUE(content->frames.empty());

  content = reader.read(datagram_with(RawProtobuf().message(3, RawProtobuf().varint(1, 5).text(100, "new"))));
  ASSERT_NE(content, nullptr);
  ASSERT_EQ(content->frames.size(), 1U);
  EXPECT_EQ(std::get<Control>(content->frames[0]).id, 5U);
  EXPECT_FALSE(std::get<Control>(content->frames[0]).request.has_value());
}

TEST(Codec, TooManyFramesMakeADatagramMalformed) {
  RawProtobuf many;
  many.fixed64(1, 1);
  for (int i = 0; i < limits::kMaxFrames; ++i) many.text(3, "");
  DataReader reader;
  EXPECT_NE(reader.read(many.bytes()), nullptr);
  many.text(3, "");
  EXPECT_EQ(reader.read(many.bytes()), nullptr);
}

TEST(Codec, ADatagramFromBeyondAllClocksIsMalformed) {
  DataReader reader;
  EXPECT_NE(reader.read(RawProtobuf().fixed64(1, std::uint64_t{1} << 60U).bytes()), nullptr);
  EXPECT_EQ(reader.read(RawProtobuf().fixed64(1, (std::uint64_t{1} << 60U) + 1).bytes()), nullptr);
}

TEST(Codec, TextThatIsNotUtf8MakesADatagramMalformedWithoutAWord) {
  testing::internal::CaptureStderr();
  DataReader reader;
  EXPECT_EQ(reader.read(datagram_with(RawProtobuf().message(5, RawProtobuf().varint(1, 1).text(2, "\xFF")))), nullptr);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(Codec, OurOwnTextIsCutToSizeAtACharacterAndWhereItIsNotUtf8) {
  const auto reason = [](const std::string& text) {
    DataReader reader;
    const auto* content = read(reader, data(1, {}, Bye{.code = Code::kOk, .reason = text}));
    return content && content->frames.size() == 1 ? std::get<Bye>(content->frames[0]).reason : "refused";
  };
  const std::string full(limits::kMaxDetail, 'x');
  EXPECT_EQ(reason(full), full);
  EXPECT_EQ(reason(full + "y"), full);
  EXPECT_EQ(reason(full.substr(1) + "ä"), full.substr(1));
  EXPECT_EQ(reason("10 µm → ∞ 🙂"), "10 µm → ∞ 🙂");
  EXPECT_EQ(reason("good\xC0\x80"), "good");          // overlong
  EXPECT_EQ(reason("good\xED\xA0\x80"), "good");      // surrogate
  EXPECT_EQ(reason("good\xF4\x90\x80\x80"), "good");  // beyond U+10FFFF
  EXPECT_EQ(reason("good\xE2\x82"), "good");          // truncated
}

}  // namespace
}  // namespace tendon::codec_refusals_test
