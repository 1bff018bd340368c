// SPDX-License-Identifier: Apache-2.0
// These tests check that the bounds of core/PROOFS.md are sharp. The hands first supply energy, and then try to extract
// more energy than they have supplied. This must fail at the bound, and succeed if the bound is increased by 2 %. The
// links have stalls, bursts, duplicates and reordering (rough_network).
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iostream>

#include "core/ledger/energy_ledger.h"
#include "core/teleoperation/methods/model_mediated.h"
#include "core/teleoperation/methods/two_channel_passivity.h"
#include "core/teleoperation/methods/wave_variables.h"
#include "tests/core/teleoperation/one_way.h"
#include "tests/support/dice.h"
#include "tests/support/property_cases.h"

namespace tendon::coupling_bounds_test {
namespace {

using namespace std::chrono_literals;

constexpr Duration kPeriod = 1ms;
constexpr double kT = 1e-3;
constexpr int kPeriods = 3000;
constexpr int kSupply = 1000;  ///< periods in which the hands supply energy

/// The energy that was absorbed by both ends, in J.
struct Absorbed {
  double now = 0;
  double least = 0;
  double most = 0;

  void add(double joules) {
    now += joules;
    least = std::min(least, now);
    most = std::max(most, now);
  }
  bool is_negative() const { return least < -1e-9 * std::max(most, 1e-3); }
};

/// Multiplies the energy of all received waves by `factor` (core/PROOFS.md, "Wave variables").
Absorbed waves(std::uint64_t seed, double factor) {
  Dice dice(seed);
  const double impedance = dice.decades(-1, 1.5);
  const WavePort<1>::Config config{
      .impedance = impedance, .period = kPeriod, .smoothing = dice.chance(0.5) ? kPeriod : WavePort<1>::kSmoothing};
  std::array<WavePort<1>, 2> ends{WavePort<1>(config), WavePort<1>(config)};
  std::array<OneWay<WaveMessage<1>>, 2> ways{OneWay<WaveMessage<1>>(rough_network(dice)),
                                             OneWay<WaveMessage<1>>(rough_network(dice))};
  const double size = dice.decades(-2, 0);
  const double hertz = dice.decades(-1, 1);
  std::array<double, 2> speed{};
  std::array<double, 2> force{};
  Absorbed absorbed;
  for (int i = 0; i < kPeriods; ++i) {
    for (std::size_t e = 0; e < 2; ++e) {
      ways[1 - e].deliver(i, [&](WaveMessage<1> wave) {
        wave.integral *= std::sqrt(factor);
        wave.energy *= factor;
        ends[e].receive(wave);
      });
      // A hand with the impedance of the line takes the whole wave.
      speed[e] = (force[e] + impedance * speed[e]) / (2 * impedance);
      if (i < kSupply) speed[e] += size * std::sin(hertz * i * kT + static_cast<double>(e));
      force[e] = ends[e].command(Vec<1>(speed[e])).force[0];
      absorbed.add(-force[e] * speed[e] * kT);
      ways[e].send(i, ends[e].observe({Vec<1>(force[e]), Vec<1>(speed[e] * kT), kPeriod}));
    }
  }
  return absorbed;
}

/// Multiplies all received energies by `factor` (core/PROOFS.md, "Two-channel passivity control").
Absorbed two_channels(std::uint64_t seed, double factor) {
  Dice dice(seed);
  PassivityLeader<1> leader({.max_damping = 1e9, .period = kPeriod});
  PassivityFollower<1> follower({.drift_rate = dice.chance(0.5) ? 0 : dice.within(0, 20), .period = kPeriod});
  OneWay<LeaderMessage<1>> there(rough_network(dice));
  OneWay<FollowerMessage<1>> back(rough_network(dice));
  const double size = dice.decades(-1, 1);
  const double fast = dice.decades(-2, 0);
  double led = 0;     // the newest velocity at the follower, m/s
  double pushed = 0;  // the newest force at the leader, N
  Absorbed absorbed;
  for (int i = 0; i < kPeriods; ++i) {
    const double way = i < kSupply ? -1 : 1;
    there.deliver(i, [&](LeaderMessage<1> message) {
      message.energy_in *= factor;
      led = message.velocity[0];
      follower.receive(message);
    });
    back.deliver(i, [&](FollowerMessage<1> message) {
      message.energy_in *= factor;
      pushed = message.force[0];
      leader.receive(message);
    });
    const Vec<1> speed(std::copysign(fast * dice.uniform(), way * pushed));
    const Vec<1> felt = leader.command(speed).force;
    absorbed.add(-felt.dot(speed) * kT);
    there.send(i, leader.observe({felt, speed * kT, kPeriod}));
    const Vec<1> tool(std::copysign(size * dice.uniform(), way * led));
    const auto step = follower.step(tool);
    absorbed.add(-tool.dot(step.velocity) * kT);
    back.send(i, step.message);
  }
  return absorbed;
}

/// Multiplies the budget E − U and the stiffness 2b/T by the factors (core/PROOFS.md, "Surfaces").
Absorbed surfaces(std::uint64_t seed, double of_budget, double of_stiffness) {
  Dice dice(seed);
  const Friction friction{.coulomb = 0, .viscous = dice.decades(-1, 0.5)};
  SurfaceRenderer<3> renderer;
  EnergyLedger ledger(friction);
  OneWay<SurfaceModel<3>> way(rough_network(dice));
  const double greed = dice.uniform();
  SurfaceModel<3> found;
  Vec3 x = Vec3::Zero();
  Absorbed absorbed;
  for (int i = 0; i < kPeriods; ++i) {
    if (i == 0 || dice.chance(0.1)) {
      const double share = dice.chance(0.5) ? 1 : dice.uniform();
      found.normal = dice.direction();
      found.offset = dice.within(-0.02, 0.02);
      found.stiffness = of_stiffness * share * 2 * friction.viscous / kT;
    }
    ++found.sequence;
    way.send(i, found);
    way.deliver(i, [&](const SurfaceModel<3>& model) { renderer.receive(model); });
    const double budget = of_budget * std::max(ledger.energy() - renderer.energy(x), 0.0);
    const Vec3 force = renderer.command(x, budget).demand.force;
    const Vec3 dx =
        dice.chance(greed) ? Vec3(kT / (2 * friction.viscous) * force) : Vec3(dice.direction() * dice.decades(-6, -3));
    ledger.observe(force, dx, kPeriod);
    x += dx;
    absorbed.add(ledger.energy() - absorbed.now);
  }
  return absorbed;
}

/// Checks that `run(seed, factor)` does not find energy if the factor is 1, and finds energy if it is 1.02.
template <class Run>
void expect_sharp(const char* name, const Run& run) {
  const int seeds = property_cases() / 10;
  int at_bound = 0;
  int above = 0;
  double most = 0;
  double least = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    const Absorbed absorbed = run(static_cast<std::uint64_t>(seed), 1.0);
    EXPECT_FALSE(absorbed.is_negative()) << name << ", seed " << seed << ": " << absorbed.least << " J";
    at_bound += absorbed.is_negative() ? 1 : 0;
    most += absorbed.most;
    least = std::min(least, absorbed.least);
    above += run(static_cast<std::uint64_t>(seed), 1.02).is_negative() ? 1 : 0;
  }
  std::cout << name << ": energy found in " << at_bound << " of " << seeds << " runs at the bound (least " << least
            << " J), in " << above << " at 1.02\n";
  EXPECT_GT(most, 1e-3 * seeds) << name << ": nothing was supplied, so nothing was tested";
  EXPECT_GT(above, 0) << name;
}

TEST(CouplingBounds, WavesNeedTheEnergyThatWasSent) { expect_sharp("waves", waves); }

TEST(CouplingBounds, ChannelsNeedTheEnergyThatWasReported) { expect_sharp("two channels", two_channels); }

TEST(CouplingBounds, ASurfaceNeedsTheSpareEnergyAsItsBudget) {
  expect_sharp("budget", [](std::uint64_t seed, double factor) { return surfaces(seed, factor, 1); });
}

TEST(CouplingBounds, ASurfaceIsAtMostAsStiffAsTheLimiterAllows) {
  expect_sharp("stiffness", [](std::uint64_t seed, double factor) { return surfaces(seed, 1, factor); });
}

}  // namespace
}  // namespace tendon::coupling_bounds_test
