// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/worker/stream.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <stdexcept>
#include <string>

namespace tendon::worker::stream_test {
namespace {

DeviceState full_state() {
  DeviceState hand;
  hand.tick = 4711;
  hand.position = Vec3(0.01, -0.02, 0.03);
  hand.velocity = Vec3(0.1, 0.2, -0.3);
  hand.buttons = 0x8001;
  hand.turning = Turning{};
  hand.turning->orientation = Quat{0.6, 0.8, 0, 0};
  hand.grip = Grip{};
  return hand;
}

Touch full_touch() {
  Touch touch = Vec3(-1, 0.5, 0.25);
  touch.stiffness = Vec3(500, 1, 2).asDiagonal();
  touch.valid_radius = 0.002;
  touch.contact = Contact{.normal = Vec3::UnitX(), .gap = -0.001, .table = {}};
  touch.topology_changed = true;
  touch.error = 0.01;
  touch.torque = Vec3(0.01, 0, 0);
  touch.angular_stiffness = Vec3(0.1, 0.2, 0.3).asDiagonal();
  touch.grip_force = 2;
  return touch;
}

TEST(WorkerStream, StatesAndAnswersComeBackAsTheyWere) {
  Codec proxy;
  Codec worker;
  const DeviceState hand = full_state();
  const auto read = worker.read_state(proxy.state(7, hand));
  ASSERT_TRUE(read.has_value());
  EXPECT_EQ(read->tick, hand.tick);
  EXPECT_EQ(read->position, hand.position);
  EXPECT_EQ(read->buttons, hand.buttons);
  EXPECT_EQ(read->turning->orientation.x, hand.turning->orientation.x);

  const Touch touch = full_touch();
  const auto answer = proxy.read_answer(worker.answer(7, *read, touch), 7, hand);
  ASSERT_TRUE(answer.touch.has_value()) << answer.refused;
  EXPECT_EQ(answer.touch->force, touch.force);
  EXPECT_EQ(answer.touch->stiffness, touch.stiffness);
  EXPECT_EQ(answer.touch->valid_radius, touch.valid_radius);
  EXPECT_EQ(answer.touch->contact->gap, touch.contact->gap);
  EXPECT_EQ(answer.touch->topology_changed, touch.topology_changed);
  EXPECT_EQ(answer.touch->error, touch.error);
  EXPECT_EQ(answer.touch->torque, touch.torque);
  EXPECT_EQ(answer.touch->angular_stiffness, touch.angular_stiffness);
  EXPECT_EQ(answer.touch->grip_force, touch.grip_force);
}

TEST(WorkerStream, AnUnknownForceIsADatagramWithoutFrames) {
  Codec codec;
  Touch unknown;
  unknown.unknown = true;
  const auto answer = codec.read_answer(codec.answer(1, full_state(), unknown), 1, full_state());
  ASSERT_TRUE(answer.touch.has_value());
  EXPECT_TRUE(answer.touch->unknown);
}

TEST(WorkerStream, AnswersOfAnotherStateAndOfNonsenseAreRefused) {
  Codec codec;
  const DeviceState hand = full_state();
  DeviceState other = hand;
  ++other.tick;
  Record right = codec.answer(7, hand, full_touch());
  EXPECT_EQ(codec.read_answer(right, 8, hand).refused, "it answers a state that was not requested");
  EXPECT_EQ(codec.read_answer(right, 7, other).refused, "its force answers another state");
  right.sequence = 8;  // the number of the record
  EXPECT_EQ(codec.read_answer(right, 8, hand).refused, "its force answers another state");
  EXPECT_EQ(codec.read_answer(codec.state(7, hand), 7, hand).refused, "it does not contain exactly one force");
  EXPECT_EQ(codec.read_answer({.sequence = 7, .body = {std::byte{0xff}, std::byte{0xff}}}, 7, hand).refused,
            "it is not a Datagram");
  Touch nan = full_touch();
  nan.force.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(codec.read_answer(codec.answer(7, hand, nan), 7, hand).refused, "it contains a number that is not finite");
  EXPECT_EQ(codec.read_answer(codec.answer(7, hand, Vec3(1e13, 0, 0)), 7, hand).refused,
            "it contains a value that is out of bounds");
}

TEST(WorkerStream, RecordsSurviveAnyCutOfTheStream) {
  std::mt19937_64 dice(1);
  std::vector<std::byte> bytes;
  Codec codec;
  for (std::uint64_t i = 1; i <= 50; ++i) {
    const auto one = to_bytes(codec.state(i, full_state()));
    bytes.insert(bytes.end(), one.begin(), one.end());
  }
  RecordReader reader;
  std::uint64_t next = 1;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t size = std::min<std::size_t>(1 + dice() % 300, bytes.size() - at);
    reader.add({bytes.data() + at, size});
    at += size;
    while (const auto record = reader.next()) {
      EXPECT_EQ(record->sequence, next++);
      EXPECT_TRUE(codec.read_state(*record).has_value());
    }
  }
  EXPECT_EQ(next, 51U);
}

TEST(WorkerStream, AnImpossibleLengthEndsTheStream) {
  for (const std::uint32_t length : {0U, 7U, 8U + 1201U, 0xffffffffU}) {
    RecordReader reader;
    std::array<std::byte, 4> bytes{};
    for (std::size_t i = 0; i < 4; ++i) bytes.at(i) = static_cast<std::byte>(length >> (8 * i));
    reader.add(bytes);
    EXPECT_THROW(reader.next(), std::runtime_error) << length;
  }
}

TEST(WorkerStream, OpensWithTheSecretAlone) {
  const std::string secret(kSecretDigits, 'a');
  EXPECT_TRUE(opens(opening(secret), secret));
  std::string other = secret;
  other.back() = 'b';
  EXPECT_FALSE(opens(opening(other), secret));
  EXPECT_FALSE(opens(opening(secret.substr(1)), secret));
  EXPECT_FALSE(opens(opening(""), secret));
  Record again = opening(secret);
  again.sequence = 1;
  EXPECT_FALSE(opens(again, secret));
}

TEST(WorkerStream, TheBytesAreThoseOfItsDescription) {
  Codec codec;
  Touch unknown;
  unknown.unknown = true;
  const std::vector<std::byte> bytes = to_bytes(codec.answer(0x0102, DeviceState{}, unknown));
  // proto3 omits tx_time_ns = 0.
  const std::vector<std::byte> expected = {std::byte{8}, std::byte{0}, std::byte{0}, std::byte{0},
                                           std::byte{2}, std::byte{1}, std::byte{0}, std::byte{0},
                                           std::byte{0}, std::byte{0}, std::byte{0}, std::byte{0}};
  EXPECT_EQ(bytes, expected);
  EXPECT_EQ(to_bytes(opening("s")).size(), 4 + 8 + 16 + 1U);
}

}  // namespace
}  // namespace tendon::worker::stream_test
