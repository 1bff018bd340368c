// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/touch/rigid_shape.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/dice.h"

namespace tendon::softbody {
namespace {

struct Named {
  std::string name;
  RigidShape shape;
};

std::vector<Named> shapes() {
  return {{"sphere", RigidShape::sphere(0.01)},
          {"capsule", RigidShape::capsule(0.004, 0.012, Vec3(2, -1, 2) / 3)},
          {"ball-like capsule", RigidShape::capsule(0.006, 0, Vec3::UnitX())},
          {"box", RigidShape::box(Vec3(0.02, 0.03, 0.012), 0.002)},
          {"pill", RigidShape::box(Vec3(0.02, 0.03, 0.012), 0.006)}};
}

TEST(RigidShape, ItsDerivativesAreThoseOfItsDistance) {
  constexpr double kStep = 1e-7;  // m
  Dice dice(5);
  for (const auto& [name, shape] : shapes()) {
    int judged = 0;
    for (int i = 0; i < 2000; ++i) {
      const Vec3 x(dice.within(-0.03, 0.03), dice.within(-0.03, 0.03), dice.within(-0.03, 0.03));
      const Distance here = shape.distance(x);
      if (here.value < -1e-3) continue;  // the core
      Vec3 slope;
      Mat3 curve;
      bool smooth = true;
      for (int c = 0; c < 3; ++c) {
        const Distance ahead = shape.distance(x + kStep * Vec3::Unit(c));
        const Distance behind = shape.distance(x - kStep * Vec3::Unit(c));
        slope[c] = (ahead.value - behind.value) / (2 * kStep);
        curve.col(c) = (ahead.gradient - behind.gradient) / (2 * kStep);
        smooth = smooth && (ahead.curvature - behind.curvature).norm() < 0.01 * (1 + here.curvature.norm());
      }
      EXPECT_NEAR(here.gradient.norm(), 1, 1e-12) << name;
      EXPECT_LT((slope - here.gradient).norm(), 1e-6) << name;
      if (!smooth) continue;  // where a flat side meets a round edge
      ++judged;
      EXPECT_LT((curve - here.curvature).norm(), 1e-4 * (1 + here.curvature.norm())) << name;
    }
    EXPECT_GT(judged, 1000) << name;
  }
}

TEST(RigidShape, ItsSignSaysWhichSideOfTheSurfaceAPointIsOn) {
  const RigidShape sphere = RigidShape::sphere(0.01);
  EXPECT_NEAR(sphere.distance(Vec3::Zero()).value, -0.01, 1e-15);
  EXPECT_NEAR(sphere.distance(Vec3(0, 0.006, 0.008)).value, 0, 1e-15);
  EXPECT_NEAR(sphere.distance(Vec3(0, 600, 800)).value, 999.99, 1e-9);

  const RigidShape capsule = RigidShape::capsule(0.004, 0.012, Vec3::UnitX());
  EXPECT_NEAR(capsule.distance(Vec3(0.011, 0, 0)).value, -0.004, 1e-15);
  EXPECT_NEAR(capsule.distance(Vec3(-0.016, 0, 0)).value, 0, 1e-15);
  EXPECT_NEAR(capsule.distance(Vec3(0.016, 0, 0.003)).value, 0.001, 1e-15);
  EXPECT_NEAR(capsule.distance(Vec3(0.005, 0, -0.01)).value, 0.006, 1e-15);

  const RigidShape box = RigidShape::box(Vec3(0.02, 0.03, 0.012), 0.002);
  EXPECT_NEAR(box.distance(Vec3::Zero()).value, -0.006, 1e-15);       // to the nearest side
  EXPECT_NEAR(box.distance(Vec3(0, 0, 0.007)).value, 0.001, 1e-15);   // above a side
  EXPECT_NEAR(box.distance(Vec3(0.009, 0, 0)).value, -0.001, 1e-15);  // below one
  EXPECT_GT(box.distance(Vec3(0.01, 0.015, 0.006)).value, 0.001);     // where a sharp corner would be
  EXPECT_NEAR(box.distance(Vec3(0.008, 0.013, 0.004) + 0.005 * Vec3(2, 1, 2) / 3).value, 0.003, 1e-15);  // a corner's
  EXPECT_NEAR(box.distance(Vec3(1000, 0, 0)).value, 999.99, 1e-9);
}

TEST(RigidShape, AStepAgainstTheGradientEndsOnTheSurface) {
  Dice dice(6);
  for (const auto& [name, shape] : shapes()) {
    for (int i = 0; i < 500; ++i) {
      const Vec3 x(dice.within(-0.05, 0.05), dice.within(-0.05, 0.05), dice.within(-0.05, 0.05));
      const Distance here = shape.distance(x);
      if (here.value < 0) continue;
      EXPECT_NEAR(shape.distance(x - here.value * here.gradient).value, 0, 1e-12) << name;
      EXPECT_GE(Eigen::SelfAdjointEigenSolver<Mat3>(here.curvature).eigenvalues().minCoeff(), -1e-9) << name;  // convex
    }
  }
}

TEST(RigidShape, NoPointOfItsSurfaceIsFartherThanItsFarthest) {
  Dice dice(7);
  for (const auto& [name, shape] : shapes()) {
    for (int i = 0; i < 200; ++i) {
      const Vec3 way = Vec3(dice.within(-1, 1), dice.within(-1, 1), dice.within(-1, 1)).normalized();
      const Vec3 far = shape.farthest(way);
      EXPECT_NEAR(shape.distance(far).value, 0, 1e-12) << name;
      EXPECT_LE(far.norm(), shape.reach() + 1e-12) << name;
      // Beyond the plane through it there is nothing of the tool.
      EXPECT_GT(shape.distance(far + 0.001 * way).value, 0.001 - 1e-12) << name;
      Vec3 beside = 1e3 * (Mat3::Identity() - way * way.transpose()) * Vec3(0.3, 0.5, -0.7);
      beside.normalize();
      EXPECT_GT(shape.distance(far + 1e-6 * way + 0.002 * beside).value, 0) << name;
    }
  }
}

TEST(RigidShape, RefusesWhatIsNoShape) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {0.0, -1.0, nan}) {
    EXPECT_THROW(RigidShape::sphere(bad), std::invalid_argument);
    EXPECT_THROW(RigidShape::capsule(bad, 0.01, Vec3::UnitX()), std::invalid_argument);
    EXPECT_THROW(RigidShape::box(Vec3(0.01, bad, 0.01), 0.001), std::invalid_argument);
    EXPECT_THROW(RigidShape::box(Vec3::Constant(0.01), bad), std::invalid_argument);
  }
  EXPECT_THROW(RigidShape::capsule(0.01, -1, Vec3::UnitX()), std::invalid_argument);
  EXPECT_THROW(RigidShape::capsule(0.01, 0.01, Vec3(0, 0, 2)), std::invalid_argument);
  EXPECT_THROW(RigidShape::box(Vec3(0.01, 0.02, 0.03), 0.0051), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::softbody
