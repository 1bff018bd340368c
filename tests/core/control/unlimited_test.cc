// SPDX-License-Identifier: Apache-2.0
#include "core/control/unlimited.h"

#include "tests/core/control/adversary.h"
#include "tests/core/control/press.h"

namespace tendon::unlimited_test {
namespace {

static_assert(StabilityController<Unlimited<1>, 1>);
static_assert(StabilityController<Unlimited<3>, 3>);
static_assert(StabilityController<Unlimited<6>, 6>);

constexpr Friction kFriction{0.05, 0.26};

TEST(Unlimited, KeepsTheCommonPromises) {
  expect_the_common_promises<1>(Unlimited<1>({kFriction}), kFriction);
  expect_the_common_promises<3>(Unlimited<3>({kFriction}), kFriction);
  expect_the_common_promises<6>(Unlimited<6>({kFriction}), kFriction);
}

TEST(Unlimited, LetsEverythingFiniteThrough) {
  Unlimited<3> law({kFriction});
  const LimitedForce<3> limited = law.limit({Vec3(1e9, -1, 0)});
  EXPECT_EQ(limited.force, Vec3(1e9, -1, 0));
  EXPECT_TRUE(limited.reasons.empty());
  EXPECT_EQ(limited.permitted, std::numeric_limits<double>::infinity());
}

TEST(Unlimited, AlmostEveryAdversaryDrawsEnergy) {
  const auto make = [](Friction friction, Duration) { return Unlimited<3>({friction}); };
  EXPECT_GT(broken_by_hostile_worlds<3>(make, 50), 45);
}

TEST(Unlimited, ShowsASoftWallAsItIsAndIsThrownOffAStiffOne) {
  const Press soft = press(Unlimited<1>({kPressFriction}), 800);
  EXPECT_NEAR(soft.stiffness, 800, 8);
  EXPECT_LT(soft.unrest, 1e-3);
  EXPECT_GT(press(Unlimited<1>({kPressFriction}), 20000).unrest, 0.5);
}

}  // namespace
}  // namespace tendon::unlimited_test
