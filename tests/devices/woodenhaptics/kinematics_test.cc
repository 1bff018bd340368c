// SPDX-License-Identifier: Apache-2.0
#include "devices/woodenhaptics/kinematics.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>

#include "tests/devices/woodenhaptics/published_arm.h"
#include "tests/support/dice.h"

namespace tendon::woodenhaptics::kinematics_test {
namespace {

using published_arm::Arm;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Uniform in the published workspace, with the full force.
Pose place(Dice& dice, const Model& model) {
  for (;;) {
    const auto pose = pose_at(model, model.workspace_radius * std::cbrt(dice.uniform()) * dice.direction());
    if (pose && force_share(model, *pose) == 1) return *pose;
  }
}

int largest(const Currents& currents) {
  return std::max({std::abs(currents[0]), std::abs(currents[1]), std::abs(currents[2])});
}

TEST(WoodenHapticsModel, HasThePublishedNumbersOfEachArm) {
  ASSERT_EQ(models().size(), published_arm::kRows.size());
  for (const auto& [name, row] : published_arm::kRows) {
    SCOPED_TRACE(name);
    const Model* model = find_model(name);
    ASSERT_NE(model, nullptr);
    for (std::size_t i = 0; i < 3; ++i) {
      const Joint& joint = model->joints[i];
      EXPECT_EQ(joint.capstan, row[1 + i]);
      EXPECT_EQ(joint.length, row[4 + i]);
      EXPECT_EQ(joint.body, row[7 + i]);
      EXPECT_EQ(model->origin[i], row[10 + i]);
      EXPECT_EQ(joint.torque_constant, row[14 + i]);
      EXPECT_EQ(joint.counts_per_turn, row[18 + i]);
      EXPECT_EQ(joint.calibration, row[32 + i]);
      EXPECT_EQ(joint.direction, row[38 + i] == 1 ? -1 : 1);
    }
    EXPECT_EQ(model->workspace_radius, row[13]);
    EXPECT_EQ(model->full_scale, row[17]);
    EXPECT_EQ(model->max_force, row[24]);
    EXPECT_FALSE(has_unpublished_kinematics(name));
  }
}

TEST(WoodenHapticsModel, ArmsWithAClosedLinkageAreKnownByNameAndNotDriven) {
  for (const char* name : {"polhem_v2", "polhem_v3"}) {
    EXPECT_EQ(find_model(name), nullptr);
    EXPECT_TRUE(has_unpublished_kinematics(name));
  }
  EXPECT_EQ(find_model("polhem"), nullptr);
  EXPECT_FALSE(has_unpublished_kinematics("polhem"));
}

TEST(WoodenHapticsKinematics, TheTipIsWhereTheTurnedLinksEnd) {
  Dice dice(1);
  for (const Model& model : models()) {
    const Arm arm(model.name);
    for (int i = 0; i < 5000; ++i) {
      const auto count = [&dice] { return static_cast<std::int32_t>(dice.within(-50'000, 50'000)); };
      const Counts counts{count(), count(), count()};
      const Vec3 angles = angles_at(model, counts);
      const Vec3 expected = Vec3(counts[0], counts[1], counts[2]).cwiseProduct(arm.per_count());
      ASSERT_LT((angles - expected).norm(), 1e-12);
      ASSERT_LT((pose_with(model, angles).position - arm.position_at(angles)).norm(), 1e-14);
    }
  }
}

// At (0, 0, 6000) or (0, 0, -5000), the upper link is upright, and the lower link is level and points straight ahead.
TEST(WoodenHapticsKinematics, CalibratedTheUpperLinkIsUprightTheLowerLevel) {
  for (const char* name : {"woodenhaptics_v2019", "woodenhaptics_v2015", "polhem_v1"}) {
    const Model& model = *find_model(name);
    const auto& [a, b, c] = model.joints;
    const Vec3 angles = angles_at(model, {a.calibration, b.calibration, c.calibration});
    EXPECT_LT((angles - Vec3(0, 0, std::numbers::pi / 2)).norm(), 1e-12) << name;
    const Vec3 tip(c.length - model.origin[0], -model.origin[1], a.length + b.length - model.origin[2]);
    EXPECT_LT((pose_with(model, angles).position - tip).norm(), 1e-12) << name;
  }
}

TEST(WoodenHapticsKinematics, ForwardUndoesInverseWithinANanometre) {
  Dice dice(2);
  for (const Model& model : models()) {
    const Arm arm(model.name);
    double worst = 0;
    double worst_published = 0;
    double worst_angle = 0;
    for (int i = 0; i < 20'000; ++i) {
      const Pose pose = place(dice, model);
      worst = std::max(worst, (pose_with(model, pose.angles).position - pose.position).norm());
      worst_published = std::max(worst_published, (arm.position_at(pose.angles) - pose.position).norm());
      worst_angle = std::max(worst_angle, (arm.angles_at(pose.position) - pose.angles).norm());
    }
    EXPECT_LE(worst, 1e-9) << model.name;
    EXPECT_LE(worst_published, 1e-9) << model.name;
    EXPECT_LE(worst_angle, 1e-9) << model.name;
  }
}

TEST(WoodenHapticsKinematics, InverseUndoesForwardWithTheElbowOutwards) {
  Dice dice(3);
  for (const Model& model : models()) {
    for (int i = 0; i < 20'000; ++i) {
      const double b = dice.within(-1, 1.5);
      const Vec3 angles(dice.within(-3, 3), b, dice.within(0.05, 3) - b);
      const Pose pose = pose_with(model, angles);
      if (force_share(model, pose) == 0) continue;  // includes points above the column, where A rotates by half a turn
      const auto again = pose_at(model, pose.position);
      ASSERT_TRUE(again);
      ASSERT_LT((again->angles - angles).norm(), 1e-9) << angles.transpose();
    }
  }
}

TEST(WoodenHapticsKinematics, TheJacobianIsTheDerivativeOfThePosition) {
  Dice dice(4);
  for (const Model& model : models()) {
    const Arm arm(model.name);
    double worst = 0;
    for (int i = 0; i < 5000; ++i) {
      const Vec3 angles = 3 * dice.direction();
      worst = std::max(worst, (pose_with(model, angles).jacobian - arm.numeric_jacobian(angles)).cwiseAbs().maxCoeff());
    }
    EXPECT_LE(worst, 1e-9) << model.name;  // m/rad; the values are about 0.2
  }
}

TEST(WoodenHapticsKinematics, TheWholeWorkspaceCanBeReachedWithAllForce) {
  Dice dice(5);
  for (const char* name : {"woodenhaptics_v2019", "woodenhaptics_v2015"}) {
    const Model& model = *find_model(name);
    for (int i = 0; i < 20'000; ++i) {
      const auto pose = pose_at(model, model.workspace_radius * dice.direction());
      ASSERT_TRUE(pose);
      ASSERT_EQ(force_share(model, *pose), 1);
    }
  }
}

TEST(WoodenHapticsKinematics, WhatIsNowhereHasNoPose) {
  const Model& model = *find_model("woodenhaptics_v2019");
  EXPECT_FALSE(pose_at(model, {1, 0, 0}));
  EXPECT_FALSE(pose_at(model, {kNan, 0, 0}));
  EXPECT_FALSE(pose_at(model, Vec3(0, 0, 0.1) - Vec3(0.220, 0, 0.080))) << "the column's axis";
  EXPECT_TRUE(pose_at(model, Vec3::Zero()));
}

TEST(WoodenHapticsKinematics, CurrentsDoTheWorkOfTheForce) {
  Dice dice(6);
  for (const Model& model : models()) {
    const Arm arm(model.name);
    for (int i = 0; i < 5000; ++i) {
      const Pose pose = place(dice, model);
      const Vec3 force = dice.within(0, 2) * dice.direction();
      const Currents currents = currents_for(model, pose, force, 30'000);
      const Vec3 amperes = 1e-3 * Vec3(currents[0], currents[1], currents[2]);
      const Vec3 torque = amperes.cwiseProduct(arm.per_ampere());
      const Vec3 turn = 1e-4 * dice.direction();
      const Vec3 moved = arm.position_at(pose.angles + turn) - arm.position_at(pose.angles - turn);
      // The tolerance is the rounding error of 1 mA per motor.
      const double lost = 1e-3 * arm.per_ampere().cwiseProduct(2 * turn).cwiseAbs().sum();
      ASSERT_NEAR(torque.dot(2 * turn), force.dot(moved), lost + 1e-11);
      const auto given = force_of(model, pose, currents);
      ASSERT_TRUE(given);
      ASSERT_LT((arm.numeric_jacobian(pose.angles).transpose() * *given - torque).norm(), 1e-9);
    }
  }
}

// The torque constant, the capstan and the lengths were published. The arithmetic was done by hand.
TEST(WoodenHapticsKinematics, ANewtonUpwardsTakesTheCurrentsOfTheDrawings) {
  const Model& model = *find_model("woodenhaptics_v2019");
  const auto pose = pose_at(model, Vec3::Zero());
  ASSERT_TRUE(pose);
  // Lateral: arm 220 mm, gear 16, 0.321 N·m/A.
  EXPECT_EQ(currents_for(model, *pose, {0, 4, 0}, 2000)[0], static_cast<int>(4e3 * 0.220 / 16 / 0.321));
  // Gear 12, 0.0603 N·m/A. The upper link leans 19.7° forward and is pushed down; the lower one is at 38.1°.
  const Currents up = currents_for(model, *pose, {0, 0, 4}, 2000);
  EXPECT_NEAR(up[1], -4e3 * 0.205 * std::sin(pose->angles[1]) / 12 / 0.0603, 1);
  EXPECT_NEAR(up[2], 4e3 * 0.245 * std::sin(pose->angles[2]) / 12 / 0.0603, 1);
  EXPECT_NEAR(pose->angles[1] * 180 / std::numbers::pi, 19.7, 0.1);
  EXPECT_NEAR(pose->angles[2] * 180 / std::numbers::pi, 38.1, 0.1);
}

TEST(WoodenHapticsKinematics, ATooLargeForceKeepsItsDirectionAndNeverWraps) {
  Dice dice(7);
  for (const Model& model : models()) {
    for (int i = 0; i < 5000; ++i) {
      const Pose pose = place(dice, model);
      const Vec3 direction = dice.direction();
      const double size = dice.decades(3, 12);
      for (const double most : {500.0, 2000.0, 6000.0, 32'767.0}) {
        const Currents currents = currents_for(model, pose, size * direction, most);
        ASSERT_LE(largest(currents), most);
        if (size > 1e6) {
          ASSERT_GE(largest(currents), most - 1);
        }
        const auto given = force_of(model, pose, currents);
        ASSERT_GT(given->normalized().dot(direction), most < 1000 ? 0.97 : 0.99);
        ASSERT_LT(given->norm(), size);
      }
    }
  }
}

TEST(WoodenHapticsKinematics, RoundingNeverMakesATorqueLarger) {
  Dice dice(8);
  for (const Model& model : models()) {
    const Arm arm(model.name);
    for (int i = 0; i < 5000; ++i) {
      const Pose pose = place(dice, model);
      const Vec3 force = dice.within(0, 4) * dice.direction();
      const Vec3 exact = 1e3 * (pose.jacobian.transpose() * force).cwiseQuotient(arm.per_ampere());
      const Currents currents = currents_for(model, pose, force, 30'000);
      for (std::size_t motor = 0; motor < 3; ++motor) {
        const double wanted = exact[static_cast<Eigen::Index>(motor)];
        ASSERT_LE(std::abs(currents[motor]), std::abs(wanted) + 1e-9);
        ASSERT_GE(currents[motor] * wanted, 0);
      }
    }
  }
}

TEST(WoodenHapticsKinematics, TheForceFadesToNoneAtASingularPose) {
  Dice dice(9);
  for (const Model& model : models()) {
    const Vec3 force(1, -1, 1);
    double last = 1;
    for (double elbow = 0.3; elbow > -0.2; elbow -= 1e-3) {  // folding
      const double b = 0.8;
      const Pose pose = pose_with(model, {0.3, b, elbow - b});
      const double share = force_share(model, pose);
      ASSERT_LE(share, last);
      last = share;
      const Currents currents = currents_for(model, pose, force, 2000);
      if (std::sin(elbow) <= 0.1) {
        ASSERT_EQ(currents, Currents{});
        ASSERT_FALSE(force_of(model, pose, currents));
      } else {
        const auto given = force_of(model, pose, currents);
        ASSERT_TRUE(!given || given->allFinite());
      }
    }
    EXPECT_EQ(last, 0);
    EXPECT_EQ(force_share(model, pose_with(model, {0, 1.5, std::numbers::pi - 1.5})), 0) << "stretched";
    EXPECT_EQ(force_share(model, pose_with(model, {0, 0, 0.04})), 0) << "above the column";
    for (int i = 0; i < 5000; ++i) {
      const Pose pose = pose_with(model, 4 * dice.direction());
      const auto given = force_of(model, pose, currents_for(model, pose, 3 * dice.direction(), 2000));
      ASSERT_TRUE(!given || given->norm() < 3.5) << pose.angles.transpose();
    }
  }
}

TEST(WoodenHapticsKinematics, AForceThatIsNoneGivesNone) {
  const Model& model = *find_model("polhem_v1");
  const auto pose = pose_at(model, Vec3::Zero());
  ASSERT_TRUE(pose);
  EXPECT_EQ(currents_for(model, *pose, {kNan, 0, 0}, 2000), Currents{});
  EXPECT_EQ(currents_for(model, *pose, {0, std::numeric_limits<double>::infinity(), 0}, 2000), Currents{});
  EXPECT_NE(currents_for(model, *pose, {1, 1, 1}, 2000), Currents{});
}

}  // namespace
}  // namespace tendon::woodenhaptics::kinematics_test
