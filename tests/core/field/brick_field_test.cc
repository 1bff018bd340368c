// SPDX-License-Identifier: Apache-2.0
#include "core/field/brick_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "tests/core/field/shapes.h"
#include "tests/support/dice.h"

namespace tendon::field::brick_field_test {
namespace {

BrickField bricks_of(const std::function<double(const Vec3&)>& shape, double spacing) {
  BrickField field;
  sample(shape, Vec3::Constant(-0.04), Vec3::Constant(0.04), spacing, field);
  return field;
}

TEST(BrickField, ASphereOf2MillimetresErrsByMicrometres) {
  const BrickField field = bricks_of(sphere, 2e-3);
  Dice dice(1);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 n = dice.direction();
    const SurfacePoint point = field.at((0.03 + dice.within(-2e-3, 2e-3)) * n);
    const SurfacePoint on = field.at(0.03 * n);
    EXPECT_LT(std::abs(on.distance), 1e-6);
    EXPECT_LT((on.gradient.normalized() - n).norm(), 2e-3);  // 0.1°
    EXPECT_NEAR(point.gradient.norm(), 1, 2e-2);
  }
}

TEST(BrickField, ItNeedsFewBricks) {
  EXPECT_LE(bricks_of(sphere, 2e-3).bricks(), 125U);
  const BrickField fine = bricks_of(sphere, 1e-3);
  EXPECT_LE(fine.bricks(), 400U);
  EXPECT_GT(fine.bricks(), 200U);
}

TEST(BrickField, ValueAndGradientAreContinuousAcrossBricks) {
  const BrickField field = bricks_of(torus, 2e-3);
  Dice dice(2);
  int crossed = 0;
  for (int i = 0; i < 100'000; ++i) {
    // Two positions on either side of the boundary between two bricks.
    Vec3 x = 0.04 * Vec3(dice.within(-1, 1), dice.within(-1, 1), dice.within(-0.4, 0.4));
    const auto axis = static_cast<Eigen::Index>(dice.bits() % 3);
    x[axis] = -0.04 + 2e-3 * (8 * std::round((x[axis] + 0.04) / 16e-3) - 0.5);
    if (std::abs(torus(x)) > 2e-3) continue;
    const Vec3 h = 1e-10 * Vec3::Unit(axis);
    const SurfacePoint a = field.at(x - h);
    const SurfacePoint b = field.at(x + h);
    const bool on_surface = std::abs(torus(x)) < 0.2e-3;  // otherwise some neighbours of an apron can be missing
    EXPECT_NEAR(a.distance, b.distance, on_surface ? 1e-9 : 1e-6);
    EXPECT_LT((a.gradient - b.gradient).norm(), on_surface ? 1e-6 : 0.05);
    crossed += on_surface ? 1 : 0;
  }
  EXPECT_GT(crossed, 300);
}

TEST(BrickField, TheGradientIsTheSlopeOfTheDistance) {
  const BrickField field = bricks_of(sharp_box, 2e-3);
  Dice dice(4);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 x = Vec3(dice.within(-0.022, 0.022), dice.within(-0.027, 0.027), dice.within(-0.012, 0.012));
    if (std::abs(sharp_box(x)) > 3e-3) continue;
    Vec3 slope;
    for (int a = 0; a < 3; ++a) {
      const Vec3 h = 1e-7 * Vec3::Unit(a);
      slope[a] = (field.at(x + h).distance - field.at(x - h).distance) / 2e-7;
    }
    EXPECT_LT((slope - field.at(x).gradient).norm(), 1e-4);
  }
}

