// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/near/press_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "tests/clients/softbody/near/pressed_before.h"

namespace tendon::softbody::press_grid_test {
namespace {

using testing::kB1PatchRadius;
using testing::pressed_block;
using testing::PressedBefore;
using testing::small_block;

VectorXd displaced(const Solid& solid, const VectorXd& free) {
  VectorXd all = VectorXd::Zero(solid.size());
  solid.add_free(free, all);
  return all;
}

TEST(SolvedPresses, AFactorServesForManyAndEachBeginsNextToItsShape) {
  for (const Law law : {Law::kNeoHookean, Law::kCorotational}) {
    const SolvedPresses& presses = small_block(law).presses;
    const int wanted = presses.grid.places() * PressGrid::kLevels + presses.grid.cells();
    EXPECT_EQ(presses.work.presses, wanted);
    EXPECT_LE(presses.work.factors, wanted / 20);
    EXPECT_LE(presses.work.steps, 3.1 * wanted);
  }
}

TEST(SolvedPresses, ForceStiffnessGlideAndEnergyAreThoseByAFactorOfTheirOwn) {
  for (const Law law : {Law::kNeoHookean, Law::kCorotational}) {
    PressedBefore& block = small_block(law);
    const PressGrid& grid = block.presses.grid;
    QuasiStaticModel exact(block.solid, block.top, {.max_iterations = 200, .tolerance = 1e-10});
    for (const int i : {0, 2, 3}) {
      const Patch patch = *block.top.patch_with_curvatures(grid.place(i, 1));
      for (const int level : {1, 3, 5}) {
        const SolvedPress& press = block.presses.knots[at(grid.knot(i, 1, level))];
        ASSERT_TRUE(press.good);
        exact.set_displacements(displaced(block.solid, press.shape));
        exact.press(patch, Prescribed::kDepth, level * grid.step);
        exact.renew_factor();
        const Reaction truth = exact.press(patch, Prescribed::kDepth, level * grid.step);
        EXPECT_NEAR(press.reaction.force, truth.force, 5e-6 * truth.force);
        EXPECT_NEAR(press.energy, exact.forces().energy, 1e-9 * press.energy);
        EXPECT_NEAR(press.reaction.stiffness, truth.stiffness, 1e-4 * truth.stiffness);
        EXPECT_NEAR((press.reaction.glide.tilting - truth.glide.tilting).norm(), 0, 5e-5 * truth.stiffness);
        EXPECT_NEAR((press.reaction.glide.giving - truth.glide.giving).norm(), 0, 2e-4 * truth.glide.giving.norm());
      }
    }
  }
}

/// 30 mm, so deep that the force decreases and the body folds: elements would be inverted.
TEST(SolvedPresses, WhereTheBodyFallsToAnotherShapeNoneIsGood) {
  const Solid solid = pressed_block(Element::kHex8Sri, 6, 0.45, Law::kNeoHookean);
  const TouchSurface top(solid.mesh(), Vec3::UnitZ(), 0.03);
  const PressGrid grid{.middle = Vec2::Zero(), .spacing = 0.005, .around = 2, .step = 0.006};
  QuasiStaticModel plain(solid, top, {.max_iterations = 200});
  Reaction above;
  for (int level = 1; level <= 4; ++level) {
    const Reaction here = plain.press(*top.patch(Vec2::Zero()), Prescribed::kDepth, level * grid.step);
    EXPECT_EQ(here.force > above.force, level < 4);
    above = here;
  }
  ASSERT_GT(solid.inverted(plain.displacements()), 0);

  const SolvedPresses presses = solve_presses(solid, top, grid, false, {});
  for (int place = 0; place < grid.places(); ++place) {
    for (int level = 0; level <= PressGrid::kLevels; ++level) {
      const SolvedPress& press = presses.knots[at(place * (PressGrid::kLevels + 1) + level)];
      EXPECT_TRUE(level > 2 || press.good) << place << ' ' << level;
      EXPECT_FALSE(level > 3 && press.good) << place << ' ' << level;
      EXPECT_EQ(press.shape.size() > 0, press.good && level > 0);
      if (press.shape.size() == 0) continue;
      EXPECT_EQ(solid.inverted(displaced(solid, press.shape)), 0) << place << ' ' << level;
    }
  }
  for (int cell = 0; cell < grid.cells(); ++cell) {
    EXPECT_FALSE(cell % PressGrid::kLevels >= 3 && presses.middles[at(cell)].good) << cell;
  }
}

TEST(SolvedPresses, WithoutGlidesForceAndShapeAreAsGoodAndNothingIsTabulated) {
  PressedBefore& block = small_block(Law::kNeoHookean);
  const SolvedPresses without = solve_presses(block.solid, block.top, block.presses.grid, false, {});
  for (std::size_t knot = 0; knot < without.knots.size(); ++knot) {
    const SolvedPress& press = without.knots[knot];
    const SolvedPress& with = block.presses.knots[knot];
    ASSERT_TRUE(press.good);
    EXPECT_FALSE(press.reaction.knows_glide);
    EXPECT_NEAR(press.reaction.force, with.reaction.force, 1e-5 * with.reaction.force);
    EXPECT_NEAR((press.shape - with.shape).norm(), 0, 1e-4 * with.shape.norm());
  }
  EXPECT_EQ(TabulatedLevel(tabulate(without), 0.02).size().cells, 0);
}

TEST(SolvedPresses, EachPressIsToldOfAndHowManyThereWillBe) {
  const Solid solid = pressed_block(Element::kHex8Sri, 4, 0.45, Law::kCorotational);
  const TouchSurface top(solid.mesh(), Vec3::UnitZ(), kB1PatchRadius);
  const PressGrid grid = PressGrid::over(Vec2::Zero(), 0.005, kB1PatchRadius);
  int told = 0;
  std::string last;
  solve_presses(solid, top, grid, false, [&](std::string_view what) {
    ++told;
    last = what;
  });
  EXPECT_EQ(told, 205);
  EXPECT_EQ(last, "pressing the body: 205 of 205 presses");
}

}  // namespace
}  // namespace tendon::softbody::press_grid_test
