// SPDX-License-Identifier: Apache-2.0
//
// What the loops do between a state in its box and its force in the other one, beside system calls: instructions by
// callgrind, clock readings, and looks at a link, each of which would be a system call.
#include <gtest/gtest.h>

#include <cstdint>
#include <iostream>
#include <sstream>

#include "tests/support/callgrind.h"
#include "tests/support/instruction_test.h"

namespace tendon::turn_proof_test {
namespace {

constexpr std::uint64_t kTurns = 600;       // of the longer run of turn-proof
constexpr double kCounted = 600.0 - 100.0;  // between its two lengths

constexpr double kMost = 9150;  // a few percent above what it takes

using TurnProof = testing::InstructionTest;

TEST_F(TurnProof, AStateAndItsForceTakeTwoDatagramsAndFewInstructions) {
  const auto counted = testing::count_instructions(TENDON_TURN_PROOF, "", "exchange_in_turn");
  ASSERT_EQ(counted.size(), 1U);
  std::uint64_t readings = 0;
  std::uint64_t looks = 0;
  std::uint64_t sent = 0;
  std::uint64_t forces = 0;
  ASSERT_TRUE(std::istringstream(counted[0].line) >> readings >> looks >> sent >> forces) << counted[0].line;
  const double instructions = counted[0].instructions / kCounted;
  std::cout << "a state and its force: " << instructions << " instructions, " << static_cast<double>(readings) / kTurns
            << " clock readings, " << static_cast<double>(looks) / kTurns << " looks, "
            << static_cast<double>(sent) / kTurns << " datagrams\n";
  EXPECT_EQ(forces, kTurns) << "not every state was answered in its turn";
  EXPECT_EQ(sent, 2 * kTurns);
  // Both ends look in vain, and then find something; the server looks once more when a state has left.
  EXPECT_EQ(looks, 5 * kTurns);
  // After each look but that last one, when the step has rung, and when the engine has answered.
  EXPECT_EQ(readings, 6 * kTurns);
  EXPECT_LE(instructions, kMost);
  EXPECT_GE(instructions, 0.5 * kMost) << "this is no whole turn, or this bound is old";
}

}  // namespace
}  // namespace tendon::turn_proof_test
