// SPDX-License-Identifier: Apache-2.0
#include "core/control/passive_synthesis.h"

#include <numbers>

#include "tests/core/control/adversary.h"

namespace tendon::passive_synthesis_test {
namespace {

using std::chrono::milliseconds;

constexpr Friction kFriction{0.05, 0.26};

TEST(PassiveSynthesis, ScalesByWhatFrictionAffords) {
  PassiveSynthesis<3> law({kFriction, milliseconds(1), milliseconds(2)});  // 0.26 / 2.5 ms = 104 N/m
  Mat3 stiffness = Mat3::Zero();
  stiffness(0, 1) = 1040;  // not symmetric: the bound uses the largest rate of change of the force
  const LimitedForce<3> limited = law.limit({Vec3(1, -2, 3), stiffness});
  EXPECT_NEAR((limited.force - Vec3(0.1, -0.2, 0.3)).norm(), 0, 1e-12);
  EXPECT_TRUE(limited.reasons.has(Reason::kEnergy));
}

TEST(PassiveSynthesis, LeavesASoftFieldAlone) {
  PassiveSynthesis<1> law({kFriction, milliseconds(1)});
  const LimitedForce<1> limited = law.limit({Vec<1>(3.0), Mat<1>(519.0)});
  EXPECT_EQ(limited.force[0], 3);
  EXPECT_TRUE(limited.reasons.empty());
}

TEST(PassiveSynthesis, StartsFromTheConfiguredSlopeAndKeepsTheSteepest) {
  PassiveSynthesis<1> law({kFriction, milliseconds(1), {}, 1040});
  EXPECT_DOUBLE_EQ(law.limit({Vec<1>(2.0), Mat<1>(100.0)}).force[0], 1);
  EXPECT_DOUBLE_EQ(law.limit({Vec<1>(2.0), Mat<1>(2080.0)}).force[0], 0.5);
  EXPECT_DOUBLE_EQ(law.limit({Vec<1>(2.0), Mat<1>(100.0)}).force[0], 0.5);
}

TEST(PassiveSynthesis, WithoutAnyKnownSlopeThereIsNoForce) {
  PassiveSynthesis<1> law({kFriction, milliseconds(1)});
  const LimitedForce<1> limited = law.limit({Vec<1>(2.0)});
  EXPECT_EQ(limited.force[0], 0);
  EXPECT_TRUE(limited.reasons.has(Reason::kEnergy));
}

template <int N>
int broken(int periods_late, int seeds) {
  return broken_by_static_worlds<N>(
      [&](Friction friction, Duration hold, double stiffest) {
        return PassiveSynthesis<N>({friction, hold, hold * periods_late, stiffest});
      },
      seeds, {}, periods_late);
}

TEST(PassiveSynthesis, NoAdversaryDrawsEnergyFromAStaticField) {
  EXPECT_EQ(broken<1>(0, 300), 0);
  EXPECT_EQ(broken<3>(0, 300), 0);
  EXPECT_EQ(broken<6>(0, 50), 0);
}

TEST(PassiveSynthesis, NoAdversaryDrawsEnergyFromAStaticFieldThatIsLate) {
  EXPECT_EQ(broken<1>(1, 150), 0);
  EXPECT_EQ(broken<1>(7, 150), 0);
  EXPECT_EQ(broken<3>(3, 150), 0);
}

// The hand moves in many slow circles in a spring. In this limit the bound is tight, both with and without delay.
double energy_of_slow_waving(int periods_late, double overclaim) {
  const double viscous = 0.26;
  PassiveSynthesis<1> law({{0, viscous * overclaim}, milliseconds(1), milliseconds(periods_late), 20000});
  EnergyLedger truth({0, viscous});
  World<1> world = [](const Vec<1>& x) { return Demand<1>{Vec<1>(-20000 * x), Mat<1>(20000.0)}; };
  if (periods_late > 0) world = delayed<1>(world, periods_late);
  Vec<1> force(0);
  double before = 0;
  for (int step = 1; step <= 40000; ++step) {
    const double x = 1e-3 * std::sin(2 * std::numbers::pi * step / 400);
    truth.observe(force, Vec<1>(x - before), milliseconds(1));
    law.observe({force, Vec<1>(x - before), milliseconds(1)});
    before = x;
    force = law.limit(world(Vec<1>(x))).force;
  }
  return truth.energy();
}

TEST(PassiveSynthesis, FivePercentTooStiffGivesOutEnergy) {
  for (const int late : {0, 1, 5}) {
    EXPECT_GT(energy_of_slow_waving(late, 1.0), -1e-9) << late;
    EXPECT_LT(energy_of_slow_waving(late, 1.05), -1e-6) << late;
  }
}

}  // namespace
}  // namespace tendon::passive_synthesis_test
