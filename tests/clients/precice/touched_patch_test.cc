// SPDX-License-Identifier: Apache-2.0
#include "clients/precice/touched_patch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/refusal.h"

namespace tendon::precice_worker::touched_patch_test {
namespace {

DeviceState at(double x, double y = 0, double z = 0) {
  DeviceState hand;
  hand.position = Vec3(x, y, z);
  return hand;
}

std::vector<double> held(const TouchedPatch& patch, const DeviceState& hand, double stiffness) {
  std::vector<double> forces = patch.displacements(hand);
  for (double& force : forces) force *= stiffness / static_cast<double>(patch.nodes());
  return forces;
}

Touch pressed(TouchedPatch& patch, const DeviceState& hand, double stiffness) {
  return patch.answer(hand, held(patch, hand, stiffness));
}

TEST(TouchedPatch, ItsNodesFillACircleInThePlaneOfTheSurface) {
  const TouchedPatch patch({.middle = Vec3(0.1, 0.2, 0.3), .normal = Vec3(0, 0, 2), .radius = 0.02, .rings = 4});
  ASSERT_EQ(patch.nodes(), 1U + 3 * 4 * 5);
  double farthest = 0;
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < patch.nodes(); ++i) {
    const Vec3 place(patch.places()[3 * i], patch.places()[3 * i + 1], patch.places()[3 * i + 2]);
    EXPECT_NEAR(place.z(), 0.3, 1e-15);
    farthest = std::max(farthest, (place - Vec3(0.1, 0.2, 0.3)).norm());
    sum += place;
  }
  EXPECT_NEAR(farthest, 0.02, 1e-15);
  EXPECT_LT((sum / static_cast<double>(patch.nodes()) - Vec3(0.1, 0.2, 0.3)).norm(), 1e-15);
}

TEST(TouchedPatch, EveryNodeFollowsTheDepthOfTheHandAlongTheNormal) {
  const TouchedPatch patch({.rings = 2});
  const std::vector<double> moved = patch.displacements(at(0.003, 0.004, -0.002));
  ASSERT_EQ(moved.size(), patch.places().size());
  for (std::size_t i = 0; i < moved.size(); ++i) EXPECT_NEAR(moved[i], i % 3 == 0 ? 0.003 : 0, 1e-18);
}

TEST(TouchedPatch, AHandInFrontOrAsideDoesNotTouch) {
  TouchedPatch patch({.radius = 0.01});
  for (const DeviceState& hand : {at(-0.002), at(0.003, 0.011), at(0.003, -0.008, 0.008)}) {
    for (const double moved : patch.displacements(hand)) EXPECT_EQ(moved, 0);
    EXPECT_EQ(patch.answer(hand, std::vector<double>(patch.places().size(), 1.0)).force, Vec3::Zero());
  }
}

TEST(TouchedPatch, TheHandFeelsTheOppositeOfWhatHoldsTheNodes) {
  TouchedPatch patch({.middle = Vec3(0.01, 0, 0)});
  EXPECT_LT((pressed(patch, at(0.014), 500).force - Vec3(-2, 0, 0)).norm(), 1e-12);
}

TEST(TouchedPatch, TheSurfaceOnlyPushes) {
  TouchedPatch patch({});
  EXPECT_EQ(pressed(patch, at(0.004), -500).force, Vec3::Zero());
}

TEST(TouchedPatch, TheSecantOfASpringIsItsStiffnessAndHasNoError) {
  TouchedPatch patch({.normal = Vec3(0, 0, 1)});
  const Touch first = pressed(patch, at(0, 0, -0.001), 500);
  EXPECT_FALSE(first.stiffness);
  EXPECT_FALSE(first.error);
  const Touch second = pressed(patch, at(0, 0, -0.002), 500);
  ASSERT_TRUE(second.stiffness);
  EXPECT_LT((*second.stiffness - Mat3(Vec3(0, 0, 500).asDiagonal())).norm(), 1e-9);
  EXPECT_FALSE(second.error) << "nothing has said it beforehand";
  const Touch third = pressed(patch, at(0, 0, -0.0035), 500);
  ASSERT_TRUE(third.error);
  EXPECT_LT(*third.error, 1e-12);
}

TEST(TouchedPatch, TheErrorIsHowFarTheSecantWasWrong) {
  TouchedPatch patch({});
  pressed(patch, at(0.001), 500);
  pressed(patch, at(0.002), 500);
  const Touch stiffer = pressed(patch, at(0.003), 700);  // 2.1 N; 1.5 N were expected
  EXPECT_NEAR(stiffer.error.value_or(-1), 0.6, 1e-12);
  EXPECT_NEAR(stiffer.stiffness.value_or(Mat3::Zero())(0, 0), 1100, 1e-8);
}

TEST(TouchedPatch, ATinyStepMakesNoStiffness) {
  TouchedPatch patch({});
  pressed(patch, at(0.001), 500);
  EXPECT_FALSE(pressed(patch, at(0.001 + 0.5 * TouchedPatch::kLeastStep), 900).stiffness);
  pressed(patch, at(0.002), 500);
  const Touch touch = pressed(patch, at(0.002 + 0.5 * TouchedPatch::kLeastStep), 900);
  EXPECT_NEAR(touch.stiffness.value_or(Mat3::Zero())(0, 0), 500, 1e-8);
}

TEST(TouchedPatch, OutsideItIsNotStiff) {
  TouchedPatch patch({});
  pressed(patch, at(0.001), 500);
  pressed(patch, at(0.002), 500);
  EXPECT_EQ(pressed(patch, at(-0.001), 500).stiffness.value_or(Mat3::Identity()), Mat3::Zero());
}

TEST(TouchedPatch, WhatIsNoNumberGoesOnAndIsForgotten) {
  TouchedPatch patch({});
  pressed(patch, at(0.001), 500);
  EXPECT_TRUE(std::isnan(pressed(patch, at(0.002), std::numeric_limits<double>::quiet_NaN()).force.x()));
  EXPECT_NEAR(pressed(patch, at(0.003), 500).stiffness.value_or(Mat3::Zero())(0, 0), 500, 1e-8);
}

std::string refused(const TouchedPatch::Config& config) {
  return thrown_by([&] { const TouchedPatch patch(config); });
}

TEST(TouchedPatch, AnImpossibleOneIsRefusedWithItsFieldAndValue) {
  EXPECT_EQ(refused({.normal = Vec3::Zero()}), "normal = 0 0 0: expected three finite numbers, not all 0");
  EXPECT_EQ(refused({.radius = 0}), "radius = 0: expected more than 0");
  EXPECT_EQ(refused({.rings = 51}), "rings = 51: expected 1 to 50");
  EXPECT_EQ(refused({.middle = Vec3(NAN, 0, 0)}), "middle = nan   0   0: expected three finite numbers");
  TouchedPatch patch({});
  EXPECT_THROW(patch.answer(at(0.001), std::vector<double>(3)), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::precice_worker::touched_patch_test
