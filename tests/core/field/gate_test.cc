// SPDX-License-Identifier: Apache-2.0
// The energy gate against any motion of the hand, any field, swaps, poses, parameters, tables and fixtures, without a
// limiter. A field must never store more than the hand has supplied.
#include "core/field/energy_gate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <iostream>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "core/base/rotation.h"
#include "core/field/renderer.h"
#include "core/ledger/energy_ledger.h"
#include "tests/core/field/random_table.h"
#include "tests/core/field/shapes.h"
#include "tests/support/dice.h"
#include "tests/support/property_cases.h"

namespace tendon::field::gate_test {
namespace {

constexpr double kB = 0.26;  // N·s/m
constexpr double kPeriod = 1e-3;
constexpr double kMostStiffness = 2 * kB / kPeriod;
constexpr int kSteps = 600;

const std::array<BrickField, 4>& grids() {
  static const auto made = [] {
    auto fields = std::make_unique<std::array<BrickField, 4>>();
    const Vec3 half = Vec3::Constant(0.04);
    sample(sphere, -half, half, 2e-3, (*fields)[0]);
    sample(torus, -half, half, 2e-3, (*fields)[1]);
    sample(shell, -half, half, 2e-3, (*fields)[2]);
    sample(sharp_box, -half, half, 2e-3, (*fields)[3]);
    return fields;
  }();
  return *made;
}

struct Outcome {
  double least = 0;        // J, minimum of E − H
  double least_given = 0;  // J, minimum of E without credits from the tank, plus push_j + push_w t
  int bound = 0;           // steps in which the gate refused energy
};

Field random_field(Dice& dice, double stiffness, double fixture_stiffness) {
  Field field{.bricks = &grids()[dice.bits() % 4]};
  if (dice.chance(0.2))
    field.primitives.push_back({.shape = Sphere{.centre = 0.03 * dice.direction(), .radius = 0.01}});
  if (dice.chance(0.2)) field.bricks = nullptr;
  if (fixture_stiffness > 0 && dice.chance(0.7)) {
    field.fixtures.push_back({.kind = static_cast<Fixture::Kind>(dice.bits() % 3),
                              .at = 0.02 * dice.direction(),
                              .direction = dice.direction(),
                              .stiffness = fixture_stiffness});
    if (dice.chance(0.5)) field.fixtures[0].most_force = 0.5;
  }
  Material material{.friction = dice.chance(0.5) ? 0 : dice.uniform()};
  material.branch = dice.chance(0.5) ? 0 : 0.4 * stiffness;
  material.tau = dice.within(0.02, 0.32);
  material.stiffness = (stiffness - material.branch) * (dice.chance(0.7) ? 1 : dice.within(0.05, 1));
  describe_table(dice, stiffness, material);
  field.materials = {material};
  return field;
}

TimedPose random_pose(Dice& dice, LocalTime now) {
  return {.at = now + dice.milliseconds(-100, 100),
          .pose = {.position = 0.01 * dice.direction(), .turn = rotation_by(0.3 * dice.direction())},
          .velocity = dice.within(0, 0.3) * dice.direction(),
          .angular_velocity = dice.within(0, 5) * dice.direction()};
}

/// Simulates one hand. The sum of all stiffnesses is at most share · 2b/T.
Outcome run(std::uint64_t seed, double share, const EnergyGate::Config& push) {
  Dice dice(seed);
  const double fixtures = dice.chance(0.3) ? 0.3 * share * kMostStiffness : 0;
  const double stiffness = share * kMostStiffness - fixtures;
  Renderer renderer({.max_stiffness = stiffness, .push = push, .learns = dice.chance(0.5), .holds = false});
  const Friction friction{dice.chance(0.5) ? 0.0 : 0.02, kB};
  EnergyLedger ledger(friction);
  double credited = 0;
  std::vector<std::unique_ptr<Field>> fields;
  LocalTime now{};
  const auto swap = [&] {
    fields.push_back(std::make_unique<Field>(random_field(dice, stiffness, fixtures)));
    renderer.use(fields.back().get(), now);
  };
  swap();
  Vec3 x = 0.05 * dice.direction();
  Vec3 v = Vec3::Zero();
  Renderer::Rendered last;
  last.proxy = x;
  Outcome outcome;
  const auto style = seed % 4;
  const bool moves = dice.chance(0.5);
  const bool swaps = dice.chance(0.7);
  for (int k = 0; k < kSteps; ++k) {
    Vec3 dx;
    if (style == 0) {
      v = 0.95 * v + 0.01 * dice.direction() - 0.015 * x;
      dx = v * kPeriod;
    } else if (style == 1) {  // the motion that takes the most energy
      dx = (dice.chance(0.5) ? 1 : -1) * last.force * (kPeriod / (2 * kB)) + 2e-4 * dice.direction();
    } else if (style == 2) {  // presses slowly and then returns to the proxy
      dx = k % 60 < 50 ? Vec3(-x.normalized() * (x.norm() > 0.036 ? 1e-3 : 4e-5)) : Vec3(last.proxy - x);
    } else {
      v = 0.98 * v + 0.02 * dice.direction();
      dx = v * kPeriod - 0.004 * x;
    }
    if (dx.norm() > 3e-3) dx *= 3e-3 / dx.norm();
    x += dx;
    ledger.observe(last.force, dx, std::chrono::milliseconds(1));
    now += std::chrono::milliseconds(1);
    if (swaps && dice.chance(0.02)) swap();
    if (moves && dice.chance(0.05)) renderer.observe(random_pose(dice, now));
    if (k > 20 && dice.chance(0.05)) {
      renderer.observe(static_cast<std::uint64_t>(k) - dice.bits() % 20, dice.within(0, 3) * dice.direction(), now);
    }
    last = renderer.render({.at = now, .position = x}, ledger.energy() + credited, static_cast<std::uint64_t>(k + 1));
    credited += last.credit;
    if (last.refused > 1e-12) ++outcome.bound;
    outcome.least = std::min(outcome.least, ledger.energy() + credited - last.stored);
    const double allowed = push.push_j + push.push_w * kPeriod * (k + 1);
    outcome.least_given = std::min(outcome.least_given, ledger.energy() + allowed);
    if (outcome.least < -1e-9) break;
  }
  return outcome;
}

int runs() { return property_cases() >= 10'000 ? 10'000 : 200; }

TEST(FieldGate, AGateNeverStoresMoreThanTheAccount) {
  double least = 0;
  int bound = 0;
  for (int i = 1; i <= runs(); ++i) {
    const Outcome outcome = run(static_cast<std::uint64_t>(i), 1, {});
    least = std::min(least, outcome.least);
    bound += outcome.bound;
    ASSERT_GE(outcome.least, -1e-9) << "seed " << i;
    ASSERT_GE(outcome.least_given, -1e-9) << "seed " << i;
  }
  RecordProperty("least_E_minus_H_joules", std::to_string(least));
  std::cout << runs() << " runs of " << kSteps << " steps, seeds 1 … " << runs() << ": least E - H " << least
            << " J, the gate refused in " << 100.0 * bound / runs() / kSteps << " % of the steps\n";
  EXPECT_GT(bound, runs()) << "the gate was hardly tested";
}

TEST(FieldGate, ASlightlyStifferFieldBreaksTheClaim) {
  int broken = 0;
  int first = 0;
  for (int i = 1; i <= runs(); ++i) {
    if (run(static_cast<std::uint64_t>(i), 1.02, {}).least >= -1e-9) continue;
    if (broken++ == 0) first = i;
  }
  std::cout << "K = 1.02 · 2b/T: " << broken << " of " << runs() << " runs store more than the account, first seed "
            << first << "\n";
  EXPECT_GT(broken, 0) << "the claim is not tight, or the adversaries are too weak";
}

TEST(FieldGate, APoseGivesTheHandAtMostItsTank) {
  const EnergyGate::Config push{.push_j = 0.01, .push_w = 0.2};
  double least = 0;
  for (int i = 1; i <= runs(); ++i) {
    const Outcome outcome = run(static_cast<std::uint64_t>(i), 1, push);
    ASSERT_GE(outcome.least, -1e-9) << "seed " << i;
    ASSERT_GE(outcome.least_given, -1e-9) << "seed " << i;
    least = std::min(least, outcome.least);
  }
  std::cout << "tank of 10 mJ and 0.2 W: least E - H " << least << " J\n";
}

TEST(FieldGate, SpringsSettleOneAfterTheOther) {
  EnergyGate gate({.push_j = 1, .push_w = 0});
  gate.open(10, 4, EnergyGate::kNoLimit, kPeriod);
  EXPECT_EQ(gate.most(3), 3 + 6 + 1);
  gate.settle(3, 7);  // pays 4 of 6
  EXPECT_EQ(gate.most(1), 1 + 2 + 1);
  gate.settle(1, 0);  // a decrease is not available to other springs
  EXPECT_EQ(gate.most(0), 2 + 1);
  gate.settle(0, 2.5);
  EXPECT_EQ(gate.drawn(), 0.5);
  EXPECT_EQ(gate.tank(), 0.5);
  gate.open(0, 2, EnergyGate::kNoLimit, kPeriod);  // the account is below the stored energy
  EXPECT_EQ(gate.most(2), 2 + 0.5);
  gate.open(std::numeric_limits<double>::quiet_NaN(), 2, EnergyGate::kNoLimit, kPeriod);
  EXPECT_EQ(gate.most(2), 2 + 0.5);
  gate.open(10, 0, 0.2, kPeriod);
  EXPECT_EQ(gate.most(0), 0.2 * kPeriod + 0.5);
}

}  // namespace
}  // namespace tendon::field::gate_test
