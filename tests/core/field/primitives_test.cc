// SPDX-License-Identifier: Apache-2.0
#include "core/field/primitives.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "core/base/rotation.h"
#include "core/field/field.h"
#include "tests/support/dice.h"

namespace tendon::field::primitives_test {
namespace {

const Primitive kPlane{.shape = Plane{.at = {0, 0, 0.01}, .normal = Vec3(0.6, 0, 0.8)}};
const Primitive kSphere{.shape = Sphere{.centre = {0.01, 0, 0}, .radius = 0.02}};
const Primitive kCapsule{.shape = Capsule{.from = {-0.01, 0, 0}, .to = {0.02, 0.01, 0}, .radius = 0.005}};
const Primitive kBox{
    .shape = Box{
        .centre = {0, 0.01, 0}, .half = {0.02, 0.015, 0.01}, .rounding = 0.003, .turn = rotation_by({0.3, -0.2, 0.5})}};

TEST(FieldPrimitives, ADistanceIsExactOnSimplePlaces) {
  EXPECT_NEAR(distance(kPlane, {0, 0, 0.02}).distance, 0.008, 1e-15);
  EXPECT_NEAR(distance(kSphere, {0.01, 0.05, 0}).distance, 0.03, 1e-15);
  EXPECT_NEAR(distance(kSphere, {0.01, 0, 0}).distance, -0.02, 1e-15);
  EXPECT_NEAR(distance(kCapsule, {-0.02, 0, 0}).distance, 0.005, 1e-15);
  const Primitive cube{.shape = Box{.half = {0.01, 0.01, 0.01}}};
  EXPECT_NEAR(distance(cube, {0.013, 0.014, 0}).distance, 0.005, 1e-15);
  EXPECT_NEAR(distance(cube, {0.002, -0.004, 0.009}).distance, -0.001, 1e-15);
}

TEST(FieldPrimitives, TheGradientIsTheSlopeAndHasLengthOne) {
  Dice dice(3);
  for (Primitive primitive : {kPlane, kSphere, kCapsule, kBox}) {
    for (const bool hollow : {false, true}) {
      primitive.hollow = hollow;
      int kinks = 0;
      for (int i = 0; i < 500; ++i) {
        const Vec3 x = 0.04 * dice.uniform() * dice.direction();
        const SurfacePoint point = distance(primitive, x);
        Vec3 slope;
        for (int a = 0; a < 3; ++a) {
          const Vec3 h = 1e-7 * Vec3::Unit(a);
          slope[a] = (distance(primitive, x + h).distance - distance(primitive, x - h).distance) / 2e-7;
        }
        EXPECT_NEAR(point.gradient.norm(), 1, 1e-9);
        if ((point.gradient - slope).norm() > 1e-4) ++kinks;  // only beside the medial axis
      }
      EXPECT_LE(kinks, 1) << primitive.shape.index();
    }
  }
}

TEST(FieldPrimitives, AtACentreTheGradientIsStillAUnitVector) {
  EXPECT_EQ(distance(kSphere, {0.01, 0, 0}).gradient.norm(), 1);
  EXPECT_NEAR(distance(kBox, {0, 0.01, 0}).gradient.norm(), 1, 1e-12);
  const Primitive ball{.shape = Capsule{.radius = 0.01}};  // both ends are equal
  EXPECT_NEAR(distance(ball, {0, 0.03, 0}).distance, 0.02, 1e-15);
}

TEST(FieldPrimitives, AFieldIsTheUnionOfItsShapes) {
  Field field;
  field.materials.resize(2);
  field.primitives = {kSphere, kPlane};
  field.primitives[1].material = 1;
  EXPECT_EQ(field.at({0.01, 0, 0.05}).material, 0);
  EXPECT_EQ(field.at({-0.05, 0, 0.02}).material, 1);
  EXPECT_NO_THROW(field.expect_valid(1500));
}

std::string refusal(const Field& field) {
  try {
    field.expect_valid(1500);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(FieldPrimitives, AWrongNumberIsNamed) {
  const auto with = [](const Primitive& primitive) {
    Field field;
    field.primitives = {primitive};
    return refusal(field);
  };
  EXPECT_EQ(with({.shape = Sphere{.radius = 0}}), "sphere.radius = 0: expected a finite number above 0");
  EXPECT_EQ(with({.shape = Plane{.normal = {0, 0, 2}}}), "plane.normal = 2: expected a vector of length 1");
  EXPECT_EQ(with({.shape = Capsule{.from = {std::numeric_limits<double>::quiet_NaN(), 0, 0}, .radius = 1}}),
            "capsule.from.x = nan: expected a finite number");
  EXPECT_NE(with({.shape = Box{.half = {0.01, 0.01, 0.01}, .rounding = 0.02}}), "");
  EXPECT_NE(with({.shape = Box{.half = {0.01, 0.01, 0.01}, .turn = {.w = 0}}}), "");
  EXPECT_EQ(with({.shape = Sphere{.radius = 1}, .material = 1}), "primitive.material = 1: expected below 1");
  Field field;
  field.materials[0].friction = 2.1;
  EXPECT_EQ(refusal(field), "friction = 2.1: expected 0 … 2");
  field.materials[0] = {.stiffness = 1400, .branch = 200};
  EXPECT_EQ(refusal(field), "stiffness = 1600: expected above 0, and at most 1500 N/m with the branch");
  field.materials[0] = {.tau = 0};
  EXPECT_EQ(refusal(field), "tau = 0: expected 0.01 … 10 s");
  field.materials = {};
  EXPECT_EQ(refusal(field), "materials = 0: expected 1 or more");
  field = Field{};
  field.fixtures.resize(5);
  EXPECT_EQ(refusal(field), "fixtures = 5: expected at most 4");
  field.fixtures = {{.stiffness = 2000}};
  EXPECT_EQ(refusal(field), "fixture.stiffness = 2000: expected above 0, and at most 1500 N/m");
}

}  // namespace
}  // namespace tendon::field::primitives_test
