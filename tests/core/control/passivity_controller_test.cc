// SPDX-License-Identifier: Apache-2.0
#include "core/control/passivity_controller.h"

#include <Eigen/Geometry>

#include "tests/core/control/adversary.h"
#include "tests/core/control/press.h"

namespace tendon::passivity_controller_test {
namespace {

using std::chrono::milliseconds;
using enum PassivityObserver;

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr Friction kFriction{0.05, 0.26};

// The energy that the law observes for a spring under random motion, and the minimum of the ledger.
struct Seen {
  double worst_of_sum = 0;  // J, |observed − (K x²/2 ± K/2 Σ Δx²)|
  double least_observed = 0;
  double least_ledger = 0;
  int interventions = 0;
};

template <class Law>
Seen watch_a_spring(Law law, double sign_of_leak) {
  constexpr double kStiffness = 20000;
  Dice dice(11);
  Seen seen;
  Vec<1> force(0);
  double x = 0;
  double squares = 0;
  for (int step = 0; step < 3000; ++step) {
    const double dx = dice.within(-1e-3, 1e-3) - 0.3 * x;
    law.observe({force, Vec<1>(dx), milliseconds(1)});
    x += dx;
    squares += dx * dx;
    const LimitedForce<1> limited = law.limit({Vec<1>(-kStiffness * x), Mat<1>(kStiffness)});
    if (!limited.reasons.empty()) ++seen.interventions;
    force = Vec<1>(-kStiffness * x);  // the unlimited spring
    seen.worst_of_sum =
        std::max(seen.worst_of_sum, std::abs(law.observed() - kStiffness * (x * x + sign_of_leak * squares) / 2));
    seen.least_observed = std::min(seen.least_observed, law.observed());
    seen.least_ledger = std::min(seen.least_ledger, law.energy());
  }
  return seen;
}

TEST(PassivityController, AsPublishedItNeverSeesTheLeakOfASampledSpring) {
  const Seen seen = watch_a_spring(PassivityController<1>({kFriction, kSameSample, kInf}), +1);
  EXPECT_LT(seen.worst_of_sum, 1e-9);
  EXPECT_GE(seen.least_observed, 0);
  EXPECT_EQ(seen.interventions, 0);
  EXPECT_LT(seen.least_ledger, -1);
}

TEST(PassivityController, TheZohExactObserverSeesTheLeakAndActs) {
  const Seen seen = watch_a_spring(PassivityController<1>({kFriction, kZohExact, 1e-9}), -1);
  EXPECT_LT(seen.worst_of_sum, 1e-9);
  EXPECT_LT(seen.least_observed, -1);
  EXPECT_GT(seen.interventions, 100);
}

TEST(PassivityController, DampsAsMuchAsIsMissing) {
  PassivityController<3> law({kFriction, kZohExact, kInf});
  const Vec3 dx(1e-3, -2e-3, 0.5e-3);
  const Vec3 held(0.3, 0.1, 0);
  const Vec3 wanted(0.7, -0.2, 0.4);
  law.observe({held, dx, milliseconds(2)});
  const double predicted = -held.dot(dx) - wanted.dot(dx);
  ASSERT_LT(predicted, 0);
  const LimitedForce<3> limited = law.limit({wanted});
  EXPECT_NEAR(law.observed() - limited.force.dot(dx), 0, 1e-15);
  EXPECT_NEAR((limited.force - wanted).cross(dx).norm(), 0, 1e-15);
  EXPECT_TRUE(limited.reasons.has(Reason::kEnergy));
}

TEST(PassivityController, NeitherDividesByZeroSpeedNorDampsMoreThanItMay) {
  PassivityController<1> law({kFriction, kZohExact, 5, 1e-3});
  law.observe({Vec<1>(100.0), Vec<1>(0.99e-6), milliseconds(1)});
  EXPECT_EQ(law.limit({Vec<1>(1.0)}).force[0], 1);
  law.observe({Vec<1>(100.0), Vec<1>(1e-3), milliseconds(1)});
  EXPECT_DOUBLE_EQ(law.limit({Vec<1>(1.0)}).force[0], 1 - 5 * 1.0);
  EXPECT_EQ(series_damping(1, 0, milliseconds(1), 0, kInf), 0);
  EXPECT_EQ(series_damping(1, 1, Duration::zero(), 0, kInf), 0);
}

TEST(PassivityController, AsPublishedAStiffWallStillThrowsTheHandOff) {
  const Press published = press(PassivityController<1>({kPressFriction, kSameSample, kInf}), 20000);
  EXPECT_GT(published.unrest, 0.5);
  EXPECT_LT(published.least_work, -0.1);
}

// 2m/T = 250 N·s/m for the mass of device and hand.
TEST(PassivityController, ADamperWithoutLimitGivesBurstsUpToMaxForce) {
  const Press result = press(PassivityController<1>({kPressFriction, kZohExact, kInf}), 20000);
  EXPECT_GT(result.peak_force, 50);
  EXPECT_GT(result.unrest, 0.02);
}

TEST(ParallelPassivityController, TheEnvironmentIsLeftBehindByWhatIsMissing) {
  ParallelPassivityController<1> law({kFriction, kZohExact, kInf});
  law.observe({Vec<1>(1.0), Vec<1>(1e-3), milliseconds(1)});  // 1 mJ generated
  const LimitedForce<1> limited = law.limit({Vec<1>(-4.0), Mat<1>(1000.0)});
  // In this interval Σ f Δx is −1 mJ, and another such interval at 4 N adds 4 mJ, so no damping is needed.
  EXPECT_EQ(limited.force[0], -4);
  law.observe({Vec<1>(-4.0), Vec<1>(-0.5e-3), milliseconds(1)});  // −3 mJ
  const double missing = 3e-3 + 3.5 * 0.5e-3;
  const LimitedForce<1> leaving = law.limit({Vec<1>(-3.5), Mat<1>(1000.0)});
  EXPECT_NEAR(law.offset()[0], missing / 3.5, 1e-12);
  EXPECT_NEAR(leaving.force[0], -3.5 + 1000 * law.offset()[0], 1e-12);
  EXPECT_TRUE(leaving.reasons.has(Reason::kEnergy));
}

TEST(ParallelPassivityController, AsPublishedItIsAsBlindAsTheSeriesForm) {
  const Seen seen = watch_a_spring(ParallelPassivityController<1>({kFriction, kSameSample, kInf}), +1);
  EXPECT_LT(seen.worst_of_sum, 1e-9);
  EXPECT_EQ(seen.interventions, 0);
}

TEST(ParallelPassivityController, AsPublishedItCountsTheEnvironmentsMotion) {
  ParallelPassivityController<1> law({kFriction, kSameSample, kInf});
  law.observe({Vec<1>(0.0), Vec<1>(1e-3), milliseconds(1)});
  EXPECT_NEAR(law.limit({Vec<1>(4.0), Mat<1>(1000.0)}).force[0], 3, 1e-12);
  EXPECT_NEAR(law.observed(), -4e-3, 1e-15);
  law.observe({Vec<1>(3.0), Vec<1>(1e-3), milliseconds(1)});
  EXPECT_NEAR(law.limit({Vec<1>(0.0), Mat<1>(1000.0)}).force[0], -1, 1e-12);
  EXPECT_NEAR(law.observed(), -4e-3 + 1 * (1e-3 + 1e-3) + 4e-3, 1e-15);
}

TEST(ParallelPassivityController, HandDriftsFromEnvironmentUntilContactEnds) {
  ParallelPassivityController<1> law({kFriction, kZohExact, kInf});
  Vec<1> force(0);
  const auto move = [&](double dx, double x) {
    law.observe({force, Vec<1>(dx), milliseconds(1)});
    force = law.limit({Vec<1>(-20000 * x), Mat<1>(x > 0 ? 20000.0 : 0.0)}).force;
  };
  for (int i = 0; i < 200; ++i) move(i % 2 == 0 ? 1e-3 : -0.9e-3, i % 2 == 0 ? 1e-3 : 1e-4);
  EXPECT_GT(law.offset()[0], 1e-5);
  move(-2e-4, 0);
  EXPECT_EQ(law.offset()[0], 0);
  EXPECT_EQ(force[0], 0);
}

TEST(ParallelPassivityController, WithoutAStiffnessItChangesNothing) {
  ParallelPassivityController<3> law({kFriction, kZohExact, kInf});
  law.observe({Vec3(5, 0, 0), Vec3(1e-3, 0, 0), milliseconds(1)});
  EXPECT_EQ(law.limit({Vec3(5, 1, 0)}).force, Vec3(5, 1, 0));
}

}  // namespace
}  // namespace tendon::passivity_controller_test
