// SPDX-License-Identifier: Apache-2.0
#include "core/estimation/clock_offset_estimator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <vector>

#include "tests/support/dice.h"

namespace tendon::clock_offset_estimator_test {
namespace {

using std::chrono::hours;
using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr LocalTime kStart{std::chrono::seconds(100)};

struct Hosts {
  Duration offset = hours(1000);
  double drift = 0;
  std::function<Duration(Dice&)> there;
  std::function<Duration(Dice&)> back;
  std::function<Duration(Dice&)> holds = [](Dice&) { return microseconds(200); };

  Duration true_offset(LocalTime at) const { return offset + from_seconds(drift * seconds(at - kStart)); }
  PeerTime peer(LocalTime at) const { return PeerTime(at.time_since_epoch() + true_offset(at)); }

  ClockExchange exchange(LocalTime at, Dice& dice) const {
    const LocalTime heard = at + there(dice);
    const LocalTime answered = heard + holds(dice);
    return {at, peer(heard), peer(answered), answered + back(dice)};
  }
};

/// Bad Wi-Fi: the delay is just above 1 ms, but one in 14 datagrams is in a stall with a long tail.
Duration wifi(Dice& dice) {
  const double little = -0.15e-3 * std::log(1 - dice.uniform());
  const double stall = dice.chance(0.07) ? 4e-3 / (1 - dice.uniform()) : 0;
  return from_seconds(1e-3 + little + std::min(stall, 0.2));
}

struct Score {
  double p50 = 0;  ///< s
  double p99 = 0;
  double round_trip_p99 = 0;
  double broken_bounds = 0;  ///< share of estimates whose error exceeds the bound
};

Score score(const Hosts& hosts, Duration period, Duration length, std::uint64_t seed) {
  Dice dice(seed);
  ClockOffsetEstimator estimator;
  std::vector<double> errors;
  std::vector<double> trips;
  int broken = 0;
  for (LocalTime at = kStart; at < kStart + length; at += period) {
    const ClockExchange exchange = hosts.exchange(at, dice);
    estimator.observe(exchange);
    trips.push_back(seconds(exchange.answered_at - exchange.sent));
    const auto estimate = estimator.estimate(exchange.answered_at);
    const Duration error = std::chrono::abs(estimate->offset - hosts.true_offset(exchange.answered_at));
    errors.push_back(seconds(error));
    broken += error > estimate->error_bound ? 1 : 0;
  }
  std::sort(errors.begin(), errors.end());
  std::sort(trips.begin(), trips.end());
  return {errors[errors.size() / 2], errors[errors.size() * 99 / 100], trips[trips.size() * 99 / 100],
          static_cast<double>(broken) / static_cast<double>(errors.size())};
}

TEST(ClockOffsetEstimator, IsWithin350UsAtP99OverAWifiOf60MsRoundTrip) {
  const Hosts hosts{.drift = 16e-6, .there = wifi, .back = wifi};
  for (const Duration period : {Duration(milliseconds(200)), Duration(milliseconds(20))}) {
    const Score s = score(hosts, period, period * 9000, 1);
    RecordProperty("p99_us", std::to_string(s.p99 * 1e6));
    EXPECT_GT(s.round_trip_p99, 0.05);
    // The documented limit is 350 µs. The measured values are 36 and 16 µs. They would be 119 µs with equal weights,
    // and 275 µs with the newest exchange of each block instead of the best one.
    EXPECT_LT(s.p99, 100e-6) << "p50 " << s.p50 << ", round trip p99 " << s.round_trip_p99;
    EXPECT_EQ(s.broken_bounds, 0);
  }
}

TEST(ClockOffsetEstimator, ItsBoundHoldsForEveryPromisedDriftAndAsymmetry) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Dice dice(seed);
    const double longest_there = dice.decades(-4, -0.7);
    const double longest_back = dice.decades(-4, -0.7);
    const Hosts hosts{.offset = from_seconds(dice.within(-1e6, 1e6)),
                      .drift = dice.within(-190e-6, 190e-6),
                      .there = [=](Dice& d) { return from_seconds(d.within(0, longest_there)); },
                      .back = [=](Dice& d) { return from_seconds(d.within(0, longest_back)); }};
    EXPECT_EQ(score(hosts, dice.milliseconds(1, 500), std::chrono::seconds(60), seed).broken_bounds, 0) << seed;
  }
}

