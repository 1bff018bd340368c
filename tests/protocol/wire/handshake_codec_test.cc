// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/handshake_codec.h"
#include "protocol/wire/codec.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <limits>
#include <string>
#include <vector>

#include "protocol/limits.h"
#include "protocol/secrets/client_key.h"
#include "protocol/secrets/noise.h"
#include "tests/protocol/examples.h"
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

TEST(Codec, WaysAreReadInTheirOrderAndRefusedWhenTheyAreTooManyOrTooLong) {
  const auto hello = read_hello(write_body(examples::hello_with_ways()));
  ASSERT_TRUE(hello.has_value());
  EXPECT_EQ(hello->ways, (std::vector<std::string>{"tabulated", "near"}));
  const auto reads = [](std::size_t count, std::size_t length) {
    RawProtobuf raw = RawProtobuf().varint(1, 1).varint(2, 1).varint(3, 2);
    for (std::size_t i = 0; i < count; ++i) raw.text(7, std::string(length, 'w'));
    return read_hello(raw.bytes()).has_value();
  };
  EXPECT_TRUE(reads(limits::kMaxWays, limits::kMaxLabel));
  EXPECT_FALSE(reads(limits::kMaxWays + 1, 1));
  EXPECT_FALSE(reads(1, limits::kMaxLabel + 1));
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

TEST(Codec, TheLongestDescriptionOfAHandleFitsIntoADatagramOfItsOwn) {
  ControlAck answer{.id = ~0U, .code = Code::kOk, .detail = std::string(limits::kMaxDetail, 'd')};
  answer.handle = HandleDescription{.device = 15,
                                    .operator_from_device = Quat{.w = 0.5, .x = -0.5, .y = 0.5, .z = 0.5},
                                    .buttons = std::vector(limits::kMaxButtons + 1, std::string(limits::kMaxName, 'n')),
                                    .orientation_measured = true,
                                    .max_torque = 0.1,
                                    .gripper_open = 0.3,
                                    .max_gripper_force = 1e12,
                                    .group = std::string(limits::kMaxName, 'g'),
                                    .hand = Hand::kRight,
                                    .joints = std::vector(limits::kMaxJoints + 1, std::string(limits::kMaxName, 'j'))};
  std::array<std::byte, kMaxDatagram> buffer;
  DataWriter writer;
  writer.begin(std::span(buffer).first(kMaxDatagram - crypto::kTagSize), {}, LocalTime{limits::kMaxTime},
               examples::echo());
  ASSERT_TRUE(writer.add(answer));
  DataReader reader;
  const DataContent* content = reader.read(std::span(buffer).subspan(kHeaderSize, writer.size() - kHeaderSize));
  ASSERT_NE(content, nullptr);
  ASSERT_EQ(content->frames.size(), 1U);
  const auto& handle = std::get<ControlAck>(content->frames[0]).handle;
  ASSERT_TRUE(handle.has_value());
  EXPECT_EQ(handle->operator_from_device, answer.handle->operator_from_device);
  EXPECT_TRUE(handle->orientation_measured);
  EXPECT_EQ(handle->max_torque, 0.1);
  EXPECT_EQ(handle->gripper_open, 0.3);
  EXPECT_EQ(handle->max_gripper_force, 1e12);
  EXPECT_EQ(handle->group.size(), limits::kMaxLabel);
  EXPECT_EQ(handle->hand, Hand::kRight);
  EXPECT_EQ(handle->joints, std::vector(limits::kMaxJoints, std::string(limits::kMaxLabel, 'j')));
  EXPECT_EQ(handle->buttons.size(), limits::kMaxButtons);
  EXPECT_EQ(handle->buttons.back().size(), limits::kMaxLabel);
}

/// Worst case of both: eight bytes for every component, ten for every counter.
TEST(Codec, AStateAndAForceAlwaysFitTogetherIntoASealedDatagram) {
  const Vec3 vector = Vec3::Constant(-1.0 / 3);
  const Mat3 matrix{{1.1, 2.1, 3.1}, {4.1, 5.1, 6.1}, {7.1, 8.1, 9.1}};
  const Quat turned{.w = 0.5, .x = -0.5, .y = 0.5, .z = 0.5};
  DeviceState state{.tick = ~std::uint64_t{0},
                    .sampled = PeerTime{limits::kMaxTime},
                    .position = vector,
                    .velocity = vector,
                    .force_applied = vector,
                    .energy = -0.1,
                    .permitted_force = kInf,
                    .reasons = ~0U,
                    .force_sequence = ~std::uint64_t{0},
                    .force_age = limits::kMaxTime,
                    .mode = Mode::kFault,
                    .device = limits::kMaxDevices - 1,
                    .channel = limits::kMaxChannels - 1,
                    .force_wanted = vector,
                    .stiffness_wanted = matrix,
                    .buttons = ~0U,
                    .turning = Turning{.orientation = turned, .angular_velocity = vector},
                    .torque_applied = vector,
                    .grip = Grip{.opening = 0.1, .velocity = -0.1},
                    .grip_applied = 0.1,
                    .hand_force = vector,
                    .joints = Joints{.count = Joints::kMost, .angle = {}, .velocity = {}}};
  state.joints->angle.fill(-0.1);
  state.joints->velocity.fill(0.1);
  ForceTable table{.first = -0.1, .step = 0.1, .size = ForceTable::kMaxEntries, .force = {}};
  table.force.fill(0.1);
  ForceCommand force{.sequence = ~std::uint64_t{0},
                     .based_on_tick = ~std::uint64_t{0},
                     .force = vector,
                     .model = LocalModel{.at = vector,
                                         .stiffness = matrix,
                                         .valid_radius = 0.1,
                                         .contact = Contact{.normal = {0.6, 0.64, 0.48}, .gap = -0.1, .table = table}},
                     .valid_for = limits::kMaxValidFor,
                     .device = limits::kMaxDevices - 1,
                     .channel = limits::kMaxChannels - 1,
                     .topology_changed = true,
                     .error = 0.1,
                     .torque = RemoteTorque{.torque = vector, .model = RotationModel{}},
                     .grip_force = -0.1};
  force.torque->model->at = turned;
  force.torque->model->stiffness = matrix;
  OutgoingEcho echo = examples::echo();
  echo.packet_number = ~std::uint64_t{0};

  std::array<std::byte, kMaxDatagram> buffer;
  DataWriter writer;
  writer.begin(std::span(buffer).first(kMaxDatagram - crypto::kTagSize), {}, LocalTime{limits::kMaxTime}, echo);
  const std::size_t empty = writer.size();
  ASSERT_TRUE(writer.add(state));
  EXPECT_EQ(writer.size() - empty, 565U);
  ASSERT_TRUE(writer.add(force));
  EXPECT_EQ(writer.size() + crypto::kTagSize, 1179U);

  DataReader reader;
  const DataContent* content = reader.read(std::span(buffer).subspan(kHeaderSize, writer.size() - kHeaderSize));
  ASSERT_NE(content, nullptr);
  EXPECT_EQ(content->frames.size(), 2U);
  EXPECT_EQ(content->invalid, 0U);
}

TEST(Codec, AMissingVelocityOfAJointIs0AndOneWithoutAnAngleSaysNothing) {
  constexpr std::uint64_t kOne = 0x3ff0'0000'0000'0000;  // 1.0
  const auto read_joints = [](int angles, int velocities) -> std::optional<Joints> {
    RawProtobuf state;
    state.varint(11, 2);
    for (int i = 0; i < angles; ++i) state.fixed64(23, kOne);
    for (int i = 0; i < velocities; ++i) state.fixed64(24, kOne);
    DataReader reader;
    const auto* content = reader.read(datagram_with(RawProtobuf().message(1, state)));
    if (content == nullptr || content->frames.empty()) return {};
    return std::get<DeviceState>(content->frames[0]).joints;
  };
  EXPECT_EQ(read_joints(2, 1), (Joints{.count = 2, .angle = {1, 1}, .velocity = {1}}));
  EXPECT_EQ(read_joints(1, 3), (Joints{.count = 1, .angle = {1}, .velocity = {1}}));
  EXPECT_EQ(read_joints(0, 1), std::nullopt);
}

TEST(Codec, AVelocityOfWhatIsNotMeasuredSaysNothing) {
  const auto read_state = [](const std::function<void(RawProtobuf&)>& add) -> std::optional<DeviceState> {
    RawProtobuf state;
    state.varint(11, 2);
    add(state);
    DataReader reader;
    const auto* content = reader.read(datagram_with(RawProtobuf().message(1, state)));
    if (content == nullptr || content->frames.empty()) return {};
    return std::get<DeviceState>(content->frames[0]);
  };
  constexpr std::uint64_t kOne = 0x3ff0'0000'0000'0000;  // 1.0
  constexpr std::uint64_t kFar = 0x7ff0'0000'0000'0000;  // infinity
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
  const auto read_torque = [](const RawProtobuf& model) -> std::optional<RemoteTorque> {
    DataReader reader;
    const auto* content = reader.read(datagram_with(raw_force([&](RawProtobuf& force) { force.message(14, model); })));
    if (content == nullptr || content->frames.empty()) return {};
    return std::get<ForceCommand>(content->frames[0]).torque;
  };
  constexpr std::uint64_t kOne = 0x3ff0'0000'0000'0000;  // 1.0
  const RawProtobuf one = RawProtobuf().fixed64(1, kOne);
  const auto torque = read_torque(RawProtobuf().message(1, one).fixed64(2, kOne));
  ASSERT_TRUE(torque && torque->model);
  EXPECT_EQ(torque->torque, Vec3::Zero());
  EXPECT_EQ(torque->model->stiffness, Mat3::Identity());
  EXPECT_FALSE(read_torque(RawProtobuf().fixed64(2, kOne))) << "no orientation";
  EXPECT_FALSE(read_torque(RawProtobuf().message(1, one))) << "no stiffness";
  EXPECT_FALSE(read_torque(RawProtobuf().message(1, one).fixed64(2, kOne).fixed64(2, kOne))) << "two entries";
}

TEST(Codec, AxesThatAreNoRotationMakeADescriptionRefused) {
  const auto accepted = [](const Quat& q) {
    ControlAck ack = examples::handle_described(1);
    ack.handle->operator_from_device = q;
    DataReader reader;
    const DataContent* content = read(reader, data(1, {}, ack));
    return content != nullptr && std::get<ControlAck>(content->frames.at(0)).code == Code::kOk;
  };
  EXPECT_TRUE(accepted({.w = 0, .x = 0.6, .y = 0, .z = -0.8}));
  EXPECT_TRUE(accepted({.w = 1.0009, .x = 0, .y = 0, .z = 0}));
  EXPECT_FALSE(accepted({.w = 1.0011, .x = 0, .y = 0, .z = 0}));
  EXPECT_FALSE(accepted({.w = 0.9989, .x = 0, .y = 0, .z = 0}));
  EXPECT_FALSE(accepted({.w = 0, .x = 0, .y = 0, .z = 0}));
  EXPECT_FALSE(accepted({.w = kNan, .x = 0, .y = 0, .z = 1}));
  EXPECT_FALSE(accepted({.w = kInf, .x = 0, .y = 0, .z = 0}));
}

TEST(Codec, ADeviceOrChannelThatCannotBeIsRefused) {
  const auto refused = [](const RawProtobuf& frame) {
    DataReader reader;
    const DataContent* content = reader.read(datagram_with(frame));
    return content != nullptr && content->invalid == 1;
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
}  // namespace tendon::handshake_codec_test
