// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "devices/simulated/simulated_device.h"
#include "tests/devices/device_bench.h"

namespace tendon::simulated_device_energy_test {
namespace {

using namespace std::chrono_literals;

/// The position of the encoder and of the motors.
Vec3 motor_side(const SimulatedDevice::Truth& truth) { return truth.position + truth.deflection; }

double stored(const SimulatedDevice::Truth& truth) { return truth.kinetic_energy + truth.spring_energy; }

/// Sum (5) of Lee and Lee (2009) with f = −(force on the hand), independent of the ledger: E = Σ −F·dx + f_c |dx| + b
/// |dx|²/T
struct Equation5 {
  double b;
  double f_c;
  double energy = 0;

  void add(const Vec3& force, const Vec3& dx, Duration held) {
    energy += -force.dot(dx) + f_c * dx.norm() + b * dx.squaredNorm() / seconds(held);
  }
};

struct World {
  SimulatedDevice::Config config;
  bool pushes_along = false;  ///< the adversary pushes along the motion

  explicit World(Dice& dice) {
    config.mass = dice.within(0.02, 0.5);
    config.start_velocity = random_vector(dice, 0.3);
    if (dice.chance(0.7)) config.viscous_friction = std::pow(10.0, dice.within(-3, 0.5));
    if (dice.chance(0.7)) config.coulomb_friction = std::pow(10.0, dice.within(-3, 0));
    if (dice.chance(0.5)) config.max_force = dice.within(0.5, 10);
    if (dice.chance(0.7)) {
      ScriptedMotion::Script script = ScriptedMotion::Sine{.amplitude = dice.within(0, 0.05),
                                                           .frequency = dice.within(0.1, 10),
                                                           .centre = random_vector(dice, 0.02),
                                                           .direction = random_vector(dice, 1)};
      if (dice.chance(0.5)) {
        script = ScriptedMotion::RampHold{.from = random_vector(dice, 0.05),
                                          .to = random_vector(dice, 0.05),
                                          .ramp = from_seconds(dice.within(0.01, 0.2)),
                                          .hold = from_seconds(dice.within(0, 0.1))};
      }
      config.hand = OperatorHand::Config{.stiffness = std::pow(10.0, dice.within(1, 6)),
                                         .damping = dice.chance(0.2) ? 0 : std::pow(10.0, dice.within(-1, 2)),
                                         .mass = dice.chance(0.2) ? 0 : dice.within(0.001, 2),
                                         .motion = ScriptedMotion(script)};
    }
    pushes_along = dice.chance(0.3);
    if (dice.chance(0.1)) put_in_joints(dice);  // rare, because they cost ten times as much
    if (dice.chance(0.3)) {
      config.structural_mode = {.handle_mass = config.mass * dice.within(0.05, 0.95),
                                .stiffness = std::pow(10.0, dice.within(2, 5)),
                                .damping = dice.chance(0.2) ? 0 : std::pow(10.0, dice.within(-2, 1))};
    } else if (dice.chance(0.5)) {
      put_among_walls(dice);
    }
  }

  void put_among_walls(Dice& dice) {
    auto& environment = config.environment.emplace();
    if (dice.chance(0.5)) environment.damping = dice.within(0, 5);
    if (dice.chance(0.5)) environment.friction = dice.within(0, 1);
    for (int i = 0; i < 3; ++i) {
      environment.walls.push_back({.point = random_vector(dice, 0.02),
                                   .normal = random_vector(dice, 1),
                                   .stiffness = std::pow(10.0, dice.within(1, 4)),
                                   .damping = dice.within(0, 5),
                                   .friction = dice.within(0, 1),
                                   .speed = dice.within(-0.1, 0.1),
                                   .from = from_seconds(dice.within(0, 0.1)),
                                   .until = from_seconds(dice.within(0.1, 0.3))});
    }
  }

