// SPDX-License-Identifier: Apache-2.0
#include "server/recording/recording_codec.h"

#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/base/reason.h"
#include "recording.pb.h"
#include "server/recording/byte_sink.h"
#include "server/recording/recorder.h"
#include "server/recording/recording_reader.h"
#include "tests/server/recording/recording_samples.h"

namespace tendon::recording_codec_test {
namespace {

namespace pb = tendon::recording::v1;

TEST(RecordingCodec, SpellsOutEveryReasonThatCoreHas) {
  for (int bit = 0; bit < 32; ++bit) {
    const Reasons reasons = Reasons::from_bits(std::uint32_t{1} << bit);
    std::string name = to_string(reasons);
    if (name.empty()) continue;
    std::ranges::replace_if(
        name, [](char c) { return c == ' ' || c == '-'; }, '_');

    StepRecord step = testing::sample_step(1);
    step.reasons = reasons;
    pb::Step message;
    ASSERT_TRUE(message.ParseFromString(recording::encode(step)));
    EXPECT_EQ(message.reason_bits(), reasons.bits());
    const auto* field = pb::Reason::descriptor()->FindFieldByName(name);
    ASSERT_NE(field, nullptr) << "Reason in recording.proto has no field " << name;
    const std::size_t tag = field->number() < 16 ? 1 : 2;
    EXPECT_EQ(message.reason().ByteSizeLong(), tag + 1) << "only " << name << " is set";
    EXPECT_TRUE(message.reason().GetReflection()->GetBool(message.reason(), field)) << name;
  }
}

TEST(RecordingCodec, TheSchemaStandsAlone) {
  google::protobuf::FileDescriptorSet files;
  ASSERT_TRUE(files.ParseFromString(recording::schema_data()));
  google::protobuf::DescriptorPool pool;
  for (const auto& file : files.file()) ASSERT_NE(pool.BuildFile(file), nullptr);
  for (const auto& kind : {recording::kScene, recording::kStep, recording::kDatagram, recording::kLoss})
    EXPECT_NE(pool.FindMessageTypeByName(std::string(kind.schema)), nullptr) << kind.schema;
}

// PlotJuggler would use this field as the time in seconds and convert it to a double.
TEST(RecordingCodec, NoFieldIsCalledTimestamp) {
  const auto* file = pb::Step::descriptor()->file();
  for (int m = 0; m < file->message_type_count(); ++m)
    EXPECT_EQ(file->message_type(m)->FindFieldByName("timestamp"), nullptr) << file->message_type(m)->full_name();
}

TEST(RecordingCodec, GivesPlotsTheNormsOfTheForces) {
  pb::Step message;
  ASSERT_TRUE(message.ParseFromString(recording::encode(testing::sample_step(1))));
  EXPECT_DOUBLE_EQ(message.force_wanted_norm_n(), 5);
  EXPECT_DOUBLE_EQ(message.force_applied_norm_n(), 2);
}

TEST(RecordingCodec, GivesPlotsThePacketNumber) {
  const auto packet = [](DatagramRecord datagram) {
    pb::Datagram message;
    EXPECT_TRUE(message.ParseFromString(recording::encode(datagram)));
    return message;
  };
  DatagramRecord datagram = testing::sample_datagram(testing::ms(1), 40, true);
  EXPECT_EQ(packet(datagram).type(), pb::DATAGRAM_TYPE_UNSPECIFIED) << "garbage is garbage";

  const std::array<std::uint8_t, 16> header = {0x54, 0x13, 0, 0, 0x78, 0x56, 0x34, 0x12, 7, 0, 0, 0, 0, 0, 0, 0};
  std::ranges::transform(header, datagram.bytes.begin(), [](std::uint8_t b) { return std::byte{b}; });
  EXPECT_EQ(packet(datagram).type(), pb::DATAGRAM_TYPE_DATA);
  EXPECT_EQ(packet(datagram).connection_id(), 0x12345678U);
  EXPECT_EQ(packet(datagram).packet_number(), 7U);

  datagram.size = kMaxDatagram + 1;
  EXPECT_EQ(packet(datagram).type(), pb::DATAGRAM_TYPE_UNSPECIFIED) << "too large for a datagram of ours";
}

TEST(RecordingCodec, KeepsWhatFitsOfADatagramThatWasTooLarge) {
  const auto datagram = testing::sample_datagram(testing::ms(1), 60'000, true);
  const auto read = recording::decode_datagram(recording::encode(datagram), testing::ms(1));
  EXPECT_EQ(read.size, 60'000U);
  EXPECT_EQ(read.bytes, datagram.bytes);
}

PortRecord a_port() {
  PortRecord port;
  port.tick = 77;
  port.channel = 2;
  port.at = testing::ms(77);
  port.settled = {.credit = 1.25e-3, .withdraw = 0.5e-3};
  port.grip_settled = {.credit = 0.75e-3, .withdraw = 0.25e-3};
  port.stiffness = 128;
  port.round_trip = std::chrono::milliseconds(50);
  port.sent.epoch = 5;
  port.sent.sequence = 77;
  port.sent.answers_epoch = 4;
  port.sent.answers = 60;
  port.sent.time = Duration(-3);
  port.sent.round_trip = Duration(9);
  port.sent.phase = PortPhase::kClutched;
  port.sent.engagement = 2;
  port.sent.buttons = 3;
  port.sent.position = {1, -2, 3};
  port.sent.velocity = {4, 5, -6};
  port.sent.force = {-7, 8, 9};
  port.sent.account = 0.125;
  port.sent.need = 0.25;
  port.sent.given = 0.5;
  port.sent.taken = 0.75;
  port.peer = port.sent;
  port.peer_arrived = testing::ms(76);
  port.peer->contact_force = Vec3(0.5, 0.25, -0.5);
  port.peer->surface = {.normal = {0.48, 0.6, 0.64}, .offset = -0.125, .stiffness = 500};
  port.peer->wave_integral = {0.25, 0.5, -1};
  port.peer->wave_energy = 0.5;
  port.peer->turn = {
      .turn = {.w = 0.5, .x = 0.5, .y = -0.5, .z = 0.5}, .angular_velocity = {1, 2, 3}, .torque = {4, -5, 6}};
  port.peer->grip = {
      .opening = 0.0625, .velocity = -0.125, .force = 2, .account = -0.25, .need = 0.5, .given = 0.75, .taken = 1.25};
  port.peer->energy_in = 3.5;
  port.peer->share = 0;
  port.peer->position_scale = 0.5;
  port.peer->force_scale = 4;
  return port;
}

std::vector<std::string> unset_in(const google::protobuf::Message& message) {
  std::vector<std::string> unset;
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const auto* const field = message.GetDescriptor()->field(i);
    const auto* const reflection = message.GetReflection();
    const bool set =
        field->is_repeated() ? reflection->FieldSize(message, field) > 0 : reflection->HasField(message, field);
    if (!set) {
      unset.push_back(field->full_name());
    } else if (field->message_type() != nullptr && !field->is_repeated()) {
      std::ranges::copy(unset_in(reflection->GetMessage(message, field)), std::back_inserter(unset));
    }
  }
  return unset;
}

template <class Message>
Message parsed(const std::string& bytes) {
  Message message;
  EXPECT_TRUE(message.ParseFromString(bytes));
  message.DiscardUnknownFields();
  EXPECT_EQ(message.SerializeAsString(), bytes);
  return message;
}

/// Steps and datagrams are encoded without protobuf.
TEST(RecordingCodec, AStepHasTheBytesThatProtobufWrites) {
  parsed<pb::Step>(recording::encode(StepRecord{}));
  for (std::uint64_t tick = 0; tick < 3000; ++tick) {
    StepRecord step = testing::sample_step(tick);
    step.reasons = Reasons::from_bits(static_cast<std::uint32_t>(tick * 97));
    if (tick % 2 == 1) step.hand_force = Vec3(0, -0.0, NAN);
    parsed<pb::Step>(recording::encode(step, std::string(tick % 200, 'w')));
  }
  StepRecord whole = testing::sample_step(35);
  whole.reasons = Reasons::from_bits(0xFFFF);
  whole.hand.position.z() = whole.hand.velocity.y() = 1;
  for (Vec3* const v : {&whole.was_applied, &whole.wanted, &whole.force, &whole.applied}) v->setConstant(0.5);
  whole.hand_force = whole.wanted;
  whole.force_error = 0;
  whole.disarmed = true;
  whole.buttons = 1;
  whole.stiffness(0, 1) = 1;
  const Vec3 one(1, 1, 1);
  whole.handle = HandleStep{.turn = TurnStep{{{0.5, 0.5, 0.5, 0.5}, one}, one, one, one, one},
                            .grip = GripStep{{1, 1}, 1, 1, 1, 1, 1, 1},
                            .joints = Joints::three(one, one)};
  EXPECT_EQ(unset_in(parsed<pb::Step>(recording::encode(whole, "near"))),
            std::vector<std::string>{"tendon.recording.v1.Step.assumption_broken"});
}

TEST(RecordingCodec, ADatagramHasTheBytesThatProtobufWrites) {
  for (const std::uint32_t size : {0U, 1U, 15U, 90U, 127U, 128U, 1200U, 60'000U}) {
    DatagramRecord datagram = testing::sample_datagram(testing::ms(1), size, size % 2 == 0);
    parsed<pb::Datagram>(recording::encode(datagram));
    datagram.peer.ip.fill(0xfe);
    datagram.bytes[0] = std::byte{0x54};
    datagram.bytes[1] = std::byte{0x13};
    parsed<pb::Datagram>(recording::encode(datagram));
  }
}

TEST(RecordingCodec, APortComesBackWithAllThatItHad) {
  PortRecord port = a_port();
  const PortRecord read = recording::decode_port(recording::encode(port), port.at);
  EXPECT_EQ(recording::encode(read), recording::encode(port));
  EXPECT_EQ(read.at, port.at);
  EXPECT_FALSE(read.sent.contact_force || read.sent.surface || read.sent.turn || read.sent.grip || read.sent.share);
  port.sent = *port.peer;
  pb::Port message;
  ASSERT_TRUE(message.ParseFromString(recording::encode(port)));
  EXPECT_EQ(unset_in(message), std::vector<std::string>()) << "every field of the schema is written";
  PortRecord alone = port;
  alone.peer.reset();
  EXPECT_FALSE(recording::decode_port(recording::encode(alone), port.at).peer);
  PortRecord odd = port;
  odd.sent.phase = static_cast<PortPhase>(8);
  EXPECT_THROW(recording::decode_port(recording::encode(odd), port.at), std::invalid_argument);
}

FieldInput an_input(FieldInput::Kind kind) {
  FieldInput input{.tick = 77, .at = testing::ms(77), .kind = kind, .channel = 1, .source = 5, .generation = 3};
  if (kind == FieldInput::Kind::kTruth) {
    input.answers_tick = 40;
    input.received = testing::ms(76);
    input.truth = {1, -2, 0.1};
  }
  if (kind == FieldInput::Kind::kPose) {
    input.pose = {.at = testing::ms(99),
                  .pose = {.position = {0.1, 0.2, -0.3}, .turn = {.w = 0.5, .x = 0.5, .y = -0.5, .z = 0.5}},
                  .velocity = {1, 2, 3},
                  .angular_velocity = {4, 5, 6}};
  }
  return input;
}

FieldData a_field() {
  return {.at = testing::ms(70),
          .channel = 1,
          .source = 5,
          .generation = 3,
          .manifest = {std::byte{1}, std::byte{0}, std::byte{255}},
          .weights = std::vector<std::byte>(1024, std::byte{7}),
          .materials = {{.stiffness = 900, .branch = 300, .tau = 0.1, .friction = 0.4},
                        {.stiffness = 500, .table = field::DepthTable::of(2e-3, std::vector{0.1, 1 / 3.0})}},
          .fixtures = {{.kind = field::Fixture::Kind::kPlane,
                        .at = {0.1, 0.2, 0.3},
                        .direction = {1, 0, 0},
                        .stiffness = 100,
                        .most_force = 2}}};
}

TEST(RecordingCodec, InputsAndDataOfFieldsComeBackWithAllThatTheyHad) {
  using Kind = FieldInput::Kind;
  for (const Kind kind : {Kind::kUse, Kind::kStop, Kind::kRelease, Kind::kPose, Kind::kTruth}) {
    const FieldInput input = an_input(kind);
    const FieldInput read = recording::decode_field_input(recording::encode(input), input.at);
    EXPECT_EQ(recording::encode(read), recording::encode(input));
    EXPECT_EQ(read.kind, kind);
    EXPECT_EQ(read.pose.at, kind == Kind::kPose ? input.pose.at : LocalTime{});
    if (kind == Kind::kTruth) {
      EXPECT_EQ(read.received, input.received);
    }
  }
  EXPECT_THROW(recording::decode_field_input(recording::encode(an_input(static_cast<Kind>(9))), testing::ms(77)),
               std::invalid_argument);
  const FieldData data = a_field();
  const FieldData read = recording::decode_field_data(recording::encode(data), data.at);
  EXPECT_EQ(recording::encode(read), recording::encode(data));
  EXPECT_EQ(read.manifest, data.manifest);
  EXPECT_EQ(read.weights, data.weights);
  EXPECT_EQ(read.materials, data.materials);
  EXPECT_EQ(read.fixtures[0].kind, field::Fixture::Kind::kPlane);
  pb::FieldData message;
  ASSERT_TRUE(message.ParseFromString(recording::encode(data)));
  message.mutable_fixtures(0)->set_kind(3);
  EXPECT_THROW(recording::decode_field_data(message.SerializeAsString(), data.at), std::invalid_argument);
}

TEST(RecordingCodec, FieldsAreInTheFileOfADeviceThatAllowsThem) {
  MemorySink sink;
  Recorder::Config config = testing::sample_config();
  config.fields = true;
  config.more_devices.push_back({.name = "left", .scene = config.scene, .fields = true});
  Recorder recorder(config, sink);
  recorder.record(a_field(), 1);
  recorder.record(an_input(FieldInput::Kind::kUse), 1);
  recorder.record(testing::sample_step(77), 1);
  recorder.record(an_input(FieldInput::Kind::kPose));
  recorder.close();
  RecordingReader reader(testing::stream(sink.bytes()), "x", RecordingReader::Devices::kAll);
  std::vector<std::size_t> kinds;
  std::vector<std::size_t> devices;
  while (const auto record = reader.next()) {
    kinds.push_back(record->index());
    devices.push_back(reader.device());
  }
  EXPECT_EQ(kinds, (std::vector<std::size_t>{0, 0, 6, 5, 1, 5}));
  EXPECT_EQ(devices, (std::vector<std::size_t>{0, 1, 1, 1, 1, 0}));
}

TEST(RecordingCodec, APortIsInTheFileBeforeItsStepAndOnlyOfACoupledDevice) {
  for (const bool coupled : {true, false}) {
    MemorySink sink;
    Recorder::Config config = testing::sample_config();
    config.ports = coupled;
    Recorder recorder(config, sink);
    if (coupled) recorder.record(a_port());
    recorder.record(testing::sample_step(77));
    recorder.close();
    RecordingReader reader(testing::stream(sink.bytes()), "x");
    std::vector<std::size_t> kinds;
    while (const auto record = reader.next()) kinds.push_back(record->index());
    EXPECT_EQ(kinds, coupled ? (std::vector<std::size_t>{0, 4, 1}) : (std::vector<std::size_t>{0, 1}));
  }
}

}  // namespace
}  // namespace tendon::recording_codec_test
