// SPDX-License-Identifier: Apache-2.0
//
// The promise of the whole project, kept by the whole server: 10 000 seeds, each a world of its own with a
// network, a device, an operator and a physics engine, every one of them bad in its own way.
//
// TENDON_WORLDS sets the number of seeds (ctest: 10 000 in four shards). A failure names its seed;
// TENDON_WORLD_SEED=n runs that world alone.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <iostream>
#include <limits>
#include <memory>
#include <string>

#include "core/haptic_controller.h"
#include "devices/simulated/simulated_device.h"
#include "tests/simulation/adversary.h"
#include "tests/simulation/world.h"

namespace tendon::simulation {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

struct Outcome {
  double least_energy = kInf;   ///< J, of steps not flagged as overrun
  double worst_excess = -kInf;  ///< N above the bound
  /// J, work that the hand has really done − ledger, at the end of the run (simulated devices, joint form: a sum over
  /// axes is no lower bound of isotropic friction, control.md 1.6 (a)). The device starts at rest.
  double true_margin = kInf;
  bool only_finite = true;
  bool felt = false;     ///< a remote force was rendered
  bool limited = false;  ///< … and limited by energy
  std::string world;     ///< what it was like
};

// What the remote physics engine answers.
Physics engine(Dice& dice, std::string& description) {
  const double stiffness = dice.decades(1, 5);
  const std::uint64_t seed = dice.bits();
  switch (static_cast<int>(dice.within(0, 6))) {
    case 0:
      description += "spring";
      return [stiffness](const DeviceState& hand) -> Touch { return Vec3(-stiffness * hand.position); };
    case 1:
      description += "wall with local model";
      return [stiffness](const DeviceState& hand) -> Touch {
        const double depth = std::max(0.0, hand.position.x());
        Touch touch = Vec3(-stiffness * depth, 0, 0);
        if (depth > 0) touch.stiffness = Vec3(stiffness, 0, 0).asDiagonal();
        return touch;
      };
    case 2:
      description += "a million newton";
      return [dice = Dice(seed)](const DeviceState&) mutable -> Touch { return Vec3(dice.direction() * 1e6); };
    case 3:
      description += "steps";
      return [dice = Dice(seed)](const DeviceState&) mutable -> Touch {
        return Vec3(dice.direction() * (dice.chance(0.5) ? 0.0 : dice.decades(-2, 2)));
      };
    case 4:
      description += "negative spring and negative damper";
      return [stiffness](const DeviceState& hand) -> Touch {
        Touch touch = Vec3(stiffness * hand.position + 10 * hand.velocity);
        touch.stiffness = Mat3(-stiffness * Mat3::Identity());
        return touch;
      };
    default:
      description += "pushes along";  // in the direction in which the hand is already pushed
      return [dice = Dice(seed)](const DeviceState& hand) mutable -> Touch {
        return Vec3(hand.force_applied.norm() > 1e-3 ? Vec3(hand.force_applied * 100) : dice.direction());
      };
  }
}

// A client that sends what no client may: NaN, infinity, forces for steps that never were. It speaks
// the protocol, so its datagrams arrive.
Physics with_bad_days(Physics physics, std::uint64_t seed) {
  return [physics = std::move(physics), dice = Dice(seed)](const DeviceState& hand) mutable -> Touch {
    if (dice.chance(0.05)) return Vec3(Vec3::Constant(std::nan("")));
    if (dice.chance(0.05)) return Vec3(0, kInf, 0);
    return physics(hand);
  };
}

Outcome run_world(std::uint64_t seed, double force_scale = 1) {
  Dice dice(seed);
  Outcome outcome;
  const auto limiter = dice.chance(0.75) ? Law::kAol : Law::kAolPerAxis;

  World::Config config;
  config.seed = seed;
  auto& control = config.loop.control;
  control.limiter.law = limiter;
  control.limiter.friction = {dice.chance(0.2) ? 0.0 : dice.decades(-3, -0.3), dice.decades(-2.5, 0.3)};
  // Periods of 0.5–2 ms: each interval is a period and up to as much again, less what the step before was late.
  config.loop.period = std::chrono::microseconds(1000);
  const bool punctual = dice.chance(0.3) || force_scale != 1;
  config.latest_wake = std::chrono::microseconds(punctual ? 0 : 1000);
  control.limiter.longest_hold = std::chrono::microseconds(punctual ? 1000 : 2000);
  control.max_force = dice.decades(0, 2);
  control.max_slew = dice.chance(0.3) ? kInf : dice.decades(2, 5);
  Duration round_trip{};
  for (injector::Profile* way : {&config.to_server, &config.from_server}) {
    *way = {};
    const Duration mean = dice.milliseconds(0, dice.chance(0.2) ? 500 : 100);
    const Duration jitter = from_seconds(seconds(mean) * dice.uniform());
    way->delay = injector::UniformDelay{mean - jitter, mean + jitter};
    round_trip += mean;
    way->loss = injector::RandomLoss{dice.chance(0.2) ? 0 : dice.within(0, 0.5)};
    way->duplicate = dice.chance(0.5) ? 0 : dice.within(0, 0.3);
  }
  if (dice.chance(0.1)) {
    config.pause_probability = 2e-3;
    config.pause = dice.milliseconds(5, 60);
  }

  const bool adversary = dice.chance(0.5) || force_scale != 1;
  std::unique_ptr<Device> device;
  AdversaryDevice* hostile = nullptr;
  SimulatedDevice* simulated = nullptr;
  if (adversary) {
    AdversaryDevice::Config c;
    c.friction = control.limiter.friction;
    c.hostility = dice.uniform();
    c.largest_move = dice.decades(-4, -2);
    if (dice.chance(0.5)) c.clamp = control.max_force * dice.uniform();
    c.force_scale = force_scale;
    if (force_scale != 1) c.clamp = kInf;
    auto made = std::make_unique<AdversaryDevice>(c, dice.bits());
    hostile = made.get();
    device = std::move(made);
  } else {
    SimulatedDevice::Config c;
    c.mass = dice.decades(-1.5, 0);
    // True friction: what the limiter assumes, or more.
    if (control.limiter.friction.coulomb > 0)
      c.coulomb_friction = control.limiter.friction.coulomb * (1 + dice.uniform());
    c.viscous_friction = control.limiter.friction.viscous * (1 + dice.uniform());
    if (dice.chance(0.5)) c.max_force = control.max_force * dice.within(0.1, 1);
    OperatorHand::Config hand{
        .stiffness = dice.decades(1, 3),
        .damping = dice.decades(-1, 1),
        .mass = dice.within(0, 0.1),
        .motion = ScriptedMotion(ScriptedMotion::Sine{
            .amplitude = dice.within(1e-3, 0.04), .frequency = dice.decades(-0.5, 1), .direction = dice.direction()})};
    c.hand = hand;
    auto made = std::make_unique<SimulatedDevice>(c);
    simulated = made.get();
    device = std::move(made);
  }

  outcome.world = "seed " + std::to_string(seed) + ": " + (adversary ? "adversary, " : "hand, ");
  ForceClient::Config client;
  client.rate_hz = dice.decades(0, 3);
  client.seed = seed;
  Physics physics = with_bad_days(engine(dice, outcome.world), dice.bits());
  outcome.world += " at " + std::to_string(client.rate_hz) + " Hz; up " + to_string(config.to_server) + "; down " +
                   to_string(config.from_server);

  double last_energy = 0;
  World world(config, *device);
  world.add_controller(client, std::move(physics));
  world.watch_steps([&](const StepRecord& step) {
    outcome.only_finite = outcome.only_finite && step.force.allFinite() && step.applied.allFinite() &&
                          std::isfinite(step.energy) && step.hand.velocity.allFinite();
    const double size = limiter == Law::kAolPerAxis ? step.force.cwiseAbs().maxCoeff() : step.force.norm();
    outcome.worst_excess = std::max(outcome.worst_excess, size - step.permitted * (1 + 1e-12));
    last_energy = step.energy;
    if (step.mode == Mode::kActive) outcome.felt = true;
    if (step.reasons.has(Reason::kEnergy)) outcome.limited = true;
    if (config.pause_probability == 0) outcome.least_energy = std::min(outcome.least_energy, step.energy);
    // After an overrun the ledger may be below zero; it must then permit friction only, until it has recovered.
    if (step.energy < 0 && limiter == Law::kAol) {
      outcome.worst_excess = std::max(outcome.worst_excess, size - control.limiter.friction.coulomb * (1 + 1e-12));
    }
  });
  // Long enough to shake hands over this network, and to be felt for half a second.
  world.run_for(4 * round_trip + std::chrono::milliseconds(700));
  if (hostile != nullptr) outcome.only_finite = outcome.only_finite && hostile->saw_only_finite_forces();
  if (simulated != nullptr && limiter == Law::kAol) {
    outcome.true_margin = simulated->truth().hand_work - last_energy;
  }
  return outcome;
}

std::uint64_t from_environment(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): nobody sets variables here
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}

