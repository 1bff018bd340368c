// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/methods/two_channel_passivity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "tests/core/teleoperation/one_way.h"

namespace tendon::two_channel_passivity_test {
namespace {

using namespace std::chrono_literals;

constexpr Duration kPeriod = 1ms;
constexpr double kT = 1e-3;

struct Channel {
  double least = 0;  // J, energy absorbed by both ends
  double drift = 0;  // m, difference between the positions of tool and leader when both are at rest in free space
};

// Prescribed motion. The massless tool presses against a spring of 400 N/m.
Channel run(bool on, const Network& network, double drift_rate) {
  constexpr int kPeriods = 22000;
  PassivityLeader<1> leader({.max_damping = 1e9, .period = kPeriod});
  PassivityFollower<1> follower({.drift_rate = drift_rate, .period = kPeriod});
  OneWay<LeaderMessage<1>> there(network);
  Network other = network;
  other.seed += 1000;
  OneWay<FollowerMessage<1>> back(other);
  Vec<1> raw_velocity(0);
  Vec<1> raw_force(0);
  Channel channel;
  double energy = 0;
  double x_leader = 0;
  double x = 0;
  for (int i = 0; i < kPeriods; ++i) {
    there.deliver(i, [&](const auto& m) {
      follower.receive(m);
      raw_velocity = m.velocity;
    });
    back.deliver(i, [&](const auto& m) {
      leader.receive(m);
      raw_force = m.force;
    });
    const bool resting =
        i >= 20000;  // after 16 cycles the tool is at its initial position and does not touch the spring
    const double v = resting ? 0.0 : 0.1 * std::sin(2 * std::numbers::pi * 0.8 * i * kT);
    const Vec<1> force = on ? leader.command(Vec<1>(v)).force : raw_force;
    energy -= force[0] * v * kT;
    there.send(i, leader.observe({force, Vec<1>(v * kT), kPeriod}));
    x_leader += v * kT;

    const double tool_force = x > 0 ? 400 * x : 0.0;  // the force that is needed to hold the tool
    const auto step = follower.step(Vec<1>(tool_force));
    const double tool_velocity = on ? step.velocity[0] : raw_velocity[0];
    energy -= tool_force * tool_velocity * kT;
    x += tool_velocity * kT;
    back.send(i, step.message);
    channel.least = std::min(channel.least, energy);
  }
  channel.drift = x - x_leader;
  return channel;
}

TEST(TwoChannelPassivity, KeepsAChannelPassiveThatLosesJoulesWithout) {
  const Network sixty{.delay = 60};
  const auto off = run(false, sixty, 0);
  const auto on = run(true, sixty, 0);
  const auto corrected = run(true, sixty, 2);
  std::cout << "60 ms each way: least energy off " << off.least << " J, on " << on.least << " J, with drift correction "
            << corrected.least << " J; drift " << on.drift * 1e3 << " mm, corrected " << corrected.drift * 1e3
            << " mm\n";
  EXPECT_LT(off.least, -3);
  EXPECT_GE(on.least, -1e-9);
  EXPECT_GE(corrected.least, -1e-9);
}

TEST(TwoChannelPassivity, IsPassiveThroughLossJitterAndReordering) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    for (const double drift_rate : {0.0, 2.0, 20.0}) {
      const Network bad{.delay = 30, .jitter = 60, .loss = 0.2, .seed = seed};
      EXPECT_GE(run(true, bad, drift_rate).least, -1e-9) << seed << ' ' << drift_rate;
    }
  }
}

TEST(TwoChannelPassivity, DriftIsMadeGoodWhenThatCostsNothing) {
  const Network sixty{.delay = 60};
  EXPECT_GT(std::abs(run(true, sixty, 0).drift), 0.02);
  EXPECT_LT(std::abs(run(true, sixty, 2).drift), 0.002);
}

// Random motion and forces in six dimensions, with force limits at the leader and no assumption about either side.
TEST(TwoChannelPassivity, IsPassiveForEveryMotionAndEveryForce) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Dice dice(seed);
    PassivityLeader<6> leader({.max_damping = 1e9, .period = kPeriod});
    PassivityFollower<6> follower({.drift_rate = dice.within(0, 10), .period = kPeriod});
    const Network bad{.delay = 10, .jitter = 20, .loss = 0.1, .seed = seed};
    OneWay<LeaderMessage<6>> there(bad);
    OneWay<FollowerMessage<6>> back(bad);
    const auto random = [&](double size) {
      Vec<6> v;
      for (double& component : v) component = dice.within(-size, size);
      return v;
    };
    double energy = 0;
    for (int i = 0; i < 2000; ++i) {
      there.deliver(i, [&](const auto& m) { follower.receive(m); });
      back.deliver(i, [&](const auto& m) { leader.receive(m); });
      const Vec<6> v = random(0.2);
      const auto wanted = leader.command(v).force;
      energy -= wanted.dot(v) * kT;
      there.send(i, leader.observe({wanted, v * kT, kPeriod}));
      const Vec<6> force = random(5);
      const auto step = follower.step(force);
      energy -= force.dot(step.velocity) * kT;
      back.send(i, step.message);
      ASSERT_GE(energy, -1e-9) << "seed " << seed << " period " << i;
    }
  }
}

