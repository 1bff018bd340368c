// SPDX-License-Identifier: Apache-2.0
#include "core/ledger/hold_bound.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace tendon::hold_bound_test {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

TEST(HoldBound, WithoutALongerHoldItIsTMaxToTheNanosecond) {
  HoldBound bound(milliseconds(2), {});
  for (const Duration held : {milliseconds(1), milliseconds(2), milliseconds(0), milliseconds(-3)}) {
    bound.observe(held);
    EXPECT_EQ(bound.in_force(), milliseconds(2));
  }
}

TEST(HoldBound, ALongerHoldRaisesItAtOnceByTheMargin) {
  HoldBound bound(milliseconds(2), {.margin = 0.25});
  bound.observe(microseconds(2400));
  EXPECT_EQ(bound.in_force(), milliseconds(3));
  bound.observe(microseconds(2990));
  EXPECT_LT(bound.in_force(), milliseconds(3)) << "within the bound: it comes back";
  bound.observe(microseconds(4000));
  EXPECT_EQ(bound.in_force(), milliseconds(5));
}

TEST(HoldBound, AMachineThatStoppedRaisesItToTheMostAndNotFurther) {
  HoldBound bound(milliseconds(2), {.most = 4});
  bound.observe(std::chrono::hours(1));
  EXPECT_EQ(bound.in_force(), milliseconds(8));
}

TEST(HoldBound, WithoutAMarginTheHoldItselfIsWithinTheBound) {
  HoldBound bound(milliseconds(2), {.margin = 0});
  bound.observe(Duration(2'000'001));
  EXPECT_EQ(bound.in_force(), Duration(2'000'001));
}

TEST(HoldBound, ItComesBackWithItsTimeConstantAndEndsAtTMax) {
  HoldBound bound(milliseconds(2), {.margin = 0, .memory = std::chrono::seconds(10)});
  bound.observe(milliseconds(4));
  for (int ms = 0; ms < 10'000; ++ms) bound.observe(milliseconds(1));
  EXPECT_NEAR(seconds(bound.in_force() - milliseconds(2)), 2e-3 * std::exp(-1), 2e-5);
  for (int ms = 0; ms < 90'000; ++ms) bound.observe(milliseconds(1));
  EXPECT_EQ(bound.in_force(), milliseconds(2));
}

TEST(HoldBound, RefusesImpossibleValues) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(HoldBound(Duration::zero(), {}), std::invalid_argument);
  EXPECT_THROW(HoldBound(milliseconds(1), {.margin = -0.1}), std::invalid_argument);
  EXPECT_THROW(HoldBound(milliseconds(1), {.margin = kNaN}), std::invalid_argument);
  EXPECT_THROW(HoldBound(milliseconds(1), {.memory = Duration::zero()}), std::invalid_argument);
  EXPECT_THROW(HoldBound(milliseconds(1), {.most = 0.9}), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::hold_bound_test
