// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/simulated_gripper.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/devices/device_bench.h"
#include "tests/support/refusal.h"

namespace tendon::simulated_gripper_test {
namespace {

constexpr double kSubstep = 50e-6;

using Hand = SimulatedGripper::Hand;

class Fingers {
 public:
  explicit Fingers(const SimulatedGripper::Config& config) : gripper(config) {}

  void press(double force, Duration::rep substeps, double h = kSubstep) {
    gripper.hold(force);
    gripper.integrate(now, substeps, h);
    now += h * static_cast<double>(substeps);
  }
  const SimulatedGripper::Truth& truth() const { return gripper.truth(); }

  SimulatedGripper gripper;
  double now = 0;
};

SimulatedGripper::Config free_gripper() { return {.open = 0.5, .arm = 0.06, .mass = 0.02, .start = 0.25}; }

ScriptedMotion at_rest(double opening) { return ScriptedMotion(ScriptedMotion::Sine{.centre = {opening, 0, 0}}); }

TEST(SimulatedGripper, AForceOpensItAsNewtonSays) {
  Fingers fingers(free_gripper());
  EXPECT_NEAR(fingers.gripper.sample(), 0.25, 1e-15);
  fingers.press(0.1, 800);  // 40 ms at 5 m/s²: 4 mm
  EXPECT_NEAR(fingers.truth().position, 0.015 + 0.004, 1e-14);
  EXPECT_NEAR(fingers.gripper.sample(), 0.019 / 0.06, 1e-12);
  EXPECT_NEAR(fingers.truth().kinetic_energy, 0.1 * 0.004, 1e-14);
}

TEST(SimulatedGripper, StopsAtItsEndsAndStaysUntilItIsPulledAway) {
  for (const double side : {-1.0, 1.0}) {
    const double end = side < 0 ? 0 : 0.5;
    Fingers fingers(free_gripper());
    for (int i = 0; i < 400; ++i) {
      fingers.press(side * 3, 20);
      ASSERT_GE(fingers.truth().position, 0);
      ASSERT_LE(fingers.truth().position, 0.06 * 0.5);
    }
    EXPECT_NEAR(fingers.gripper.sample(), end, 1e-15);
    EXPECT_EQ(fingers.truth().velocity, 0);
    fingers.press(0, 1000);
    EXPECT_NEAR(fingers.gripper.sample(), end, 1e-15) << "it does not bounce";
    fingers.press(side * -0.1, 200);
    EXPECT_LT(side * (fingers.gripper.sample() - end), -1e-3);
  }
}

TEST(SimulatedGripper, SticksExactlyUntilAForceAboveItsFriction) {
  auto config = free_gripper();
  config.coulomb_friction = 0.3;
  Fingers fingers(config);
  fingers.press(0.299, 20'000);
  fingers.press(-0.299, 20'000);
  EXPECT_EQ(fingers.truth().position, 0.06 * 0.25);
  fingers.press(0.301, 20);
  EXPECT_GT(fingers.truth().position, 0.06 * 0.25);
  fingers.press(0, 20);
  EXPECT_EQ(fingers.truth().velocity, 0);
}

TEST(SimulatedGripper, AHandBringsItToItsOpeningOrPressesTheStop) {
  auto config = free_gripper();
  config.hand = Hand{.stiffness = 400, .damping = 3, .motion = at_rest(0.4)};
  config.start = 0.1;
  Fingers fingers(config);
  fingers.press(0, 20'000);
  EXPECT_NEAR(fingers.gripper.sample(), 0.4, 1e-9);
  fingers.press(1, 20'000);  // the motor pushes against the hand
  EXPECT_NEAR(fingers.gripper.sample(), 0.4 + 1 / (400 * 0.06), 1e-9);
  EXPECT_NEAR(fingers.truth().hand_force, -1, 1e-9);

  config.hand->motion = at_rest(-0.2);
  config.start.reset();
  Fingers squeezed(config);
  squeezed.press(0, 1000);
  EXPECT_EQ(squeezed.gripper.sample(), 0);
  EXPECT_NEAR(squeezed.truth().hand_force, -400 * 0.06 * 0.2, 1e-12);
}

TEST(SimulatedGripper, WorkOfTheHandIsNeverLessThanTheLedgerDemands) {
  // The cases are at the stops and between them. If there is no friction and no contact, the balance is exact.
  double least = 1e300;
  int met = 0;
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    Dice dice(seed);
    auto config = free_gripper();
    config.mass = std::pow(10.0, dice.within(-3, -0.5));
    config.start = dice.within(0, 0.5);
    if (dice.chance(0.6)) config.viscous_friction = std::pow(10.0, dice.within(-3, 0.5));
    if (dice.chance(0.6)) config.coulomb_friction = std::pow(10.0, dice.within(-3, 0));
    if (dice.chance(0.7)) {
      config.hand = Hand{.stiffness = std::pow(10.0, dice.within(1, 5)),
                         .damping = dice.chance(0.2) ? 0 : std::pow(10.0, dice.within(-1, 2)),
                         .motion = ScriptedMotion(ScriptedMotion::Sine{.amplitude = dice.within(0, 0.6),
                                                                       .frequency = dice.within(0.5, 20),
                                                                       .centre = {dice.within(0, 0.5), 0, 0}})};
    }
    Fingers fingers(config);
    double ledger = 0;
    double turnover = 0;
    bool stop = false;
    double force = 0;
    for (int step = 0; step < 200; ++step) {
      if (step % 20 == 0) force = dice.within(-5, 5);
      const double before = fingers.truth().position;
      const Duration::rep substeps = 1 + step % 30;
      for (int i = 0; i < substeps; ++i) {
        fingers.press(force, 1);
        stop = stop || fingers.truth().position == 0 || fingers.truth().position == 0.06 * 0.5;
      }
      const double moved = fingers.truth().position - before;
      ledger += -force * moved + config.coulomb_friction.value_or(0) * std::abs(moved) +
                config.viscous_friction.value_or(0) * moved * moved / (kSubstep * static_cast<double>(substeps));
      turnover += std::abs(force * moved) + std::abs(fingers.truth().hand_work);
      const double balance = fingers.truth().hand_work - fingers.truth().kinetic_energy - ledger;
      least = std::min(least, balance);
      ASSERT_GE(balance, -1e-13 * std::max(1.0, turnover)) << "seed " << seed << ", step " << step;
      if (stop || config.viscous_friction || config.coulomb_friction) continue;
      ASSERT_NEAR(balance, 0, 1e-13 * std::max(1.0, turnover)) << seed;
    }
    met += stop ? 1 : 0;
  }
  EXPECT_LT(least, 1e-12) << "the bound is not even approached: these worlds test nothing";
  EXPECT_GT(met, 500);
}

TEST(SimulatedGripper, TheSampleIsTheCentreOfTheCount) {
  auto config = free_gripper();
  config.encoder_step = 0.01;
  Fingers fingers(config);
  for (int i = 0; i < 200; ++i) {
    fingers.press(0.01, 20);
    const double counts = fingers.gripper.sample() / 0.01;
    ASSERT_NEAR(counts, std::round(counts), 1e-12);
    ASSERT_LE(std::abs(fingers.gripper.sample() - fingers.truth().position / 0.06), 0.005 + 1e-12);
  }
}

TEST(SimulatedGripper, ItsDataSheetHasForceOnlyWithAMotor) {
  auto config = free_gripper();
  EXPECT_EQ(SimulatedGripper(config).info(), (DeviceInfo::Gripper{.open = 0.5, .arm = 0.06, .max_force = 0}));
  config.max_force = 8;
  EXPECT_EQ(SimulatedGripper(config).info().max_force, 8);
}

TEST(SimulatedGripper, RefusesImpossibleValuesNamingTheField) {
  auto good = free_gripper();
  good.hand = Hand{.stiffness = 400, .damping = 3, .motion = at_rest(0.4)};
  expect_refusals(good, Makes<SimulatedGripper>(),
                  {
                      {"gripper.open = 0", [](auto& c) { c.open = 0; }},
                      {"gripper.arm = 0", [](auto& c) { c.arm = 0; }},
                      {"gripper.mass = 0", [](auto& c) { c.mass = 0; }},
                      {"gripper.start = 0.6", [](auto& c) { c.start = 0.6; }},
                      {"gripper.viscous_friction = 0", [](auto& c) { c.viscous_friction = 0; }},
                      {"gripper.coulomb_friction = 0", [](auto& c) { c.coulomb_friction = 0; }},
                      {"gripper.max_force = 0", [](auto& c) { c.max_force = 0; }},
                      {"gripper.encoder_step = 0", [](auto& c) { c.encoder_step = 0; }},
                      {"gripper.hand.stiffness = 0", [](auto& c) { c.hand->stiffness = 0; }},
                      {"gripper.hand.damping = -1", [](auto& c) { c.hand->damping = -1; }},
                  });
}

}  // namespace
}  // namespace tendon::simulated_gripper_test
