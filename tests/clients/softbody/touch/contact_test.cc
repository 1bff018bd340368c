// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/touch/contact.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "clients/softbody/models/linear.h"
#include "clients/softbody/scene.h"
#include "tests/clients/softbody/pressed_block.h"
#include "tests/clients/softbody/touch/ways.h"
#include "tests/support/dice.h"

namespace tendon::softbody::contact_test {
namespace {

using testing::force_slope;
using testing::kB1PatchRadius;
using testing::pressed_block;

class Contacts : public ::testing::Test {
 protected:
  Solid solid_ = pressed_block(Element::kHex8Sri, 8, 0.45);
  TouchSurface top_{solid_.mesh(), Vec3::UnitZ(), kB1PatchRadius};
  CondensedModel model_{solid_, top_, top_.nodes()};
};

TEST_F(Contacts, NothingIsFeltOutsideAndThePushIsUpwardsInside) {
  PatchContact contact(model_, top_, 0, PatchContact::Side::kUnilateral);
  const Feel outside = contact.at(Vec3(0, 0, 0.053));
  EXPECT_EQ(outside.force, Vec3::Zero());
  EXPECT_FALSE(outside.touching);
  EXPECT_NEAR(outside.gap, 0.003, 1e-12);
  EXPECT_NEAR(outside.valid_radius, 0.003, 1e-12);
  const Feel inside = contact.at(Vec3(0, 0, 0.048));
  EXPECT_TRUE(inside.touching);
  EXPECT_NEAR(inside.gap, -0.002, 1e-12);
  EXPECT_NEAR(inside.force.z(), 0.002 * inside.stiffness(2, 2), 1e-9);
  EXPECT_LT(inside.force.head<2>().norm(), 1e-9);  // no tangential force at the center
}

TEST_F(Contacts, ASphereTouchesARadiusEarlier) {
  PatchContact point(model_, top_, 0, PatchContact::Side::kUnilateral);
  PatchContact sphere(model_, top_, 0.01, PatchContact::Side::kUnilateral);
  EXPECT_LT((point.at(Vec3(0.01, 0, 0.049)).force - sphere.at(Vec3(0.01, 0, 0.059)).force).norm(), 1e-12);
  EXPECT_THROW(PatchContact(model_, top_, -1, PatchContact::Side::kUnilateral), std::invalid_argument);
}

TEST_F(Contacts, OnlyABilateralToolPullsAndOnlyOnceItHasTouched) {
  PatchContact sticky(model_, top_, 0, PatchContact::Side::kBilateral);
  EXPECT_EQ(sticky.at(Vec3(0, 0, 0.052)).force, Vec3::Zero());
  EXPECT_GT(sticky.at(Vec3(0, 0, 0.048)).force.z(), 0);
  EXPECT_LT(sticky.at(Vec3(0, 0, 0.052)).force.z(), 0);
  PatchContact loose(model_, top_, 0, PatchContact::Side::kUnilateral);
  EXPECT_GT(loose.at(Vec3(0, 0, 0.048)).force.z(), 0);
  EXPECT_EQ(loose.at(Vec3(0, 0, 0.052)).force, Vec3::Zero());
}

TEST_F(Contacts, AClosedWayThroughTheBodyGivesBackExactlyWhatItTook) {
  PatchContact contact(model_, top_, 0, PatchContact::Side::kUnilateral);
  const auto place = [](double turn) {
    const double angle = 2 * std::numbers::pi * turn;
    return Pose{.position = Vec3(0.02 + 0.012 * std::cos(angle), -0.015 + 0.012 * std::sin(angle),
                                 0.048 + 0.0015 * std::sin(2 * angle))};
  };
  const auto felt = [&](const Pose& tool) { return contact.at(tool.position); };
  // About 5 mJ are exchanged. Without the tangential force, 0.1 mJ would remain.
  EXPECT_LT(std::abs(testing::closed_way(place, 2000, felt).work), 2e-8);
}

TEST_F(Contacts, StiffnessIsTheForcesOwnSlopeAlongTheNormal) {
  PatchContact contact(model_, top_, 0, PatchContact::Side::kUnilateral);
  Dice dice(5);
  for (int i = 0; i < 20; ++i) {
    const Vec3 tool(dice.within(-0.03, 0.03), dice.within(-0.03, 0.03), dice.within(0.046, 0.0495));
    const Mat3 k = contact.at(tool).stiffness;
    const double h = 1e-7;
    const Vec3 slope =
        -(contact.at(tool + h * Vec3::UnitZ()).force - contact.at(tool - h * Vec3::UnitZ()).force) / (2 * h);
    EXPECT_LT((slope - k.col(2)).norm(), 1e-4 * k.norm());
    EXPECT_LT((k - k.transpose()).norm(), 1e-9);
    const Mat3 measured = force_slope(tool, 1e-5, [&](const Vec3& there) { return contact.at(there); });
    EXPECT_LT((k - measured).norm(), 0.05 * k.norm());  // the neglected part is ∂²/∂c²
  }
}

constexpr double kStep = 2e-5;  // m

TEST(ExactStiffness, OfABodyThatBendsAndStretchesIsTheForcesOwnSlope) {
  for (const Law law : {Law::kNeoHookean, Law::kCorotational, Law::kStVenantKirchhoff}) {
    const Solid solid = pressed_block(Element::kHex8Sri, 8, 0.45, law);
    const TouchSurface top(solid.mesh(), Vec3::UnitZ(), kB1PatchRadius);
    QuasiStaticModel model(solid, top, {.max_iterations = 100, .tolerance = 1e-9});
    PatchContact contact(model, top, 0, PatchContact::Side::kUnilateral);
    const auto touched = [&](const Vec3& tool) { return contact.at(tool); };
    for (const Vec3& tool : {Vec3(0.013, 0.007, 0.045), Vec3(-0.03, 0.02, 0.047), Vec3(0, 0, 0.0465)}) {
      for (double depth = 1e-3; depth < 0.05 - tool.z(); depth += 1e-3)
        contact.at(Vec3(tool.x(), tool.y(), 0.05 - depth));
      const Mat3 given = contact.at(tool).stiffness;
      EXPECT_LT((given - force_slope(tool, kStep, touched)).norm(), 0.01 * given.norm())
          << static_cast<int>(law) << ' ' << tool.transpose();
      EXPECT_LT((given - given.transpose()).norm(), 1e-9 * given.norm());
    }
  }
}

TEST(ExactStiffness, OfTheLiverIsRightToTwoNewtonsAMetreAlsoBelowZero) {
  BodyConfig config = read_scene(TENDON_SCENES "/liver.toml").body;
  *newton_of(config.model) = {.max_iterations = 100, .tolerance = 1e-9};
  Body body(config);
  const auto touched = [&](const Vec3& tool) { return body.touch(tool); };
  double lowest = 0;
  for (const Vec2& aside : {Vec2(0, 0), Vec2(-0.003, 0.006)}) {
    const Vec3 above = body.touch_point() + Vec3(aside.x(), aside.y(), 0);
    for (double depth = 5e-4; depth < 3e-3; depth += 5e-4) body.touch(above - depth * Vec3::UnitZ());
    const Vec3 tool = above - 3e-3 * Vec3::UnitZ();
    const Mat3 given = body.touch(tool).stiffness;
    EXPECT_LT((given - force_slope(tool, kStep, touched)).cwiseAbs().maxCoeff(), 2) << given;
    lowest = std::min(lowest, Eigen::SelfAdjointEigenSolver<Mat3>(given).eigenvalues()[0]);
  }
  EXPECT_LT(lowest, -20);  // N/m: the patch tends to slip away
}

std::vector<BodyConfig> linear_ones(BodyConfig config) {
  std::vector<BodyConfig> all;
  for (const ModelKind kind : {ModelKind::kCondensed, ModelKind::kLinear}) {
    config.model = model_config(kind);
    all.push_back(config);
  }
  config.effects = {.density = 1000, .gravity = Vec3(0.5, 0, -1)};
  all.push_back(config);
  config.effects = {};
  config.model = LinearConfig{.plasticity = Yield{.stress = 1e5, .hardening = 1e4}, .newton = {100, 1e-9}};
  all.push_back(config);
  config.model = LinearConfig{};
  config.stiffening = StiffnessOverTime{.at = {0}, .factor = {3}};
  all.push_back(config);
  return all;
}

void expect_slope_of_its_force(const BodyConfig& config, const Vec2& aside, double depth, double share) {
  Body body(config);
  body.tick(0);
  const auto touched = [&](const Vec3& tool) { return body.touch(tool); };
  const Vec3 above = body.touch_point() + Vec3(aside.x(), aside.y(), 0);
  body.touch(above + Vec3(1e-3, 1e-3, -depth));  // the state from another place must be ignored
  const Mat3 given = body.touch(above - depth * Vec3::UnitZ()).stiffness;
  EXPECT_LT((given - force_slope(above - depth * Vec3::UnitZ(), kStep, touched)).norm(), share * given.norm())
      << info(config.model).name << '\n'
      << given;
}

TEST(ExactStiffness, OfALinearBodyOnAFlatSideIsTheForcesOwnSlopeWhenAsked) {
  BodyConfig block = testing::pressed_body(ModelKind::kLinear, Element::kHex8Sri, 8);
  block.whole_stiffness = true;
  for (const BodyConfig& config : linear_ones(block)) {
    for (const Vec2& aside : {Vec2(0.013, 0.007), Vec2(-0.03, 0.02)}) {
      expect_slope_of_its_force(config, aside, 3e-3, 5e-3);
    }
  }
}

TEST(ExactStiffness, OfALinearBodyOnACurvedSideIsTheForcesOwnSlopeUnasked) {
  BodyConfig liver = read_scene(TENDON_SCENES "/liver.toml").body;
  for (const BodyConfig& config : linear_ones(liver)) {
    for (const Vec2& aside : {Vec2(0, 0), Vec2(-0.003, 0.006)}) expect_slope_of_its_force(config, aside, 3e-3, 5e-3);
  }
}

TEST(ExactStiffness, IsNotPaidForOnAFlatSideUnlessItIsAskedFor) {
  const Solid flat = pressed_block(Element::kHex8Sri, 4, 0.45);
  const TouchSurface top(flat.mesh(), Vec3::UnitZ(), kB1PatchRadius);
  EXPECT_FALSE(top.curved());
  EXPECT_FALSE(CondensedModel(flat, top, top.nodes()).glides());
  EXPECT_FALSE(LinearModel(flat, top).glides());
  EXPECT_TRUE(LinearModel(flat, top, {}, true).glides());
  EXPECT_FALSE(LinearModel(flat, top, {.density = 1000, .step = 1e-3, .inertia = true}, true).glides());
  EXPECT_TRUE(TouchSurface(flat.mesh(), Vec3(1, 0, 1).normalized(), kB1PatchRadius).curved());
  EXPECT_FALSE(TouchSurface(flat.mesh(), Vec3(0.1, 0, 1).normalized(), kB1PatchRadius).curved());
  const LinearModel still(flat, top);
  LinearModel asked(flat, top, {}, true);
  asked.press(*top.patch_with_curvatures(Vec2::Zero()), Prescribed::kDepth, 1e-3);
  EXPECT_GT(asked.bytes(), still.bytes());
}

TEST_F(Contacts, OffTheBodyOrNowhereNothingIsFelt) {
  PatchContact contact(model_, top_, 0, PatchContact::Side::kBilateral);
  EXPECT_EQ(contact.at(Vec3(0.2, 0, 0.01)).force, Vec3::Zero());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Vec3& tool : {Vec3(nan, 0, 0), Vec3(0, 0, nan), Vec3(0, 0, -std::numeric_limits<double>::infinity())}) {
    const Feel feel = contact.at(tool);
    EXPECT_EQ(feel.force, Vec3::Zero());
    EXPECT_FALSE(feel.touching);
  }
}

}  // namespace
}  // namespace tendon::softbody::contact_test
