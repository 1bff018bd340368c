// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/mechanism.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/LU>

#include "devices/falcon/kinematics.h"
#include "tests/devices/device_bench.h"

namespace tendon::mechanism_test {
namespace {

constexpr Mechanism::Arm kPhantom{.upper_arm = 0.14, .forearm = 0.14};
constexpr Mechanism::Arm kUneven{.upper_arm = 0.215, .forearm = 0.17};

std::vector<Mechanism::Kind> all_kinds() { return {Mechanism::Falcon{}, kPhantom, kUneven}; }

Vec3 anywhere(Dice& dice, double reach) {
  Vec3 x = random_vector(dice, 1);
  while (x.norm() > 1) x = random_vector(dice, 1);
  return reach * x;
}

Vec3 handle_of(const Mechanism::Arm& arm, const Vec3& q) {
  const double r = arm.upper_arm * std::cos(q[1]) + arm.forearm * std::sin(q[2]);
  return {r * std::sin(q[0]), arm.forearm - arm.forearm * std::cos(q[2]) + arm.upper_arm * std::sin(q[1]),
          r * std::cos(q[0]) - arm.upper_arm};
}

TEST(Mechanism, AnArmsAnglesCarryItsHandleAndItsJacobianInvertsThem) {
  for (const Mechanism::Arm& arm : {kPhantom, kUneven}) {
    const Mechanism mechanism(arm);
    Dice dice(1);
    int within = 0;
    for (int i = 0; i < 4000; ++i) {
      const Vec3 q = random_vector(dice, 0.5);
      const Vec3 x = handle_of(arm, q);
      if (x.norm() > mechanism.reach()) continue;
      ++within;
      ASSERT_LT((mechanism.angles(x) - q).norm(), 1e-12) << x.transpose();
      Mat3 derivative;
      constexpr double kSmall = 1e-6;
      for (Eigen::Index joint = 0; joint < 3; ++joint) {
        const Vec3 turn = kSmall * Vec3::Unit(joint);
        derivative.col(joint) = (handle_of(arm, q + turn) - handle_of(arm, q - turn)) / (2 * kSmall);
      }
      ASSERT_LT((mechanism.jacobian(x) * derivative - Mat3::Identity()).norm(), 1e-8) << x.transpose();
    }
    EXPECT_GT(within, 500);
    const Vec3 far = 2 * mechanism.reach() * Vec3::UnitX();
    EXPECT_LT((mechanism.angles(far) - mechanism.angles(far / 2)).norm(), 1e-12) << "of the nearest place";
  }
}

TEST(Mechanism, TheFalconsAnglesAndJacobianAreThoseOfItsKinematics) {
  const Mechanism mechanism(Mechanism::Falcon{});
  Dice dice(2);
  for (int i = 0; i < 100; ++i) {
    const Vec3 x = anywhere(dice, mechanism.reach());
    const auto pose = falcon::pose_at(falcon::kCentre + x);
    ASSERT_EQ(mechanism.angles(x), pose->angles);
    ASSERT_EQ(mechanism.jacobian(x), pose->jacobian);
  }
}

TEST(Mechanism, NoJointMovesTheHandleFurtherThanItsLever) {
  for (const Mechanism::Kind& kind : all_kinds()) {
    const Mechanism mechanism(kind);
    Vec3 longest = Vec3::Zero();
    Dice dice(3);
    for (int i = 0; i < 30'000; ++i) {
      Vec3 x = anywhere(dice, mechanism.reach());
      if (i % 2 == 0) x *= mechanism.reach() / x.norm();
      const Mat3 levers = mechanism.jacobian(x).inverse();
      ASSERT_TRUE(levers.allFinite());
      longest = longest.cwiseMax(levers.colwise().norm().transpose());
    }
    for (Eigen::Index joint = 0; joint < 3; ++joint) {
      EXPECT_LE(longest[joint], mechanism.levers()[joint] * (1 + 1e-12));
      EXPECT_GT(longest[joint], mechanism.levers()[joint] * 0.99) << "a bound that is not reached is too cautious";
    }
  }
}

TEST(Mechanism, BeyondItsWorkspaceTheJacobianIsThatOfTheNearestPlaceInIt) {
  for (const Mechanism::Kind& kind : all_kinds()) {
    const Mechanism mechanism(kind);
    const Vec3 towards = Vec3(1, 2, -2) / 3;
    const Mat3 edge = mechanism.jacobian(mechanism.reach() * towards);
    for (const double times : {1.001, 2.0, 100.0}) {
      EXPECT_LT((mechanism.jacobian(times * mechanism.reach() * towards) - edge).norm(), 1e-9 * edge.norm());
    }
    EXPECT_GT((mechanism.jacobian(0.9 * mechanism.reach() * towards) - edge).norm(), 1e-3 * edge.norm());
  }
}

TEST(Mechanism, RefusesArmsThatAreNoHapticDevices) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double length : {0.0, -0.1, nan, 100.0}) {
    EXPECT_THROW(Mechanism(Mechanism::Arm{length, 0.1}), std::invalid_argument) << length;
    EXPECT_THROW(Mechanism(Mechanism::Arm{0.1, length}), std::invalid_argument) << length;
  }
}

}  // namespace
}  // namespace tendon::mechanism_test
