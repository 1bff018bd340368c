// SPDX-License-Identifier: Apache-2.0
#include "core/base/rotation.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "core/base/frames.h"
#include "core/base/portable_math.h"
#include "tests/support/dice.h"

namespace tendon::rotation_test {
namespace {

class Rotations : public ::testing::Test {
 protected:
  Vec3 vector(double longest) { return dice_.direction() * dice_.within(0, longest); }
  Quat rotation() { return rotation_by(vector(std::numbers::pi)); }
  /// Returns a random symmetric stiffness. The eigenvalues are between 0 and 2 N·m/rad.
  Mat3 stiffness() {
    const Mat3 turn = matrix_of(rotation());
    const Vec3 values(dice_.within(0, 2), dice_.within(0, 2), dice_.within(0, 2));
    return turn * values.asDiagonal() * turn.transpose();
  }
  Dice dice_{20};
};

Quat negative(const Quat& q) { return {-q.w, -q.x, -q.y, -q.z}; }

TEST(PortableAtan2, IsThatOfTheCLibraryAllRound) {
  for (int i = -1000; i <= 1000; ++i) {
    const double angle = i * std::numbers::pi / 1000;
    for (const double size : {1e-9, 1.0, 3e7}) {
      const double x = size * std::cos(angle);
      const double y = size * std::sin(angle);
      EXPECT_NEAR(portable::atan2(y, x), std::atan2(y, x), 5e-16) << angle;
    }
  }
  EXPECT_EQ(portable::atan2(0, 0), 0);
  EXPECT_EQ(portable::atan2(1, 0), std::numbers::pi / 2);
  EXPECT_EQ(portable::atan2(0, -1), std::numbers::pi);
}

TEST_F(Rotations, ProductsAndTurnedVectorsAreThoseOfMatrices) {
  for (int i = 0; i < 1000; ++i) {
    const Quat a = rotation();
    const Quat b = rotation();
    EXPECT_LT((matrix_of(product(a, b)) - matrix_of(a) * matrix_of(b)).norm(), 1e-14);
    EXPECT_LT((matrix_of(inverse(a)) - matrix_of(a).transpose()).norm(), 1e-15);
    const Vec3 v = vector(1);
    EXPECT_LT((rotated(a, v) - matrix_of(a) * v).norm(), 1e-14);
  }
}

TEST_F(Rotations, AVectorComesBackFromItsRotation) {
  for (int i = 0; i < 1000; ++i) {
    const Vec3 turn = vector(std::numbers::pi - 1e-9);
    const Quat q = rotation_by(turn);
    EXPECT_TRUE(is_rotation(q));
    EXPECT_LT((rotation_vector(q) - turn).norm(), 1e-13);
    EXPECT_EQ(rotation_vector(negative(q)), rotation_vector(q)) << "q and -q are the same rotation";
    EXPECT_LT((matrix_of(q) - Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix()).norm(), 1e-14);
  }
  EXPECT_EQ(rotation_by(Vec3::Zero()), Quat{});
  EXPECT_EQ(rotation_vector(Quat{}), Vec3(0, 0, 0));
  const Vec3 tiny(1e-12, 0, 0);
  EXPECT_LT((rotation_vector(rotation_by(tiny)) - tiny).norm(), 1e-27);
}

TEST_F(Rotations, TheTurnBetweenTwoLeadsFromOneToTheOther) {
  for (int i = 0; i < 1000; ++i) {
    const Quat from = rotation();
    const Quat to = rotation();
    const Quat there = product(rotation_by(turn_between(from, to)), from);
    EXPECT_LT((matrix_of(there) - matrix_of(to)).norm(), 1e-13);
  }
}

TEST(Rotation, OfNoDirectionIsTheIdentity) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(unit({0, 0, 0, 0}), Quat{});
  EXPECT_EQ(unit({nan, 0, 0, 0}), Quat{});
  EXPECT_EQ(unit({0, 0, 3, 0}), (Quat{0, 0, 1, 0}));
  EXPECT_FALSE(is_rotation({nan, 0, 0, 0}));
  EXPECT_FALSE(is_rotation({1.0011, 0, 0, 0}));
  EXPECT_TRUE(is_rotation({1.0009, 0, 0, 0}));
}

TEST_F(Rotations, ASpringsTorqueIsTheGradientOfItsEnergy) {
  for (int i = 0; i < 1000; ++i) {
    const Mat3 k = stiffness();
    const Quat rest = rotation();
    const Quat q = rotation();
    const Vec3 torque = spring_torque(k, rest, q);
    EXPECT_EQ(spring_torque(k, rest, negative(q)), torque) << "no jump at q -> -q";
    Vec3 gradient;
    constexpr double kStep = 1e-5;
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 turn = kStep * Vec3::Unit(axis);
      gradient[axis] = (spring_energy(k, rest, product(rotation_by(turn), q)) -
                        spring_energy(k, rest, product(rotation_by(-turn), q))) /
                       (2 * kStep);
    }
    EXPECT_LT((torque + gradient).norm(), 1e-9);
  }
}

TEST_F(Rotations, ASpringIsStiffnessTimesAngleForSmallTurns) {
  for (int i = 0; i < 100; ++i) {
    const Mat3 k = stiffness();
    const Quat rest = rotation();
    const Vec3 turn = vector(1e-4);
    EXPECT_LT((spring_torque(k, rest, product(rotation_by(turn), rest)) + k * turn).norm(), 1e-8);
  }
}

/// Returns the work of the hand (J) along a closed path. If it is negative, the spring generated energy.
double work_round(const Mat3& k, const Quat& rest, const std::vector<Quat>& way) {
  constexpr int kParts = 40;  // per leg; three Gauss points in each part leave an error of about 1e-12 J
  constexpr std::array<std::pair<double, double>, 3> kGauss{
      {{0.1127016653792583, 5.0 / 18}, {0.5, 8.0 / 18}, {0.8872983346207417, 5.0 / 18}}};
  double work = 0;
  for (std::size_t leg = 0; leg < way.size(); ++leg) {
    const Quat& from = way[leg];
    const Vec3 turn = turn_between(from, way[(leg + 1) % way.size()]);
    for (int i = 0; i < kParts; ++i) {
      for (const auto& [place, weight] : kGauss) {
        const Quat here = product(rotation_by(turn * ((i + place) / kParts)), from);
        work -= spring_torque(k, rest, here).dot(turn) * weight / kParts;
      }
    }
  }
  return work;
}

TEST_F(Rotations, NoWayRoundASpringMakesEnergy) {
  for (int i = 0; i < 200; ++i) {
    const Mat3 k = stiffness();
    const Quat rest = rotation();
    const std::vector<Quat> way = {rotation(), rotation(), rotation(), rotation()};
    EXPECT_NEAR(work_round(k, rest, way), 0, 1e-9);
  }
}

}  // namespace
}  // namespace tendon::rotation_test
