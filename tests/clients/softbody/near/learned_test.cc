// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/near/learned.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tests/clients/softbody/near/pressed_before.h"
#include "tests/support/dice.h"

namespace tendon::softbody::learned_test {
namespace {

using testing::PressedBefore;
using testing::small_block;

constexpr Law kBothLaws[] = {Law::kNeoHookean, Law::kCorotational};

TEST(LearnedShapes, PressesBetweenAreWithinTheErrorSaidAndTwoPercent) {
  for (const Law law : kBothLaws) {
    PressedBefore& block = small_block(law);
    const auto fallback_level = block.learned(0.02);
    Dice dice(1);
    for (int i = 0; i < 60; ++i) {
      const Vec2 place(dice.within(-0.005, 0.005), dice.within(-0.005, 0.005));
      const double depth = dice.within(1e-4, 0.0055);
      const auto found = fallback_level->press(*block.top.patch_with_curvatures(place), depth);
      ASSERT_TRUE(found) << i;
      EXPECT_EQ(found->share, 1) << i;
      const double truth = block.truth(place, depth);
      EXPECT_NEAR(found->reaction.force, truth, found->reaction.error) << i;
      EXPECT_NEAR(found->reaction.force, truth, 0.02 * truth) << i;
      EXPECT_LE(found->reaction.error, 0.02 * truth * 1.02) << i;
      EXPECT_NEAR(found->reaction.depth, depth, 1e-12);
    }
  }
}

TEST(LearnedShapes, AnAnswerBeginsNextToItsShape) {
  for (const Law law : kBothLaws) {
    PressedBefore& block = small_block(law);
    const LearnedBody body(block.solid, block.top, block.shapes);
    const PressGrid& grid = block.presses.grid;
    double most = 0;
    for (int level = 0; level < PressGrid::kLevels - 1; ++level) {
      const Vec2 place = grid.place(1.5, 2.5);
      const double depth = (level + 0.5) * grid.step;
      const auto begun = body.press(*block.top.patch(place), depth, *grid.find(place, depth), 1);
      ASSERT_TRUE(begun);
      most = std::max(most, begun->error / begun->force);
    }
    EXPECT_LT(most, 0.01);
  }
}

TEST(LearnedShapes, ASmallPressIsThatOfTheWholeLinearBody) {
  PressedBefore& block = small_block(Law::kNeoHookean);
  const auto fallback_level = block.learned(0.02);
  const Vec2 place(0.0013, -0.0021);
  const Reaction found = fallback_level->press(*block.top.patch_with_curvatures(place), 1e-7)->reaction;
  const Reaction truth = block.exact.press(*block.top.patch_with_curvatures(place), Prescribed::kDepth, 1e-7);
  EXPECT_NEAR(found.stiffness, truth.stiffness, 3e-3 * truth.stiffness);
  EXPECT_NEAR(found.force, truth.force, 3e-3 * truth.force);
}

TEST(LearnedShapes, FewElementsAreSummedOver) {
  for (const Law law : kBothLaws) {
    const LearnedShapes& shapes = small_block(law).shapes;
    EXPECT_LT(shapes.elements.size(), 80U);  // of 108
    EXPECT_EQ(shapes.weights.size(), static_cast<Eigen::Index>(shapes.elements.size()));
    EXPECT_TRUE((shapes.weights.array() > 0).all());
    EXPECT_LE(shapes.linear.rows(), 45);
  }
}

TEST(LearnedShapes, TheForcesAreTheSlopesOfTheReducedEnergy) {
  for (const Law law : kBothLaws) {
    PressedBefore& block = small_block(law);
    const LearnedBody body(block.solid, block.top, block.shapes);
    const VectorXd q = block.shapes.knots.col(block.presses.grid.knot(2, 1, 4));
    VectorXd slope(q.size());
    VectorXd ignored(q.size());
    body.energy(q, slope);
    for (Eigen::Index i = 0; i < q.size(); i += 7) {
      VectorXd more = q;
      VectorXd less = q;
      const double by = 1e-4 * q.norm();
      more[i] += by;
      less[i] -= by;
      EXPECT_NEAR((body.energy(more, ignored) - body.energy(less, ignored)) / (2 * by), slope[i], 1e-5 * slope.norm());
    }
  }
}

TEST(LearnedShapes, OutsideOfWhatWasLearnedThereIsNoAnswer) {
  PressedBefore& block = small_block(Law::kNeoHookean);
  const auto fallback_level = block.learned(0.1);
  const auto answers = [&](const Vec2& place, double depth) {
    return fallback_level->press(*block.top.patch_with_curvatures(place), depth).has_value();
  };
  EXPECT_TRUE(answers(Vec2::Zero(), 0.003));
  EXPECT_FALSE(answers(Vec2(0.0101, 0), 0.003));
  EXPECT_FALSE(answers(Vec2(0, -0.0101), 0.003));
  EXPECT_FALSE(answers(Vec2::Zero(), 0.0071));
  EXPECT_FALSE(answers(Vec2::Zero(), -0.001));
  EXPECT_FALSE(answers(Vec2::Zero(), std::numeric_limits<double>::quiet_NaN()));
}

TEST(LearnedShapes, TowardsTheRimOfWhatWasLearnedTheirShareFallsToNothing) {
  PressedBefore& block = small_block(Law::kNeoHookean);
  const auto fallback_level = block.learned(0.1);
  double last = 1;
  for (const double x : {0.0049, 0.006, 0.0075, 0.009, 0.0099}) {
    const auto answer = fallback_level->press(*block.top.patch_with_curvatures(Vec2(x, 0)), 0.003);
    ASSERT_TRUE(answer);
    EXPECT_NEAR(answer->share, x < 0.005 ? 1 : (0.01 - x) / 0.005, 1e-9);
    EXPECT_LE(answer->share, last);
    last = answer->share;
  }
}

TEST(LearnedShapes, WhereASolutionWasNotGoodNothingIsAnswered) {
  PressedBefore& block = small_block(Law::kNeoHookean);
  SolvedPresses presses = block.presses;
  SolvedPress& bad = presses.knots[static_cast<std::size_t>(presses.grid.knot(2, 2, 3))];
  bad.good = false;
  bad.shape = VectorXd();
  const LearnedLevel fallback_level(block.solid, block.top, learn_shapes(block.solid, block.top, presses, {}), 0.02);
  const double step = presses.grid.step;
  EXPECT_FALSE(fallback_level.press(*block.top.patch(Vec2::Zero()), 3 * step));
  EXPECT_LT(fallback_level.press(*block.top.patch(Vec2::Zero()), 1.5 * step)->share, 1);
  EXPECT_EQ(fallback_level.press(*block.top.patch(Vec2::Zero()), 0.9 * step)->share, 1);
}

TEST(LearnedShapes, WhereTheForcesAreNotThoseThatWereSolvedNothingIsAnswered) {
  PressedBefore& block = small_block(Law::kCorotational);
  SolvedPresses presses = block.presses;
  SolvedPress& wrong = presses.knots[static_cast<std::size_t>(presses.grid.knot(2, 2, 3))];
  wrong.reaction.force *= 1.1;
  const LearnedLevel fallback_level(block.solid, block.top, learn_shapes(block.solid, block.top, presses, {}), 0.02);
  EXPECT_FALSE(fallback_level.press(*block.top.patch(Vec2::Zero()), 3 * presses.grid.step));
  EXPECT_EQ(fallback_level.size().cells, fallback_level.size().of_cells - 8);
}

// Regression: in a rotated frame, a tool on the border of two cells had the error of the other cell.
TEST(LearnedShapes, TheErrorOnABorderOfCellsDoesNotDependOnRounding) {
  PressedBefore& block = small_block(Law::kNeoHookean);
  const PressGrid& grid = block.presses.grid;
  for (const auto& fallback_level : {block.learned(0.1), block.tabulated(0.1)}) {
    const auto said = [&](const Vec2& place, double depth) {
      const auto answer = fallback_level->press(*block.top.patch(place), depth);
      return answer ? answer->reaction.error / answer->reaction.force : -1;
    };
    for (int i = 1; i < grid.side() - 1; ++i) {
      for (const double level : {1.0, 2.5}) {
        const Vec2 place = grid.place(i, 1.3);
        const double depth = level * grid.step;
        const double rounding = 1e-14;
        const double here = said(place, depth);
        for (const double by : {-rounding, rounding}) {
          EXPECT_NEAR(said(place + by * Vec2::UnitX(), depth), here, 1e-6 * here) << i << ' ' << level;
          EXPECT_NEAR(said(place, depth + by), here, 1e-6 * here) << i << ' ' << level;
        }
      }
    }
  }
}

TEST(LearnedShapes, ASmallerErrorIsAskedForInFewerCells) {
  PressedBefore& block = small_block(Law::kCorotational);
  const int all = block.learned(0.02)->size().cells;
  const int some = block.learned(3e-4)->size().cells;
  EXPECT_GT(all, some);
  EXPECT_LE(block.learned(3e-4)->size().error, 3e-4);
  EXPECT_EQ(block.learned(1e-7)->size().cells, 0);
}

}  // namespace
}  // namespace tendon::softbody::learned_test