class PassivityWorlds : public testing::TestWithParam<std::uint64_t> {};

constexpr std::uint64_t kShards = 4;

TEST_P(PassivityWorlds, TheLedgerNeverIsNegativeNoForceIsAboveItsBoundAndOnlyNumbersReachTheDevice) {
  const std::uint64_t worlds = from_environment("TENDON_WORLDS", 400);
  const std::uint64_t only = from_environment("TENDON_WORLD_SEED", 0);
  std::uint64_t ran = 0;
  std::uint64_t felt = 0;
  std::uint64_t limited = 0;
  double least_energy = kInf;
  for (std::uint64_t seed = 1 + GetParam(); seed <= worlds; seed += kShards) {
    if (only != 0 && seed != only) continue;
    const Outcome outcome = run_world(seed);
    ASSERT_GE(outcome.least_energy, -1e-9) << outcome.world;
    ASSERT_LE(outcome.worst_excess, 1e-12) << outcome.world;
    ASSERT_TRUE(outcome.only_finite) << outcome.world;
    ASSERT_GE(outcome.true_margin, -1e-9) << outcome.world;
    ++ran;
    felt += outcome.felt ? 1 : 0;
    limited += outcome.limited ? 1 : 0;
    least_energy = std::min(least_energy, outcome.least_energy);
  }
  RecordProperty("worlds", std::to_string(ran));
  RecordProperty("least_energy_j", std::to_string(least_energy));
  std::cout << ran << " worlds, forces felt in " << felt << ", limited in " << limited << ", least energy "
            << least_energy << " J\n";
  // A property of worlds in which nothing happens would prove nothing.
  if (only == 0) {
    EXPECT_GT(felt, ran * 8 / 10);
    EXPECT_GT(limited, ran * 6 / 10);
  }
}

INSTANTIATE_TEST_SUITE_P(Shards, PassivityWorlds, testing::Range<std::uint64_t>(0, kShards));

TEST(PassivityWorldsCanFail, ADeviceThatGivesOutOnePercentMoreThanTheBoundBreaksThem) {
  int broken = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    if (run_world(seed, 1.01).least_energy < -1e-9) ++broken;
  }
  std::cout << broken << " of 60 sabotaged worlds broken\n";
  EXPECT_GT(broken, 20);
}

}  // namespace
}  // namespace tendon::simulation
