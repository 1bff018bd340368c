// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/models/quasi_static.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "clients/softbody/models/linear.h"
#include "clients/softbody/touch/contact.h"
#include "tests/clients/softbody/drawn_answers.h"
#include "tests/clients/softbody/pressed_block.h"
#include "tests/clients/softbody/touch/ways.h"

namespace tendon::softbody::quasi_static_test {
namespace {

using testing::kB1PatchRadius;
using testing::pressed_block;
using testing::PressedByNewton;

constexpr Law kLaws[] = {Law::kCorotational, Law::kStVenantKirchhoff, Law::kNeoHookean};

TEST(QuasiStatic, SmallPressesAreAnsweredAsByTheLinearModel) {
  for (const Element element : {Element::kTet4, Element::kHex8Sri}) {
    const Solid linear = pressed_block(element, 4, 0.45);
    const TouchSurface top(linear.mesh(), Vec3::UnitZ(), kB1PatchRadius);
    const double expected = LinearModel(linear, top).press(*top.patch(Vec2::Zero()), Prescribed::kDepth, 1e-6).force;
    for (const Law law : kLaws) {
      PressedByNewton pressed(element, 4, law);
      const Reaction found = pressed.model.press(pressed.patch, Prescribed::kDepth, 1e-6);
      EXPECT_NEAR(found.force / expected, 1, 2e-4) << static_cast<int>(law);
      EXPECT_NEAR(found.depth, 1e-6, 1e-12);
    }
  }
}

TEST(QuasiStatic, ForceIsTheSlopeOfTheEnergyAndStiffnessThatOfTheForce) {
  for (const Law law : kLaws) {
    PressedByNewton pressed(Element::kHex8Sri, 4, law);
    const double h = 1e-5;
    const auto press = [&](double depth) {
      const Reaction reaction = pressed.model.press(pressed.patch, Prescribed::kDepth, depth);
      return std::pair(reaction, pressed.solid.energy(pressed.model.displacements()));
    };
    const auto [low, energy_low] = press(0.004 - h);
    const auto [here, energy] = press(0.004);
    const auto [high, energy_high] = press(0.004 + h);
    EXPECT_NEAR((energy_high - energy_low) / (2 * h) / here.force, 1, 1e-5);
    EXPECT_NEAR((high.force - low.force) / (2 * h) / here.stiffness, 1, 2e-3);
    EXPECT_LT(here.error, 1e-5 * here.force);
  }
}

TEST(QuasiStatic, DepthAndForceOneStepAndManyGiveTheSameForce) {
  for (const Law law : {Law::kCorotational, Law::kNeoHookean}) {
    PressedByNewton at_once(Element::kHex8Sri, 4, law);
    const Reaction deep = at_once.model.press(at_once.patch, Prescribed::kDepth, 0.01);
    PressedByNewton slowly(Element::kHex8Sri, 4, law);
    for (const double depth : {0.002, 0.004, 0.006, 0.008}) slowly.model.press(slowly.patch, Prescribed::kDepth, depth);
    EXPECT_NEAR(slowly.model.press(slowly.patch, Prescribed::kDepth, 0.01).force / deep.force, 1, 1e-6);
    EXPECT_NEAR(slowly.model.press(slowly.patch, Prescribed::kForce, deep.force).depth, 0.01, 1e-7);
  }
}

TEST(QuasiStatic, AFactorServesManyAnswersOfAHandThatMovesAsHandsDo) {
  for (const Law law : {Law::kCorotational, Law::kNeoHookean}) {
    PressedByNewton kept(Element::kHex8Sri, 4, law);
    int answers = 0;
    for (double time = 0; time < 2; time += 0.01) {  // 100 answers per second, 0.5 to 2.5 mm deep
      const double depth = 0.0015 + 0.001 * std::sin(5 * time);
      const Reaction found = kept.model.press(kept.patch, Prescribed::kDepth, depth);
      EXPECT_LE(kept.model.iterations(), 12);
      EXPECT_LE(found.error, 1e-5 * found.force);
      if (++answers % 20 != 0) continue;
      PressedByNewton anew(Element::kHex8Sri, 4, law);
      EXPECT_NEAR(found.force / anew.model.press(anew.patch, Prescribed::kDepth, depth).force, 1, 1e-6);
      const double h = 1e-6;
      const double high = anew.model.press(anew.patch, Prescribed::kDepth, depth + h).force;
      const double low = anew.model.press(anew.patch, Prescribed::kDepth, depth - h).force;
      EXPECT_NEAR((high - low) / (2 * h) / found.stiffness, 1, 5e-3);
    }
    EXPECT_LT(kept.model.factors(), answers / 10);
  }
}

TEST(QuasiStatic, OneIterationPerAnswerFollowsTheToolAndTellsItsError) {
  PressedByNewton exact(Element::kHex8Sri, 4, Law::kNeoHookean);
  PressedByNewton hasty(Element::kHex8Sri, 4, Law::kNeoHookean, 1);
  for (int i = 1; i <= 20; ++i) {
    const double depth = 5e-4 * i;
    const double truth = exact.model.press(exact.patch, Prescribed::kDepth, depth).force;
    const Reaction found = hasty.model.press(hasty.patch, Prescribed::kDepth, depth);
    EXPECT_EQ(hasty.model.iterations(), 1);
    EXPECT_NEAR(found.force, truth, 0.03 * truth + 1e-9);
    EXPECT_GE(found.error, std::abs(found.force - truth));
  }
}

/// B1, pressed 5 mm deep and stroked 20 mm sideways in steps of 1 mm, about ten times as fast as a hand at 1 kHz.
TEST(QuasiStatic, HalfAPercentIsWorthFewStepsAndNoFactorOnAHardPath) {
  for (const Law law : {Law::kNeoHookean, Law::kCorotational}) {
    const Solid solid = pressed_block(Element::kHex8Sri, 8, 0.45, law);
    const TouchSurface top(solid.mesh(), Vec3::UnitZ(), kB1PatchRadius);
    QuasiStaticModel exact(solid, top, {.max_iterations = 100, .tolerance = 1e-9});
    QuasiStaticModel asked(solid, top, {.max_iterations = 100, .tolerance = 5e-3});
    QuasiStaticModel usual(solid, top, {});
    int steps = 0;
    int answers = 0;
    for (int i = 1; i <= 45; ++i) {
      const double depth = 1e-3 * std::min(i, 5);
      const double aside = 1e-3 * (i <= 25 ? std::max(0, i - 5) : 45 - i);
      const Patch patch = *top.patch(Vec2(aside, 0));
      const double truth = exact.press(patch, Prescribed::kDepth, depth).force;
      const Reaction found = asked.press(patch, Prescribed::kDepth, depth);
      EXPECT_NEAR(found.force, truth, 5e-3 * truth) << i;
      EXPECT_LE(std::abs(found.force - truth), found.error) << i;
      EXPECT_LE(found.error, 5e-3 * found.force) << i;
      EXPECT_NEAR(usual.press(patch, Prescribed::kDepth, depth).force, truth, 1e-6 * truth) << i;
      steps += asked.iterations();
      ++answers;
    }
    EXPECT_LE(steps, 2 * answers) << static_cast<int>(law);
    EXPECT_EQ(asked.factors(), 0) << static_cast<int>(law);
  }
}

/// Even without a Newton step, the force follows the requested place, in normal and tangential direction.
TEST(QuasiStatic, AnswersWithoutAStepHaveTheStiffnessSentAsTheirSlope) {
  for (const Law law : {Law::kNeoHookean, Law::kCorotational}) {
    const Solid solid = pressed_block(Element::kHex8Sri, 8, 0.45, law);
    const TouchSurface top(solid.mesh(), Vec3::UnitZ(), kB1PatchRadius);
    QuasiStaticModel model(solid, top, {.max_iterations = 100, .tolerance = 5e-3});
    PatchContact contact(model, top, 0, PatchContact::Side::kUnilateral);
    const Vec3 tool(0.02, -0.015, 0.0455);
    for (double above = 4.5e-3; above > 0; above -= 2.5e-4) contact.at(tool + above * Vec3::UnitZ());
    Feel feel = contact.at(tool);
    while (model.iterations() > 0) feel = contact.at(tool);
    const Mat3 measured = testing::force_slope(tool, 1e-6, [&](const Vec3& at) {
      const Feel there = contact.at(at);
      EXPECT_EQ(model.iterations(), 0);
      return there;
    });
    EXPECT_LT((measured - feel.stiffness).norm(), 0.05 * feel.stiffness.norm()) << feel.stiffness << "\n" << measured;
    EXPECT_LT((measured - measured.transpose()).norm(), 0.01 * feel.stiffness.norm()) << measured;
  }
}

/// Tolerances of 0.3 to 30 %, or a single Newton step.
TEST(QuasiStatic, TheErrorSaidCoversTheTrueOneOfDrawnAnswers) {
  const testing::ErrorsSaid said = testing::errors_said(4e-3, [](int path, double tolerance) {
    const double poisson = path % 2 == 0 ? 0.45 : 0.499;
    auto block =
        std::make_unique<testing::AskedAndExact>(pressed_block(Element::kHex8Sri, 4, poisson, kLaws[path % 3]));
    block->asked = std::make_unique<QuasiStaticModel>(
        block->solid, block->top,
        QuasiStaticModel::Config{.max_iterations = path % 4 == 0 ? 1 : 30, .tolerance = tolerance});
    return block;
  });
  testing::expect_covered(said);
}

TEST(QuasiStatic, WhatCannotBeIsRefused) {
  const Solid solid = pressed_block(Element::kHex8Sri, 2, 0.45, Law::kNeoHookean);
  const TouchSurface top(solid.mesh(), Vec3::UnitZ(), kB1PatchRadius);
  EXPECT_THROW(QuasiStaticModel(solid, top, {.max_iterations = 0}), std::invalid_argument);
  EXPECT_THROW(QuasiStaticModel(solid, top, {.tolerance = 0}), std::invalid_argument);
  EXPECT_THROW(LinearModel(solid, top), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::softbody::quasi_static_test
