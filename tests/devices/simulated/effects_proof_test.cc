// SPDX-License-Identifier: Apache-2.0
// If a scene does not list an effect, the effect must not cost anything. The test compares the callgrind instructions
// of each read and apply in a hand without effects to those of a build that does not contain them (see CMakeLists.txt).
#include <gtest/gtest.h>

#include <iomanip>
#include <iostream>

#include "tests/support/callgrind.h"
#include "tests/support/instruction_test.h"

namespace tendon::effects_proof_test {
namespace {

constexpr double kSteps = 1000 - 500;  // the two run lengths of device-proof

using DeviceEffectsProof = testing::InstructionTest;

TEST_F(DeviceEffectsProof, AnEffectNotListedCostsABranchAStepNoneASubstep) {
  const auto whole = testing::count_instructions(TENDON_PROOF_WHOLE, "none", "live_in_turn");
  const auto bare = testing::count_instructions(TENDON_PROOF_BARE, "none", "live_in_turn");
  ASSERT_EQ(whole.size(), 1U);
  ASSERT_EQ(bare.size(), 1U);
  const double with_code = whole[0].instructions / kSteps;
  const double without_code = bare[0].instructions / kSteps;
  std::cout << "a step: " << with_code << " instructions, built without effects: " << without_code << '\n';
  EXPECT_GT(without_code, 1000);
  EXPECT_GE(with_code, without_code);
  EXPECT_LT(with_code - without_code, 69) << "eighteen branches of three instructions, and the calls behind them";
}

TEST_F(DeviceEffectsProof, WhatIsListedCostsSome) {
  const auto all = testing::count_instructions(TENDON_PROOF_WHOLE, "each", "live_in_turn");
  ASSERT_EQ(all.size(), 13U);
  for (std::size_t i = 1; i < all.size(); ++i) {
    const double more = (all[i].instructions - all[0].instructions) / kSteps;
    EXPECT_GT(more, 0) << all[i].line;
    std::cout << std::setw(18) << all[i].line << std::setw(10) << more << " instructions a step\n";
  }
}

}  // namespace
}  // namespace tendon::effects_proof_test