  void put_in_joints(Dice& dice) {
    JointFriction::Config joints{.mechanism = Mechanism::Falcon{}, .centre = random_vector(dice, 0.02)};
    if (dice.chance(0.5)) {
      joints.mechanism = Mechanism::Arm{.upper_arm = dice.within(0.05, 0.3), .forearm = dice.within(0.05, 0.3)};
    }
    const auto each = [&dice] { return std::pow(10.0, dice.within(-5, -1)); };
    joints.coulomb = {each(), each(), each()};
    if (dice.chance(0.5)) joints.viscous = {each() / 10, each() / 10, each() / 10};
    config.joint_friction = joints;
    config.coulomb_friction.reset();
  }
};

TEST(SimulatedDeviceEnergy, HandAndWallsNeverDoLessWorkThanEquation5Demands) {
  // Tests 2000 random devices, hands, forces and intervals with exact position sensing.
  double least = 1e300;
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    Dice dice(seed);
    const World world(dice);
    Bench bench(world.config);
    const Friction least_anywhere = least_friction(world.config);
    Equation5 equation{least_anywhere.viscous, least_anywhere.coulomb};
    const double stored_at_start = stored(bench.truth());
    double turnover = 1;
    for (int step = 0; step < 100; ++step) {
      const Vec3 wish =
          world.pushes_along ? Vec3(bench.truth().velocity.normalized() * dice.within(0, 5)) : random_vector(dice, 5);
      const Vec3 applied = bench.device().apply(wish);
      const Vec3 before = motor_side(bench.truth());
      const Duration interval(static_cast<Duration::rep>(dice.within(1e4, 2e6)));
      bench.wait(interval);
      const Vec3 dx = motor_side(bench.truth()) - before;
      equation.add(applied, dx, interval);
      const double brought = bench.truth().hand_work + bench.truth().environment_work;
      turnover += std::abs(applied.dot(dx)) + std::abs(brought);

      const double balance = brought + stored_at_start - stored(bench.truth()) - equation.energy;
      least = std::min(least, balance);
      // Rounding errors grow with the exchanged energy: 1e-12 J, and 1e-13 of the energy above 10 J.
      ASSERT_GE(balance, -1e-12 * std::max(1.0, turnover / 10)) << "seed " << seed << ", step " << step;
    }
  }
  EXPECT_LT(least, 1e-9) << "the bound is not even approached: these worlds test nothing";
}

TEST(SimulatedDeviceEnergy, NothingIsLostWhereNothingRubs) {
  // If there is no friction, the result is exact, even if the hand has a mass and a stiff grip.
  SimulatedDevice::Config config;
  config.mass = 0.075;
  config.start_velocity = {0.1, -0.2, 0.3};
  config.hand = OperatorHand::Config{.stiffness = 2000,
                                     .damping = 3,
                                     .mass = 0.2,
                                     .motion = ScriptedMotion(ScriptedMotion::Sine{.amplitude = 0.03, .frequency = 2})};
  Bench bench(config);
  const double at_start = bench.truth().kinetic_energy;
  Dice dice(1);
  double given_out = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vec3 before = bench.truth().position;
    const Vec3 applied = bench.device().apply(random_vector(dice, 5));
    bench.wait(1ms);
    given_out += applied.dot(bench.truth().position - before);
    ASSERT_NEAR(bench.truth().hand_work + given_out + at_start, bench.truth().kinetic_energy, 1e-12);
  }
}

TEST(SimulatedDeviceEnergy, UniformSlidingIsTheCaseWhereTheBoundIsReached) {
  // At constant velocity, the work of the hand in equation (5) is equal to the friction loss.
  SimulatedDevice::Config config;
  config.mass = 0.075;
  config.viscous_friction = 0.26;
  config.coulomb_friction = 0.04;
  config.start_velocity = {0.1, 0, 0};
  Bench bench(config);
  Equation5 equation{0.26, 0.04};
  const double at_start = bench.truth().kinetic_energy;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 before = bench.truth().position;
    const Vec3 applied = bench.device().apply({0.26 * 0.1 + 0.04, 0, 0});  // compensates for friction at this speed
    bench.wait(1ms);
    equation.add(applied, bench.truth().position - before, 1ms);
    ASSERT_NEAR(at_start - bench.truth().kinetic_energy - equation.energy, 0, 1e-12);
  }
}

}  // namespace
}  // namespace tendon::simulated_device_energy_test
