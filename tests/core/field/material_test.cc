// SPDX-License-Identifier: Apache-2.0
#include "core/field/material.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "core/field/fixture.h"
#include "tests/core/field/random_table.h"
#include "tests/support/dice.h"
#include "tests/support/refusal.h"

namespace tendon::field::material_test {
namespace {

constexpr double kMostStiffness = 1500;

Material random_material(Dice& dice) {
  Material material{.stiffness = dice.within(50, 1000),
                    .branch = dice.chance(0.3) ? 0 : dice.within(0, 500),
                    .tau = dice.within(0.01, 1)};
  describe_table(dice, kMostStiffness, material);
  return material;
}

TEST(FieldMaterial, ADentNeverMakesEnergy) {
  Dice dice(7);
  for (int run = 0; run < 500; ++run) {
    const Material law = random_material(dice);
    double dent = 0;
    double depth = 0;
    for (int k = 0; k < 100; ++k) {
      depth = dice.chance(0.2) ? 0 : dice.within(0, 0.02);
      const double before = law.energy(depth, dent);
      const double period = dice.decades(-4, 1);
      dent = law.relaxed(depth, dent, period);
      EXPECT_LE(law.energy(depth, dent), before + 1e-15) << "run " << run;
      EXPECT_GE(law.energy(depth, dent), 0);
      EXPECT_GE(dent, 0);
    }
  }
}

TEST(FieldMaterial, TheForceIsTheSlopeOfTheEnergyWhichIsConvex) {
  Dice dice(8);
  for (int run = 0; run < 2000; ++run) {
    const Material law = random_material(dice);
    const double dent = dice.chance(0.5) ? 0 : dice.within(0, 0.01);
    const double depth = dice.within(0, 0.02);
    const double h = 1e-8;
    const double slope = (law.energy(depth + h, dent) - law.energy(depth - h, dent)) / (2 * h);
    EXPECT_NEAR(law.force(depth, dent), slope, 1e-4);
    EXPECT_GE(law.force(depth, dent), 0);
    const double more = law.force(depth + 1e-4, dent) - law.force(depth, dent);
    EXPECT_GE(more, -1e-12);
    EXPECT_LE(more, law.most_stiffness() * 1e-4 + 1e-9);
    EXPECT_LE(law.force(depth, dent), law.most_stiffness() * depth + 1e-9);
  }
}

TEST(FieldMaterial, TheDepthOfAnEnergyIsTheInverse) {
  Dice dice(9);
  for (int run = 0; run < 5000; ++run) {
    const Material law = random_material(dice);
    const double dent = dice.chance(0.5) ? 0 : dice.within(0, 0.01);
    const double energy = law.energy(0, dent) + dice.decades(-12, -1);
    const double depth = law.depth_of(energy, dent, 0.02);
    EXPECT_LE(law.energy(depth, dent), energy * (1 + 1e-12));
    if (depth < 0.02) {
      EXPECT_NEAR(law.energy(depth, dent), energy, 1e-12 * energy + 1e-15);
    }
    EXPECT_LE(depth, 0.02);
    EXPECT_EQ(law.depth_of(law.energy(0, dent) - 1e-9, dent, 0.02), 0);
  }
}

TEST(FieldMaterial, AnUnpaidDentShrinksToWhatIsPaid) {
  Dice dice(10);
  for (int run = 0; run < 2000; ++run) {
    const Material law = random_material(dice);
    const double dent = dice.within(0, 0.02);
    const double stored = law.energy(0, dent);
    const double paid = stored * dice.uniform();
    if (stored > 0) {
      EXPECT_LE(law.energy(0, dent * (paid / stored)), paid * (1 + 1e-9) + 1e-18);
    }
  }
}

TEST(FieldMaterial, UnderAHeldHandTheBranchRelaxes) {
  const Material law{.stiffness = 200, .branch = 300, .tau = 0.1};
  double dent = 0;
  EXPECT_NEAR(law.force(0.01, dent), 5, 1e-12);
  for (int k = 0; k < 100; ++k) dent = law.relaxed(0.01, dent, 1e-3);
  EXPECT_NEAR(law.force(0.01, dent), 2 + 3 * std::exp(-1), 0.01);
  EXPECT_EQ(law.force(0.5 * law.rest(dent), dent), 0);
}

TEST(FieldMaterial, ABlendIsLinearInTheForce) {
  Dice dice(11);
  Material a = random_material(dice);
  Material b = random_material(dice);
  a.branch = b.branch = 0;
  for (const double share : {0.0, 0.25, 1.0}) {
    for (const double depth : {0.0005, 0.004, 0.03}) {
      EXPECT_NEAR(blended(a, b, share).force(depth, 0), (1 - share) * a.force(depth, 0) + share * b.force(depth, 0),
                  1e-12);
    }
  }
}

TEST(FieldMaterial, ABlendOfTwoStepsContainsBothTablesAndIsNotStiffer) {
  Dice dice(13);
  for (int run = 0; run < 2000; ++run) {
    Material a = random_material(dice);
    Material b = random_material(dice);
    a.branch = b.branch = 0;
    const double share = dice.uniform();
    const Material both = blended(a, b, share);
    EXPECT_LE(both.most_stiffness(), std::max(a.most_stiffness(), b.most_stiffness()) + 1e-6);
    for (std::size_t i = 1; both.table.used && i <= DepthTable::kKnots; ++i) {
      EXPECT_GE(both.table.force[i] - both.table.force[i - 1], -0.9 * both.stiffness * both.table.step - 1e-12);
    }
    const double end = 16 * both.table.step;
    for (const double depth : {2 * both.table.step, end, 2 * end}) {
      const double expected = (1 - share) * a.force(depth, 0) + share * b.force(depth, 0);
      EXPECT_NEAR(both.force(depth, 0), expected, 1e-9 * (1 + expected)) << "run " << run;
    }
  }
}

TEST(FieldMaterial, ADescribedTableIsRefusedExactlyIfItWouldBeBounded) {
  Dice dice(14);
  int refused = 0;
  for (int run = 0; run < 2000; ++run) {
    Material law = random_material(dice);
    EXPECT_NO_THROW(law.expect_valid(kMostStiffness));
    if (!law.table.used) continue;
    const std::size_t knot = 1 + dice.bits() % DepthTable::kKnots;
    law.table.force[knot] += law.table.step * dice.within(-2000, 2000);
    Material bounded = law;
    bound_table(bounded, kMostStiffness);
    const bool valid = thrown_by([&] { law.expect_valid(kMostStiffness); }).empty();
    EXPECT_EQ(valid, bounded == law);
    refused += valid ? 0 : 1;
  }
  EXPECT_GT(refused, 500);
}

TEST(FieldMaterial, ATableThatCannotBeIsRefusedWithItsKnot) {
  const auto said = [](double step, std::vector<double> forces) {
    const Material law{.stiffness = 200, .branch = 300, .table = DepthTable::of(step, forces)};
    return thrown_by([&] { law.expect_valid(1500); });
  };
  EXPECT_EQ(said(1e-3, {1, 2, 2.5}), "");
  EXPECT_EQ(said(1e-3, {1, 2.1}), "table knot 2 = 2.1: expected 0.82 … 2 N");
  EXPECT_EQ(said(2e-3, {0, -0.37}), "table knot 2 = -0.37: expected -0.36 … 2 N");
  EXPECT_EQ(said(1e-3, {0, std::nan("")}), "table knot 2 = nan: expected -0.18 … 1 N");
  EXPECT_EQ(said(9e-5, {0}), "table.step = 9e-05: expected 1e-04 … 0.1 m");
  EXPECT_EQ(said(0.11, {0}), "table.step = 0.11: expected 1e-04 … 0.1 m");
}

TEST(FieldMaterial, BeyondItsLastForceATableIsConstant) {
  const Material law{.stiffness = 100, .table = DepthTable::of(2e-3, std::vector{0.1, 0.4})};
  EXPECT_NEAR(law.correction(3e-3), 0.25, 1e-12);
  for (const double depth : {4e-3, 5e-3, 32e-3, 1.0}) EXPECT_NEAR(law.correction(depth), 0.4, 1e-12) << depth;
  EXPECT_NEAR(law.most_stiffness(), 250, 1e-9);
}

TEST(FieldFixture, PullsToAPointALineOrAPlaneUpToItsForce) {
  const Vec3 x(0.01, 0.02, 0.03);
  const Vec3 up = Vec3::UnitZ();
  EXPECT_EQ((Fixture{.kind = Fixture::Kind::kPoint, .at = {0, 0, 1}, .stiffness = 1}).nearest(x), Vec3(0, 0, 1));
  EXPECT_EQ((Fixture{.kind = Fixture::Kind::kLine, .direction = up, .stiffness = 1}).nearest(x), Vec3(0, 0, 0.03));
  EXPECT_EQ((Fixture{.kind = Fixture::Kind::kPlane, .direction = up, .stiffness = 1}).nearest(x), Vec3(0.01, 0.02, 0));
  const Fixture law{.stiffness = 200, .most_force = 1};
  Dice dice(12);
  for (int i = 0; i < 1000; ++i) {
    const double d = dice.within(0, 0.02);
    EXPECT_NEAR(law.force(d), (law.energy(d + 1e-8) - law.energy(d - 1e-8)) / 2e-8, 1e-6);
    EXPECT_LE(law.force(d), 1);
    EXPECT_NEAR(law.distance_of(law.energy(d), 1), d, 1e-12);
    EXPECT_EQ(law.distance_of(law.energy(d), 0.5 * d), 0.5 * d);
  }
  EXPECT_EQ((Fixture{.stiffness = 200}).energy(1), 100);  // the force is not limited
}

}  // namespace
}  // namespace tendon::field::material_test
