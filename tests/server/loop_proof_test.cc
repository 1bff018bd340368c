// SPDX-License-Identifier: Apache-2.0
// Counts the callgrind instructions of a haptic step for three handles: a point, for which the features of other
// handles must be nearly free, a handle that rotates and grips, and a point that reports its joints. It also
// counts the instructions of the log thread for each step.
#include <gtest/gtest.h>

#include <iostream>

#include "tests/support/callgrind.h"
#include "tests/support/instruction_test.h"

namespace tendon::loop_proof_test {
namespace {

constexpr double kSteps = 3000 - 1000;  // the two run lengths of loop-proof

/// The number of instructions for the step of a point at 38d7a6d, which did not support rotation and grip.
constexpr double kBeforeHandles = 2977.5;

constexpr double kMostOfARecord = 3150;  // this is a few percent above the measured value

using LoopProof = testing::InstructionTest;

TEST_F(LoopProof, APointsStepIsHardlySlowerAndAWholeHandleCostsTwoAndAHalf) {
  const auto counted = testing::count_instructions(TENDON_LOOP_PROOF, "", "step_in_turn");
  ASSERT_EQ(counted.size(), 3U);
  const double point = counted[0].instructions / kSteps;
  const double handle = counted[1].instructions / kSteps;
  const double jointed = counted[2].instructions / kSteps;
  std::cout << "a step: of a point " << point << " instructions (" << kBeforeHandles
            << " before there were handles), of a "
            << "handle that turns and grips " << handle << ": " << handle / point << " times as many; of a point "
            << "with three joints " << jointed << "\n";
  // The velocity estimate is cheaper than before, and packing the steps before a fault (StepFlight) adds 240.
  EXPECT_LT(point, 0.98 * kBeforeHandles);
  EXPECT_GT(point, 0.5 * kBeforeHandles) << "this is no step";
  EXPECT_LT(handle, 2.6 * point);
  EXPECT_GT(handle, 1.5 * point) << "this is no handle";
  EXPECT_LT(jointed, 1.18 * point);
  EXPECT_GT(jointed, point) << "these are no joints";
}

TEST_F(LoopProof, RecordingAStepTakesFewInstructions) {
  const auto counted = testing::count_instructions(TENDON_LOOP_PROOF, "record", "record_in_turn");
  ASSERT_EQ(counted.size(), 1U);
  const double record = counted[0].instructions / kSteps;
  std::cout << "recording the step of a point: " << record << " instructions\n";
  EXPECT_LT(record, kMostOfARecord);
  EXPECT_GT(record, 0.5 * kMostOfARecord) << "this is no record, or this bound is old";
}

}  // namespace
}  // namespace tendon::loop_proof_test
