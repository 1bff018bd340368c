// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/simulated_rotation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/devices/device_bench.h"
#include "tests/support/refusal.h"

namespace tendon::simulated_rotation_test {
namespace {

constexpr double kSubstep = 50e-6;
constexpr double kPi = std::numbers::pi;

using Hand = SimulatedRotation::Hand;

class Spindle {
 public:
  explicit Spindle(const SimulatedRotation::Config& config) : rotation(config) {}

  void turn(const Vec3& torque, Duration::rep substeps, double h = kSubstep) {
    rotation.hold(torque);
    rotation.integrate(now, substeps, h);
    now += h * static_cast<double>(substeps);
  }
  const SimulatedRotation::Truth& truth() const { return rotation.truth(); }

  SimulatedRotation rotation;
  double now = 0;
};

Vec3 turn_to(const SimulatedRotation::Truth& truth, const Vec3& wanted) {
  return turn_between(truth.orientation, rotation_by(wanted));
}

SimulatedRotation::Config free_handle() { return {.inertia = 2e-5}; }

SimulatedRotation::Config held_handle(const Vec3& where, double damping = 0) {
  SimulatedRotation::Config config = free_handle();
  config.hand =
      Hand{.stiffness = 0.5, .damping = damping, .motion = ScriptedMotion(ScriptedMotion::Sine{.centre = where})};
  return config;
}

TEST(SimulatedRotation, TurnsFreelyForEverAndKeepsItsEnergy) {
  auto config = free_handle();
  config.start = Vec3(0.3, -0.2, 0.5);
  config.start_angular_velocity = {3, -4, 12};
  Spindle spindle(config);
  spindle.turn(Vec3::Zero(), 200'000);  // 10 s, about 20 revolutions
  EXPECT_NEAR((spindle.truth().angular_velocity - Vec3(3, -4, 12)).norm(), 0, 1e-11);
  EXPECT_NEAR(spindle.truth().kinetic_energy, 2e-5 * 169 / 2, 1e-15);
  const Quat exact = product(rotation_by(Vec3(30, -40, 120)), rotation_by(Vec3(0.3, -0.2, 0.5)));
  EXPECT_LT(turn_between(exact, spindle.truth().orientation).norm(), 1e-9);
  EXPECT_TRUE(is_rotation(spindle.truth().orientation));
}

TEST(SimulatedRotation, ATorqueTurnsItAboutItsBaseFrameAxisHoweverItLies) {
  auto config = free_handle();
  config.start = Vec3(1, 2, -0.5);
  Spindle spindle(config);
  spindle.turn({0, 1e-3, 0}, 2000);  // 0.1 s at 50 rad/s²: 0.25 rad
  EXPECT_NEAR((spindle.truth().angular_velocity - Vec3(0, 5, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR((turn_between(rotation_by(*config.start), spindle.truth().orientation) - Vec3(0, 0.25, 0)).norm(), 0,
              1e-12);
}

TEST(SimulatedRotation, ViscousFrictionSlowsItAsTheClosedForm) {
  auto config = free_handle();
  config.viscous_friction = 4e-4;  // time constant of 50 ms
  config.start_angular_velocity = {0, 0, 10};
  Spindle spindle(config);
  spindle.turn(Vec3::Zero(), 1000);
  EXPECT_NEAR(spindle.truth().angular_velocity.z(), 10 * std::exp(-1.0), 1e-6);
}

TEST(SimulatedRotation, SticksExactlyAndBreaksLooseAboveItsFriction) {
  auto config = free_handle();
  config.coulomb_friction = 2e-3;
  config.start_angular_velocity = {5, 0, 0};
  Spindle spindle(config);
  spindle.turn(Vec3::Zero(), 1001);  // this takes 50 ms, from 5 rad/s at −100 rad/s²
  EXPECT_EQ(spindle.truth().angular_velocity, Vec3::Zero());
  EXPECT_NEAR(rotation_vector(spindle.truth().orientation).x(), 0.125, 1e-6);
  const Quat stuck = spindle.truth().orientation;
  spindle.turn(Vec3(1, 1, -1) * (1.999e-3 / std::sqrt(3)), 20'000);
  EXPECT_EQ(spindle.truth().angular_velocity, Vec3::Zero());
  EXPECT_EQ(turn_between(stuck, spindle.truth().orientation), Vec3::Zero());
  spindle.turn(Vec3(1, 1, -1) * (2.001e-3 / std::sqrt(3)), 20'000);
  EXPECT_GT(spindle.truth().angular_velocity.norm(), 0);
}

TEST(SimulatedRotation, AHandSwingsItAsASpringDoesAtAnyAngle) {
  // The period 2π √(J/K) of a linear spring does not depend on the amplitude.
  for (const double angle : {0.01, 0.5, 2.5}) {
    auto config = held_handle(Vec3::Zero());
    config.start = Vec3(0, angle, 0);
    Spindle spindle(config);
    const double period = 2 * kPi * std::sqrt(2e-5 / 0.5);
    spindle.turn(Vec3::Zero(), 794, period / 794);
    EXPECT_NEAR((rotation_vector(spindle.truth().orientation) - Vec3(0, angle, 0)).norm(), 0, 1e-5 * angle);
    spindle.turn(Vec3::Zero(), 397, period / 794);
    EXPECT_NEAR((rotation_vector(spindle.truth().orientation) + Vec3(0, angle, 0)).norm(), 0, 3e-5 * angle);
  }
}

TEST(SimulatedRotation, AHandBringsItWhereItWantsFromAnySide) {
  Dice dice(3);
  for (int i = 0; i < 50; ++i) {
    const Vec3 wanted = random_vector(dice, 1.8);
    auto config = held_handle(wanted, 3e-3);
    config.start = random_vector(dice, 1.8);
    Spindle spindle(config);
    spindle.turn(Vec3::Zero(), 20'000);
    EXPECT_LT(turn_to(spindle.truth(), wanted).norm(), 1e-6) << i;
    EXPECT_LT(spindle.truth().hand_torque.norm(), 1e-6);
  }
}

TEST(SimulatedRotation, AHandThatTurnsAboutChangingAxesIsFollowed) {
  // Only the damper moves the handle, at the script's angular velocity. The rotation vector's rate would drift.
  auto config = free_handle();
  config.inertia = 1e-7;
  const ScriptedMotion motion(
      ScriptedMotion::MinimumJerk{.points = {{1.2, 0, 0}, {0, 1.5, 0}, {0, -0.5, 1.4}},
                                  .durations = {std::chrono::milliseconds(300), std::chrono::milliseconds(300)},
                                  .back_and_forth = false});
  config.hand = Hand{.stiffness = 1e-9, .damping = 1, .motion = motion};
  Spindle spindle(config);
  double furthest = 0;
  for (int i = 0; i < 600; ++i) {
    spindle.turn(Vec3::Zero(), 20);
    furthest = std::max(furthest, turn_to(spindle.truth(), motion.at(spindle.now).position).norm());
  }
  EXPECT_LT(furthest, 1e-5);
}

TEST(SimulatedRotation, RecordedMotionAlongAnAxisIsATurnAboutIt) {
  auto config = free_handle();
  ScriptedMotion::Recorded recorded{.samples = {{0, 0}, {0.5, 1}, {1, 2}}, .direction = {0, 0, 1}};
  config.hand = Hand{.stiffness = 5, .damping = 0.02, .motion = ScriptedMotion(recorded)};
  Spindle spindle(config);
  spindle.turn(Vec3::Zero(), 40'000);
  EXPECT_NEAR((rotation_vector(spindle.truth().orientation) - Vec3(0, 0, 2)).norm(), 0, 1e-6);
}

struct World {
  SimulatedRotation::Config config;
  bool pushes_along = false;  ///< the adversary pushes along the rotation

  explicit World(Dice& dice) {
    config.inertia = std::pow(10.0, dice.within(-6, -3));
    config.start = random_vector(dice, 2);
    config.start_angular_velocity = random_vector(dice, 10);
    if (dice.chance(0.7)) config.viscous_friction = std::pow(10.0, dice.within(-6, -2));
    if (dice.chance(0.7)) config.coulomb_friction = std::pow(10.0, dice.within(-5, -2));
    if (dice.chance(0.7)) {
      ScriptedMotion::Script script = ScriptedMotion::Sine{.amplitude = dice.within(0, 1.5),
                                                           .frequency = dice.within(0.1, 10),
                                                           .centre = random_vector(dice, 0.5),
                                                           .direction = random_vector(dice, 1)};
      if (dice.chance(0.5)) {
        script = ScriptedMotion::RampHold{.from = random_vector(dice, 1.5),
                                          .to = random_vector(dice, 1.5),
                                          .ramp = from_seconds(dice.within(0.01, 0.2)),
                                          .hold = from_seconds(dice.within(0, 0.1))};
      }
      config.hand = Hand{.stiffness = std::pow(10.0, dice.within(-2, 3)),
                         .damping = dice.chance(0.2) ? 0 : std::pow(10.0, dice.within(-4, -1)),
                         .motion = ScriptedMotion(script)};
    }
    pushes_along = dice.chance(0.3);
  }
};

TEST(SimulatedRotation, WorkOfTheHandIsNeverLessThanTheLedgerDemands) {
  // Each interval is one substep, so turn_between gives the true rotation for every axis.
  double least = 1e300;
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    Dice dice(seed);
    const World world(dice);
    Spindle spindle(world.config);
    const double at_start = spindle.truth().kinetic_energy;
    double ledger = 0;
    double turnover = 0;
    Vec3 torque = Vec3::Zero();
    for (int step = 0; step < 300; ++step) {
      if (step % 10 == 0) torque = random_vector(dice, 0.2);
      if (world.pushes_along) torque = spindle.truth().angular_velocity.normalized() * 0.1;
      const Quat before = spindle.truth().orientation;
      const double h = dice.within(20e-6, 50e-6);
      spindle.turn(torque, 1, h);
      const Vec3 turned = turn_between(before, spindle.truth().orientation);
      ledger += -torque.dot(turned) + world.config.coulomb_friction.value_or(0) * turned.norm() +
                world.config.viscous_friction.value_or(0) * turned.squaredNorm() / h;
      turnover += std::abs(torque.dot(turned)) + std::abs(spindle.truth().hand_work);
      const double balance = spindle.truth().hand_work + at_start - spindle.truth().kinetic_energy - ledger;
      least = std::min(least, balance);
      ASSERT_GE(balance, -1e-13 * std::max(1.0, turnover)) << "seed " << seed << ", step " << step;
      if (world.config.coulomb_friction) continue;
      ASSERT_NEAR(balance, 0, 1e-13 * std::max(1.0, turnover)) << seed;
    }
  }
  EXPECT_LT(least, 1e-12) << "the bound is not even approached: these worlds test nothing";
}

TEST(SimulatedRotation, AboutOneAxisTheBalanceHoldsOverWholePeriods) {
  auto config = held_handle(Vec3(0, 0, 0.4), 1e-3);
  config.viscous_friction = 1e-4;
  config.coulomb_friction = 1e-3;
  Spindle spindle(config);
  double ledger = 0;
  double gap = 0;
  for (int step = 0; step < 3000; ++step) {
    const Quat before = spindle.truth().orientation;
    const Vec3 torque(0, 0, step / 100 % 2 == 0 ? 0.05 : -0.05);
    spindle.turn(torque, 20);
    const Vec3 turned = turn_between(before, spindle.truth().orientation);
    ledger += -torque.dot(turned) + 1e-3 * turned.norm() + 1e-4 * turned.squaredNorm() / 1e-3;
    gap = spindle.truth().hand_work - spindle.truth().kinetic_energy - ledger;
    ASSERT_GE(gap, -1e-12) << step;
  }
  EXPECT_LT(gap, 0.3 * std::abs(ledger)) << "what the ledger does not see is friction within a period";
}

TEST(SimulatedRotation, TheSampleIsTheNearestCountFromTheStart) {
  auto config = free_handle();
  config.start = Vec3(0.2, 1, -0.7);
  config.start_angular_velocity = {2, 5, -7};
  config.encoder_step = 1e-3;
  Spindle spindle(config);
  EXPECT_EQ(turn_between(rotation_by(*config.start), spindle.rotation.sample()), Vec3::Zero());
  double furthest = 0;
  for (int i = 0; i < 2000; ++i) {  // passes 180° several times
    spindle.turn(Vec3::Zero(), 17);
    const Quat seen = spindle.rotation.sample();
    ASSERT_TRUE(is_rotation(seen));
    const Vec3 counts = turn_between(rotation_by(*config.start), seen) / 1e-3;
    // Just below 180° the rounded vector may exceed π, and the reported rotation then has the opposite sign.
    const double off = (counts - counts.array().round().matrix()).norm();
    ASSERT_LT(counts.norm() < 3140 ? off : 0.0, 1e-9);
    furthest = std::max(furthest, turn_between(spindle.truth().orientation, seen).norm());
  }
  EXPECT_LE(furthest, 1e-3 * std::sqrt(3) / 2 + 1e-12);
  EXPECT_GT(furthest, 0.6e-3);
}

TEST(SimulatedRotation, StartsWhereTheHandIsOrWhereItIsTold) {
  EXPECT_EQ(SimulatedRotation(held_handle({0, 1, 0})).truth().orientation, rotation_by({0, 1, 0}));
  EXPECT_EQ(SimulatedRotation(free_handle()).truth().orientation, Quat{});
  auto config = held_handle({0, 1, 0});
  config.start = Vec3(0.5, 0, 0);
  EXPECT_EQ(SimulatedRotation(config).truth().orientation, rotation_by({0.5, 0, 0}));
}

TEST(SimulatedRotation, RefusesImpossibleValuesNamingTheField) {
  expect_refusals(held_handle(Vec3::Zero()), Makes<SimulatedRotation>(),
                  {
                      {"rotation.inertia = 0", [](auto& c) { c.inertia = 0; }},
                      {"rotation.start", [](auto& c) { c.start = Vec3(0, NAN, 0); }},
                      {"rotation.start_angular_velocity", [](auto& c) { c.start_angular_velocity.z() = INFINITY; }},
                      {"rotation.viscous_friction = 0", [](auto& c) { c.viscous_friction = 0; }},
                      {"rotation.coulomb_friction = -1", [](auto& c) { c.coulomb_friction = -1; }},
                      {"rotation.max_torque = 0", [](auto& c) { c.max_torque = 0; }},
                      {"rotation.encoder_step = 0", [](auto& c) { c.encoder_step = 0; }},
                      {"rotation.hand.stiffness = 0", [](auto& c) { c.hand->stiffness = 0; }},
                      {"rotation.hand.damping = -1", [](auto& c) { c.hand->damping = -1; }},
                  });
}

}  // namespace
}  // namespace tendon::simulated_rotation_test
