// SPDX-License-Identifier: Apache-2.0
#include "server/recording/solver_paths.h"

#include <gtest/gtest.h>

#include <string>

namespace tendon::solver_paths_test {
namespace {

TEST(SolverPaths, TheSameNameHasTheSameNumberAndANewOneTheNext) {
  SolverPaths ways;
  EXPECT_EQ(ways.number_of("near"), 1);
  EXPECT_EQ(ways.number_of("tabulated"), 2);
  EXPECT_EQ(ways.number_of("near"), 1);
  EXPECT_EQ(ways.number_of("nea"), 3);
  EXPECT_EQ(ways.name_of(1), "near");
  EXPECT_EQ(ways.name_of(2), "tabulated");
  EXPECT_EQ(ways.name_of(3), "nea");
}

TEST(SolverPaths, ANumberThatWasNotGivenOutHasNoName) {
  SolverPaths ways;
  ways.number_of("near");
  for (const int number : {0, 2, static_cast<int>(SolverPaths::kMost), static_cast<int>(SolverPaths::kMost) + 1, 255}) {
    EXPECT_EQ(ways.name_of(static_cast<std::uint8_t>(number)), "") << number;
  }
}

TEST(SolverPaths, WhatIsNoNameOrHasNoRoomHasNoNumber) {
  SolverPaths ways;
  EXPECT_EQ(ways.number_of(""), 0);
  EXPECT_EQ(ways.number_of(std::string(limits::kMaxLabel + 1, 'w')), 0);
  const std::string longest(limits::kMaxLabel, 'w');
  EXPECT_EQ(ways.number_of(longest), 1);
  EXPECT_EQ(ways.name_of(1), longest);
  for (std::size_t i = 2; i <= SolverPaths::kMost; ++i) EXPECT_EQ(ways.number_of("way " + std::to_string(i)), i);
  EXPECT_EQ(ways.number_of("one more"), 0);
  EXPECT_EQ(ways.number_of("way 63"), 63) << "those before keep theirs";
}

}  // namespace
}  // namespace tendon::solver_paths_test
