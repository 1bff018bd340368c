// SPDX-License-Identifier: Apache-2.0
#include "core/ledger/output_bound.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "core/ledger/energy_ledger.h"
#include "tests/support/dice.h"

namespace tendon::output_bound_test {
namespace {

using std::chrono::milliseconds;
using Vec1 = Eigen::Matrix<double, 1, 1>;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr Friction kFriction{0.05, 0.26};
const OutputBound kBound = OutputBound::of(kFriction, milliseconds(1));

TEST(OutputBound, PermitsEquationEight) {
  EXPECT_DOUBLE_EQ(kBound.largest(0.01), 0.05 + 2 * std::sqrt(0.26 * 0.01 / 0.001));
}

TEST(OutputBound, TheFirstForceAllowedIsFrictionOnly) {
  const auto limited = kBound.limit<3>(Vec3(10, 0, 0), 0);
  EXPECT_DOUBLE_EQ(limited.force.norm(), 0.05);
  EXPECT_TRUE(limited.reasons.has(Reason::kEnergy));
}

TEST(OutputBound, WithoutFrictionNothingIsRenderedUntilMotionHasEarnedIt) {
  const OutputBound frictionless = OutputBound::of({0, 0.26}, milliseconds(1));
  EXPECT_EQ(frictionless.limit<3>(Vec3(10, 0, 0), 0).force.norm(), 0);
  EXPECT_GT(frictionless.limit<3>(Vec3(10, 0, 0), 1e-6).force.norm(), 0);
}

TEST(OutputBound, NegativeEnergyPermitsFrictionOnly) {
  EXPECT_EQ(kBound.largest(-1), 0.05);
  EXPECT_EQ(kBound.largest(kNaN), 0.05);
}

TEST(OutputBound, LeavesAForceWithinTheBoundAloneAndGivesNoReason) {
  const auto limited = kBound.limit<3>(Vec3(0.5, -1, 0.25), 0.01);
  EXPECT_EQ(limited.force, Vec3(0.5, -1, 0.25));
  EXPECT_TRUE(limited.reasons.empty());
}

TEST(OutputBound, KeepsTheDirection) {
  const Vec3 wanted(35.9, 2.0, -7.0);
  const auto limited = kBound.limit<3>(wanted, 0.01);
  EXPECT_NEAR(limited.force.norm(), kBound.largest(0.01), 1e-12);
  EXPECT_NEAR(limited.force.normalized().dot(wanted.normalized()), 1, 1e-15);
}

TEST(OutputBound, NotANumberBecomesZeroWithTheReason) {
  for (const double bad : {kNaN, kInf, -kInf}) {
    const auto limited = kBound.limit<3>(Vec3(0.1, bad, 0), 1);
    EXPECT_EQ(limited.force, Vec3::Zero());
    EXPECT_TRUE(limited.reasons.has(Reason::kNotFinite));
  }
}

TEST(OutputBound, AMillionNewtonAndMoreStayWithinTheBound) {
  for (const double size : {1e6, 1e100, 1e300}) {
    EXPECT_LE(kBound.limit<3>(Vec3(size, -size, size), 0.01).force.norm(), kBound.largest(0.01) * (1 + 1e-15));
  }
}

TEST(OutputBound, RefusesAHoldOfNoLength) {
  EXPECT_THROW(OutputBound::of(kFriction, Duration::zero()), std::invalid_argument);
}

Vec3 worst_motion(const Vec3& force, const Friction& friction, Duration held) {
  const double size = force.norm();
  if (size <= friction.coulomb) return Vec3::Zero();
  return force / size * (seconds(held) * (size - friction.coulomb) / (2 * friction.viscous));
}

// Returns the minimum energy after random and worst-case steps. `scale` is the ratio of the forces to the bound.
double least_energy_against_adversary(double scale, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  EnergyLedger ledger(kFriction);
  Vec3 force = Vec3::Zero();
  double least = 0;
  for (int step = 0; step < 4000; ++step) {
    Vec3 dx = worst_motion(force, kFriction, milliseconds(1));
    if (uniform() < 0.5)
      dx = Vec3(uniform() - 0.5, uniform() - 0.5, uniform() - 0.5) * std::pow(10, -7 + 5 * uniform());
    least = std::min(least, ledger.observe(force, dx, milliseconds(1)));
    const Vec3 wanted = Vec3(uniform() - 0.5, uniform() - 0.5, uniform() - 0.5) * std::pow(10, -1 + 4 * uniform());
    force = wanted * std::min(1.0, scale * kBound.largest(ledger.energy()) / wanted.norm());
    if (scale == 1.0) force = kBound.limit<3>(wanted, ledger.energy()).force;
  }
  return least;
}

TEST(OutputBound, TheWorstMotionCannotMakeTheEnergyNegative) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    ASSERT_GE(least_energy_against_adversary(1.0, seed), -1e-12) << "seed " << seed;
  }
}

