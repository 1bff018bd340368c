// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/touch/surface_distance.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/clients/softbody/touch/surfaces.h"
#include "tests/support/dice.h"

namespace tendon::softbody::surface_distance_test {
namespace {

TEST(SurfaceDistance, OfABoxItIsThatOnPaperAlsoAtEdgesAndCorners) {
  const Vec3 size(2, 3, 1);
  const SurfaceDistance distance(testing::box_surface(size));
  Dice dice(21);
  for (int i = 0; i < 3000; ++i) {
    Vec3 x(dice.within(-2, 2), dice.within(-2, 2), dice.within(-2, 2));
    if (i % 3 == 0) x.y() = x.x() - 0.5;  // points over the edges
    if (i % 5 == 0) x = x.x() * size;     // and over corners
    const Vec3 beyond = x.cwiseAbs() - size / 2;
    const double paper = beyond.cwiseMax(0.0).norm() + std::min(0.0, beyond.maxCoeff());
    EXPECT_NEAR(distance.at(x), paper, 1e-12);
    EXPECT_NEAR(distance.at(x, std::abs(paper)), paper, 1e-12);
    EXPECT_NEAR(distance.at(x, 10), paper, 1e-12);
    const Vec3 nearest = distance.nearest_point(x, 10);
    EXPECT_NEAR(distance.at(nearest), 0, 1e-12);
    EXPECT_NEAR((x - nearest).norm(), std::abs(paper), 1e-12);
  }
  EXPECT_EQ(distance.nearest_point(Vec3(0, 0, 5), 1), Vec3(0, 0, 5));
}

TEST(SurfaceDistance, OfManyFacetsItIsTheLeastOfAllAndACavityIsOutside) {
  const Triangles outer = testing::ball(1, 40);
  const Triangles inner = testing::turned_inside_out(testing::ball(0.6, 24));
  const SurfaceDistance distance(testing::together(outer, inner));
  Dice dice(22);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 x(dice.within(-1.3, 1.3), dice.within(-1.3, 1.3), dice.within(-1.3, 1.3));
    const double paper = std::max(x.norm() - 1, 0.6 - x.norm());
    EXPECT_NEAR(distance.at(x), paper, 0.01);  // the facets are flat
  }
}

TEST(SurfaceDistance, AtASharpCornerTheSideIsRightWhereSingleFacetsAreWrong) {
  Triangles needle;
  needle.points = {Vec3(0, 0, 0), Vec3(0.1, 0, -4), Vec3(-0.1, 0.15, -4), Vec3(-0.3, -0.1, -4)};
  needle.facets = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
  const SurfaceDistance distance(needle);
  Dice dice(23);
  for (int i = 0; i < 2000; ++i) {
    // the nearest point is mostly the tip
    const Vec3 above(dice.within(-1, 1), dice.within(-1, 1), dice.within(0.2, 1));
    EXPECT_GT(distance.at(above), 0);
  }
  EXPECT_LT(distance.at(Vec3(-0.05, 0.01, -2)), 0);
}

}  // namespace
}  // namespace tendon::softbody::surface_distance_test
