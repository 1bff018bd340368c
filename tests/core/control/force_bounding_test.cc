// SPDX-License-Identifier: Apache-2.0
#include "core/control/force_bounding.h"

#include "tests/core/control/adversary.h"

namespace tendon::force_bounding_test {
namespace {

using std::chrono::milliseconds;

constexpr Friction kFriction{0.05, 0.26};

// This is Lee & Lee 2009, eq. (8), with f_c = 0.
TEST(ForceBounding, WithoutCoulombFrictionItIsTheAdjustingOutputLimiter) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Dice dice(seed);
    const Friction friction{0, dice.decades(-2, 0)};
    ForceBounding<3> law({friction, milliseconds(2)});
    EnergyLedger ledger(friction);
    Vec3 force = Vec3::Zero();
    for (int step = 0; step < 300; ++step) {
      const Vec3 dx = dice.direction() * dice.decades(-6, -3);
      const Duration held = dice.milliseconds(0.5, 2);
      law.observe({force, dx, held});
      ledger.observe(force, dx, held);
      const LimitedForce<3> limited = law.limit({Vec3(dice.direction() * dice.decades(-2, 2))});
      const double bound = 2 * std::sqrt(friction.viscous / seconds(milliseconds(2)) * ledger.energy());
      ASSERT_DOUBLE_EQ(limited.permitted, bound) << "seed " << seed << " step " << step;
      force = limited.force;
      if (force == Vec3::Zero()) break;  // no-contact rule
    }
  }
}

TEST(ForceBounding, ForgetsWhatFreeMotionEarnedButNeverADebt) {
  ForceBounding<1> law({kFriction, milliseconds(1)});
  for (int i = 0; i < 1000; ++i) law.observe({Vec<1>(0.0), Vec<1>(1e-4), milliseconds(1)});
  EXPECT_DOUBLE_EQ(law.limit({Vec<1>(9.0)}).permitted, 2 * 0.26 * 1e-4 / 1e-3);  // depends only on the last interval
  law.observe({Vec<1>(5.0), Vec<1>(1e-3), milliseconds(1)});
  EXPECT_EQ(law.limit({Vec<1>(9.0)}).permitted, 0);
  law.observe({Vec<1>(0.0), Vec<1>(1e-4), milliseconds(1)});
  EXPECT_EQ(law.limit({Vec<1>(9.0)}).permitted, 0);
}

TEST(MemorylessForceBounding, PermitsTheLastForcePlusTwoBOverTTimesMotion) {
  MemorylessForceBounding<3> law({kFriction, milliseconds(1)});
  const Vec3 force(0.3, -0.2, 0.1);
  const Vec3 dx(1e-4, 2e-4, -3e-4);
  law.observe({force, dx, milliseconds(1)});
  EXPECT_NEAR(law.limit({Vec3(9, 9, 9)}).permitted, (force - 520 * dx).norm(), 1e-14);
}

TEST(MemorylessForceBounding, AHoldLongerThanAgreedIsCreditedWithItsFriction) {
  MemorylessForceBounding<1> law({kFriction, milliseconds(1)});
  law.observe({Vec<1>(0.0), Vec<1>(1e-3), milliseconds(4)});
  EXPECT_NEAR(law.limit({Vec<1>(9.0)}).permitted, 2 * std::sqrt(260 * 0.26 * 1e-6 / 4e-3), 1e-12);
}

TEST(MemorylessForceBounding, TheLedgerCoversTheWorstThatTheNextHoldCanDo) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Dice dice(seed);
    MemorylessForceBounding<3> law({kFriction, milliseconds(1)});
    Vec3 force = Vec3::Zero();
    for (int step = 0; step < 300; ++step) {
      const Duration held = dice.milliseconds(0.2, 1);
      const Vec3 dx =
          dice.chance(0.4) ? worst_motion<3>(force, {0, 0.26}, held) : Vec3(dice.direction() * dice.decades(-6, -2.5));
      law.observe({force, dx, held});
      force = law.limit({Vec3(dice.direction() * dice.decades(-1, 3))}).force;
      ASSERT_GE(law.energy(), force.squaredNorm() * 1e-3 / (4 * 0.26) - 1e-12) << "seed " << seed << " step " << step;
    }
  }
}

TEST(MemorylessForceBounding, AHeldForceLosesWhatTheHandHasComeBackAndNoMore) {
  MemorylessForceBounding<1> law({kFriction, milliseconds(1)});
  Dice dice(3);
  Vec<1> force(-2.0);
  double x = 0;
  double deepest = 0;
  for (int step = 0; step < 2000; ++step) {
    const double dx = dice.within(-1e-3, 1e-3) - x;  // oscillates about one position
    law.observe({force, Vec<1>(dx), milliseconds(1)});
    x += dx;
    deepest = std::max(deepest, x);
    force = law.limit({Vec<1>(-2.0)}).force;
    ASSERT_GE(-force[0], 2.0 - 520 * (deepest - x) - 1e-9);
  }
}

TEST(MemorylessForceBounding, AForceDoesNotAppearWhileTheHandIsAtRest) {
  MemorylessForceBounding<1> law({kFriction, milliseconds(1)});
  for (int step = 0; step < 100; ++step) {
    law.observe({Vec<1>(0.0), Vec<1>(0.0), milliseconds(1)});
    ASSERT_EQ(law.limit({Vec<1>(-2.0)}).force[0], 0);
  }
}

// f_c must be zero. Otherwise the unclaimed Coulomb friction would compensate for the overclaimed viscous friction.
template <class Law>
double least_energy(double overclaim) {
  double least = 0;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Dice dice(seed);
    Adversary adversary{.friction = {0, 0.26}, .jitter = false, .clamps = false, .overlooks = false};
    Law law({{0, 0.26 * overclaim}, adversary.longest_hold});
    least = std::min(least, run_adversary<3>(law, adversary, hostile_world<3>(dice), dice).least_energy);
  }
  return least;
}

TEST(ForceBounding, ABoundOnePercentTooHighIsBrokenWithMemoryAndWithout) {
  EXPECT_GE(least_energy<ForceBounding<3>>(1.0), -1e-12);
  EXPECT_LT(least_energy<ForceBounding<3>>(1.01), -1e-8);
  EXPECT_GE(least_energy<MemorylessForceBounding<3>>(1.0), -1e-12);
  EXPECT_LT(least_energy<MemorylessForceBounding<3>>(1.01), -1e-8);
}

}  // namespace
}  // namespace tendon::force_bounding_test
