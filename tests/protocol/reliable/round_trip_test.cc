// SPDX-License-Identifier: Apache-2.0
#include "protocol/reliable/round_trip.h"

#include <gtest/gtest.h>

namespace tendon::round_trip_test {
namespace {

using std::chrono::milliseconds;

TEST(RoundTrip, FollowsRfc6298) {
  RoundTrip round_trip;
  round_trip.observe(milliseconds(80));
  EXPECT_EQ(round_trip.smoothed(), milliseconds(80));
  EXPECT_EQ(round_trip.variation(), milliseconds(40));
  round_trip.observe(milliseconds(160));
  EXPECT_EQ(round_trip.smoothed(), milliseconds(90));   // 80 + 80/8
  EXPECT_EQ(round_trip.variation(), milliseconds(50));  // 40 + (80 − 40)/4
  EXPECT_EQ(round_trip.timeout(milliseconds(20)), milliseconds(290));
}

TEST(RoundTrip, NeverWaitsLessThanTheMinimum) {
  RoundTrip round_trip;
  for (int i = 0; i < 1000; ++i) round_trip.observe(Duration{100});
  EXPECT_EQ(round_trip.timeout(milliseconds(20)), milliseconds(20));
}

TEST(RoundTrip, WaitsAHandshakesWhileBeforeTheFirstSample) {
  EXPECT_EQ(RoundTrip().timeout(milliseconds(20)), RoundTrip::kFirstTimeout);
}

}  // namespace
}  // namespace tendon::round_trip_test