TEST(OutputBound, ABoundOnePercentHigherIsBrokenByTheWorstMotion) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    ASSERT_LT(least_energy_against_adversary(1.01, seed), -1e-6) << "seed " << seed;
  }
}

// core/PROOFS.md, "Several coordinates": motion along x only, then a demand of (35.9, 2.0) N.
TEST(OutputBound, OnlyTheJointFormIsTheSameInEveryFrame) {
  const auto after_pushing_along_x = [](double angle, bool joint) {
    const Eigen::Rotation2D<double> turn(angle);
    const auto turned = [&turn](double x, double y) -> Vec3 {
      const Eigen::Vector2d v = turn * Eigen::Vector2d(x, y);
      return {v.x(), v.y(), 0};
    };
    EnergyLedger all(kFriction);
    std::array<EnergyLedger, 2> axes = {EnergyLedger(kFriction), EnergyLedger(kFriction)};
    const Vec3 dx = turned(0.05e-3, 0);
    for (int i = 0; i < 300; ++i) {
      all.observe(Vec3::Zero().eval(), dx, milliseconds(1));
      for (std::size_t axis = 0; axis < 2; ++axis) {
        axes[axis].observe(Vec1(0), Vec1(dx[static_cast<int>(axis)]), milliseconds(1));
      }
    }
    const Vec3 wanted = turned(35.9, 2.0);
    Vec3 force = Vec3::Zero();
    if (joint) {
      force = kBound.limit<3>(wanted, all.energy()).force;
    } else {
      for (int axis = 0; axis < 2; ++axis) {
        force[axis] = kBound.limit<1>(Vec1(wanted[axis]), axes[static_cast<std::size_t>(axis)].energy()).force[0];
      }
    }
    return Eigen::Vector2d(turn.inverse() * force.head<2>());
  };
  const Eigen::Vector2d upright = after_pushing_along_x(0, true);
  EXPECT_NEAR(upright.y() / upright.x(), 2.0 / 35.9, 1e-12);
  for (const double angle : {0.26, 0.52, 0.79, 2.0}) {
    EXPECT_NEAR((after_pushing_along_x(angle, true) - upright).norm(), 0, 1e-12);
    EXPECT_GT((after_pushing_along_x(angle, false) - after_pushing_along_x(0, false)).norm(), 1e-3);
  }
}

// core/PROOFS.md, "Operational stiffness".
TEST(OutputBound, NeverClipsASpringSofterThanTwoBOverT) {
  std::mt19937_64 random(4);
  const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  for (int run = 0; run < 150; ++run) {
    const double stiffness = uniform() * 2 * kFriction.viscous / 1e-3;
    EnergyLedger ledger(kFriction);
    double x = 0;
    double speed = 0;
    Vec1 force(0);
    for (int step = 0; step < 2000; ++step) {
      speed += (uniform() - 0.5) * 0.02 - 0.01 * speed - 0.5 * x;
      const double dx = speed * 1e-3;
      ledger.observe(force, Vec1(dx), milliseconds(1));
      x += dx;
      const auto limited = kBound.limit<1>(Vec1(-stiffness * x), ledger.energy());
      ASSERT_TRUE(limited.reasons.empty()) << "run " << run << " step " << step;
      force = limited.force;
    }
  }
}

