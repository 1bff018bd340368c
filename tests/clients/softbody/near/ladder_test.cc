// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/near/ladder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "clients/softbody/touch/contact.h"
#include "tests/clients/softbody/near/pressed_before.h"
#include "tests/clients/softbody/pressed_block.h"
#include "tests/clients/softbody/same_answer.h"

namespace tendon::softbody {
namespace {

using testing::AskedAndExact;
using testing::PressedBefore;
using testing::small_block;

constexpr Law kBothLaws[] = {Law::kNeoHookean, Law::kCorotational};

std::unique_ptr<Ladder> ladder_with(const PressedBefore& block, bool tabulated, double tolerance) {
  std::vector<std::unique_ptr<Rung>> rungs;
  if (tabulated) rungs.push_back(block.tabulated(tolerance));
  rungs.push_back(block.learned(tolerance));
  return std::make_unique<Ladder>(std::move(rungs), block.near(tolerance));
}

Reaction press(const PressedBefore& block, Model& model, const Vec2& place, double depth) {
  return model.press(*block.top.patch_with_curvatures(place), Given::kLeastDepth, depth);
}

TEST(Ladder, TheFirstRungThatIsGoodEnoughAnswers) {
  PressedBefore& block = small_block(Law::kNeoHookean);
  const auto both = ladder_with(block, true, 0.02);
  press(block, *both, Vec2::Zero(), 0.003);
  EXPECT_EQ(both->steps()[0].answers, 1);
  EXPECT_EQ(both->steps()[1].answers, 0);
  EXPECT_EQ(both->steps()[0].size.name, "tabulated");
  // Between what the table is wrong by there and what the shapes are.
  const auto exact = ladder_with(block, true, 1e-3);
  press(block, *exact, Vec2(0.001, 0.002), 0.003);
  EXPECT_EQ(exact->steps()[0].answers, 0);
  EXPECT_EQ(exact->steps()[1].answers, 1);
  const auto none = ladder_with(block, true, 1e-6);
  NearModel near(block.solid, block.top, *block.top.patch(Vec2::Zero()),
                 {.newton = {.max_iterations = 100, .tolerance = 1e-6}});
  EXPECT_EQ(press(block, *none, Vec2::Zero(), 0.003).force, press(block, near, Vec2::Zero(), 0.003).force);
  EXPECT_EQ(none->steps()[0].answers + none->steps()[1].answers, 0);
}

TEST(Ladder, AGivenForceIsAnsweredByTheNearField) {
  PressedBefore& block = small_block(Law::kNeoHookean);
  const auto ladder = ladder_with(block, true, 0.02);
  const Reaction found = ladder->press(*block.top.patch(Vec2::Zero()), Given::kForce, 1);
  EXPECT_NEAR(block.truth(Vec2::Zero(), found.depth), 1, 0.02);
  EXPECT_EQ(ladder->steps()[0].answers + ladder->steps()[1].answers, 0);
}

TEST(Ladder, WhereAnotherRungTakesOverNothingJumps) {
  for (const Law law : kBothLaws) {
    PressedBefore& block = small_block(law);
    const auto ladder = ladder_with(block, true, 0.02);
    double last = 0;
    for (int i = 0; i <= 120; ++i) {
      const Vec2 place(1e-4 * i, 5e-5 * i);
      const Reaction found = press(block, *ladder, place, 4e-3);
      const double truth = block.truth(place, 4e-3);
      EXPECT_NEAR(found.force, truth, 0.02 * truth) << i;
      EXPECT_GE(found.error, std::abs(found.force - truth)) << i;
      if (i > 0) {
        EXPECT_NEAR(found.force, last, 3e-3 * truth) << i;
      }
      last = found.force;
    }
    for (int i = 0; i <= 60; ++i) {  // down, through the last depths
      const double depth = 3e-3 + 1e-4 * i;
      const double truth = block.truth(Vec2::Zero(), depth);
      const Reaction found = press(block, *ladder, Vec2::Zero(), depth);
      EXPECT_NEAR(found.force, truth, 0.02 * truth) << i;
      EXPECT_GE(found.error, std::abs(found.force - truth)) << i;
    }
    const int answers = ladder->steps()[0].answers;
    EXPECT_GT(answers, 50);
    EXPECT_LT(answers, 182);
  }
}

TEST(Ladder, TheStiffnessSentIsTheForcesOwnSlope) {
  for (const bool tabulated : {false, true}) {
    for (const Law law : kBothLaws) {
      PressedBefore& block = small_block(law);
      const auto ladder = ladder_with(block, tabulated, 0.02);
      PatchContact contact(*ladder, block.top, 0, PatchContact::Side::kUnilateral);
      for (const Vec3& tool :
           {Vec3(0.003, 0.0021, 0.0452), Vec3(-0.0017, 0.0003, 0.0473), Vec3(0.004, -0.004, 0.0465)}) {
        const Mat3 given = contact.at(tool).stiffness;
        Mat3 measured;
        constexpr double kStep = 2e-5;
        for (int c = 0; c < 3; ++c) {
          const Vec3 step = kStep * Vec3::Unit(c);
          measured.col(c) = -(contact.at(tool + step).force - contact.at(tool - step).force) / (2 * kStep);
        }
        EXPECT_LT((given - measured).norm(), 0.01 * given.norm()) << tabulated << '\n' << given - measured;
        EXPECT_LT((given - given.transpose()).norm(), 1e-9 * given.norm());
      }
    }
  }
}

TEST(Ladder, ClosedWaysAcrossRungsGiveNoMoreThanAHundredthOfWhatTheyTook) {
  for (const Law law : kBothLaws) {
    PressedBefore& block = small_block(law);
    const auto ladder = ladder_with(block, true, 0.02);
    PatchContact contact(*ladder, block.top, 0, PatchContact::Side::kUnilateral);
    // Down in the middle, out over the rim, and back at another depth or beside; to and fro.
    for (const double aside : {0.0, 0.004}) {
      for (const bool back : {false, true}) {
        std::vector<Vec3> corners{Vec3(0, 0, 0.0505),          Vec3(0, 0, 0.046),  Vec3(0.012, aside, 0.0455),
                                  Vec3(0.012, -aside, 0.0475), Vec3(0, 0, 0.0475), Vec3(-0.003, 0.009, 0.0425),
                                  Vec3(0, 0, 0.0505)};
        if (back) std::ranges::reverse(corners);
        double work = 0;
        double given = 0;
        Vec3 last = corners.front();
        Vec3 force = contact.at(last).force;
        for (std::size_t k = 1; k < corners.size(); ++k) {
          const int steps = static_cast<int>(std::ceil((corners[k] - corners[k - 1]).norm() / 1e-4));
          for (int i = 1; i <= steps; ++i) {
            const Vec3 there = corners[k - 1] + (corners[k] - corners[k - 1]) * i / steps;
            const Vec3 next = contact.at(there).force;
            work += (force + next).dot(there - last) / 2;
            given = std::max(given, -work);
            last = there;
            force = next;
          }
        }
        EXPECT_LT(work, 0.01 * given) << aside << back;
        EXPECT_GT(given, 1e-3);
      }
    }
    EXPECT_GT(ladder->steps()[0].answers, 100);
  }
}

TEST(Ladder, TheErrorSaidCoversTheTrueOneOfTwoHundredDrawnAnswers) {
  static PressedBefore* const blocks[] = {new PressedBefore(6, 0.45, Law::kNeoHookean, 0.01),
                                          new PressedBefore(6, 0.45, Law::kCorotational, 0.01),
                                          new PressedBefore(6, 0.499, Law::kCorotational, 0.01)};
  const testing::ErrorsSaid said = testing::errors_said(20, 5e-3, [&](int path, double tolerance) {
    const PressedBefore& block = *blocks[path % 4 == 3 ? 2 : path % 2];
    auto asked = std::make_unique<AskedAndExact>(block.solid);
    asked->asked = ladder_with(block, path % 3 != 0, tolerance);
    return asked;
  });
  EXPECT_EQ(said.answers, 200);
  EXPECT_GE(said.covered, 198);
  ::testing::Test::RecordProperty("covered", said.covered);
}

TEST(Ladder, BlendedAnswersAreBetweenTheTwoInForceAndInStiffness) {
  const Reaction one = testing::whole_answer();
  Reaction other = one;
  other.force = 2.1;
  other.stiffness = 430;
  other.slope = Vec2(-0.05, 0.3);
  other.glide.tilting = Vec2(-2, 1);
  using testing::felt;
  for (const double share : {0.0, 0.3, 1.0}) {
    const Reaction both = blended(one, other, share);
    const Feel found = felt(both);
    EXPECT_LT((found.force - (1 - share) * felt(one).force - share * felt(other).force).norm(), 1e-12);
    EXPECT_LT((found.stiffness - (1 - share) * felt(one).stiffness - share * felt(other).stiffness).norm(), 1e-9);
    EXPECT_NEAR(both.error, 0.01 + 0.1, 1e-12);
  }
}

TEST(Ladder, ABodyThatListsNothingHasNoLadder) {
  BodyConfig config = testing::pressed_body(ModelKind::kNear, Element::kHex8Sri, 6);
  EXPECT_TRUE(Body(config).ladder().empty());
  config.learn = true;
  config.reach = 0.005;
  config.tolerance = 0.02;
  const Body learned(config);
  ASSERT_EQ(learned.ladder().size(), 1U);
  EXPECT_EQ(learned.ladder()[0].size.name, "learned");
  EXPECT_GT(learned.size().bytes, Body(testing::pressed_body(ModelKind::kNear, Element::kHex8Sri, 6)).size().bytes);
}

TEST(Ladder, WhatCannotBeLearnedIsRefused) {
  BodyConfig config = testing::pressed_body(ModelKind::kNear, Element::kHex8Sri, 6);
  config.tabulate = true;
  EXPECT_THROW(Body{config}, std::invalid_argument);  // no reach
  config.reach = 0.031;
  EXPECT_THROW(Body{config}, std::invalid_argument);
  config.reach = 0.005;
  config.middle = Vec3(0.2, 0, 0);
  EXPECT_THROW(Body{config}, std::invalid_argument);
  config = testing::pressed_body(ModelKind::kNeoHookean, Element::kHex8Sri, 6);
  config.learn = true;
  config.reach = 0.005;
  EXPECT_THROW(Body{config}, std::invalid_argument);
}

}  // namespace
}  // namespace tendon::softbody
