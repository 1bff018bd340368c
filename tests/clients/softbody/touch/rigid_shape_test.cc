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

#include "tests/clients/softbody/touch/surfaces.h"
#include "tests/support/dice.h"
#include "tests/support/refusal.h"

namespace tendon::softbody::rigid_shape_test {
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

TEST(ShortestRotation, LeadsFromOneDirectionToTheOtherByTheAngleBetween) {
  Dice dice(3);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 from = dice.direction() * dice.within(0.1, 10);
    const Vec3 to = i % 4 == 0 ? Vec3(-2 * from) : Vec3(dice.direction());
    const Mat3 turn = shortest_rotation(from, to);
    EXPECT_LT((turn * from.normalized() - to.normalized()).norm(), 1e-6) << i;
    const double angle = std::acos(std::clamp(from.normalized().dot(to.normalized()), -1.0, 1.0));
    EXPECT_NEAR(Eigen::AngleAxisd(turn).angle(), angle, 1e-6) << i;
  }
  EXPECT_EQ(shortest_rotation({2, 0, 0}, {-1, 0, 0}), Mat3(Vec3(-1, -1, 1).asDiagonal()));
  EXPECT_EQ(shortest_rotation({0, 0, 2}, {0, 0, -1}), Mat3(Vec3(1, -1, -1).asDiagonal()));
}

TEST(RigidShape, ItsDerivativesAreThoseOfItsDistance) {
  constexpr double kStep = 1e-7;  // m
  Dice dice(5);
  for (const auto& [name, shape] : shapes()) {
    int judged = 0;
    for (int i = 0; i < 2000; ++i) {
      const Vec3 x(dice.within(-0.03, 0.03), dice.within(-0.03, 0.03), dice.within(-0.03, 0.03));
      const Distance here = shape.distance(x);
      if (here.value < -1e-3) continue;
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
      EXPECT_EQ(shape.value(x), here.value) << name;
      EXPECT_LT((slope - here.gradient).norm(), 1e-6) << name;
      if (!smooth) continue;  // between a flat face and a rounded edge
      ++judged;
      EXPECT_LT((curve - here.curvature).norm(), 1e-4 * (1 + here.curvature.norm())) << name;
    }
    EXPECT_GT(judged, 1000) << name;
  }
}

TEST(RigidShape, ItIsSoThickWhereItIsThinnest) {
  EXPECT_DOUBLE_EQ(RigidShape::sphere(0.01).thinnest(), 0.02);
  EXPECT_DOUBLE_EQ(RigidShape::capsule(0.004, 0.012, Vec3::UnitX()).thinnest(), 0.008);
  EXPECT_DOUBLE_EQ(RigidShape::box(Vec3(0.02, 0.03, 0.012), 0.002).thinnest(), 0.012);
}

TEST(RigidShape, ItsSignSaysWhichSideOfTheSurfaceAPointIsOn) {
  const RigidShape sphere = RigidShape::sphere(0.01);
  EXPECT_NEAR(sphere.distance(Vec3::Zero()).value, -0.01, 1e-15);
  EXPECT_NEAR(sphere.value(Vec3::Zero()), -0.01, 1e-15);
  EXPECT_NEAR(sphere.distance(Vec3(0, 0.006, 0.008)).value, 0, 1e-15);
  EXPECT_NEAR(sphere.distance(Vec3(0, 600, 800)).value, 999.99, 1e-9);

  const RigidShape capsule = RigidShape::capsule(0.004, 0.012, Vec3::UnitX());
  EXPECT_NEAR(capsule.distance(Vec3(0.011, 0, 0)).value, -0.004, 1e-15);
  EXPECT_NEAR(capsule.distance(Vec3(-0.016, 0, 0)).value, 0, 1e-15);
  EXPECT_NEAR(capsule.distance(Vec3(0.016, 0, 0.003)).value, 0.001, 1e-15);
  EXPECT_NEAR(capsule.distance(Vec3(0.005, 0, -0.01)).value, 0.006, 1e-15);

  const RigidShape box = RigidShape::box(Vec3(0.02, 0.03, 0.012), 0.002);
  EXPECT_NEAR(box.distance(Vec3::Zero()).value, -0.006, 1e-15);
  EXPECT_NEAR(box.value(Vec3::Zero()), -0.006, 1e-15);
  EXPECT_NEAR(box.distance(Vec3(0, 0, 0.007)).value, 0.001, 1e-15);
  EXPECT_NEAR(box.distance(Vec3(0.009, 0, 0)).value, -0.001, 1e-15);
  EXPECT_GT(box.distance(Vec3(0.01, 0.015, 0.006)).value, 0.001);
  EXPECT_NEAR(box.distance(Vec3(0.008, 0.013, 0.004) + 0.005 * Vec3(2, 1, 2) / 3).value, 0.003, 1e-15);
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
      EXPECT_GT(shape.distance(far + 0.001 * way).value, 0.001 - 1e-12) << name;
      Vec3 beside = 1e3 * (Mat3::Identity() - way * way.transpose()) * Vec3(0.3, 0.5, -0.7);
      beside.normalize();
      EXPECT_GT(shape.distance(far + 1e-6 * way + 0.002 * beside).value, 0) << name;
    }
  }
}

