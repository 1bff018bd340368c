// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/near/near_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "clients/softbody/body.h"
#include "clients/softbody/touch/contact.h"
#include "tests/clients/softbody/drawn_answers.h"
#include "tests/clients/softbody/pressed_block.h"
#include "tests/clients/softbody/touch/ways.h"

namespace tendon::softbody::near_model_test {
namespace {

using testing::AskedAndExact;
using testing::expect_right;
using testing::expect_same_bits;
using testing::kB1PatchRadius;
using testing::pressed_block;
using testing::pressed_body;

constexpr Law kLaws[] = {Law::kNeoHookean, Law::kCorotational, Law::kStVenantKirchhoff};

struct Near : AskedAndExact {
  Near(int n, double poisson, Law law, double tolerance = 1e-6, int modes = NearBody::Config{}.modes)
      : AskedAndExact(pressed_block(Element::kHex8Sri, n, poisson, law)),
        model(solid, top, *top.patch(Vec2::Zero()), {{.max_iterations = 100, .tolerance = tolerance}, modes}) {}
  Reaction press(const Vec2& place, double depth) {
    return model.press(*top.patch_with_curvatures(place), Prescribed::kDepth, depth);
  }
  NearModel model;
};

TEST(Near, PressesAreThoseOfTheWholeMeshWithinTwoPercentAndTheErrorSaid) {
  for (const int n : {8, 12}) {
    for (const Law law : kLaws) {
      Near near(n, 0.45, law, 5e-3);
      ASSERT_GT(near.model.size().radius, 0);
      for (const double depth : {1e-3, 3e-3, 5e-3}) {
        if (law == Law::kStVenantKirchhoff && depth > 4e-3) continue;  // the block collapses
        const Reaction found = near.press(Vec2::Zero(), depth);
        expect_right(found, near.truth(Vec2::Zero(), depth), 0.02, n, static_cast<int>(law), depth);
        EXPECT_NEAR(found.depth, depth, 1e-12);
      }
    }
  }
}

TEST(Near, ABodySmallerThanItsNearFieldIsTheWholeModelBitByBit) {
  Near near(4, 0.45, Law::kNeoHookean);
  EXPECT_EQ(near.model.size().radius, 0);
  QuasiStaticModel whole(near.solid, near.top, {.max_iterations = 100, .tolerance = 1e-6});
  for (const double depth : {1e-3, 4e-3, 2e-3}) {
    const Patch patch = *near.top.patch_with_curvatures(Vec2(depth, 0.01));
    const Reaction expected = whole.press(patch, Prescribed::kDepth, depth);
    const Reaction found = near.model.press(patch, Prescribed::kDepth, depth);
    expect_same_bits(found, expected, 0);
    EXPECT_EQ(found.way, SolverPath::kWhole);
    EXPECT_EQ(expected.way, SolverPath::kOnly);
  }
  EXPECT_EQ(near.model.size().made, 1);
}

/// Two laws and ν up to 0.499.
TEST(Near, TheErrorSaidCoversTheTrueOneOfDrawnAnswers) {
  const testing::ErrorsSaid said = testing::errors_said(5e-3, [](int path, double tolerance) {
    auto block = std::make_unique<AskedAndExact>(
        pressed_block(Element::kHex8Sri, 8, path % 4 == 3 ? 0.499 : 0.45, kLaws[path % 2]));
    block->asked =
        std::make_unique<NearModel>(block->solid, block->top, *block->top.patch(Vec2::Zero()),
                                    NearModel::Config{.newton = {.max_iterations = 30, .tolerance = tolerance}});
    return block;
  });
  testing::expect_covered(said);
}

/// The reported error grows with the nonlinearity that the linear far field neglects.
TEST(Near, AFarFieldThatIsNotLinearIsSaid) {
  Near near(12, 0.45, Law::kNeoHookean, 1e-9);
  double before = 0;
  for (const double depth : {1e-3, 3e-3, 5e-3, 8e-3}) {
    const Reaction found = near.press(Vec2::Zero(), depth);
    EXPECT_GT(found.error, before);
    EXPECT_GE(found.error, std::abs(found.force - near.truth(Vec2::Zero(), depth)));
    before = found.error;
  }
}

TEST(Near, OnItsWayAsideItFollowsTheWholeMeshThroughSeveralCentres) {
  for (const Law law : {Law::kNeoHookean, Law::kCorotational}) {
    Near near(8, 0.45, law, 5e-3);
    double last = 0;
    for (int i = 0; i <= 40; ++i) {
      const Vec2 place(5e-4 * i, 0);
      const double truth = near.truth(place, 4e-3);
      const Reaction found = near.press(place, 4e-3);
      expect_right(found, truth, 0.02, i);
      if (i > 0) {
        EXPECT_NEAR(found.force, last, 0.01 * truth) << i;
      }
      last = found.force;
    }
    EXPECT_GE(near.model.size().made, 2);
    EXPECT_LE(near.model.size().made, 8);
  }
}

TEST(Near, AHandThatHoversWhereTheFieldChangesMakesOneNewField) {
  Near near(8, 0.45, Law::kCorotational);
  double edge = 0;
  while (near.model.size().made == 1) near.press(Vec2(edge += 2e-4, 0), 2e-3);
  for (int i = 0; i < 40; ++i) near.press(Vec2(edge + (i % 2 == 0 ? -1e-3 : 1e-3), 0), 2e-3);
  EXPECT_EQ(near.model.size().made, 2);
}

/// One piece per answer. The field must be complete before the old one no longer contains the patch, because the rest
/// would be computed in one answer.
TEST(Near, AHandOfATenthOfAMillimetreAnAnswerNeverWaitsForAField) {
  for (const Law law : {Law::kNeoHookean, Law::kCorotational}) {
    Near near(12, 0.45, law, 5e-3);
    near.press(Vec2::Zero(), 3e-3);
    double last = near.press(Vec2::Zero(), 3e-3).force;
    int most = 0;
    for (int i = 1; i <= 140; ++i) {
      const int before = near.model.size().pieces;
      const double force = near.press(Vec2(1e-4 * i, 2e-5 * i), 3e-3).force;
      most = std::max(most, near.model.size().pieces - before);
      EXPECT_NEAR(force, last, 2e-3 * last) << i;
      last = force;
    }
    EXPECT_EQ(most, 1);
    EXPECT_GE(near.model.size().made, 3);
  }
}

TEST(Near, AFieldIsMadeOnWhileTheHandIsStill) {
  Near near(8, 0.45, Law::kNeoHookean, 5e-3);
  const int pieces = near.model.size().pieces;
  const Vec2 place(0.00455, 0);  // outside of the useful region of the field, but the field still contains the patch
  int answers = 0;
  for (; near.model.size().made == 1 && answers < 100; ++answers) near.press(place, 2e-3);
  EXPECT_EQ(near.model.size().made, 2);
  EXPECT_EQ(near.model.size().pieces - pieces, answers);
  EXPECT_GE(answers, 20);
  for (int i = 0; i < 10; ++i) near.press(place, 2e-3);
  EXPECT_EQ(near.model.size().pieces - pieces, answers);
}

/// Differences fade with the hand's distance, not with time.
TEST(Near, WhileAHandIsStillItsForceIsToo) {
  for (const Law law : kLaws) {
    Near near(8, 0.45, law, 5e-3);
    for (int i = 0; i <= 40; ++i) near.press(Vec2(0.00012 * i, 0), 5e-5 * i);
    const double force = near.press(Vec2(0.0048, 0), 2e-3).force;
    ASSERT_EQ(near.model.size().made, 1);
    for (int i = 0; i < 80; ++i) EXPECT_NEAR(near.press(Vec2(0.0048, 0), 2e-3).force, force, 1e-6 * force) << i;
    EXPECT_EQ(near.model.size().made, 2);
  }
}

TEST(Near, AFieldThatTheHandHasLeftBeforeItIsWholeIsNotMadeToItsEnd) {
  Near near(8, 0.45, Law::kNeoHookean, 5e-3);
  near.press(Vec2(0.005, 0), 3e-3);
  const int pieces = near.model.size().pieces;
  const Vec2 place(-0.02, 0.01);
  const double truth = near.truth(place, 3e-3);
  EXPECT_NEAR(near.press(place, 3e-3).force, truth, 0.02 * truth);
  EXPECT_EQ(near.model.size().made, 2);
  EXPECT_LE(near.model.size().pieces - pieces, 31);
  near.press(place, 3e-3);
  EXPECT_LE(near.model.size().pieces - pieces, 31);
}

TEST(Near, AHandThatLeavesTheFieldHasTheRestOfTheNextOneAtOnce) {
  Near near(8, 0.45, Law::kNeoHookean, 5e-3);
  near.press(Vec2(0.005, 0), 3e-3);
  near.press(Vec2(0.0087, 0), 3e-3);
  EXPECT_EQ(near.model.size().made, 2);
}

TEST(Near, AHandThatJumpsFarIsAnsweredAtOnce) {
  Near near(12, 0.45, Law::kNeoHookean, 5e-3);
  near.press(Vec2(-0.025, -0.025), 3e-3);
  for (const Vec2& place : {Vec2(0.025, 0.01), Vec2(0.045, 0.045)}) {  // far away, and a corner that is half outside
    const auto patch = near.top.patch(place, 0.2);
    ASSERT_TRUE(patch);
    const double truth = near.exact.press(*patch, Prescribed::kDepth, 3e-3).force;
    expect_right(near.model.press(*patch, Prescribed::kDepth, 3e-3), truth, 0.02);
  }
}

TEST(Near, TheStiffnessSentIsTheForcesOwnSlope) {
  for (const Law law : kLaws) {
    AskedAndExact block(pressed_block(Element::kHex8Sri, 8, 0.45, law));
    for (const Vec3& tool : {Vec3(0.005, 0.003, 0.0455), Vec3(-0.03, 0.02, 0.047)}) {
      NearModel model(block.solid, block.top, *block.top.patch(tool.head<2>()),
                      {.newton = {.max_iterations = 100, .tolerance = 1e-9}});
      PatchContact contact(model, block.top, 0, PatchContact::Side::kUnilateral);
      for (double depth = 1e-3; depth < 0.05 - tool.z(); depth += 1e-3)
        contact.at(Vec3(tool.x(), tool.y(), 0.05 - depth));
      const Mat3 given = contact.at(tool).stiffness;
      const Mat3 measured = testing::force_slope(tool, 2e-5, [&](const Vec3& at) { return contact.at(at); });
      EXPECT_EQ(model.size().made, 1);
      EXPECT_LT((given - measured).norm(), 0.01 * given.norm()) << static_cast<int>(law) << '\n' << given - measured;
      EXPECT_LT((given - given.transpose()).norm(), 1e-9 * given.norm());
    }
  }
}

TEST(Near, WhereAFieldTakesOverForceAndStiffnessGoOnAndFadeTogether) {
  const Reaction one = testing::whole_answer();
  Reaction before = one;
  before.force = 2.1;
  const Handover met = handover(before, one, one.depth);
  using testing::felt;
  for (const double share : {0.0, 0.3, 1.0}) {
    const Reaction both = kept(met, share, one);
    const double times = 1 + share * 0.05;
    EXPECT_LT((felt(both).force - times * felt(one).force).norm(), 1e-12);
    EXPECT_LT((felt(both).stiffness - times * felt(one).stiffness).norm(), 1e-9);
    EXPECT_NEAR(both.error, times * 0.01 + both.force * share * 0.05, 1e-12);
  }
  // At a smaller depth the ratio is kept, at a larger depth the difference.
  Reaction less = one;
  less.force = 1;
  less.depth = 2e-3;
  EXPECT_NEAR(kept(met, 1, less).force, 1.05, 1e-12);
  Reaction more = one;
  more.force = 4;
  more.depth = 8e-3;
  EXPECT_NEAR(kept(met, 1, more).force, 4.1, 1e-12);
  before.slope = Vec2(0.12, -0.2);
  EXPECT_EQ(kept(handover(before, one, one.depth), 1, one).slope, before.slope);
  EXPECT_EQ(kept(handover({}, one, one.depth), 1, one).force, one.force);
  EXPECT_EQ(kept(handover(one, {}, one.depth), 1, one).force, one.force);
}

}  // namespace
}  // namespace tendon::softbody::near_model_test
