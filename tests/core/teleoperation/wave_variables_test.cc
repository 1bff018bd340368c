// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/wave_variables.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "tests/core/teleoperation/link.h"

namespace tendon {
namespace {

using namespace std::chrono_literals;

constexpr Duration kPeriod = 1ms;
constexpr double kT = 1e-3;

struct Channel {
  double least = 0;          // J, that the two ends together have put in
  double least_account = 0;  // J, of either end
};

// Both ends are moved at random; what is applied is what is wanted, or anything between that and nothing.
template <int N>
Channel run(double impedance, const Network& network, double drift_rate, bool clipped) {
  WavePort<N> leader({.impedance = impedance, .drift_rate = drift_rate, .period = kPeriod});
  WavePort<N> follower({.impedance = impedance, .drift_rate = drift_rate, .period = kPeriod});
  Link<WaveMessage<N>> there(network);
  Network other = network;
  other.seed += 1000;
  Link<WaveMessage<N>> back(other);
  Dice dice(network.seed + 77);
  Channel channel;
  double energy = 0;
  for (int i = 0; i < 5000; ++i) {
    Vec<N> v_leader = Vec<N>::Constant(0.1 * std::sin(2 * std::numbers::pi * 1.1 * i * kT));
    Vec<N> v_follower;
    for (int k = 0; k < N; ++k) {
      v_leader[k] += dice.within(-0.05, 0.05);
      v_follower[k] = dice.within(-0.2, 0.2);
    }
    there.deliver(i, [&](const auto& m) { follower.receive(m); });
    back.deliver(i, [&](const auto& m) { leader.receive(m); });
    const auto step = [&](WavePort<N>& port, const Vec<N>& v) {
      const double share = clipped && dice.chance(0.5) ? dice.uniform() : 1.0;
      const Vec<N> force = share * port.command(v).force;
      energy -= force.dot(v) * kT;
      channel.least_account = std::min(channel.least_account, port.energy());
      return port.observe({force, v * kT, kPeriod});
    };
    there.send(i, step(leader, v_leader));
    back.send(i, step(follower, v_follower));
    channel.least = std::min(channel.least, energy);
  }
  return channel;
}

TEST(WaveVariables, ArePassiveForAnyConstantDelayAndAnyImpedance) {
  for (const double impedance : {0.05, 2.0, 80.0}) {
    for (const int delay : {1, 50, 400}) {
      for (const bool clipped : {false, true}) {
        EXPECT_GE(run<1>(impedance, {.delay = delay}, 0, clipped).least, -1e-12) << impedance << ' ' << delay;
        EXPECT_GE(run<3>(impedance, {.delay = delay}, 3, clipped).least, -1e-12) << impedance << ' ' << delay;
      }
    }
  }
}

TEST(WaveVariables, ArePassiveThroughLossJitterAndReordering) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    for (const double drift_rate : {0.0, 3.0, 50.0}) {
      const Network bad{.delay = 20, .jitter = 40, .loss = 0.2, .seed = seed};
      for (const bool clipped : {false, true}) {
        const auto one = run<1>(2, bad, drift_rate, clipped);
        EXPECT_GE(one.least, -1e-12);
        EXPECT_GE(one.least_account, -1e-12);
        EXPECT_GE(run<6>(2, bad, drift_rate, clipped).least, -1e-12);
      }
    }
  }
}

// Why a lost wave is not replaced by the last one: the textbook equations with hold-last, at an end that stands still.
TEST(WaveVariables, HoldingTheLastWaveWouldUseItsEnergyTwice) {
  const double impedance = 2;
  const double root = std::sqrt(2 * impedance);
  const auto energy_used = [&](bool hold) {
    Dice dice(3);
    double sent = 0;
    double used = 0;
    double last = 0;
    for (int i = 0; i < 5000; ++i) {
      const double u = root * 0.1 * (i % 100 < 10 ? 1.0 : 0.0);
      sent += kT * u * u / 2;
      const bool lost = i % 100 >= 9 && i % 100 < 40;  // a burst just after the push
      if (!lost) last = u;
      const double wave = !lost || hold ? last : 0.0;
      used += kT * wave * wave / 2;
    }
    return sent - used;
  };
  EXPECT_LT(energy_used(true), -0.01);
  EXPECT_GE(energy_used(false), 0);
}

