// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/near/tabulated.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "tests/clients/softbody/near/pressed_before.h"
#include "tests/support/dice.h"

namespace tendon::softbody::tabulated_test {
namespace {

using testing::PressedBefore;
using testing::small_block;

constexpr Law kBothLaws[] = {Law::kNeoHookean, Law::kCorotational};

TEST(TabulatedAnswers, AKnotHasWhatWasSolvedThere) {
  PressedBefore& block = small_block(Law::kNeoHookean);
  const PressGrid& grid = block.presses.grid;
  const auto fallback_level = block.tabulated(0.1);
  for (const int level : {1, 3, 4}) {
    const Vec2 place = grid.place(1, 2);
    const Reaction& solved = block.presses.knots[static_cast<std::size_t>(grid.knot(1, 2, level))].reaction;
    const Reaction found = fallback_level->press(*block.top.patch_with_curvatures(place), level * grid.step)->reaction;
    EXPECT_NEAR(found.force, solved.force, 1e-9 * solved.force);
    EXPECT_NEAR(found.stiffness, solved.stiffness, 1e-9 * solved.stiffness);
    EXPECT_LT((found.slope - solved.slope).norm(), 1e-9);
    EXPECT_LT((found.glide.tilting - solved.glide.tilting).norm(), 1e-6 * (1 + solved.glide.tilting.norm()));
  }
}

TEST(TabulatedAnswers, ForceAndStiffnessAreTheSlopesOfOneEnergy) {
  PressedBefore& block = small_block(Law::kCorotational);
  const PressGrid& grid = block.presses.grid;
  const auto energy = [&](const Vec3& at) { return energy_at(block.answers, *grid.find(at.head<2>(), at.z())); };
  Dice dice(1);
  for (int i = 0; i < 20; ++i) {
    const Vec3 at(dice.within(-0.004, 0.004), dice.within(-0.004, 0.004), dice.within(0.0005, 0.005));
    const TabulatedEnergy here = energy(at);
    constexpr double kStep = 1e-6;
    const auto difference = [&](int axis, const auto& of) {
      const Vec3 step = kStep * Vec3::Unit(axis);
      return (of(energy(at + step)) - of(energy(at - step))) / (2 * kStep);
    };
    const auto value = [](const TabulatedEnergy& e) { return e.energy; };
    const auto force = [](const TabulatedEnergy& e) { return e.force; };
    EXPECT_NEAR(difference(2, value), here.force, 1e-5 * here.force);
    EXPECT_NEAR(difference(0, value), here.across.x(), 1e-5 * here.force);
    EXPECT_NEAR(difference(1, value), here.across.y(), 1e-5 * here.force);
    // Within one cell, because the second derivatives may jump between cells.
    EXPECT_NEAR(difference(2, force), here.stiffness, 1e-4 * here.stiffness);
    EXPECT_NEAR(difference(0, force), here.mixed.x(), 1e-4 * here.stiffness);
    EXPECT_NEAR(difference(1, force), here.mixed.y(), 1e-4 * here.stiffness);
    EXPECT_NEAR(difference(0, [](const TabulatedEnergy& e) { return e.across.y(); }), here.curves(0, 1),
                1e-3 * here.stiffness);
    EXPECT_NEAR(difference(1, [](const TabulatedEnergy& e) { return e.across.y(); }), here.curves(1, 1),
                1e-2 * here.stiffness);
  }
}

TEST(TabulatedAnswers, PressesBetweenAreWithinTheErrorSaidAndTwoPercent) {
  for (const Law law : kBothLaws) {
    PressedBefore& block = small_block(law);
    const auto fallback_level = block.tabulated(0.02);
    Dice dice(2);
    int covered = 0;
    for (int i = 0; i < 100; ++i) {
      const Vec2 place(dice.within(-0.005, 0.005), dice.within(-0.005, 0.005));
      const double depth = dice.within(1e-4, 0.0055);
      const auto found = fallback_level->press(*block.top.patch_with_curvatures(place), depth);
      ASSERT_TRUE(found) << i;
      const double truth = block.truth(place, depth);
      EXPECT_NEAR(found->reaction.force, truth, 0.02 * truth) << i;
      covered += std::abs(found->reaction.force - truth) <= found->reaction.error ? 1 : 0;
    }
    EXPECT_GE(covered, 99);
  }
}

TEST(TabulatedAnswers, AKnotThatWasNotSolvedIsNotTabulated) {
  PressedBefore& block = small_block(Law::kNeoHookean);
  SolvedPresses presses = block.presses;
  presses.knots[static_cast<std::size_t>(presses.grid.knot(2, 2, 3))].good = false;
  const TabulatedLevel fallback_level(tabulate(presses), 0.1);
  EXPECT_FALSE(fallback_level.press(*block.top.patch(Vec2::Zero()), 3 * presses.grid.step));
  EXPECT_TRUE(fallback_level.press(*block.top.patch(Vec2::Zero()), presses.grid.step));
  EXPECT_EQ(fallback_level.size().cells, fallback_level.size().of_cells - 8);
}

}  // namespace
}  // namespace tendon::softbody::tabulated_test
