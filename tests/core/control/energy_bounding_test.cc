// SPDX-License-Identifier: Apache-2.0
#include "core/control/energy_bounding.h"

#include "tests/core/control/adversary.h"

namespace tendon::energy_bounding_test {
namespace {

using std::chrono::milliseconds;

constexpr Friction kFriction{0.05, 0.26};
constexpr double kSlope = 260;  // b/T, N/m

template <int N>
void expect_both_conditions(double c1, double c2) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Dice dice(seed);
    EnergyBounding<N> law({kFriction, milliseconds(1), c1, c2});
    Vec<N> f = Vec<N>::Zero();
    double sum = 0;  // Σ f(n)·Δx(n)
    double scale = 1;
    for (int step = 0; step < 500; ++step) {
      const Vec<N> dx = random_direction<N>(dice) * dice.decades(-6, -2.5);
      law.observe({Vec<N>(-f), dx, milliseconds(1)});
      const Vec<N> now = -law.limit({Vec<N>(random_direction<N>(dice) * dice.decades(-1, 3))}).force;
      ASSERT_LE(now.dot(dx), f.dot(dx) + c1 * dx.squaredNorm() + 1e-12 * scale);
      ASSERT_LE(now.squaredNorm(), f.squaredNorm() + 2 * c2 * now.dot(dx) + 1e-12 * scale);
      sum += now.dot(dx);
      scale += std::abs(now.dot(dx)) + now.squaredNorm();
      ASSERT_GE(sum, now.squaredNorm() / (2 * c2) - 1e-12 * scale);
      f = now;
    }
  }
}

TEST(EnergyBounding, TheSumOfForceTimesMotionCoversWhatIsStored) {
  expect_both_conditions<1>(kSlope, kSlope);
  expect_both_conditions<1>(kSlope, kSlope / 2);
  expect_both_conditions<3>(kSlope, kSlope);
  expect_both_conditions<3>(kSlope / 2, kSlope / 3);
  expect_both_conditions<6>(kSlope, kSlope);
}

TEST(EnergyBounding, NoOtherFeasibleForceIsNearerToTheWantedOne) {
  Dice dice(7);
  for (int run = 0; run < 2000; ++run) {
    EnergyBounding<3> law({kFriction, milliseconds(1)});
    const Vec3 before = dice.direction() * dice.decades(-2, 1);
    const Vec3 dx = dice.direction() * dice.decades(-4, -1);
    const Vec3 wanted = dice.direction() * dice.decades(-2, 1.5);
    law.observe({-before, dx, milliseconds(1)});
    const double distance = (-law.limit({-wanted}).force - wanted).norm();
    if (distance < 1e-12) continue;
    for (int i = 0; i < 50; ++i) {
      const Vec3 other = wanted + dice.direction() * distance * 0.999 * dice.uniform();
      const bool feasible = other.dot(dx) <= before.dot(dx) + kSlope * dx.squaredNorm() &&
                            other.squaredNorm() <= before.squaredNorm() + 2 * kSlope * other.dot(dx);
      ASSERT_FALSE(feasible) << "run " << run;
    }
  }
}

// A slow entry costs the stored energy. If c1 is larger than b/T, leaving in one step returns (c1 − b/T) Δx².
double energy_after_creeping_in_and_stepping_out(double overclaim) {
  EnergyBounding<1> law({{0, kFriction.viscous * overclaim}, milliseconds(1)});
  EnergyLedger truth({0, kFriction.viscous});
  Vec<1> force(0);
  const auto move = [&](double dx) {
    law.observe({force, Vec<1>(dx), milliseconds(1)});
    truth.observe(force, Vec<1>(dx), milliseconds(1));
    force = law.limit({Vec<1>(-1e6)}).force;
  };
  for (int i = 0; i < 1000; ++i) move(1e-5);
  for (int cycle = 0; cycle < 300; ++cycle) {
    for (int i = 0; i < 250; ++i) move(1e-6);
    move(-2.5e-4);
  }
  for (int i = 0; i < 5000 && force[0] < -1e-6; ++i) move(-1e-5);
  return truth.energy();
}

TEST(EnergyBounding, ASlopeFivePercentAboveBOverTGivesOutEnergy) {
  EXPECT_GE(energy_after_creeping_in_and_stepping_out(1.0), 0);
  EXPECT_LT(energy_after_creeping_in_and_stepping_out(1.05), 0);
}

TEST(EnergyBounding, AForceThatNobodyWantsAnyMoreGoesWhileTheHandIsAtRest) {
  EnergyBounding<3> law({kFriction, milliseconds(1)});
  law.observe({Vec3(1, 0, 0), Vec3::Zero(), milliseconds(1)});
  EXPECT_EQ(law.limit({Vec3::Zero()}).force, Vec3::Zero());
  EXPECT_NEAR(law.limit({Vec3(0, 9, 0)}).force.norm(), 1, 1e-15);
}

}  // namespace
}  // namespace tendon::energy_bounding_test