// The leader moves to and fro and comes to rest somewhere else; the follower's tool is free. With losses their distance
// drifts apart unless the sums of the waves put it right.
double drift(double drift_rate, double loss) {
  WavePort<1> leader({.impedance = 2, .drift_rate = drift_rate, .period = kPeriod});
  WavePort<1> follower({.impedance = 2, .drift_rate = drift_rate, .period = kPeriod});
  Link<WaveMessage<1>> there({.delay = 30, .jitter = 20, .loss = loss, .seed = 5});
  Link<WaveMessage<1>> back({.delay = 30, .jitter = 20, .loss = loss, .seed = 6});
  double x_leader = 0;
  double x = 0;
  double v = 0;
  Vec<1> force;
  double energy = 0;
  for (int i = 0; i < 14000; ++i) {
    there.deliver(i, [&](const auto& m) { follower.receive(m); });
    back.deliver(i, [&](const auto& m) { leader.receive(m); });
    const double t = i * kT;
    const double v_leader = t < 10 ? 0.02 * std::numbers::pi * std::cos(2 * std::numbers::pi * t) + 0.01 : 0.0;
    x_leader += v_leader * kT;
    force = leader.command(Vec<1>(v_leader)).force;
    energy -= force[0] * v_leader * kT;
    there.send(i, leader.observe({force, Vec<1>(v_leader * kT), kPeriod}));

    force = follower.command(Vec<1>(v)).force;
    const double after = v + kT * force[0] / 0.2;
    const double dx = kT * (v + after) / 2;
    energy -= force[0] * dx;
    v = after;
    x += dx;
    back.send(i, follower.observe({force, Vec<1>(dx), kPeriod}));
    EXPECT_GE(energy, -1e-3) << t;
  }
  return x - x_leader;
}

TEST(WaveVariables, SendingTheSumsOfTheWavesBoundsTheDriftThatLossesMake) {
  const double without = drift(0, 0.3);
  const double with = drift(2, 0.3);
  std::cout << "drift after 10 s with 30 % loss: " << without * 1e3 << " mm, corrected " << with * 1e3 << " mm\n";
  EXPECT_GT(std::abs(without), 0.03);
  EXPECT_LT(std::abs(with), 0.005);
}

TEST(WaveVariables, AnEndThatIsTerminatedWithTheImpedanceReflectsNothing) {
  WavePort<1> leader({.impedance = 2, .period = kPeriod});
  WavePort<1> follower({.impedance = 2, .period = kPeriod});
  const auto out = leader.observe({Vec<1>(-0.4), Vec<1>(0.2 * kT), kPeriod});  // F = −B v: u = √(2B) v
  EXPECT_NEAR(out.wave[0], 2 * 0.2, 1e-15);
  follower.receive(out);
  const double v = 0.2;  // a tool with a damper of 2 N·s/m: F = B v
  const double force = follower.command(Vec<1>(v)).force[0];
  EXPECT_NEAR(force, 0.4, 1e-15);
  EXPECT_NEAR(follower.observe({Vec<1>(force), Vec<1>(v * kT), kPeriod}).wave[0], 0, 1e-12);
}

TEST(WaveVariables, SendsNothingWhileItsAccountIsShort) {
  WavePort<1> port({.impedance = 2, .period = kPeriod});
  port.command(Vec<1>(0));
  // The device pushed along with a motion that no wave had paid for.
  const auto silent = port.observe({Vec<1>(1), Vec<1>(1e-3), kPeriod});
  EXPECT_EQ(silent.wave[0], 0);
  EXPECT_NEAR(port.energy(), -1e-3, 1e-15);
  port.command(Vec<1>(0));
  const auto paid_back = port.observe({Vec<1>(-2), Vec<1>(1e-3), kPeriod});
  EXPECT_NEAR(port.energy(), 0, 1e-15);
  EXPECT_NEAR(paid_back.energy, 1e-3, 1e-15);
}

TEST(WaveVariables, PassOverWhatIsNotFiniteOrOld) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  WavePort<1> port({.impedance = 2, .period = kPeriod});
  port.receive({2, Vec<1>(0.3), Vec<1>(0), 1});
  port.receive({1, Vec<1>(9), Vec<1>(0), 1});
  port.receive({3, Vec<1>(kNan), Vec<1>(0), 1});
  port.receive({4, Vec<1>(1), Vec<1>(kNan), 1});
  port.receive({5, Vec<1>(1), Vec<1>(0), kNan});
  EXPECT_NEAR(port.command(Vec<1>(0)).force[0], 0.6, 1e-15);
  EXPECT_EQ(port.observe({Vec<1>(kNan), Vec<1>(0), kPeriod}).energy, 0);
  EXPECT_EQ(port.observe({Vec<1>(1), Vec<1>(-1), Duration::zero()}).energy, 0);
  EXPECT_FALSE(port.command(Vec<1>(kNan)).force.allFinite());
  EXPECT_TRUE(port.command(Vec<1>(0)).force.allFinite());
}

TEST(WaveVariables, SayWhatIsWrongWithTheirConfiguration) {
  EXPECT_THROW(WavePort<1>({.impedance = 0, .period = kPeriod}), std::invalid_argument);
  EXPECT_THROW(WavePort<1>({.impedance = 1, .drift_rate = -1, .period = kPeriod}), std::invalid_argument);
  EXPECT_THROW(WavePort<1>({.impedance = 1, .period = Duration::zero()}), std::invalid_argument);
}

}  // namespace
}  // namespace tendon
