// SPDX-License-Identifier: Apache-2.0
// Counts callgrind instructions, clock readings, and link polls from a state in its mailbox to the force in the other
// mailbox. With real sockets, each poll would be a system call.
#include <gtest/gtest.h>

#include <cstdint>
#include <iostream>
#include <sstream>

#include "tests/support/callgrind.h"
#include "tests/support/instruction_test.h"

namespace tendon::turn_proof_test {
namespace {

constexpr std::uint64_t kTurns = 600;       // turns of the longer run of turn-proof
constexpr double kCounted = 600.0 - 100.0;  // difference of its two run lengths

constexpr double kMost = 9250;  // this is a few percent above the measured value

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
  // There are two polls at each end, the first one without a result, and another one after the server has sent a state.
  EXPECT_EQ(looks, 5 * kTurns);
  // The clock is read after each of the first four polls, after the doorbell, and after the engine's answer.
  EXPECT_EQ(readings, 6 * kTurns);
  EXPECT_LE(instructions, kMost);
  EXPECT_GE(instructions, 0.5 * kMost) << "this is no whole turn, or this bound is old";
}

}  // namespace
}  // namespace tendon::turn_proof_test