constexpr double kMillimetres = 1e-3;

TEST(RigidShape, AMeshOfABallIsThatBallToWhatItsFactsSay) {
  const Triangles ball = testing::ball(10, 64);  // mm
  const RigidShape shape = RigidShape::mesh(ball, kMillimetres, 0.0008, 0.001, "ball.off");
  const RigidShape sphere = RigidShape::sphere(0.01);
  const RigidShape::MeshFacts& facts = *shape.mesh_facts();
  EXPECT_EQ(sphere.mesh_facts(), nullptr);
  EXPECT_EQ(facts.facets, ball.facets.size());
  EXPECT_NEAR(facts.size.z(), 0.02, 1e-4);
  EXPECT_LT(facts.error, 0.05 * facts.cell);
  EXPECT_NEAR(shape.reach(), 0.01, 2e-5);
  EXPECT_NEAR(shape.thinnest(), 6 * facts.cell, 1e-12);  // the search ends at this value
  Dice dice(8);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 way = Vec3(dice.within(-1, 1), dice.within(-1, 1), dice.within(-1, 1)).normalized();
    const Vec3 x = dice.within(0.005, 0.03) * way;
    EXPECT_NEAR(shape.distance(x).value, sphere.distance(x).value, x.norm() < 0.012 ? 2e-5 : 5e-4);
    EXPECT_LT((shape.distance(x).gradient - way).norm(), 0.11);  // a facet is 0.1 rad wide
    EXPECT_LT((shape.farthest(way) - 0.01 * way).norm(), 0.0008);
  }
}

TEST(RigidShape, AMeshWithSharpEdgesIsRightToAFifthOfACellAndSaysSo) {
  const RigidShape shape =
      RigidShape::mesh(testing::box_surface(Vec3(20, 30, 12)), kMillimetres, 0.001, 0.001, "box.off");
  EXPECT_LT(shape.mesh_facts()->error, 0.0002);
  EXPECT_GT(shape.mesh_facts()->error, 0.0001);  // the grid rounds its corners
  EXPECT_NEAR(shape.distance(Vec3(0, 0, 0.006)).value, 0, 1e-6);
  EXPECT_NEAR(shape.distance(Vec3(0.003, 0.001, 0.008)).value, 0.002, 1e-6);
  EXPECT_EQ(shape.farthest(Vec3(0.6, -0.64, 0.48)), Vec3(0.01, -0.015, 0.006));
}

std::string refusal_of(const Triangles& surface, double cell) {
  return thrown_by([&] { RigidShape::mesh(surface, kMillimetres, cell, 1e-4, "tool.stl"); });
}

TEST(RigidShape, AMeshWithoutInsideOrTooThinForItsGridIsRefusedByItsPlace) {
  Triangles open = testing::ball(10, 12);
  open.facets.erase(open.facets.begin() + 20);
  EXPECT_PRED2(says, refusal_of(open, 0.001), "tool.stl: facet ");
  EXPECT_PRED2(says, refusal_of(open, 0.001), "the surface is not closed");
  EXPECT_PRED2(says, refusal_of(testing::turned_inside_out(testing::ball(10, 12)), 0.001), "inside out");
  const std::string nested = refusal_of(testing::together(testing::ball(10, 12), testing::ball(4, 12)), 0.001);
  EXPECT_PRED2(says, nested, "tool.stl: the closed part of 120 facets that starts with facet 121 at ");
  EXPECT_PRED2(says, nested, "is inside the one that starts with facet 1 at ");
  const Triangles hollow =
      testing::together(testing::ball(10, 12), testing::turned_inside_out(testing::ball(4, 12)));  // mm
  EXPECT_EQ(refusal_of(hollow, 0.001), "");
  EXPECT_GT(RigidShape::mesh(hollow, kMillimetres, 0.001, 1e-4, "tool").distance(Vec3::Zero()).value, 0.003);

  const Triangles plate = testing::box_surface(Vec3(30, 30, 1.9));  // mm
  EXPECT_EQ(refusal_of(plate, 0.0009), "");
  const std::string thin = refusal_of(plate, 0.001);
  EXPECT_PRED2(says, thin, "tool.stl: facet 1 at (-5, 5, -0.95) mm: the surface is thinner than ");
  EXPECT_PRED2(says, refusal_of(plate, 1e-6), "grid points, expected at most");
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
  for (const double bad : {0.0, -1.0, nan}) {
    EXPECT_THROW(RigidShape::mesh(testing::ball(10, 12), bad, 0.001, 0.001, "t"), std::invalid_argument);
    EXPECT_THROW(RigidShape::mesh(testing::ball(10, 12), 0.001, bad, 0.001, "t"), std::invalid_argument);
  }
  EXPECT_THROW(RigidShape::mesh(testing::ball(10, 12), 0.001, 0.001, nan, "t"), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::softbody::rigid_shape_test