// core/PROOFS.md, "Operational stiffness": a slow, saturated push displays 2b/T for any wall stiffness.
TEST(OutputBound, ShowsAStiffWallAsASpringOfTwoBOverT) {
  const Friction friction{0.0, 0.26};
  const OutputBound bound = OutputBound::of(friction, milliseconds(1));
  EnergyLedger ledger(friction);
  Vec1 force(0);
  const double dx = 5e-6;
  for (int step = 0; step < 4000; ++step) {
    ledger.observe(force, Vec1(dx), milliseconds(1));
    force = bound.limit<1>(Vec1(-1e6), ledger.energy()).force;
  }
  EXPECT_NEAR(-force[0] / (4000 * dx), 2 * 0.26 / 1e-3, 15);
}

TEST(OutputBound, TheLargestScaleSpendsTheBudgetAndNotMore) {
  Dice dice(17);
  for (int trial = 0; trial < 2000; ++trial) {
    std::array<OutputBound, 6> bounds;
    std::array<double, 6> sizes;
    for (std::size_t i = 0; i < 6; ++i) {
      bounds[i] = {.coulomb = dice.chance(0.3) ? 0 : dice.decades(-3, 0),
                   .viscous_per_hold = dice.chance(0.1) ? 0 : dice.decades(-1, 3),
                   .reach = dice.chance(0.5)   ? kInf
                            : dice.chance(0.1) ? 0
                                               : dice.decades(-6, -2)};
      sizes[i] = dice.chance(0.1) ? 0 : dice.decades(-2, 2);
    }
    const double budget = dice.chance(0.1) ? 0 : dice.decades(-9, 1);
    const double scale = largest_scale(bounds, sizes, budget);
    const auto loss = [&](double at) {
      double sum = 0;
      for (std::size_t i = 0; i < 6; ++i) sum += bounds[i].at(at * sizes[i]);
      return sum;
    };
    if (std::isinf(scale)) {
      EXPECT_EQ(loss(1e12), 0);
      continue;
    }
    EXPECT_LE(loss(scale * (1 - 1e-12)), budget * (1 + 1e-9));
    if (scale > 0) {
      EXPECT_GT(loss(scale * (1 + 1e-6)), budget);
    }
  }
}

// Regression: with a budget of 2e-42 J, a corner rounded to just above f_c left the wrench unbounded.
TEST(OutputBound, AlmostNoBudgetPermitsFrictionAndNoMoreThanEachPartAlone) {
  Dice dice(29091);
  for (int trial = 0; trial < 20000; ++trial) {
    std::array<OutputBound, 2> bounds;
    std::array<double, 2> sizes;
    double friction = kInf;
    for (std::size_t i = 0; i < 2; ++i) {
      bounds[i] = {.coulomb = dice.chance(0.3) ? 0 : dice.decades(-5, 0), .viscous_per_hold = dice.decades(-5, 3)};
      sizes[i] = dice.decades(-5, 2);
      friction = std::min(friction, bounds[i].coulomb / sizes[i]);
    }
    const double budget = dice.chance(0.1) ? 0 : dice.decades(-323, -20);
    const double scale = largest_scale(bounds, sizes, budget);
    ASSERT_GE(scale, friction) << "trial " << trial << ", " << budget << " J";
    for (std::size_t i = 0; i < 2; ++i) {
      const double most = bounds[i].largest(budget) * (1 + 1e-12) + 1e-100;  // its square underflows
      ASSERT_LE(scale * sizes[i], most) << "trial " << trial << ", " << budget << " J";
    }
  }
}

}  // namespace
}  // namespace tendon::output_bound_test
