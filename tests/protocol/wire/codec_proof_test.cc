// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "tests/support/callgrind.h"
#include "tests/support/instruction_test.h"

namespace tendon::codec_proof_test {
namespace {

constexpr double kTimes = 1100 - 100;  // the two run lengths of codec-proof

using CodecProof = testing::InstructionTest;

struct Bound {
  std::string what;
  double instructions;  ///< the limit for our codec; this is a few percent above the measured value
  double times;         ///< protobuf needs at least this factor, even if it reuses its objects
};

TEST_F(CodecProof, StatesAndForcesCostLessThanByProtobuf) {
  std::map<std::string, double> cost;
  for (const auto& [line, instructions] : testing::count_instructions(TENDON_CODEC_PROOF, "", "in_turn")) {
    cost[line] = instructions / kTimes;
    std::cout << line << ": " << cost[line] << " instructions\n";
  }
  ASSERT_EQ(cost.size(), 12U);
  const std::vector<Bound> bounds = {{"write state", 430, 2.4},     {"read state", 870, 3.0},
                                     {"write force", 435, 2.2},     {"read force", 810, 3.4},
                                     {"write columns", 4500, 0.65}, {"read columns", 6500, 1.65}};
  for (const auto& [what, most, times] : bounds) {
    const double by_hand = cost.at(what + " by hand");
    EXPECT_LE(by_hand, most) << what;
    EXPECT_GE(by_hand, 0.5 * most) << what << ": it does not do the work, or this bound is old";
    EXPECT_GE(cost.at(what + " by protobuf"), times * by_hand) << what;
  }
}

}  // namespace
}  // namespace tendon::codec_proof_test