// A spring of the controller (1000 N/m) acts on a resting tool. Returns the minimum energy of both ends (J).
double least_with_a_spring(double booked_stiffness, double drift_rate) {
  constexpr double kStiffness = 1000;
  PassivityLeader<1> leader({.max_damping = 1e9, .period = kPeriod});
  PassivityFollower<1> follower({.drift_rate = drift_rate, .period = kPeriod, .stiffness = booked_stiffness});
  OneWay<LeaderMessage<1>> there({.delay = 20, .jitter = 20, .loss = 0.7, .seed = 1});
  OneWay<FollowerMessage<1>> back({.delay = 20, .jitter = 20, .loss = 0.7, .seed = 2});
  double energy = 0;
  double least = 0;
  double x = 0;
  for (int i = 0; i < 5000; ++i) {
    there.deliver(i, [&](const auto& m) { follower.receive(m); });
    back.deliver(i, [&](const auto& m) { leader.receive(m); });
    const Vec<1> v(0.1 * std::sin(2 * std::numbers::pi * 0.8 * i * kT));
    const Vec<1> force = leader.command(v).force;
    energy -= force[0] * v[0] * kT;
    there.send(i, leader.observe({force, v * kT, kPeriod}));
    const auto step = follower.step(Vec<1>(kStiffness * x));
    const double next = x + step.velocity[0] * kT;
    energy -= 0.5 * kStiffness * (next * next - x * x);
    x = next;
    back.send(i, step.message);
    least = std::min(least, energy);
  }
  return least;
}

TEST(TwoChannelPassivity, IsPassiveWithTheControllersSpringBehindIt) {
  for (const double drift_rate : {5.0, 100.0}) {
    const double without = least_with_a_spring(0, drift_rate);
    const double with = least_with_a_spring(1000, drift_rate);
    std::cout << "spring of 1000 N/m, drift rate " << drift_rate << ": least energy " << without
              << " J when it is not booked, " << with << " J when it is\n";
    EXPECT_LT(without, -1e-5);
    EXPECT_GE(with, -1e-9);
  }
}

TEST(TwoChannelPassivity, BooksTheForceReallyAppliedAndNotTheOneItWanted) {
  PassivityLeader<1> leader({.max_damping = 10, .period = kPeriod});
  leader.receive({1, Vec<1>(5), 1});
  EXPECT_EQ(leader.command(Vec<1>(0.1)).force[0], 5);
  leader.observe({Vec<1>(2), Vec<1>(1e-4), kPeriod});
  EXPECT_NEAR(leader.energy(), 1 - 2e-4, 1e-15);
}

TEST(TwoChannelPassivity, TheDamperHasALimit) {
  PassivityLeader<1> leader({.max_damping = 3, .period = kPeriod});
  leader.receive({1, Vec<1>(5), 0});
  EXPECT_NEAR(leader.command(Vec<1>(0.1)).force[0], 5 - 0.3, 1e-15);
  EXPECT_EQ(leader.command(Vec<1>(0)).force[0], 5);
  EXPECT_EQ(leader.command(Vec<1>(-0.1)).force[0], 5) << "the hand pushes: this puts energy in";
}

TEST(TwoChannelPassivity, PassesOverWhatIsNotFiniteOrOld) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  PassivityLeader<1> leader({.max_damping = 3, .period = kPeriod});
  leader.receive({2, Vec<1>(5), 1});
  leader.receive({1, Vec<1>(9), 0.5});
  leader.receive({3, Vec<1>(kNan), 1});
  leader.receive({4, Vec<1>(1), kNan});
  EXPECT_EQ(leader.command(Vec<1>(0)).force[0], 5);
  EXPECT_FALSE(leader.command(Vec<1>(kNan)).force.allFinite());
  EXPECT_EQ(leader.observe({Vec<1>(kNan), Vec<1>(1), kPeriod}).energy_in, 0);
  PassivityFollower<1> follower({.period = kPeriod});
  follower.receive({1, Vec<1>(kNan), Vec<1>(0), 1});
  follower.receive({2, Vec<1>(1), Vec<1>(0), kNan});
  EXPECT_EQ(follower.step(Vec<1>(1)).velocity[0], 0);
  EXPECT_EQ(follower.step(Vec<1>(kNan)).velocity[0], 0);
}

TEST(TwoChannelPassivity, SaysWhatIsWrongWithItsConfiguration) {
  EXPECT_THROW(PassivityLeader<1>({.max_damping = 0, .period = kPeriod}), std::invalid_argument);
  EXPECT_THROW(PassivityLeader<1>({.max_damping = 1, .period = Duration::zero()}), std::invalid_argument);
  EXPECT_THROW(PassivityFollower<1>({.drift_rate = -1, .period = kPeriod}), std::invalid_argument);
  EXPECT_THROW(PassivityFollower<1>({.period = kPeriod, .stiffness = -1}), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::two_channel_passivity_test
