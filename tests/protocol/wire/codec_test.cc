// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/codec.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/protocol/examples.h"
#include "tests/protocol/wire/drawn.h"
#include "tests/protocol/wire/read_back.h"
#include "tests/support/dice.h"

namespace tendon::codec_test {
namespace {

using examples::data;

/// The bytes of the examples are in golden.md, and the bounds of each field are in bounds.json.
TEST(Codec, AFrameComesOutAsItWentIn) {
  Dice dice(1);
  std::vector<Frame> frames;
  for (int i = 0; i < 10'000; ++i) frames.push_back(drawn::a_frame(dice));
  const auto written = [](const Frame& frame) {
    return std::visit([](const auto& value) { return data(1, {}, value); }, frame);
  };
  DataReader reader;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const examples::Bytes in = written(frames[i]);
    const DataContent* content = read(reader, in);
    ASSERT_NE(content, nullptr) << i;
    ASSERT_EQ(content->frames.size(), 1U) << i;
    ASSERT_EQ(written(content->frames[0]), in) << i;
  }
}

TEST(Codec, AShareOfNothingIsNotTheSameAsNone) {
  PortFrame port = examples::port();
  EXPECT_FALSE(there(port).share);
  port.share = 0;
  EXPECT_EQ(there(port).share, 0.0);
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

TEST(Codec, NineStiffnessEntriesAreRowByRow) {
  DataReader reader;
  const auto* content = reader.read(datagram_with(raw_force([](RawProtobuf& force) {
    force.message(4, RawProtobuf().packed(2, {0, 1, 2, 3, 4, 5, 6, 7, 8}));
  })));
  ASSERT_NE(content, nullptr);
  ASSERT_EQ(content->frames.size(), 1U);
  EXPECT_EQ(std::get<ForceCommand>(content->frames[0]).model->stiffness(1, 0), 3.0);
}

TEST(Codec, AForceIsValidForWholeMicrosecondsRoundedUp) {
  ForceCommand force = examples::force();
  force.valid_for = Duration{1};
  EXPECT_EQ(there(force).valid_for, std::chrono::microseconds(1));
}

}  // namespace
}  // namespace tendon::codec_test