// The peer does not receive anything new, so it echoes our last datagram with an increasing delay.
TEST(ClockOffsetEstimator, ItsBoundHoldsForAPeerThatDelaysAndDrifts) {
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Dice dice(seed);
    const double longest_hold = dice.decades(-3, 0.3);
    const Hosts hosts{.offset = from_seconds(dice.within(-1e6, 1e6)),
                      .drift = dice.chance(0.5) ? 200e-6 : -200e-6,
                      .there = [](Dice& d) { return from_seconds(d.decades(-4, -2)); },
                      .back = [](Dice& d) { return from_seconds(d.decades(-4, -2)); },
                      .holds = [=](Dice& d) { return from_seconds(d.within(0, longest_hold)); }};
    EXPECT_EQ(score(hosts, milliseconds(100), std::chrono::seconds(60), seed).broken_bounds, 0) << seed;
  }
}

TEST(ClockOffsetEstimator, FollowsADriftThatAMinimumAloneWouldFallBehind) {
  const auto constant = [](Dice&) { return Duration(milliseconds(1)); };
  const Hosts hosts{.drift = 100e-6, .there = constant, .back = constant};
  Dice dice(1);
  ClockOffsetEstimator estimator;
  for (int i = 0; i < 600; ++i) estimator.observe(hosts.exchange(kStart + milliseconds(200) * i, dice));
  const LocalTime later = kStart + std::chrono::seconds(130);  // after 10 s, the drift is 1 ms
  const auto estimate = estimator.estimate(later);
  ASSERT_TRUE(estimate);
  EXPECT_NEAR(estimate->drift, 100e-6, 1e-6);
  EXPECT_NEAR(seconds(estimate->offset - hosts.true_offset(later)), 0, 20e-6);
}

TEST(ClockOffsetEstimator, NoticesThatThePeersClockWasSetAndForgetsThePast) {
  const auto constant = [](Dice&) { return Duration(milliseconds(5)); };
  Hosts hosts{.there = constant, .back = constant};
  Dice dice(1);
  ClockOffsetEstimator estimator;
  for (int i = 0; i < 300; ++i) estimator.observe(hosts.exchange(kStart + milliseconds(100) * i, dice));
  EXPECT_EQ(estimator.steps(), 0U);
  hosts.offset += milliseconds(30);
  const ClockExchange after = hosts.exchange(kStart + milliseconds(100) * 300, dice);
  estimator.observe(after);
  EXPECT_EQ(estimator.steps(), 1U);
  EXPECT_EQ(estimator.estimate(after.answered_at)->offset, hosts.true_offset(after.answered_at));
}

TEST(ClockOffsetEstimator, TellsAPeersTimeInOursAndBack) {
  const auto constant = [](Dice&) { return Duration(milliseconds(2)); };
  const Hosts hosts{.there = constant, .back = constant};
  Dice dice(1);
  ClockOffsetEstimator estimator;
  EXPECT_FALSE(estimator.estimate(kStart));
  estimator.observe(hosts.exchange(kStart, dice));
  const auto estimate = *estimator.estimate(kStart);
  EXPECT_EQ(estimate.to_peer(kStart), hosts.peer(kStart));
  EXPECT_EQ(estimate.to_local(hosts.peer(kStart)), kStart);
  EXPECT_EQ(estimate.least_round_trip, milliseconds(4));
  EXPECT_GE(estimate.error_bound, milliseconds(2));
}

TEST(ClockOffsetEstimator, IgnoresExchangesThatCannotHaveBeen) {
  ClockOffsetEstimator estimator;
  const PeerTime peer(hours(3));
  estimator.observe({kStart, peer, peer, kStart - milliseconds(1)});
  estimator.observe({kStart, peer, peer - milliseconds(1), kStart + milliseconds(1)});
  estimator.observe({kStart, peer, peer + milliseconds(9), kStart + milliseconds(1)});
  EXPECT_FALSE(estimator.estimate(kStart));
  EXPECT_THROW(ClockOffsetEstimator(-1e-6), std::invalid_argument);
  EXPECT_THROW(ClockOffsetEstimator(0.02), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::clock_offset_estimator_test
