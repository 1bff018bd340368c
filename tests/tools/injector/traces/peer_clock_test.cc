// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/traces/peer_clock.h"

#include <gtest/gtest.h>

#include <chrono>
#include <random>
#include <stdexcept>

namespace tendon::injector::peer_clock_test {
namespace {

using namespace std::chrono_literals;

LocalTime at(Duration since_zero) { return LocalTime(since_zero); }

TEST(DriftingClock, WithoutFaultsReadsTheTruth) {
  EXPECT_EQ(DriftingClock().reading(at(5s)), at(5s));
  EXPECT_EQ(DriftingClock().truth(at(5s)), at(5s));
}

TEST(DriftingClock, OffsetDriftAndStepsAddUp) {
  const DriftingClock clock({.offset = 5ms, .drift_ppb = 20'000, .steps = {{10s, 3ms}, {20s, -7ms}}}, at(100s));
  EXPECT_EQ(clock.reading(at(100s)), at(100s + 5ms));
  EXPECT_EQ(clock.reading(at(101s)), at(101s + 5ms + 20us));
  EXPECT_EQ(clock.reading(at(110s - 1ns)), at(110s - 1ns + 5ms + 199999ns));
  EXPECT_EQ(clock.reading(at(110s)), at(110s + 8ms + 200us));
  EXPECT_EQ(clock.reading(at(120s)), at(120s + 1ms + 400us));
}

TEST(DriftingClock, DriftIsExactAfterYears) {
  const DriftingClock clock({.offset = {}, .drift_ppb = -1, .steps = {}});
  EXPECT_EQ(clock.reading(at(50 * 365 * 24h)), at(50 * 365 * 24h - 50 * 365 * 24 * 3600ns));
}

TEST(DriftingClock, ATimerRingsWhenAClockThatWasSetBackReadsItsTimeAgain) {
  const DriftingClock clock({.offset = 1s, .drift_ppb = 0, .steps = {{10s, -3s}, {20s, 1s}}});
  EXPECT_EQ(clock.truth(at(10s)), at(9s));
  EXPECT_EQ(clock.truth(at(10s), at(9500ms)), at(9500ms));
  EXPECT_EQ(clock.truth(at(10s), at(10s)), at(12s));
  EXPECT_EQ(clock.truth(at(5s), at(15s)), at(15s));
  EXPECT_EQ(clock.truth(at(19s), at(15s)), at(20s));
}

TEST(DriftingClock, ATimerOfThePeerRingsWhenItsClockFirstReadsSoMuch) {
  std::mt19937_64 random(3);
  for (int run = 0; run < 300; ++run) {
    const auto drift = static_cast<std::int64_t>(random() % 200'000'001) - 100'000'000;
    const auto change = Duration(static_cast<std::int64_t>(random() % 40'000) - 20'000);
    const DriftingClock clock(
        {.offset = Duration(random() % 1000), .drift_ppb = drift, .steps = {{5us, change}, {9us, -change}}}, at(1us));
    for (int i = 0; i < 20; ++i) {
      const LocalTime reading = at(Duration(random() % 20'000));
      const LocalTime truth = clock.truth(reading);
      EXPECT_GE(clock.reading(truth), reading);
      for (Duration earlier = 1ns; earlier < 20us; earlier += 7ns) EXPECT_LT(clock.reading(truth - earlier), reading);
    }
  }
}

TEST(DriftingClock, WhatIsBeyondItsLimitsIsRefused) {
  EXPECT_THROW(DriftingClock({.offset = 24h * 3651, .drift_ppb = 0, .steps = {}}), std::invalid_argument);
  EXPECT_THROW(DriftingClock({.offset = {}, .drift_ppb = 100'000'001, .steps = {}}), std::invalid_argument);
  EXPECT_THROW(DriftingClock({.offset = {}, .drift_ppb = 0, .steps = {{2s, 1s}, {2s, 1s}}}), std::invalid_argument);
  EXPECT_THROW(DriftingClock({.offset = 24h * 3650, .drift_ppb = 0, .steps = {{2s, 1s}}}), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::injector::peer_clock_test
