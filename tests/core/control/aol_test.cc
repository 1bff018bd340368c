// SPDX-License-Identifier: Apache-2.0
#include "core/control/aol.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <cmath>

#include "core/control/aol_plus.h"
#include "tests/support/dice.h"

namespace tendon::aol_test {
namespace {

constexpr Duration kPeriod = std::chrono::milliseconds(1);

static_assert(StabilityController<Aol<1>, 1> && StabilityController<Aol<1, 3>, 3> && StabilityController<Aol<3>, 3>);
static_assert(StabilityController<Aol<6>, 6> && StabilityController<Aol<2, 3>, 6>);
static_assert(StabilityController<PerAxisAol<1>, 1> && StabilityController<PerAxisAol<3>, 3>);

TEST(Aol, JointFormIsTheSameInEveryFrameAndBoxFormPermitsWhatAxesDo) {
  Dice dice(3);
  for (int trial = 0; trial < 200; ++trial) {
    const Friction friction{dice.decades(-3, -1), dice.decades(-2, 0)};
    Aol<1, 3> here({.friction = {friction}, .longest_hold = kPeriod});
    Aol<1, 3> there({.friction = {friction}, .longest_hold = kPeriod});
    Aol<3> box({.friction = {friction, friction, friction}, .longest_hold = kPeriod});
    PerAxisAol<3> axes({.friction = friction, .longest_hold = kPeriod});
    const Mat3 turn = Eigen::HouseholderQR<Mat3>(Mat3::Random()).householderQ();
    for (int n = 0; n < 20; ++n) {
      const Vec3 dx = dice.direction() * dice.decades(-6, -3);
      here.observe({.applied = Vec3::Zero(), .dx = dx, .held = kPeriod});
      there.observe({.applied = Vec3::Zero(), .dx = turn * dx, .held = kPeriod});
      box.observe({.applied = Vec3::Zero(), .dx = dx, .held = kPeriod});
      axes.observe({.applied = Vec3::Zero(), .dx = dx, .held = kPeriod});
    }
    const Vec3 wanted = dice.direction() * dice.decades(-1, 2);
    const Vec3 joint = here.limit({.force = wanted}).force;
    EXPECT_LT((turn * joint - there.limit({.force = turn * wanted}).force).norm(), 1e-9 * joint.norm());
    EXPECT_LT(joint.cross(wanted).norm(), 1e-9 * joint.norm() * wanted.norm());
    // If a force is permitted by the per-axis form, it must also be permitted by the box form.
    const Vec3 by_axes = axes.limit({.force = wanted}).force;
    EXPECT_LT((box.limit({.force = by_axes}).force - by_axes).norm(), 1e-9 * by_axes.norm());
  }
}

TEST(Aol, ThePaperFormLosesALateralForceThatTheJointFormKeeps) {
  // core/PROOFS.md, "Several coordinates": motion along x only, demand (−35.9, −2) N. In a frame rotated by 45° both
  // axes have the same bound, so the lateral force is zero.
  const auto lateral = [](double angle, bool joint) {
    const Friction friction{0.0, 0.26};
    Mat3 frame = Mat3::Identity();
    frame.topLeftCorner<2, 2>() << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
    Aol<1, 3> one({.friction = {friction}, .longest_hold = kPeriod});
    PerAxisAol<3> each({.friction = friction, .longest_hold = kPeriod});
    for (int n = 0; n < 100; ++n) {
      const Interval<3> interval{.applied = Vec3::Zero(), .dx = frame * Vec3(3e-4, 0, 0), .held = kPeriod};
      one.observe(interval);
      each.observe(interval);
    }
    const Demand<3> wanted{.force = frame * Vec3(-35.9, -2, 0)};
    const Vec3 force = frame.transpose() * (joint ? one.limit(wanted).force : each.limit(wanted).force);
    return force.y() / force.x() / (2 / 35.9);
  };
  const double eighth_turn = 3.14159265358979 / 4;
  EXPECT_NEAR(lateral(0, true), 1, 1e-9);
  EXPECT_NEAR(lateral(eighth_turn, true), 1, 1e-9);
  EXPECT_LT(std::abs(lateral(eighth_turn, false)), 0.2);
}

template <int Blocks, int Size>
void expect_aol_without_parts() {
  constexpr int kN = Blocks * Size;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    Dice dice(seed);
    const auto any = [&dice](double from, double to) {
      Vec<kN> vector;
      for (int i = 0; i < kN; ++i) vector[i] = dice.within(-1, 1);
      return Vec<kN>(vector.normalized() * dice.decades(from, to));
    };
    std::array<Friction, Blocks> friction;
    for (Friction& one : friction) one = {dice.decades(-3, -0.3), dice.decades(-2.5, 0.3)};
    AolPlus<Blocks, Size> plus({.friction = friction, .longest_hold = kPeriod});
    Aol<Blocks, Size> plain({.friction = friction, .longest_hold = kPeriod});
    EnergyLedger ledger(friction[0]);
    const OutputBound bound = OutputBound::of(friction[0], kPeriod);
    Vec<kN> applied = Vec<kN>::Zero();
    for (int n = 0; n < 300; ++n) {
      const Interval<kN> interval{.applied = applied, .dx = any(-6, -2), .held = dice.milliseconds(0.2, 1)};
      plus.observe(interval);
      plain.observe(interval);
      const Vec<kN> wanted = any(-2, 2);
      const auto from_plus = plus.limit({.force = wanted});
      const auto from_plain = plain.limit({.force = wanted});
      ASSERT_LE((from_plus.force - from_plain.force).norm(), (Blocks == 1 ? 0 : 1e-15) * wanted.norm());
      ASSERT_EQ(from_plus.permitted, from_plain.permitted);
      ASSERT_EQ(from_plus.reasons, from_plain.reasons);
      ASSERT_EQ(plus.energy(), plain.energy());
      if constexpr (Blocks == 1) {
        ASSERT_EQ(from_plain.force, bound.limit<kN>(wanted, ledger.observe(applied, interval.dx, interval.held)).force);
        ASSERT_EQ(plus.energy(), ledger.energy());
      }
      applied = from_plus.force;
    }
  }
}

TEST(AolPlus, WithoutPartsItIsTheAdjustingOutputLimiterBitForBit) {
  expect_aol_without_parts<1, 1>();
  expect_aol_without_parts<1, 3>();
}

TEST(AolPlus, WithoutPartsSeveralGroupsAreTheAolUpToRounding) {
  expect_aol_without_parts<3, 1>();
  expect_aol_without_parts<6, 1>();
  expect_aol_without_parts<2, 3>();
}

}  // namespace
}  // namespace tendon::aol_test
