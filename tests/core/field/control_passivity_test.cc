// SPDX-License-Identifier: Apache-2.0
// Tests HapticController with random fields, tanks, poses, true forces and motions of the hand. The account must not be
// negative, and the energy given to the hand must not exceed that of the tanks.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <iostream>
#include <limits>
#include <memory>
#include <vector>

#include "core/base/rotation.h"
#include "core/haptic_controller.h"
#include "core/ledger/energy_ledger.h"
#include "tests/core/field/random_table.h"
#include "tests/core/field/shapes.h"
#include "tests/support/dice.h"
#include "tests/support/property_cases.h"

namespace tendon::field::control_passivity_test {
namespace {

constexpr int kSteps = 400;
constexpr std::size_t kMostChannels = 3;

const std::array<BrickField, 2>& grids() {
  static const auto made = [] {
    auto fields = std::make_unique<std::array<BrickField, 2>>();
    const Vec3 half = Vec3::Constant(0.04);
    sample(torus, -half, half, 4e-3, (*fields)[0]);
    sample(sharp_box, -half, half, 4e-3, (*fields)[1]);
    return fields;
  }();
  return *made;
}

Field random_field(Dice& dice, double most_stiffness) {
  Field field;
  if (dice.chance(0.5)) field.bricks = &grids()[dice.bits() % 2];
  if (!field.bricks || dice.chance(0.3)) {
    field.primitives = {{.shape = Sphere{.centre = 0.02 * dice.direction(), .radius = dice.within(0.005, 0.03)}}};
  }
  if (dice.chance(0.3)) {
    field.fixtures = {{.kind = static_cast<Fixture::Kind>(dice.bits() % 3),
                       .at = 0.02 * dice.direction(),
                       .direction = dice.direction(),
                       .stiffness = most_stiffness * dice.decades(-2, 0)}};
    if (dice.chance(0.5)) field.fixtures[0].most_force = dice.decades(-1, 1);
  }
  field.materials = {{.stiffness = 0.6 * most_stiffness * dice.decades(-1, 0),
                      .branch = dice.chance(0.5) ? 0 : 0.4 * most_stiffness,
                      .tau = dice.within(0.02, 0.3),
                      .friction = dice.chance(0.5) ? 0 : dice.uniform()}};
  describe_table(dice, most_stiffness, field.materials[0]);
  return field;
}

TimedPose random_pose(Dice& dice, LocalTime now) {
  return {.at = now + dice.milliseconds(-100, 100),
          .pose = {.position = 0.02 * dice.direction(), .turn = rotation_by(0.5 * dice.direction())},
          .velocity = dice.within(0, 1) * dice.direction(),
          .angular_velocity = dice.within(0, 5) * dice.direction()};
}

struct Outcome {
  double least_energy = 0;  ///< J, minimum of E
  double least_owned = 0;   ///< J, minimum of the ledger without credits, plus push_j + push_w t of all channels
  double worst_stored = 0;  ///< J, maximum of H − E − credit
  double credited = 0;      ///< J
  double worst_excess = 0;  ///< N above the bound
  bool all_finite = true;
  std::uint64_t rendered = 0;  ///< steps with a field
  std::uint64_t refused = 0;   ///< steps in which the gate refused energy
};

/// If `gentle` is true, the sum of the stiffnesses is at most 2b/T and nothing else acts, so Theorem 1 applies.
Outcome run(std::uint64_t seed, bool gentle) {
  Dice dice(seed);
  HapticController::Config config;
  constexpr double kHold = 2e-3;
  config.limiter.law = dice.chance(0.5) ? Law::kAol : Law::kAolPlus;
  config.limiter.friction = {dice.chance(0.5) ? 0.0 : dice.decades(-3, -1), dice.decades(-2, 0.3)};
  config.limiter.longest_hold = from_seconds(kHold);
  config.limiter.shared_account = true;
  config.max_force = gentle ? 1e6 : dice.decades(0, 2);
  config.max_slew = gentle || dice.chance(0.5) ? std::numeric_limits<double>::infinity() : dice.decades(2, 5);
  const std::size_t channels = 1 + dice.bits() % kMostChannels;
  config.channels.assign(channels, ChannelRule::kSum);
  if (!gentle && dice.chance(0.3)) config.channels.assign(channels, ChannelRule::kPriority);
  const double theorem = 2 * config.limiter.friction.viscous / kHold / static_cast<double>(channels);
  // A material and a fixture.
  const double most_stiffness = gentle ? theorem / 2 : dice.decades(1, 4);
  auto& renderer = config.hold.field.emplace();
  renderer.max_stiffness = most_stiffness;
  renderer.learns = dice.chance(0.5);
  renderer.holds = !gentle && dice.chance(0.5);
  if (dice.chance(0.5))
    renderer.push = {.push_j = dice.decades(-4, -1), .push_w = dice.chance(0.5) ? 0 : dice.decades(-2, 0)};
  HapticController controller(config);
  EnergyLedger ledger(config.limiter.friction);

  std::vector<std::unique_ptr<Field>> fields;
  std::uint32_t generation = 0;
  LocalTime now{};
  const auto swap = [&](std::size_t channel, std::uint32_t source) {
    fields.push_back(std::make_unique<Field>(random_field(dice, most_stiffness)));
    controller.use({.field = fields.back().get(), .generation = ++generation, .source = source}, now, channel);
  };
  for (std::size_t i = 0; i < channels; ++i) swap(i, 1);

  Outcome outcome;
  Vec3 x = 0.05 * dice.direction();
  Vec3 v = Vec3::Zero();
  Vec3 applied = Vec3::Zero();
  Step step;
  const auto style = dice.bits() % 4;
  for (std::uint64_t k = 1; k <= kSteps; ++k) {
    const std::size_t channel = dice.bits() % channels;
    const std::uint32_t source = gentle || dice.chance(0.9) ? 1 : 2;
    if (dice.chance(0.02)) swap(channel, source);
    if (dice.chance(0.05)) controller.observe(random_pose(dice, now), channel);
    if (dice.chance(0.1)) {
      controller.observe({.answers_tick = k - std::min<std::uint64_t>(k, dice.bits() % 50),
                          .received = now,
                          .force = dice.decades(-2, 2) * dice.direction(),
                          .source = source,
                          .field = generation - std::min(generation, static_cast<std::uint32_t>(dice.bits() % 2))},
                         channel);
    }
    if (!gentle) {
      if (dice.chance(0.005)) controller.release(now, source, channel);
      if (dice.chance(0.005)) controller.use({.field = nullptr, .generation = 0, .source = source}, now, channel);
      if (dice.chance(0.05)) {
        controller.observe({.sequence = k,
                            .received = now,
                            .force = dice.decades(-2, 3) * dice.direction(),
                            .valid_for = dice.milliseconds(1, 100),
                            .source = source},
                           channel);
      }
      if (dice.chance(0.005)) controller.disarm();
      if (dice.chance(0.02)) controller.rearm();
    }
    const Duration held = gentle ? from_seconds(kHold) : from_seconds(kHold * dice.within(0.3, 1));
    now += held;
    Vec3 dx;
    if (style == 0) {  // eq. (7)
      const double size = applied.norm();
      const double excess = std::max(size - config.limiter.friction.coulomb, 0.0);
      if (size > 0)
        dx = applied / size * seconds(held) * excess / (2 * config.limiter.friction.viscous);
      else
        dx = 1e-3 * dice.direction();
      if (dice.chance(0.3)) dx = dice.decades(-6, -3) * dice.direction();
    } else if (style == 1 && step.field) {  // presses slowly and then returns to the proxy
      dx = k % 60 < 50 ? Vec3(-1e-4 * x.normalized()) : Vec3(step.field->proxy - x);
    } else {
      v = 0.97 * v + 0.03 * dice.direction();
      dx = v * seconds(held) - 0.01 * x;
    }
    if (dx.norm() > 5e-3) dx *= 5e-3 / dx.norm();
    if (!gentle && dice.chance(0.01)) {
      step = controller.step_unseen(now, applied);
      ledger.observe_unseen(applied.norm(), held);
      applied = Vec3::Zero();
      outcome.least_energy = std::min(outcome.least_energy, step.energy);
      continue;
    }
    x += dx;
    ledger.observe(applied, dx, held);
    step = controller.step({.at = now, .position = x}, applied);
    outcome.all_finite = outcome.all_finite && step.force.allFinite() && step.wanted.allFinite();
    outcome.least_energy = std::min(outcome.least_energy, step.energy);
    outcome.worst_excess = std::max(outcome.worst_excess, step.force.norm() - step.permitted * (1 + 1e-12));
    if (step.field) {
      ++outcome.rendered;
      if (step.field->refused > 1e-12) ++outcome.refused;
      outcome.credited += step.field->credit;
      outcome.worst_stored = std::max(outcome.worst_stored, step.field->stored - step.energy - step.field->credit);
    }
    const double tanks =
        static_cast<double>(channels) * (renderer.push.push_j + renderer.push.push_w * seconds(now.time_since_epoch()));
    outcome.least_owned = std::min(outcome.least_owned, ledger.energy() + tanks);
    applied = step.force;
  }
  return outcome;
}

int runs() { return property_cases() >= 10'000 ? 10'000 : 200; }

TEST(FieldPassivity, NoHandFieldPoseOrTruthMakesTheAccountNegative) {
  Outcome all;
  for (int i = 1; i <= runs(); ++i) {
    const Outcome one = run(static_cast<std::uint64_t>(i), false);
    ASSERT_GE(one.least_energy, -1e-9) << "seed " << i;
    ASSERT_GE(one.least_owned, -1e-9) << "seed " << i;
    ASSERT_LE(one.worst_excess, 0) << "seed " << i;
    ASSERT_TRUE(one.all_finite) << "seed " << i;
    all.credited += one.credited;
    all.rendered += one.rendered;
    all.refused += one.refused;
  }
  std::cout << runs() << " runs of " << kSteps << " steps, seeds 1 … " << runs() << ": a field in " << all.rendered
            << " steps, the gates refused in " << all.refused << ", the tanks paid " << all.credited << " J\n";
  EXPECT_GT(all.rendered, 200U * static_cast<std::uint64_t>(runs()));
  EXPECT_GT(all.credited, 0);
}

TEST(FieldPassivity, FieldsTogetherNeverStoreMoreThanTheAccount) {
  Outcome all;
  for (int i = 1; i <= runs(); ++i) {
    const Outcome one = run(static_cast<std::uint64_t>(i), true);
    ASSERT_LE(one.worst_stored, 1e-9) << "seed " << i;
    ASSERT_GE(one.least_energy, -1e-9) << "seed " << i;
    all.worst_stored = std::max(all.worst_stored, one.worst_stored);
    all.refused += one.refused;
  }
  std::cout << runs() << " runs of " << kSteps << " steps: most H - E " << all.worst_stored
            << " J, the gates refused in " << all.refused << " steps\n";
  EXPECT_GT(all.refused, static_cast<std::uint64_t>(runs())) << "the gates were hardly tested";
}

}  // namespace
}  // namespace tendon::field::control_passivity_test
