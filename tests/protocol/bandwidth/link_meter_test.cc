// SPDX-License-Identifier: Apache-2.0
#include "protocol/bandwidth/link_meter.h"

#include <gtest/gtest.h>

namespace tendon::link_meter_test {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr LocalTime kStart{seconds(100)};
const ClockOffsetEstimator::Estimate kClock{.offset = seconds(7)};

ClockExchange exchange(LocalTime sent, Duration there, Duration back) {
  const PeerTime received = kClock.to_peer(sent + there);
  return {.sent = sent,
          .received = received,
          .answered = received + milliseconds(3),
          .answered_at = sent + there + milliseconds(3) + back};
}

TEST(LinkMeter, TellsMedianAndP99OfEachWayByThePeersClock) {
  LinkMeter meter(kStart);
  for (int i = 1; i <= 100; ++i) {
    meter.observe(exchange(kStart + milliseconds(i), milliseconds(i), milliseconds(20)), kClock);
  }
  const auto report = meter.report(kStart + seconds(1));
  EXPECT_EQ(report.to_peer->median, milliseconds(50));
  EXPECT_EQ(report.to_peer->p99, milliseconds(99));
  EXPECT_EQ(report.from_peer->median, milliseconds(20));
  EXPECT_EQ(report.round_trip->median, milliseconds(70));
  EXPECT_EQ(report.round_trip->p99, milliseconds(119));
}

TEST(LinkMeter, AnExchangeToldAgainIsOneWayThereAndSeveralWaysBack) {
  LinkMeter meter(kStart);
  for (int i = 0; i < 10; ++i) meter.observe(exchange(kStart, milliseconds(10), milliseconds(40)), kClock);
  for (int i = 1; i < 3; ++i) {
    meter.observe(exchange(kStart + milliseconds(i), milliseconds(90), milliseconds(20)), kClock);
  }
  const auto report = meter.report(kStart + seconds(1));
  EXPECT_EQ(report.to_peer->median, milliseconds(90));    // 10, 90, 90
  EXPECT_EQ(report.from_peer->median, milliseconds(40));  // ten are 40 ms, two are 20 ms
}

TEST(LinkMeter, ForgetsWithEachReportAndSaysNothingOfWhatItDidNotSee) {
  LinkMeter meter(kStart);
  meter.observe(exchange(kStart, milliseconds(10), milliseconds(20)), kClock);
  EXPECT_TRUE(meter.report(kStart).round_trip.has_value());
  const auto nothing = meter.report(kStart + seconds(1));
  EXPECT_FALSE(nothing.round_trip || nothing.to_peer || nothing.from_peer);
}

TEST(LinkMeter, TheLongestGapIsBetweenTwoDatagramsOrSinceTheLast) {
  LinkMeter meter(kStart);
  for (const int at : {10, 60, 80}) meter.heard(kStart + milliseconds(at));
  EXPECT_EQ(meter.report(kStart + milliseconds(100)).longest_gap, milliseconds(50));
  EXPECT_EQ(meter.report(kStart + milliseconds(300)).longest_gap, milliseconds(220));
  meter.heard(kStart + milliseconds(310));
  EXPECT_EQ(meter.report(kStart + milliseconds(310)).longest_gap, milliseconds(230));  // began in the previous report
}

TEST(LinkMeter, AFloodIsThinnedEvenlyAndItsQuantilesHold) {
  LinkMeter meter(kStart);
  for (int i = 1; i <= 100'000; ++i) {
    meter.observe(exchange(kStart + microseconds(i), microseconds(i), milliseconds(1)), kClock);
  }
  const auto report = meter.report(kStart + seconds(1));
  EXPECT_NEAR(tendon::seconds(report.to_peer->median), 50e-3, 0.2e-3);
  EXPECT_NEAR(tendon::seconds(report.to_peer->p99), 99e-3, 0.2e-3);
}

}  // namespace
}  // namespace tendon::link_meter_test