TEST(BrickField, FarFromTheSurfaceTheDistanceIsALowerBoundWithItsSign) {
  for (const auto& shape : {sphere, torus, shell, sharp_box}) {
    const BrickField field = bricks_of(shape, 1e-3);
    Dice dice(5);
    int far = 0;
    for (int i = 0; i < 5000; ++i) {
      const Vec3 x(dice.within(-0.045, 0.045), dice.within(-0.045, 0.045), dice.within(-0.045, 0.045));
      const SurfacePoint point = field.at(x);
      const double truth = shape(x);
      if (std::abs(truth) < 1.5e-3) continue;
      EXPECT_EQ(point.distance > 0, truth > 0) << x.transpose();
      if (point.gradient.norm() > 0) continue;
      EXPECT_LE(std::abs(point.distance), std::abs(truth) + 1e-9) << x.transpose();
      ++far;
    }
    EXPECT_GT(far, 1000);
  }
}

TEST(BrickField, WithoutBricksEverythingIsFree) {
  BrickField field;
  field.reset({.bricks = {2, 3, 4}});
  field.finish();
  EXPECT_GT(field.at({0.001, 0.002, 0.003}).distance, 1);
}

TEST(BrickField, HostileWeightsGiveFiniteNumbers) {
  for (const int kind : {0, 1, 2, 3}) {
    BrickField field;
    field.reset({.spacing = 1e-3, .scale = 6e-5, .bricks = {2, 2, 2}});
    BrickField::Weights weights{};
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const bool odd = (i + i / 8 + i / 64) % 2 == 1;
      weights[i] = kind == 0 ? 32767 : kind == 1 ? -32768 : kind == 2 ? (odd ? 32767 : -32768) : 0;
    }
    field.put({0, 0, 0}, weights);
    field.put({1, 1, 1}, weights);
    field.finish();
    Dice dice(6);
    for (int i = 0; i < 1000; ++i) {
      const SurfacePoint point = field.at(0.03 * dice.direction() * dice.uniform());
      EXPECT_TRUE(std::isfinite(point.distance) && point.gradient.allFinite());
    }
    EXPECT_TRUE(std::isfinite(field.at(Vec3::Constant(1e9)).distance));
  }
}

std::string refusal(const BrickField::Lattice& lattice) {
  BrickField field;
  try {
    field.reset(lattice);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(BrickField, AWrongManifestIsRefused) {
  EXPECT_EQ(refusal({.spacing = 1e-4}), "spacing = 1e-04: expected 0.00025 … 0.008 m");
  EXPECT_NE(refusal({.spacing = std::numeric_limits<double>::quiet_NaN()}), "");
  EXPECT_NE(refusal({.scale = 0}), "");
  EXPECT_NE(refusal({.scale = std::numeric_limits<double>::quiet_NaN()}), "");
  EXPECT_NE(refusal({.scale = 1e12}), "");
  EXPECT_NE(refusal({.origin = {0, std::numeric_limits<double>::infinity(), 0}}), "");
  EXPECT_EQ(refusal({.bricks = {1, 0, 1}}), "lattice.y = 0: expected 1 or more, and at most 2 m");
  EXPECT_NE(refusal({.bricks = {1, 300, 1}}), "");
  EXPECT_EQ(refusal({.bricks = {100, 100, 100}}), "lattice = 1e+06: expected at most 65536 cells");
  EXPECT_EQ(refusal({}), "");
}

TEST(BrickField, ABrickMustHaveAFreePlaceInTheLattice) {
  BrickField field;
  field.reset({.spacing = 1e-3, .bricks = {32, 32, 2}});
  const BrickField::Weights weights{};
  field.put({1, 1, 1}, weights);
  EXPECT_THROW(field.put({1, 1, 1}, weights), std::invalid_argument);
  EXPECT_THROW(field.put({1, 1, 2}, weights), std::invalid_argument);
  EXPECT_THROW(field.put({65535, 1, 1}, weights), std::invalid_argument);
  for (std::uint16_t i = 0; i < 1022; ++i) {
    field.put({static_cast<std::uint16_t>(i % 32), static_cast<std::uint16_t>(i / 32), 0}, weights);
  }
  EXPECT_THROW(field.put({31, 31, 0}, weights), std::invalid_argument);  // the 1024th
  EXPECT_EQ(field.bricks(), BrickField::kMostBricks);
}

}  // namespace
}  // namespace tendon::field::brick_field_test
