// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/handshake_codec.h"
#include "protocol/wire/codec.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "protocol/limits.h"
#include "protocol/secrets/client_key.h"
#include "protocol/secrets/noise.h"
#include "protocol/wire/bounds.h"
#include "tests/protocol/examples.h"
#include "tests/protocol/wire/drawn.h"
#include "tests/protocol/wire/read_back.h"

namespace tendon::handshake_codec_test {
namespace {

using examples::Bytes;
using examples::data;

RC_GTEST_PROP(Codec, AHeaderComesOutAsItWentIn, ()) {
  Header header;
  header.suite = *rc::gen::element(Suite::kPlain, Suite::kNoise, Suite::kAesGcm);
  if (header.suite != Suite::kPlain) header.epoch = *rc::gen::arbitrary<std::uint8_t>();
  header.connection_id = *rc::gen::arbitrary<std::uint32_t>();
  header.packet_number = *rc::gen::arbitrary<std::uint64_t>();
  std::array<std::byte, kMaxDatagram> buffer;
  DataWriter writer;
  writer.begin(buffer, header, LocalTime{}, {});
  RC_ASSERT((decode_header(std::span(buffer).first(writer.size())) == header));
}

TEST(Codec, ADatagramOfTheHandshakeIsNeverOfSuite2) {
  for (const auto type : {DatagramType::kHello, DatagramType::kRetry, DatagramType::kData, DatagramType::kAnswer}) {
    for (const auto suite : {Suite::kPlain, Suite::kNoise, Suite::kAesGcm, Suite{3}}) {
      const auto bytes = encode_header({.type = type, .suite = suite});
      const auto most = type == DatagramType::kData ? Suite::kAesGcm : Suite::kNoise;
      EXPECT_EQ(decode_header(bytes).has_value(), suite <= most) << static_cast<int>(type) << static_cast<int>(suite);
    }
  }
}

TEST(Codec, TheFullestHelloAndWelcomeFit) {
  const std::vector<std::string> features(limits::kMaxFeatures + 1, std::string(limits::kMaxFeature + 1, 'f'));
  const std::string name(limits::kMaxName + 1, 'n');
  const std::vector<std::string> ways(limits::kMaxWays + 1, std::string(limits::kMaxLabel + 1, 'w'));
  const Hello hello{.version_min = ~0U,
                    .version_max = ~0U,
                    .role = Role::kController,
                    .name = name,
                    .features = features,
                    .ways = ways};
  EXPECT_LE(write_body(hello).size(), 882U);  // value in limits.h
  const std::size_t suite_1 = sizeof(KeyId) + kNoiseOverhead;
  EXPECT_LE(write_body(hello).size() + suite_1, kMaxHandshakeBody);
  const auto out = read_hello(write_body(hello));
  ASSERT_TRUE(out.has_value());
  EXPECT_EQ(out->name.size(), limits::kMaxName);
  EXPECT_EQ(out->features.size(), static_cast<std::size_t>(limits::kMaxFeatures));
  EXPECT_EQ(out->ways, std::vector<std::string>(limits::kMaxWays, std::string(limits::kMaxLabel, 'w')));

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
  EXPECT_LE(bytes.size(), 874U);  // value in limits.h
  EXPECT_LE(write_body(welcome).size() + suite_1, kMaxHandshakeBody);
  EXPECT_TRUE(read_answer(decode_answer(bytes)->body).has_value());
}

TEST(Codec, AnEngineThatNamesNoWaySendsTheBytesThatItAlwaysSent) {
  Hello hello = examples::hello();
  const Bytes before = write_body(hello);
  hello.ways = {"near"};
  const Bytes named = write_body(hello);
  EXPECT_EQ(named.size(), before.size() + 2 + 4) << "a tag, a length and four letters";
  ForceCommand force = examples::force_with_way();
  const Bytes said = examples::data(1, {}, force);
  force.way = 0;
  EXPECT_EQ(said.size(), examples::data(1, {}, force).size() + 2);
}

TEST(Codec, WaysClaimsAndGrantsComeOutAsTheyWentIn) {
  EXPECT_EQ(read_hello(write_body(examples::hello_with_ways())).value().ways, examples::hello_with_ways().ways);
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

/// Writes a datagram with an echo, leaves room for the tag of the seal, and reads it back.
ControlAck read_from_a_sealed_datagram(const ControlAck& answer) {
  std::array<std::byte, kMaxDatagram> buffer;
  DataWriter writer;
  writer.begin(std::span(buffer).first(kMaxDatagram - crypto::kTagSize), {}, LocalTime{limits::kMaxTime},
               examples::echo());
  EXPECT_TRUE(writer.add(answer));
  DataReader reader;
  const DataContent* content = reader.read(std::span(buffer).subspan(kHeaderSize, writer.size() - kHeaderSize));
  return content == nullptr ? ControlAck{} : std::get<ControlAck>(content->frames.at(0));
}

TEST(Codec, TheLongestDescriptionFitsIntoADatagramOfItsOwn) {
  auto answer = drawn::the_fullest<ControlAck>();
  answer.handle.reset();
  const DeviceDescription most = *answer.device;
  answer.device->name += 'n';
  answer.device->channels.resize(limits::kMaxChannels + 1);
  const auto device = read_from_a_sealed_datagram(answer).device;
  ASSERT_TRUE(device.has_value());
  EXPECT_EQ(device->channels.size(), limits::kMaxChannels);
  EXPECT_EQ(device->name, most.name);
}

TEST(Codec, TheLongestDescriptionOfAHandleFitsIntoADatagramOfItsOwn) {
  auto answer = drawn::the_fullest<ControlAck>();
  answer.device.reset();
  const HandleDescription most = *answer.handle;
  answer.handle->group += 'g';
  answer.handle->joints.resize(limits::kMaxJoints + 1);
  answer.handle->buttons.resize(limits::kMaxButtons + 1);
  answer.handle->buttons.back() += 'n';
  const auto handle = read_from_a_sealed_datagram(answer).handle;
  ASSERT_TRUE(handle.has_value());
  EXPECT_EQ(handle->operator_from_device, most.operator_from_device);
  EXPECT_EQ(handle->gripper_open, most.gripper_open);
  EXPECT_EQ(handle->group, most.group);
  EXPECT_EQ(handle->joints, most.joints);
  EXPECT_EQ(handle->buttons, most.buttons);
  EXPECT_EQ(handle->outputs, most.outputs);
}

template <class... Frames>
void expect_to_fit_into_a_sealed_datagram() {
  OutgoingEcho echo = examples::echo();
  echo.packet_number = ~std::uint64_t{0};

  std::array<std::byte, kMaxDatagram> buffer;
  DataWriter writer;
  writer.begin(std::span(buffer).first(kMaxDatagram - crypto::kTagSize), {}, LocalTime{limits::kMaxTime}, echo);
  ASSERT_TRUE((writer.add(drawn::the_fullest<Frames>()) && ...));

  DataReader reader;
  const DataContent* content = reader.read(std::span(buffer).subspan(kHeaderSize, writer.size() - kHeaderSize));
  ASSERT_NE(content, nullptr);
  EXPECT_EQ(content->frames.size(), sizeof...(Frames));
  EXPECT_EQ(content->invalid, 0U);
}

TEST(Codec, AStateOrAForceWithAPoseFitsIntoASealedDatagram) {
  expect_to_fit_into_a_sealed_datagram<DeviceState>();
  expect_to_fit_into_a_sealed_datagram<ForceCommand, FieldPose>();
}

TEST(Codec, ABrickAndTheLargestUseOfAFieldFitIntoASealedDatagram) {
  expect_to_fit_into_a_sealed_datagram<FieldBrick>();
  UseField use{.device = 15, .channel = 7, .generation = ~0U, .field = examples::field_name()};
  use.materials.resize(field::Field::kMostMaterials,
                       {.stiffness = 1, .branch_stiffness = 1, .relaxation = 1, .friction = 1});
  const Vec3 direction(0.6, 0.64, 0.48);
  use.fixtures.resize(field::Field::kMostFixtures,
                      {.at = direction, .normal = direction, .stiffness = 1, .most_force = 1});
  FieldDepthTable table{.material = 7, .step = 0.1, .size = 16};
  table.force.fill(0.1);
  use.tables.resize(field::Field::kMostTables, table);
  EXPECT_EQ(refused_field(use), "");
  OutgoingEcho echo = examples::echo();
  echo.packet_number = ~std::uint64_t{0};
  std::array<std::byte, kMaxDatagram> buffer;
  DataWriter writer;
  writer.begin(std::span(buffer).first(kMaxDatagram - crypto::kTagSize), {}, LocalTime{limits::kMaxTime}, echo);
  EXPECT_TRUE(writer.add(Control{.id = ~0U, .request = use}));
  use.tables.push_back(table);
  EXPECT_EQ(refused_field(use), "tables");
}

constexpr std::uint64_t kOne = 0x3ff0'0000'0000'0000;  // 1.0
constexpr std::uint64_t kFar = 0x7ff0'0000'0000'0000;  // infinity

template <class Frame>
std::optional<Frame> read_frame(const Bytes& body) {
  DataReader reader;
  const auto* content = reader.read(body);
  if (content == nullptr || content->frames.empty()) return {};
  return std::get<Frame>(content->frames[0]);
}

std::optional<DeviceState> read_state(const std::function<void(RawProtobuf&)>& add) {
  RawProtobuf state;
  state.varint(11, 2);
  add(state);
  return read_frame<DeviceState>(datagram_with(RawProtobuf().message(1, state)));
}

TEST(Codec, AMissingVelocityOfAJointIs0AndOneWithoutAnAngleSaysNothing) {
  const auto read_joints = [](int angles, int velocities) {
    return read_state([&](RawProtobuf& state) {
             for (int i = 0; i < angles; ++i) state.fixed64(23, kOne);
             for (int i = 0; i < velocities; ++i) state.fixed64(24, kOne);
           })
        .value()
        .joints;
  };
  EXPECT_EQ(read_joints(2, 1), (Joints{.count = 2, .angle = {1, 1}, .velocity = {1}}));
  EXPECT_EQ(read_joints(1, 3), (Joints{.count = 1, .angle = {1}, .velocity = {1}}));
  EXPECT_EQ(read_joints(0, 1), std::nullopt);
}

TEST(Codec, AVelocityOfWhatIsNotMeasuredSaysNothing) {
  const auto vector = [](std::uint64_t x) { return RawProtobuf().fixed64(1, x); };
  const auto neither = read_state([&](RawProtobuf& state) { state.message(16, vector(kOne)).fixed64(20, kOne); });
  ASSERT_TRUE(neither);
  EXPECT_FALSE(neither->turning || neither->grip);
  EXPECT_FALSE(read_state([&](RawProtobuf& state) { state.message(16, vector(kFar)); }));
  EXPECT_FALSE(read_state([&](RawProtobuf& state) { state.fixed64(20, kFar); }));
  const auto both = read_state([&](RawProtobuf& state) { state.message(15, vector(kOne)).fixed64(19, kOne); });
  ASSERT_TRUE(both);
  EXPECT_EQ(both->turning, Turning{});
  EXPECT_EQ(both->grip, (Grip{.opening = 1, .velocity = 0}));
}

TEST(Codec, ARotationModelNeedsAnOrientationAndNoTorque) {
  const auto read_torque = [](const RawProtobuf& model) {
    const auto command =
        read_frame<ForceCommand>(datagram_with(raw_force([&](RawProtobuf& force) { force.message(14, model); })));
    return command ? command->torque : std::nullopt;
  };
  const RawProtobuf one = RawProtobuf().fixed64(1, kOne);
  const auto torque = read_torque(RawProtobuf().message(1, one).fixed64(2, kOne));
  ASSERT_TRUE(torque && torque->model);
  EXPECT_EQ(torque->torque, Vec3::Zero());
  EXPECT_EQ(torque->model->stiffness, Mat3::Identity());
  EXPECT_FALSE(read_torque(RawProtobuf().fixed64(2, kOne))) << "no orientation";
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

TEST(Codec, AHelloWhoseOldestVersionIsNewerThanItsNewestIsRefused) {
  Hello hello = examples::hello();
  EXPECT_TRUE(read_hello(write_body(hello)).has_value());
  hello.version_min = 2;
  EXPECT_FALSE(read_hello(write_body(hello)).has_value());
}

}  // namespace
}  // namespace tendon::handshake_codec_test
