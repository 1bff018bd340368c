// SPDX-License-Identifier: Apache-2.0
#include "core/control/force_limits.h"

#include <gtest/gtest.h>

#include <limits>

namespace tendon::force_limits_test {
namespace {

using std::chrono::milliseconds;

TEST(Saturate, KeepsTheDirectionAndSaysWhy) {
  const Limited limited = saturate(Vec3(3, 4, 0), 2.5);
  EXPECT_NEAR((limited.force - Vec3(1.5, 2, 0)).norm(), 0, 1e-15);
  EXPECT_TRUE(limited.reasons.has(Reason::kMaxForce));
  EXPECT_TRUE(saturate(Vec3(3, 4, 0), 5).reasons.empty());
}

TEST(SlewLimit, BoundsTheChangeNotTheForce) {
  const Limited limited = limit_slew(Vec3(9, 0, 0), Vec3(8, 0, 0), 500, milliseconds(1));
  EXPECT_DOUBLE_EQ(limited.force.x(), 8.5);
  EXPECT_TRUE(limited.reasons.has(Reason::kSlew));
}

TEST(SlewLimit, BoundsADropAsItBoundsARise) {
  EXPECT_DOUBLE_EQ(limit_slew(Vec3(0, 0, 0), Vec3(8, 0, 0), 500, milliseconds(1)).force.x(), 7.5);
}

TEST(SlewLimit, AnInfiniteRateChangesNothing) {
  const Limited limited =
      limit_slew(Vec3(9, 0, 0), Vec3(-8, 0, 0), std::numeric_limits<double>::infinity(), milliseconds(1));
  EXPECT_EQ(limited.force, Vec3(9, 0, 0));
  EXPECT_TRUE(limited.reasons.empty());
}

TEST(SlewLimit, AnInfiniteRateChangesNothingEvenInNoTime) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(limit_slew(Vec3(9, 0, 0), Vec3::Zero(), kInf, Duration::zero()).force, Vec3(9, 0, 0));
}

TEST(Reasons, AreReadable) {
  Reasons reasons = Reason::kEnergy;
  reasons |= Reason::kSlew;
  EXPECT_EQ(to_string(reasons), "energy, slew");
  EXPECT_EQ(to_string(Reasons{}), "");
}

}  // namespace
}  // namespace tendon::force_limits_test
