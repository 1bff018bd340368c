// SPDX-License-Identifier: Apache-2.0
#include "protocol/deadband.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace tendon {
namespace {

using std::chrono::milliseconds;

constexpr LocalTime kStart{std::chrono::seconds(1)};

TEST(Deadband, PassesWhatDiffersByMoreThanATenthAndHoldsBackTheRest) {
  Deadband deadband(Deadband::force());
  EXPECT_TRUE(deadband.passes(kStart, {2, 0, 0}));
  EXPECT_FALSE(deadband.passes(kStart + milliseconds(1), {2.19, 0, 0}));
  EXPECT_FALSE(deadband.passes(kStart + milliseconds(2), {2, 0.19, 0}));
  EXPECT_TRUE(deadband.passes(kStart + milliseconds(3), {2.21, 0, 0}));
  // Measured from what was sent, not from what was held back: slow changes are not lost.
  EXPECT_FALSE(deadband.passes(kStart + milliseconds(4), {2.42, 0, 0}));
  EXPECT_TRUE(deadband.passes(kStart + milliseconds(5), {2.44, 0, 0}));
}

TEST(Deadband, NearZeroTheFloorCounts) {
  Deadband deadband(Deadband::force());
  EXPECT_TRUE(deadband.passes(kStart, {0, 0, 0}));
  EXPECT_FALSE(deadband.passes(kStart + milliseconds(1), {0.049, 0, 0}));
  EXPECT_TRUE(deadband.passes(kStart + milliseconds(2), {0.051, 0, 0}));
}

TEST(Deadband, IsNeverSilentForLongerThanPromised) {
  Deadband deadband({.longest_silence = milliseconds(20)});
  EXPECT_TRUE(deadband.passes(kStart, {1, 0, 0}));
  int sent = 0;
  for (int i = 1; i <= 100; ++i) sent += deadband.passes(kStart + milliseconds(i), {1, 0, 0}) ? 1 : 0;
  EXPECT_EQ(sent, 5);
}

TEST(Deadband, LeavesOutMostOfASlowTouchAndNeverMissesByMoreThanWebersShare) {
  Deadband deadband(Deadband::force());
  Vec3 held = Vec3::Zero();
  int sent = 0;
  for (int i = 0; i < 10'000; ++i) {
    const Vec3 force(2 + std::sin(2 * std::numbers::pi * i / 1000), 0, 0);
    if (deadband.passes(kStart + milliseconds(i), force)) {
      held = force;
      ++sent;
    }
    EXPECT_LE((force - held).norm(), 0.1 * held.norm() + 1e-12);
  }
  EXPECT_LT(sent, 1000);
}

TEST(Deadband, WhatIsNotANumberIsNotHeldBackItIsForTheReceiverToRefuse) {
  Deadband deadband(Deadband::force());
  EXPECT_TRUE(deadband.passes(kStart, {1, 0, 0}));
  EXPECT_TRUE(deadband.passes(kStart + milliseconds(1), {std::nan(""), 0, 0}));
}

TEST(Deadband, RefusesWhatIsImpossible) {
  EXPECT_THROW(Deadband({.share = 1.1}), std::invalid_argument);
  EXPECT_THROW(Deadband({.floor = -1}), std::invalid_argument);
  EXPECT_THROW(Deadband({.longest_silence = Duration(0)}), std::invalid_argument);
}

}  // namespace
}  // namespace tendon
