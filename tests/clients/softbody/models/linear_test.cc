// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/models/linear.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "tests/clients/softbody/pressed_block.h"
#include "tests/clients/softbody/touch/half_space.h"

namespace tendon::softbody::linear_test {
namespace {

using testing::kB1;
using testing::kB1NearlyIncompressible;
using testing::kB1PatchRadius;
using testing::pressed_block;

/// Stiffness under the patch at the center of the top, N/m.
double stiffness(Element element, int n, double poisson) {
  const Solid solid = pressed_block(element, n, poisson);
  const TouchSurface top(solid.mesh(), Vec3::UnitZ(), kB1PatchRadius);
  return LinearModel(solid, top).press(*top.patch(Vec2::Zero()), Prescribed::kForce, 0.3).stiffness;
}

double error_percent(Element element, int n, double poisson, double truth) {
  return 100 * (stiffness(element, n, poisson) / truth - 1);
}

TEST(Reference, ThePressedBlocksStiffnessIsThatOfOtherPeoplesFiniteElements) {
  EXPECT_NEAR(error_percent(Element::kTet4, 8, 0.45, kB1), 70, 1.5);
  EXPECT_NEAR(error_percent(Element::kTet4, 4, 0.45, kB1), 211, 1.5);
  EXPECT_NEAR(error_percent(Element::kHex8, 8, 0.45, kB1), 24.5, 1.5);
  EXPECT_NEAR(error_percent(Element::kHex8Sri, 8, 0.45, kB1), 8.7, 1.5);
  EXPECT_NEAR(error_percent(Element::kHex27, 8, 0.45, kB1), 2.3, 0.2);
}

TEST(Reference, NearlyIncompressibleMaterialLocksSomeElementsOnly) {
  EXPECT_NEAR(error_percent(Element::kHex8Sri, 8, 0.499, kB1NearlyIncompressible), 8.1, 1.5);
  EXPECT_LT(std::abs(error_percent(Element::kHex27Sri, 8, 0.499, kB1NearlyIncompressible)), 1);
  EXPECT_GT(error_percent(Element::kTet4, 8, 0.499, kB1NearlyIncompressible), 1000);
  EXPECT_GT(error_percent(Element::kHex8, 8, 0.499, kB1NearlyIncompressible), 200);
}

TEST(Reference, ErrorsShrinkAtTheElementsOwnOrder) {
  // Half the cell size gives a quarter of the error, but not yet on coarse meshes of tetrahedra.
  const double coarse = error_percent(Element::kHex8Sri, 8, 0.45, kB1);
  const double fine = error_percent(Element::kHex8Sri, 16, 0.45, kB1);
  EXPECT_NEAR(fine, 2.3, 1);
  EXPECT_NEAR(std::log2(coarse / fine), 2, 0.3);
}

TEST(Reference, AHalfSpaceGivesWayUnderThePatchAsBoussinesqSays) {
  // Compliance of the half space under the patch, weighted with its own pressure, by Hankel transform (Sonine's
  // integral):
  //     C = (1 − ν²)/(πEa) ∫₀^∞ (48 J₃(k)/k³)² dk
  double integral = 0;
  for (double k = 0.01; k < 30; k += 0.02) {
    const double transform = 48 * std::cyl_bessel_j(3, k) / (k * k * k);
    integral += 0.02 * transform * transform;
  }
  const Material material{.young = 1e4, .poisson = 0.3};
  const double a = 0.01;
  const double compliance = (1 - 0.09) / (std::numbers::pi * material.young * a) * integral;

  const Solid quarter = testing::quarter_of_half_space(Element::kHex27, testing::graded(a / 3, 60 * a, 7), material);
  const TouchSurface top(quarter.mesh(), Vec3::UnitZ(), a);
  const Patch patch = *top.patch(Vec2::Zero(), 0.2);
  const double quarter_stiffness = LinearModel(quarter, top).press(patch, Prescribed::kForce, 1).stiffness;
  EXPECT_NEAR(4 * quarter_stiffness * compliance, 1, 0.03);
}

TEST(Condensed, EqualsTheLinearModelItComesFromAllOverTheTop) {
  for (const Element element : {Element::kTet4, Element::kHex8Sri, Element::kHex27}) {
    const Solid solid = pressed_block(element, 6, 0.45);
    const TouchSurface top(solid.mesh(), Vec3::UnitZ(), kB1PatchRadius);
    LinearModel parent(solid, top);
    CondensedModel condensed(solid, top, top.nodes());
    for (const Vec2& middle : {Vec2(0, 0), Vec2(0.013, -0.007), Vec2(-0.04, 0.045)}) {
      const Patch patch = *top.patch(middle);
      const Reaction expected = parent.press(patch, Prescribed::kDepth, 2e-3);
      const Reaction found = condensed.press(patch, Prescribed::kDepth, 2e-3);
      EXPECT_NEAR(found.force / expected.force, 1, 1e-9);
      EXPECT_NEAR(found.stiffness / expected.stiffness, 1, 1e-9);
      EXPECT_LT((found.slope - expected.slope).norm(), 1e-9);
      EXPECT_EQ(found.depth, 2e-3);
      EXPECT_NEAR(condensed.press(patch, Prescribed::kForce, found.force).depth, 2e-3, 1e-14);
    }
  }
}

TEST(Condensed, RefusesAPatchThatLeavesItsTable) {
  const Solid solid = pressed_block(Element::kHex8Sri, 8, 0.45);
  const TouchSurface top(solid.mesh(), Vec3::UnitZ(), kB1PatchRadius);
  CondensedModel condensed(solid, top, top.nodes_of_patches(Vec2::Zero(), 0.001));
  EXPECT_NO_THROW(condensed.press(*top.patch(Vec2::Zero()), Prescribed::kForce, 1));
  EXPECT_THROW(condensed.press(*top.patch(Vec2(0.04, 0)), Prescribed::kForce, 1), std::out_of_range);
}

TEST(Patches, WeightsAreAMeanAndTheirSlopesTheirChange) {
  for (const Shape shape : {Shape::kTet4, Shape::kHex8, Shape::kHex20, Shape::kHex27}) {
    const Mesh mesh = block(shape, Vec3(0.1, 0.1, 0.05), {6, 6, 3});
    const TouchSurface top(mesh, Vec3::UnitZ(), 0.02);
    const Vec2 middle(0.011, -0.017);
    const Patch patch = *top.patch(middle);
    EXPECT_NEAR(patch.weights.sum(), 1, 1e-12);
    EXPECT_LT(patch.slopes.rowwise().sum().norm(), 1e-9);
    EXPECT_NEAR(patch.covered, 1, 2e-3);
    Vec2 mean = Vec2::Zero();
    Eigen::Matrix2d change = Eigen::Matrix2d::Zero();
    for (Eigen::Index i = 0; i < patch.weights.size(); ++i) {
      const Vec2 place = top.across(mesh.nodes[static_cast<std::size_t>(patch.nodes[static_cast<std::size_t>(i)])]);
      mean += patch.weights[i] * place;
      change += patch.slopes.col(i) * place.transpose();
    }
    EXPECT_LT((mean - middle).norm(), 2e-5);
    EXPECT_LT((change - Eigen::Matrix2d::Identity()).norm(), 0.02);  // and moves with it
    const Patch moved = *top.patch(middle + Vec2(1e-6, 0));
    ASSERT_EQ(moved.nodes, patch.nodes);
    EXPECT_LT(((moved.weights - patch.weights) / 1e-6 - patch.slopes.row(0).transpose()).norm(),
              1e-3 * patch.slopes.row(0).norm());
  }
}

TEST(Patches, ThereIsNoneWhereHalfOfItWouldHangOverTheEdge) {
  const Mesh mesh = block(Shape::kHex8, Vec3(0.1, 0.1, 0.05), {6, 6, 3});
  const TouchSurface top(mesh, Vec3::UnitZ(), 0.02);
  EXPECT_TRUE(top.patch(Vec2(0.049, 0)));
  EXPECT_FALSE(top.patch(Vec2(0.051, 0)));
  EXPECT_FALSE(top.patch(Vec2(std::nan(""), 0)));
  EXPECT_THROW(TouchSurface(mesh, Vec3(0, 0, 2), 0.02), std::invalid_argument);
  EXPECT_THROW(TouchSurface(mesh, Vec3::UnitZ(), 0), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::softbody::linear_test
