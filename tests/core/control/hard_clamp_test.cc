// SPDX-License-Identifier: Apache-2.0
#include "core/control/hard_clamp.h"

#include "tests/core/control/adversary.h"
#include "tests/core/control/press.h"

namespace tendon::hard_clamp_test {
namespace {

static_assert(StabilityController<HardClamp<1>, 1>);
static_assert(StabilityController<HardClamp<3>, 3>);
static_assert(StabilityController<HardClamp<6>, 6>);

constexpr Friction kFriction{0.05, 0.26};

TEST(HardClamp, KeepsTheCommonPromises) {
  expect_the_common_promises<1>(HardClamp<1>({kFriction, 8.5}), kFriction);
  expect_the_common_promises<3>(HardClamp<3>({kFriction, 8.5}), kFriction);
  expect_the_common_promises<6>(HardClamp<6>({kFriction, 8.5}), kFriction);
}

TEST(HardClamp, BoundsTheSizeKeepsTheDirectionAndSaysWhy) {
  HardClamp<3> law({kFriction, 5});
  const LimitedForce<3> limited = law.limit({Vec3(30, 0, -40)});
  EXPECT_TRUE(limited.force.isApprox(Vec3(3, 0, -4), 1e-15));
  EXPECT_TRUE(limited.reasons.has(Reason::kMaxForce));
  EXPECT_TRUE(law.limit({Vec3(3, 0, -4)}).reasons.empty());
  EXPECT_LE(law.limit({Vec3(1e300, -1e300, 1e300)}).force.norm(), 5 * (1 + 1e-15));
}

TEST(HardClamp, IsNotPassive) {
  const auto make = [](Friction friction, Duration) { return HardClamp<3>({friction, 5}); };
  EXPECT_GT(broken_by_hostile_worlds<3>(make, 50), 45);
  EXPECT_GT(press(HardClamp<1>({kPressFriction, 8.5}), 20000).unrest, 0.05);
}

TEST(HardClamp, RefusesALimitThatIsNone) {
  EXPECT_NE(complaint([] { HardClamp<3>({kFriction, -1}); }).find("max_force = -1: expected"), std::string::npos);
  EXPECT_THROW(HardClamp<1>({kFriction, std::numeric_limits<double>::infinity()}), std::invalid_argument);
  EXPECT_THROW(HardClamp<1>({{-1, 0.26}, 1}), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::hard_clamp_test
