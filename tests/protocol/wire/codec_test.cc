// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/codec.h"
#include "protocol/wire/handshake_codec.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "protocol/limits.h"
#include "protocol/secrets/client_key.h"
#include "protocol/secrets/noise.h"
#include "tests/protocol/examples.h"
#include "tests/protocol/wire/raw_protobuf.h"

namespace tendon {
namespace {

using examples::Bytes;
using examples::data;

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::span<const std::byte> body(const Bytes& datagram) { return std::span(datagram).subspan(kHeaderSize); }

const DataContent* read(DataReader& reader, const Bytes& datagram) { return reader.read(body(datagram)); }

/// A tx_time and one frame, given as the raw content of message Frame.
Bytes datagram_with(const RawProtobuf& frame) { return RawProtobuf().fixed64(1, 1).message(3, frame).bytes(); }

/// A force command as `change` makes it, as raw content of message Frame.
RawProtobuf raw_force(const std::function<void(RawProtobuf&)>& change) {
  RawProtobuf force;
  force.varint(1, 1).varint(5, 1000);
  change(force);
  return RawProtobuf().message(2, force);
}

// ---- round trips ----

double any_value() {
  const double mantissa = *rc::gen::map(rc::gen::inRange(-1'000'000, 1'000'001), [](int i) { return i / 1e6; });
  return mantissa * std::pow(10.0, *rc::gen::inRange(-12, 13));
}
Vec3 any_vector() {
  const double x = any_value();
  const double y = any_value();
  return {x, y, any_value()};
}
Duration any_time() {
  return Duration{*rc::gen::inRange<std::int64_t>(-limits::kMaxTime.count(), limits::kMaxTime.count())};
}

RC_GTEST_PROP(Codec, AStateComesOutAsItWentIn, ()) {
  DeviceState in;
  in.tick = *rc::gen::arbitrary<std::uint64_t>();
  in.sampled = PeerTime{any_time()};
  in.position = any_vector();
  in.velocity = any_vector();
  in.force_applied = any_vector();
  in.energy = any_value();
  in.permitted_force = *rc::gen::arbitrary<bool>() ? kInf : std::abs(any_value());
  in.reasons = *rc::gen::arbitrary<std::uint32_t>();
  in.force_sequence = *rc::gen::arbitrary<std::uint64_t>();
  in.force_age = std::chrono::abs(any_time());
  in.mode = static_cast<Mode>(*rc::gen::inRange(1, 7));
  in.device = *rc::gen::inRange(0U, limits::kMaxDevices);
  in.channel = *rc::gen::inRange(0U, limits::kMaxChannels);
  if (*rc::gen::arbitrary<bool>()) in.force_wanted = any_vector();

  DataReader reader;
  const DataContent* content = read(reader, data(1, {}, in));
  RC_ASSERT(content != nullptr);
  RC_ASSERT(content->frames.size() == 1U);
  const auto& out = std::get<DeviceState>(content->frames[0]);
  RC_ASSERT(out.force_wanted == in.force_wanted);
  RC_ASSERT(out.tick == in.tick);
  RC_ASSERT((out.sampled == in.sampled));
  RC_ASSERT(out.position == in.position);
  RC_ASSERT(out.velocity == in.velocity);
  RC_ASSERT(out.force_applied == in.force_applied);
  RC_ASSERT(out.energy == in.energy);
  RC_ASSERT(out.permitted_force == in.permitted_force);
  RC_ASSERT(out.reasons == in.reasons);
  RC_ASSERT(out.force_sequence == in.force_sequence);
  RC_ASSERT((out.force_age == in.force_age));
  RC_ASSERT((out.mode == in.mode));
  RC_ASSERT(out.device == in.device);
  RC_ASSERT(out.channel == in.channel);
}

RC_GTEST_PROP(Codec, AForceComesOutAsItWentIn, ()) {
  ForceCommand in;
  in.sequence = *rc::gen::inRange<std::uint64_t>(1, ~std::uint64_t{0});
  in.based_on_tick = *rc::gen::arbitrary<std::uint64_t>();
  in.force = any_vector();
  in.valid_for = std::chrono::microseconds(*rc::gen::inRange(1, 10'000'001));
  in.device = *rc::gen::inRange(0U, limits::kMaxDevices);
  in.channel = *rc::gen::inRange(0U, limits::kMaxChannels);
  const int form = *rc::gen::inRange(0, 4);
  if (form > 0) {
    in.model = LocalModel{.at = any_vector(), .stiffness = any_value() * Mat3::Identity()};
    if (form == 2) in.model->stiffness = any_vector().asDiagonal();
    if (form == 3) in.model->stiffness << any_vector(), any_vector(), any_vector();
    if (*rc::gen::arbitrary<bool>()) in.model->valid_radius = std::abs(any_value());
    if (*rc::gen::arbitrary<bool>()) {
      Contact& contact = in.model->contact.emplace(Contact{.normal = Vec3(0.6, 0, -0.8), .gap = any_value()});
      if (*rc::gen::arbitrary<bool>()) {
        ForceTable& table =
            contact.table.emplace(ForceTable{.first = any_value(), .step = std::abs(any_value()) + 1e-9});
        table.step = std::min(table.step, limits::kMaxValue);
        table.size =
            static_cast<std::uint32_t>(*rc::gen::inRange(ForceTable::kMinEntries, ForceTable::kMaxEntries + 1));
        for (std::size_t i = 0; i < table.size; ++i) table.force[i] = any_value();
      }
    }
  }
  in.topology_changed = *rc::gen::arbitrary<bool>();
  if (*rc::gen::arbitrary<bool>()) in.error = std::abs(any_value());

  DataReader reader;
  const DataContent* content = read(reader, data(1, {}, in));
  RC_ASSERT(content != nullptr);
  RC_ASSERT(content->frames.size() == 1U);
  const auto& out = std::get<ForceCommand>(content->frames[0]);
  RC_ASSERT(out.sequence == in.sequence);
  RC_ASSERT(out.based_on_tick == in.based_on_tick);
  RC_ASSERT(out.force == in.force);
  RC_ASSERT((out.valid_for == in.valid_for));
  RC_ASSERT(out.device == in.device);
  RC_ASSERT(out.channel == in.channel);
  RC_ASSERT(out.model.has_value() == in.model.has_value());
  if (in.model) {
    RC_ASSERT(out.model->at == in.model->at);
    RC_ASSERT(out.model->stiffness == in.model->stiffness);
    RC_ASSERT(out.model->valid_radius == in.model->valid_radius);
    RC_ASSERT(out.model->contact.has_value() == in.model->contact.has_value());
    if (const auto& contact = in.model->contact) {
      RC_ASSERT(out.model->contact->normal == contact->normal);
      RC_ASSERT(out.model->contact->gap == contact->gap);
      RC_ASSERT(out.model->contact->table.has_value() == contact->table.has_value());
      if (contact->table) {
        const ForceTable& table = *out.model->contact->table;
        RC_ASSERT(table.first == contact->table->first);
        RC_ASSERT(table.step == contact->table->step);
        RC_ASSERT(table.size == contact->table->size);
        RC_ASSERT(table.force == contact->table->force);
      }
    }
  }
  RC_ASSERT(out.topology_changed == in.topology_changed);
  RC_ASSERT(out.error == in.error);
}

Duration any_length() { return Duration{*rc::gen::inRange<std::int64_t>(0, limits::kMaxTime.count())}; }

std::string any_text(std::size_t limit) { return std::string(*rc::gen::inRange<std::size_t>(0, limit + 1), 'w'); }

LinkReport any_report() {
  const auto any_delays = []() -> std::optional<Delays> {
    if (*rc::gen::arbitrary<bool>()) return {};
    const Duration median = any_time();
    return Delays{median, any_time()};
  };
  LinkReport in;
  in.number = *rc::gen::inRange<std::uint64_t>(1, ~std::uint64_t{0});
  in.until = PeerTime{any_time()};
  in.span = any_length();
  in.forces = *rc::gen::arbitrary<std::uint64_t>();
  in.late_server = *rc::gen::arbitrary<std::uint64_t>();
  in.late_network = *rc::gen::arbitrary<std::uint64_t>();
  in.late_engine = *rc::gen::arbitrary<std::uint64_t>();
  in.worst_late = any_length();
  in.longest_gap = any_length();
  in.round_trip = any_delays();
  in.to_server = any_delays();
  in.to_client = any_delays();
  in.clock_offset = any_time();
  in.clock_drift_ppm = any_value();
  in.clock_error = any_length();
  in.received = *rc::gen::arbitrary<std::uint64_t>();
  in.lost = *rc::gen::arbitrary<std::uint64_t>();
  in.reordered = *rc::gen::arbitrary<std::uint64_t>();
  in.duplicated = *rc::gen::arbitrary<std::uint64_t>();
  in.words = any_text(limits::kMaxDetail);
  in.late_unknown = *rc::gen::arbitrary<std::uint64_t>();
  in.refused = {.not_finite = *rc::gen::arbitrary<std::uint64_t>(),
                .out_of_bounds = *rc::gen::arbitrary<std::uint64_t>(),
                .unknown_tick = *rc::gen::arbitrary<std::uint64_t>(),
                .old_sequence = *rc::gen::arbitrary<std::uint64_t>()};
  return in;
}

void assert_same(const LinkReport& out, const LinkReport& in) {
  const auto same = [](const std::optional<Delays>& a, const std::optional<Delays>& b) {
    return a.has_value() == b.has_value() && (!a || (a->median == b->median && a->p99 == b->p99));
  };
  RC_ASSERT(out.number == in.number);
  RC_ASSERT((out.until == in.until));
  RC_ASSERT((out.span == in.span && out.worst_late == in.worst_late && out.longest_gap == in.longest_gap));
  RC_ASSERT(out.forces == in.forces);
  RC_ASSERT(out.late_server == in.late_server);
  RC_ASSERT(out.late_network == in.late_network);
  RC_ASSERT(out.late_engine == in.late_engine);
  RC_ASSERT(same(out.round_trip, in.round_trip));
  RC_ASSERT(same(out.to_server, in.to_server));
  RC_ASSERT(same(out.to_client, in.to_client));
  RC_ASSERT((out.clock_offset == in.clock_offset && out.clock_error == in.clock_error));
  RC_ASSERT(out.clock_drift_ppm == in.clock_drift_ppm);
  RC_ASSERT(out.received == in.received);
  RC_ASSERT(out.lost == in.lost);
  RC_ASSERT(out.reordered == in.reordered);
  RC_ASSERT(out.duplicated == in.duplicated);
  RC_ASSERT(out.words == in.words);
  RC_ASSERT(out.late_unknown == in.late_unknown);
  RC_ASSERT((out.refused == in.refused));
}

/// As it is after a way there; `in` is the only frame.
template <class Message>
Message there(const Message& in) {
  DataReader reader;
  const DataContent* content = read(reader, data(1, {}, in));
  RC_ASSERT(content != nullptr);
  RC_ASSERT(content->frames.size() == 1U);
  return std::get<Message>(content->frames[0]);
}

RC_GTEST_PROP(Codec, AReportComesOutAsItWentIn, ()) {
  const LinkReport in = any_report();
  assert_same(there(in), in);
}

RC_GTEST_PROP(Codec, AReportOnADeviceComesOutAsItWentIn, ()) {
  DeviceReport in;
  in.number = *rc::gen::inRange<std::uint64_t>(1, ~std::uint64_t{0});
  in.until = PeerTime{any_time()};
  in.span = any_length();
  in.device = *rc::gen::inRange(0U, limits::kMaxDevices);
  in.missed = *rc::gen::arbitrary<std::uint64_t>();
  const auto buckets = *rc::gen::inRange<std::size_t>(0, limits::kLatenessBuckets + 1);
  for (std::size_t i = 0; i < buckets; ++i) {
    in.lateness[i] = *rc::gen::inRange<std::uint64_t>(0, std::uint64_t{1} << 59);  // 24 of them stay below 2^64
    in.steps += in.lateness[i];
  }
  in.steps += *rc::gen::inRange<std::uint64_t>(0, 1000);
  in.overruns = *rc::gen::inRange<std::uint64_t>(0, in.steps + 1);
  in.unseen = *rc::gen::inRange<std::uint64_t>(0, in.steps + 1);
  in.safety = static_cast<Safety>(*rc::gen::inRange(1, 9));
  in.fault = any_text(limits::kMaxDetail);
  in.degraded = any_text(limits::kMaxDetail);

  const DeviceReport out = there(in);
  RC_ASSERT(out.number == in.number);
  RC_ASSERT((out.until == in.until && out.span == in.span));
  RC_ASSERT(out.device == in.device);
  RC_ASSERT(out.steps == in.steps);
  RC_ASSERT(out.missed == in.missed);
  RC_ASSERT(out.overruns == in.overruns);
  RC_ASSERT(out.unseen == in.unseen);
  RC_ASSERT(out.lateness == in.lateness);
  RC_ASSERT((out.safety == in.safety));
  RC_ASSERT(out.fault == in.fault);
  RC_ASSERT(out.degraded == in.degraded);
}

RC_GTEST_PROP(Codec, AReportOnAnEngineComesOutAsItWentIn, ()) {
  PeerReport in;
  in.device = *rc::gen::inRange(0U, limits::kMaxDevices);
  in.channel = *rc::gen::inRange(0U, limits::kMaxChannels);
  in.name = any_text(limits::kMaxName);
  in.state_one_in = *rc::gen::inRange(1U, limits::kMaxOneIn + 1);
  in.forces_refused = *rc::gen::arbitrary<bool>();
  in.link = any_report();

  const PeerReport out = there(in);
  RC_ASSERT(out.device == in.device);
  RC_ASSERT(out.channel == in.channel);
  RC_ASSERT(out.name == in.name);
  RC_ASSERT(out.state_one_in == in.state_one_in);
  RC_ASSERT(out.forces_refused == in.forces_refused);
  assert_same(out.link, in.link);
}

TEST(Codec, SeveralFramesAndAnEchoShareOneDatagram) {
  DataReader reader;
  const auto* content = read(reader, data(42, examples::echo(), examples::state(), examples::force(),
                                          Control{.id = 1, .request = Rearm{}}, Bye{.code = Code::kOk, .reason = "x"}));
  ASSERT_NE(content, nullptr);
  ASSERT_EQ(content->frames.size(), 4U);
  EXPECT_EQ(std::get<DeviceState>(content->frames[0]).tick, 1000U);
  EXPECT_EQ(std::get<ForceCommand>(content->frames[1]).sequence, 100U);
  EXPECT_TRUE(std::holds_alternative<Rearm>(*std::get<Control>(content->frames[2]).request));
  EXPECT_EQ(std::get<Bye>(content->frames[3]).reason, "x");
  EXPECT_EQ(content->sent, PeerTime{Duration{1'000'100'000}});
  ASSERT_TRUE(content->echo.has_value());
  EXPECT_EQ(content->echo->sent, LocalTime{Duration{5'000'000}});
  EXPECT_EQ(content->echo->received, PeerTime{Duration{999'000'000}});
  EXPECT_EQ(content->echo->packet_number, 3U);
  EXPECT_EQ(content->echo->received_mask, 0b101U);
}

TEST(Codec, AWriterUsedAgainRemembersNothingOfTheLastDatagram) {
  DataWriter writer;
  DataReader reader;
  std::array<std::byte, kMaxDatagram> buffer;
  writer.begin(buffer, {.connection_id = 1}, LocalTime{}, examples::echo());
  writer.add(examples::force());
  ForceCommand plain = examples::force();
  plain.model.reset();
  writer.begin(buffer, {.connection_id = 1, .packet_number = 1}, LocalTime{}, {});
  writer.add(plain);
  const auto* content = reader.read(std::span(buffer).first(writer.size()).subspan(kHeaderSize));
  ASSERT_NE(content, nullptr);
  EXPECT_FALSE(content->echo.has_value());
  ASSERT_EQ(content->frames.size(), 1U);
  EXPECT_FALSE(std::get<ForceCommand>(content->frames[0]).model.has_value());
}

TEST(Codec, AWriterUsedAgainRemembersNothingOfTheLastReports) {
  DataWriter writer;
  DataReader reader;
  std::array<std::byte, kMaxDatagram> buffer;
  writer.begin(buffer, {.connection_id = 1}, LocalTime{}, {});
  writer.add(examples::state_with_wanted());
  writer.add(examples::device_report());
  writer.add(examples::peer_report());
  writer.begin(buffer, {.connection_id = 1, .packet_number = 1}, LocalTime{}, {});
  writer.add(examples::state());
  writer.add(DeviceReport{.number = 8});
  PeerReport quiet;
  quiet.link.number = 1;
  writer.add(quiet);
  const auto* content = reader.read(std::span(buffer).first(writer.size()).subspan(kHeaderSize));
  ASSERT_NE(content, nullptr);
  ASSERT_EQ(content->frames.size(), 3U);
  EXPECT_FALSE(std::get<DeviceState>(content->frames[0]).force_wanted.has_value());
  const auto& device = std::get<DeviceReport>(content->frames[1]);
  EXPECT_EQ(device.lateness, LatenessHistogram{});
  EXPECT_EQ(device.fault + device.degraded, "");
  const auto& peer = std::get<PeerReport>(content->frames[2]);
  EXPECT_FALSE(peer.forces_refused);
  EXPECT_FALSE(peer.link.round_trip.has_value());
  EXPECT_EQ(peer.name + peer.link.words, "");
}

TEST(Codec, TheLargestReportsFitIntoASealedDatagramOfTheirOwn) {
  constexpr std::uint64_t kMost = ~std::uint64_t{0};
  LinkReport link;
  link.number = link.forces = link.late_server = link.late_network = link.late_engine = link.late_unknown = kMost;
  link.refused = {.not_finite = kMost, .out_of_bounds = kMost, .unknown_tick = kMost, .old_sequence = kMost};
  link.until = PeerTime{limits::kMaxTime};
  link.span = link.worst_late = link.longest_gap = limits::kMaxTime;
  link.round_trip = link.to_server = link.to_client = Delays{-limits::kMaxTime, -limits::kMaxTime};
  link.clock_offset = -limits::kMaxTime;
  link.clock_drift_ppm = 0.1;
  link.clock_error = limits::kMaxTime;
  link.received = link.lost = link.reordered = link.duplicated = kMost;
  link.words.assign(limits::kMaxDetail, 'w');
  const PeerReport peer{.device = limits::kMaxDevices - 1,
                        .channel = limits::kMaxChannels - 1,
                        .name = std::string(limits::kMaxName, 'n'),
                        .state_one_in = limits::kMaxOneIn,
                        .forces_refused = true,
                        .link = link};
  DeviceReport device{.number = kMost,
                      .until = PeerTime{limits::kMaxTime},
                      .span = limits::kMaxTime,
                      .device = limits::kMaxDevices - 1,
                      .steps = kMost,
                      .missed = kMost,
                      .overruns = kMost,
                      .unseen = kMost};
  device.lateness.fill(kMost / limits::kLatenessBuckets);
  device.safety = Safety::kUnguarded;
  device.fault.assign(limits::kMaxDetail, 'f');
  device.degraded.assign(limits::kMaxDetail, 'd');

  const OutgoingEcho echo{.sent = PeerTime{limits::kMaxTime},
                          .received = LocalTime{limits::kMaxTime},
                          .packet_number = limits::kMaxPacketNumber,
                          .received_mask = 1};
  DataWriter writer;
  std::array<std::byte, kMaxDatagram - 16> buffer;
  for (const bool of_device : {true, false}) {
    writer.begin(buffer, {.connection_id = 1}, LocalTime{limits::kMaxTime}, echo);
    EXPECT_TRUE(of_device ? writer.add(device) : writer.add(peer));
    DataReader reader;
    const auto* content = reader.read(std::span(buffer).first(writer.size()).subspan(kHeaderSize));
    ASSERT_NE(content, nullptr);
    EXPECT_EQ(content->frames.size(), 1U);
  }
}

TEST(Codec, AFrameThatDoesNotFitLeavesTheDatagramAsItWas) {
  DataWriter writer;
  DataReader reader;
  std::array<std::byte, kMaxDatagram> buffer;
  writer.begin(buffer, {.connection_id = 1}, LocalTime{}, {});
  std::size_t fitted = 0;
  while (writer.add(examples::state())) ++fitted;
  EXPECT_LE(writer.size(), kMaxDatagram);
  const auto* content = reader.read(std::span(buffer).first(writer.size()).subspan(kHeaderSize));
  ASSERT_NE(content, nullptr);
  EXPECT_EQ(content->frames.size(), fitted);
}

// ---- what is refused ----

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
      {"NaN wanted", [](DeviceState& s) { s.force_wanted = Vec3(0, 0, kNan); }},
  };
  for (const BadState& bad : cases) {
    DeviceState state = examples::state();
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
      {"sequence 0", [](ForceCommand& f) { f.sequence = 0; }},
      {"valid for nothing", [](ForceCommand& f) { f.valid_for = Duration{}; }},
      {"valid for less than nothing", [](ForceCommand& f) { f.valid_for = Duration{-1}; }},
      {"valid for too long", [](ForceCommand& f) { f.valid_for = limits::kMaxValidFor + Duration{1}; }},
      {"valid for 2³² µs + 1 s", [](ForceCommand& f) { f.valid_for = std::chrono::microseconds(4'295'967'296); }},
  };
  for (const BadForce& bad : cases) {
    ForceCommand force = examples::force_with_all();
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
  wordy.words.assign(limits::kMaxDetail + 1, 'w');  // ours are cut; a stranger's are refused
  DataReader reader;
  EXPECT_EQ(read(reader, data(1, {}, wordy))->frames.size(), 1U);
  const RawProtobuf report = RawProtobuf().varint(1, 1).text(20, wordy.words);
  EXPECT_EQ(reader.read(datagram_with(RawProtobuf().message(6, report)))->invalid, 1U);
}

/// `report` is left out and counted, and the state beside it is read.
void expect_left_out(const auto& report, const std::string& what) {
  DataReader reader;
  const auto* content = read(reader, data(1, {}, report, examples::state()));
  ASSERT_NE(content, nullptr) << what;
  EXPECT_EQ(content->invalid, 1U) << what;
  ASSERT_EQ(content->frames.size(), 1U) << what;
  EXPECT_TRUE(std::holds_alternative<DeviceState>(content->frames[0])) << what;
}

/// How many of frames with `report` in field `field` are read: 0 or 1.
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
  const std::string wordy(limits::kMaxDetail + 1, 'w');  // ours are cut; a stranger's are refused
  EXPECT_EQ(there(DeviceReport{.number = 1, .fault = wordy, .degraded = wordy}).degraded.size(), limits::kMaxDetail);
  EXPECT_EQ(read_raw(7, good()), 1U);
  EXPECT_EQ(read_raw(7, good().text(11, wordy)), 0U);
  EXPECT_EQ(read_raw(7, good().text(12, wordy)), 0U);
  EXPECT_EQ(read_raw(7, RawProtobuf().varint(1, 1)), 0U) << "no safety";
  const std::string zeros(limits::kLatenessBuckets, '\0');  // each byte is an entry
  EXPECT_EQ(read_raw(7, good().text(9, zeros)), 1U);
  EXPECT_EQ(read_raw(7, good().text(9, zeros + '\0')), 0U) << "25 buckets";
}

TEST(Codec, ZerosAtTheEndOfAHistogramDoNotTravel) {
  DeviceReport report = examples::device_report();
  const std::size_t before = data(1, {}, report).size();
  std::swap(report.lateness[13], report.lateness[12]);
  EXPECT_EQ(data(1, {}, report).size(), before - 1);
  report.lateness = {};
  EXPECT_EQ(data(1, {}, report).size(), before - 2 - 15);  // key and length, 14 entries, one of two bytes
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
  };
  for (const BadPeerReport& bad : cases) {
    PeerReport report = examples::peer_report();
    bad.spoil(report);
    expect_left_out(report, bad.what);
  }
  const auto good = [] { return RawProtobuf().varint(4, 1).message(6, RawProtobuf().varint(1, 1)); };
  EXPECT_EQ(read_raw(8, good()), 1U);
  EXPECT_EQ(read_raw(8, good().text(3, std::string(limits::kMaxName + 1, 'n'))), 0U);
  EXPECT_EQ(read_raw(8, RawProtobuf().varint(4, 1)), 0U) << "no link";
}

TEST(Codec, ADeadbandOfNaNIsLeftOutAndASenselessOneIsForTheServer) {
  const auto read_back = [](const SetStateDeadband& asked) -> std::optional<SetStateDeadband> {
    DataReader reader;
    const auto* content = read(reader, data(1, {}, Control{.id = 1, .request = asked}));
    if (content->frames.empty()) return {};
    return std::get<SetStateDeadband>(*std::get<Control>(content->frames[0]).request);
  };
  EXPECT_FALSE(read_back({.share = kNan}).has_value());
  EXPECT_FALSE(read_back({.floor = kInf}).has_value());
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

TEST(Codec, NineStiffnessEntriesAreRowByRow) {
  DataReader reader;
  const auto* content = reader.read(datagram_with(raw_force([](RawProtobuf& force) {
    force.message(4, RawProtobuf().packed(2, {0, 1, 2, 3, 4, 5, 6, 7, 8}));
  })));
  ASSERT_NE(content, nullptr);
  ASSERT_EQ(content->frames.size(), 1U);
  EXPECT_EQ(std::get<ForceCommand>(content->frames[0]).model->stiffness(1, 0), 3.0);
}

TEST(Codec, AStiffnessTravelsInItsShortestForm) {
  ForceCommand force = examples::force();
  const auto size = [&](const Mat3& stiffness) {
    force.model->stiffness = stiffness;
    return data(1, {}, force).size();
  };
  const std::size_t isotropic = size(2000 * Mat3::Identity());
  EXPECT_EQ(size(Vec3(1, 2, 3).asDiagonal()), isotropic + 16);
  EXPECT_GE(size(Mat3::Constant(1)), isotropic + 64);
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
  EXPECT_EQ(reason("good\xE2\x82"), "good");          // cut in two
}

TEST(Codec, AForceIsValidForWholeMicrosecondsRoundedUp) {
  ForceCommand force = examples::force();
  force.valid_for = Duration{1};
  DataReader reader;
  const auto* content = read(reader, data(1, {}, force));
  ASSERT_EQ(content->frames.size(), 1U);
  EXPECT_EQ(std::get<ForceCommand>(content->frames[0]).valid_for, std::chrono::microseconds(1));
}

// ---- header and handshake ----

RC_GTEST_PROP(Codec, AHeaderComesOutAsItWentIn, ()) {
  Header header;
  header.suite = *rc::gen::element(Suite::kPlain, Suite::kNoise);
  if (header.suite == Suite::kNoise) header.epoch = *rc::gen::arbitrary<std::uint8_t>();
  header.connection_id = *rc::gen::arbitrary<std::uint32_t>();
  header.packet_number = *rc::gen::arbitrary<std::uint64_t>();
  std::array<std::byte, kMaxDatagram> buffer;
  DataWriter writer;
  writer.begin(buffer, header, LocalTime{}, {});
  RC_ASSERT((decode_header(std::span(buffer).first(writer.size())) == header));
}

TEST(Codec, TheFullestHelloAndWelcomeFit) {
  const std::vector<std::string> features(limits::kMaxFeatures + 1, std::string(limits::kMaxFeature + 1, 'f'));
  const std::string name(limits::kMaxName + 1, 'n');
  const Hello hello{
      .version_min = ~0U, .version_max = ~0U, .role = Role::kController, .name = name, .features = features};
  const std::size_t suite_1 = sizeof(KeyId) + kNoiseOverhead;
  EXPECT_LE(write_body(hello).size() + suite_1, kMaxHandshakeBody);
  const auto out = read_hello(write_body(hello));
  ASSERT_TRUE(out.has_value());
  EXPECT_EQ(out->name.size(), limits::kMaxName);
  EXPECT_EQ(out->features.size(), static_cast<std::size_t>(limits::kMaxFeatures));

  const Welcome welcome{.version = ~0U,
                        .features = features,
                        .role = Role::kController,
                        .device_name = name,
                        .max_force = 1,
                        .position_resolution = 1,
                        .loop_hz = limits::kMaxLoopHz,
                        .timeout = limits::kMaxTimeout,
                        .server = name,
                        .grants = std::vector<Grant>(limits::kMaxClaims + 1, {15, 7, Role::kController})};
  const Bytes bytes = examples::answer_datagram(1, welcome);
  EXPECT_LE(bytes.size(), 874U);  // as limits.h says
  EXPECT_LE(write_body(welcome).size() + suite_1, kMaxHandshakeBody);
  EXPECT_TRUE(read_answer(decode_answer(bytes)->body).has_value());
}

TEST(Codec, ClaimsAndGrantsComeOutAsTheyWentIn) {
  const auto hello = read_hello(write_body(examples::hello_with_claims()));
  ASSERT_TRUE(hello.has_value());
  ASSERT_EQ(hello->claims.size(), 2U);
  EXPECT_EQ(hello->claims[1].device, "right");
  EXPECT_EQ(hello->claims[1].channel, "tissue");
  EXPECT_EQ(hello->claims[1].role, Role::kController);
  const auto answer = read_answer(write_body(Answer(examples::welcome_with_grants())));
  ASSERT_TRUE(answer.has_value());
  const auto& grants = std::get<Welcome>(*answer).grants;
  ASSERT_EQ(grants.size(), 2U);
  EXPECT_EQ(grants[0].role, Role::kObserver);
  EXPECT_EQ(grants[1].device, 1U);
  EXPECT_EQ(grants[1].channel, 1U);
}

TEST(Codec, TheLongestDescriptionFitsIntoADatagramOfItsOwn) {
  const std::string name(limits::kMaxName, 'n');
  const Vec3 most = Vec3::Constant(limits::kMaxValue);
  ControlAck answer{.id = ~0U, .code = Code::kOk, .detail = std::string(limits::kMaxDetail, 'd')};
  answer.device = DeviceDescription{.device = 15,
                                    .name = name,
                                    .model = name,
                                    .workspace = DeviceDescription::Box{-most, most},
                                    .max_force = 1,
                                    .continuous_force = 1,
                                    .max_stiffness = 1,
                                    .position_resolution = 1,
                                    .loop_hz = limits::kMaxLoopHz};
  answer.device->channels.resize(
      limits::kMaxChannels + 1,
      {.name = name, .rule = ChannelRule::kPriority, .lease = limits::kMaxTimeout, .holder = name});
  std::array<std::byte, kMaxDatagram> buffer;
  DataWriter writer;
  writer.begin(std::span(buffer).first(kMaxDatagram - crypto::kTagSize), {}, LocalTime{limits::kMaxTime},
               examples::echo());
  ASSERT_TRUE(writer.add(answer));
  DataReader reader;
  const DataContent* content = reader.read(std::span(buffer).subspan(kHeaderSize, writer.size() - kHeaderSize));
  ASSERT_NE(content, nullptr);
  ASSERT_EQ(content->frames.size(), 1U);
  const auto& device = std::get<ControlAck>(content->frames[0]).device;
  ASSERT_TRUE(device.has_value());
  EXPECT_EQ(device->channels.size(), limits::kMaxChannels);
  EXPECT_EQ(device->name.size(), limits::kMaxLabel);
}

TEST(Codec, ADeviceOrChannelThatCannotBeIsRefused) {
  const auto refused = [](const RawProtobuf& frame) {
    DataReader reader;
    const DataContent* content = reader.read(datagram_with(frame));
    return content != nullptr && content->frames.empty() && content->invalid == 1;
  };
  const auto lease = [](std::uint64_t device, std::uint64_t channel) {
    return RawProtobuf().message(
        3, RawProtobuf().varint(1, 1).message(5, RawProtobuf().varint(1, device).varint(2, channel)));
  };
  EXPECT_FALSE(refused(raw_force([](RawProtobuf& f) { f.varint(6, 15).varint(7, 7); })));
  EXPECT_TRUE(refused(raw_force([](RawProtobuf& f) { f.varint(6, 16); })));
  EXPECT_TRUE(refused(raw_force([](RawProtobuf& f) { f.varint(7, 8); })));
  EXPECT_FALSE(refused(lease(15, 7)));
  EXPECT_TRUE(refused(lease(16, 7)));
  EXPECT_TRUE(refused(lease(15, 8)));
  EXPECT_TRUE(refused(RawProtobuf().message(1, RawProtobuf().varint(11, 2).varint(12, 16))));
  EXPECT_TRUE(refused(RawProtobuf().message(1, RawProtobuf().varint(11, 2).varint(13, 8))));
}

TEST(Codec, TheSixtyFifthFrameDoesNotFit) {
  std::array<std::byte, kMaxDatagram> buffer;
  DataWriter writer;
  writer.begin(buffer, {}, LocalTime{}, {});
  const Control small{.id = 1, .request = Rearm{}};
  for (int i = 0; i < limits::kMaxFrames; ++i) ASSERT_TRUE(writer.add(small));
  EXPECT_FALSE(writer.add(small));
  writer.begin(buffer, {}, LocalTime{}, {});
  EXPECT_TRUE(writer.add(small)) << "the next datagram is empty again";
}

TEST(Codec, AHelloWithAnythingInItsPaddingIsRefused) {
  Bytes bytes = examples::datagrams()[0].bytes;
  ASSERT_TRUE(decode_hello(bytes).has_value());
  bytes.back() = std::byte{1};
  EXPECT_FALSE(decode_hello(bytes).has_value());
}

TEST(Codec, AHelloThatMakesNoSenseIsRefused) {
  const auto accepted = [](auto spoil) {
    Hello hello = examples::hello();
    spoil(hello);
    return read_hello(write_body(hello)).has_value();
  };
  EXPECT_TRUE(accepted([](Hello&) {}));
  EXPECT_FALSE(accepted([](Hello& h) { h.version_min = 0; }));
  EXPECT_FALSE(accepted([](Hello& h) { h.version_min = 2; }));
  EXPECT_FALSE(accepted([](Hello& h) { h.role = Role{0}; }));
  EXPECT_FALSE(accepted([](Hello& h) { h.role = Role{3}; }));
}

TEST(Codec, AWelcomeThatMakesNoSenseIsRefused) {
  const auto accepted = [](auto spoil) {
    Welcome welcome = examples::welcome();
    spoil(welcome);
    return read_answer(write_body(welcome)).has_value();
  };
  EXPECT_TRUE(accepted([](Welcome&) {}));
  EXPECT_FALSE(accepted([](Welcome& w) { w.version = 0; }));
  EXPECT_FALSE(accepted([](Welcome& w) { w.max_force = kNan; }));
  EXPECT_FALSE(accepted([](Welcome& w) { w.position_resolution = -1; }));
  EXPECT_FALSE(accepted([](Welcome& w) { w.loop_hz = 0; }));
  EXPECT_FALSE(accepted([](Welcome& w) { w.timeout = Duration{}; }));
}

}  // namespace
}  // namespace tendon
