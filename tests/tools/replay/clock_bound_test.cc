// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/replay/clock_bound.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "tests/support/dice.h"

namespace tendon::replay::clock_bound_test {
namespace {

using namespace std::chrono_literals;

struct Clocks {
  double offset = 0;  // s
  double drift = 0;
  double least_there = 0;
  double least_back = 0;
  double jitter = 0;
  double loss = 0;
  double step = 0;  // s, of the second clock halfway through

  static constexpr double kLength = 120;

  double theta(double t) const { return offset + drift * t + (t > kLength / 2 ? step : 0); }
  static LocalTime at(double t) { return LocalTime(1000s + from_seconds(t)); }

  std::vector<ClockBound> bounds(std::uint64_t seed) const {
    Dice dice(seed);
    std::vector<Crossing> there;
    std::vector<Crossing> back;
    for (double t = 0; t < kLength; t += 0.01) {
      const double went = least_there + jitter * dice.uniform();
      if (!dice.chance(loss)) there.push_back({at(t), from_seconds(went + theta(t + went))});
      const double came = least_back + jitter * dice.uniform();
      if (!dice.chance(loss)) back.push_back({at(t + came), from_seconds(theta(t) - came)});
    }
    std::ranges::sort(there, {}, &Crossing::at);
    std::ranges::sort(back, {}, &Crossing::at);
    return clock_bounds(there, back, 1s);
  }
};

TEST(ClockBound, TheTrueOffsetLiesWithinItWhateverTheNetworkDoes) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Dice dice(seed);
    const Clocks clocks{.offset = dice.within(-1000, 1000),
                        .drift = dice.within(-1.9e-4, 1.9e-4),
                        .least_there = dice.decades(-4, -0.5),
                        .least_back = dice.decades(-4, -0.5),
                        .jitter = dice.decades(-4, -0.5),
                        .loss = dice.within(0, 0.9)};
    const auto bounds = clocks.bounds(seed);
    ASSERT_GT(bounds.size(), 100U);
    const double round_trip = clocks.least_there + clocks.least_back;
    for (const ClockBound& bound : bounds) {
      const double t = seconds(bound.at - Clocks::at(0));
      const double wrong = std::abs(seconds(bound.offset) - clocks.theta(t));
      ASSERT_LE(wrong, seconds(bound.error) + 1e-9) << "seed " << seed << " at " << t;
      ASSERT_GE(seconds(bound.error), round_trip / 2 * (1 - kMostDrift) - 1e-8)
          << "seed " << seed << ": nobody can know that";
    }
  }
}

TEST(ClockBound, IsHalfOfTheLeastRoundTripAndWhatClocksDriftMeanwhile) {
  const Clocks clocks{
      .offset = 5, .drift = 1e-4, .least_there = 50e-6, .least_back = 50e-6, .jitter = 1e-3, .loss = 0.02};
  for (const ClockBound& bound : clocks.bounds(3)) EXPECT_LT(bound.error, 150us);
}

TEST(ClockBound, AClockThatStepsIsFoundOut) {
  const Clocks clocks{.least_there = 1e-3, .least_back = 1e-3, .jitter = 1e-3, .step = 0.1};
  const auto bounds = clocks.bounds(1);
  EXPECT_TRUE(std::ranges::any_of(bounds, [](const ClockBound& bound) { return bound.error < 0s; }));
}

TEST(ClockBound, ClocksThatDriftMoreThanAllowedAreNotBelieved) {
  // A drift of 100 ppm contradicts an allowed drift of zero.
  const Clocks clocks{.drift = 1e-4, .least_there = 1e-4, .least_back = 1e-4};
  std::vector<Crossing> there;
  std::vector<Crossing> back;
  for (double t = 0; t < 120; t += 0.1) {
    there.push_back({Clocks::at(t), from_seconds(1e-4 + clocks.theta(t))});
    back.push_back({Clocks::at(t), from_seconds(clocks.theta(t) - 1e-4)});
  }
  const auto bounds = clock_bounds(there, back, 1s, 0);
  EXPECT_TRUE(std::ranges::any_of(bounds, [](const ClockBound& bound) { return bound.error < 0s; }));
}

TEST(ClockBound, ThereIsNoneWithoutMessagesBothWays) {
  const std::vector<Crossing> one = {{Clocks::at(0), 1ms}};
  EXPECT_TRUE(clock_bounds(one, {}, 1s).empty());
  EXPECT_TRUE(clock_bounds({}, one, 1s).empty());
  EXPECT_EQ(offset_at(clock_bounds(one, {{Clocks::at(0), -1ms}}, 1s), Clocks::at(-5)), 0ms);
}

}  // namespace
}  // namespace tendon::replay::clock_bound_test
