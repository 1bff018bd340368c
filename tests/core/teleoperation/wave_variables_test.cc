// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/methods/wave_variables.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "tests/core/teleoperation/one_way.h"

namespace tendon::wave_variables_test {
namespace {

using namespace std::chrono_literals;

constexpr Duration kPeriod = 1ms;
constexpr double kT = 1e-3;

struct Channel {
  double least = 0;          // J, absorbed by both ends
  double least_account = 0;  // J, either end
};

// The applied force is between zero and the demanded force.
template <int N>
Channel run(double impedance, const Network& network, Duration smoothing, bool clipped) {
  WavePort<N> leader({.impedance = impedance, .period = kPeriod, .smoothing = smoothing});
  WavePort<N> follower({.impedance = impedance, .period = kPeriod, .smoothing = smoothing});
  OneWay<WaveMessage<N>> there(network);
  Network other = network;
  other.seed += 1000;
  OneWay<WaveMessage<N>> back(other);
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
        EXPECT_GE(run<1>(impedance, {.delay = delay}, 1ms, clipped).least, -1e-12) << impedance << ' ' << delay;
        EXPECT_GE(run<3>(impedance, {.delay = delay}, 20ms, clipped).least, -1e-12) << impedance << ' ' << delay;
      }
    }
  }
}

TEST(WaveVariables, ArePassiveThroughLossJitterReorderingAndBursts) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    for (const Duration smoothing : {1ms, 20ms, 200ms}) {
      const int burst = seed % 2 == 0 ? 1 : 40;
      const Network bad{.delay = 20, .jitter = 40, .loss = 0.2, .seed = seed, .repeated = 0.1, .burst = burst};
      for (const bool clipped : {false, true}) {
        const auto one = run<1>(2, bad, smoothing, clipped);
        EXPECT_GE(one.least, -1e-12);
        EXPECT_GE(one.least_account, -1e-12);
        EXPECT_GE(run<6>(2, bad, smoothing, clipped).least, -1e-12);
      }
    }
  }
}

// Textbook equations with hold-last at a resting end: a lost wave replaced by the previous one uses its energy twice.
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
      const bool lost = i % 100 >= 9 && i % 100 < 40;  // burst directly after the push
      if (!lost) last = u;
      const double wave = !lost || hold ? last : 0.0;
      used += kT * wave * wave / 2;
    }
    return sent - used;
  };
  EXPECT_LT(energy_used(true), -0.01);
  EXPECT_GE(energy_used(false), 0);
}

TEST(WaveVariables, AnEndThatIsTerminatedWithTheImpedanceReflectsNothing) {
  WavePort<1> leader({.impedance = 2, .period = kPeriod, .smoothing = kPeriod});
  WavePort<1> follower({.impedance = 2, .period = kPeriod, .smoothing = kPeriod});
  const auto out = leader.observe({Vec<1>(-0.4), Vec<1>(0.2 * kT), kPeriod});  // F = −B v: u = √(2B) v
  EXPECT_NEAR(out.integral[0], 2 * 0.2 * kT, 1e-15);
  follower.receive(out);
  const double v = 0.2;  // tool with a damper of 2 N·s/m: F = B v
  const double force = follower.command(Vec<1>(v)).force[0];
  EXPECT_NEAR(force, 0.4, 1e-15);
  EXPECT_NEAR(follower.observe({Vec<1>(force), Vec<1>(v * kT), kPeriod}).integral[0], 0, 1e-15);
}

TEST(WaveVariables, SendsNothingWhileItsAccountIsShort) {
  WavePort<1> port({.impedance = 2, .period = kPeriod, .smoothing = kPeriod});
  port.command(Vec<1>(0));
  // The device pushed along a motion for which no wave had paid.
  const auto silent = port.observe({Vec<1>(1), Vec<1>(1e-3), kPeriod});
  EXPECT_EQ(silent.integral[0], 0);
  EXPECT_NEAR(port.energy(), -1e-3, 1e-15);
  port.command(Vec<1>(0));
  const auto paid_back = port.observe({Vec<1>(-2), Vec<1>(1e-3), kPeriod});
  EXPECT_NEAR(port.energy(), 0, 1e-15);
  EXPECT_NEAR(paid_back.energy, 1e-3, 1e-15);
  // Two waves (B Δx − T F)/√(2B) of 0.5 mm √(N·s/m) and 2 mm √(N·s/m) were due. Unused waves pay for the rest.
  for (std::uint64_t i = 1; i <= 4000; ++i) {
    const auto n = static_cast<double>(i);
    port.receive({i, i * 1ms, Vec<1>(1e-3 * n), 0.5e-3 * n});
    port.command(Vec<1>(0));
    port.observe({Vec<1>(0), Vec<1>(0), kPeriod});
  }
  EXPECT_NEAR(port.observe({Vec<1>(0), Vec<1>(0), kPeriod}).integral[0], 2.5e-3, 1e-9);
}

TEST(WaveVariables, OfAnEndThatHasSentForLongOnlyWhatComesNowCounts) {
  WavePort<1> port({.impedance = 2, .period = kPeriod, .smoothing = kPeriod});
  port.join({500, 500s, Vec<1>(7), 3});
  EXPECT_EQ(port.command(Vec<1>(0)).force[0], 0);
  port.observe({Vec<1>(0), Vec<1>(0), kPeriod});
  double most = 0;
  for (std::uint64_t i = 1; i <= 300; ++i) {
    const auto n = static_cast<double>(i);
    port.receive({500 + i, 500s + i * 1ms, Vec<1>(7 + 1e-3 * n), 3 + 0.5e-3 * n});
    most = std::max(most, port.command(Vec<1>(0)).force[0]);
    port.observe({Vec<1>(0), Vec<1>(0), kPeriod});
  }
  EXPECT_NEAR(most, 2, 1e-9) << "√(2B) times a wave of 1 √W";
  EXPECT_LE(port.energy(), 0.5e-3 * 300);
}

TEST(WaveVariables, UseNoWaveThatIsLongerThanItMayBe) {
  WavePort<1> port({.impedance = 2, .period = kPeriod, .smoothing = kPeriod, .max_wave = 0.25});
  for (std::uint64_t i = 1; i <= 300; ++i) {
    const auto n = static_cast<double>(i);
    port.receive({i, i * 1ms, Vec<1>(1e-3 * n), 0.5e-3 * n});
    EXPECT_LE(port.command(Vec<1>(0)).force[0], 2 * 0.25 * (1 + 1e-12));
    port.observe({Vec<1>(0), Vec<1>(0), kPeriod});
    EXPECT_LE(port.taken(), kT * 0.25 * 0.25 / 2 * (1 + 1e-12));
  }
}

TEST(WaveVariables, BelowTheReserveOfALimiterAFifthOfAWaveStays) {
  const auto sent = [](double payable, double reserve) {
    WavePort<1> port({.impedance = 2, .period = kPeriod, .smoothing = kPeriod});
    port.command(Vec<1>(0));
    // The due wave of (2 N·s/m · 1 m/s + 2 N)/2 = 2 √W carries 2 mJ in the period.
    const auto message =
        port.observe({Vec<1>(-2), Vec<1>(kT), kPeriod}, {.payable = payable, .reserve = reserve, .wanted = Vec<1>(-2)});
    EXPECT_NEAR(message.energy, port.given(), 1e-15);
    return port.given();
  };
  EXPECT_NEAR(sent(1, 0), 2e-3, 1e-12);
  EXPECT_NEAR(sent(1, 2), 1.6e-3, 1e-12);
  EXPECT_NEAR(sent(0.5e-3, 2), 0.5e-3, 1e-12) << "never more than there is";
  EXPECT_EQ(sent(-1, 0), 0);
}

TEST(WaveVariables, WhatALimiterCutIsSentWhenItHasMoreThanItNeeds) {
  WavePort<1> port({.impedance = 2, .period = kPeriod, .smoothing = kPeriod});
  port.command(Vec<1>(0));
  const auto observe = [&](double applied, double payable) {
    return port.observe({Vec<1>(applied), Vec<1>(0), kPeriod},
                        {.payable = payable, .reserve = 1, .wanted = Vec<1>(-2)});
  };
  const double cut = observe(0, 1.2).integral[0];
  EXPECT_EQ(cut, 0) << "the wave that was wanted, 1 √W for 1 ms, is left out";
  EXPECT_NEAR(observe(-2, 1.2).integral[0], kT, 1e-15)
      << "that of this period only: it has less than one and a half reserves";
  double sum = 0;
  for (int i = 0; i < 3000; ++i) sum = observe(-2, 9).integral[0] - (2 + i) * kT;
  EXPECT_NEAR(sum, kT, 1e-9);
}

TEST(WaveVariables, WhatWasForgivenIsNotSent) {
  WavePort<1> port({.impedance = 2, .period = kPeriod, .smoothing = kPeriod});
  port.command(Vec<1>(0));
  port.observe({Vec<1>(0), Vec<1>(0), kPeriod}, {.payable = 0, .reserve = 1, .wanted = Vec<1>(-2)});
  port.forgive();
  EXPECT_EQ(port.observe({Vec<1>(0), Vec<1>(0), kPeriod}, {.payable = 9, .reserve = 1}).integral[0], 0);
}

TEST(WaveVariables, PassOverWhatIsNotFiniteOrOutOfPlace) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  WavePort<1> port({.impedance = 2, .period = kPeriod, .smoothing = kPeriod});
  port.receive({2, 2ms, Vec<1>(0.3 * kT), 1});
  port.receive({2, 2ms, Vec<1>(9), 1});
  port.receive({1, 3ms, Vec<1>(9), 1});
  port.receive({0, 0ms, Vec<1>(9), 1});
  port.receive({3, 2ms, Vec<1>(9), 1});
  port.receive({3, 3ms, Vec<1>(kNan), 1});
  port.receive({5, 5ms, Vec<1>(1), kNan});
  EXPECT_NEAR(port.command(Vec<1>(0)).force[0], 0.6, 1e-12);
  EXPECT_EQ(port.observe({Vec<1>(kNan), Vec<1>(0), kPeriod}).energy, 0);
  EXPECT_EQ(port.observe({Vec<1>(1), Vec<1>(-1), Duration::zero()}).energy, 0);
  EXPECT_FALSE(port.command(Vec<1>(kNan)).force.allFinite());
  EXPECT_TRUE(port.command(Vec<1>(0)).force.allFinite());
}

TEST(WaveVariables, MakeNoMoreOfASumThanTheEnergyThatCameWithIt) {
  WavePort<1> port({.impedance = 2, .period = kPeriod, .smoothing = kPeriod});
  port.receive({1, 1ms, Vec<1>(kT), 0.125 * kT});  // a wave of 1 would need T/2
  EXPECT_NEAR(port.command(Vec<1>(0)).force[0], 2 * 0.5, 1e-12);
  port.observe({Vec<1>(1), Vec<1>(0), kPeriod});
  port.receive({2, 2ms, Vec<1>(kT), kT});
  double rest = 0;
  for (int i = 0; i < 4000; ++i) {
    const double force = port.command(Vec<1>(0)).force[0];
    rest += force / 2 * kT;
    port.observe({Vec<1>(force), Vec<1>(0), kPeriod});
  }
  EXPECT_NEAR(rest, 0.5 * kT, 1e-9) << "the other half of the sum, paid for since";
}

// A port at rest receives a constant wave of 1, with bursts from 2 s to 3 s.
TEST(WaveVariables, ABurstDelaysASteadyWaveAndTakesNothingOfIt) {
  for (const int burst : {20, 30, 40, 60, 80, 100, 120}) {
    WavePort<1> port({.impedance = 20, .period = kPeriod});
    std::vector<WaveMessage<1>> waiting;
    double during = 0;
    double after = 0;
    double most = 0;
    for (int i = 1; i <= 6000; ++i) {
      waiting.push_back({static_cast<std::uint64_t>(i), i * 1ms, Vec<1>(i * kT), i * kT / 2});
      if (i < 2000 || i > 3000 || i % burst == 0) {
        for (const WaveMessage<1>& message : waiting) port.receive(message);
        waiting.clear();
      }
      const double force = port.command(Vec<1>(0)).force[0];
      port.observe({Vec<1>(force), Vec<1>(0), kPeriod});
      const double wave = force / std::sqrt(40.0);
      if (i > 2500 && i <= 3000) during += wave / 500;
      if (i > 4000 && i <= 5000) after += wave / 1000;
      most = std::max(most, wave);
    }
    EXPECT_NEAR(after, 1, 0.01) << burst;
    EXPECT_NEAR(during, 1, 0.1) << burst;
    EXPECT_LT(most, 1.7) << burst << ": the energy of a burst is not spent at once";
  }
}

// The velocity estimate is 20 % low forward and 10 % high backward. The peer must still receive the true position.
TEST(WaveVariables, AWrongVelocityDoesNotMoveThePeer) {
  const double impedance = 4;
  WavePort<1> port({.impedance = impedance, .period = kPeriod});
  double x = 0;
  double heard = 0;
  const double root = std::sqrt(2 * impedance);
  for (int i = 1; i <= 61000; ++i) {
    const double to = i < 60000 ? 0.01 * (1 - std::cos(2 * std::numbers::pi * i * kT)) : 0;
    const double v = (to - x) / kT;
    const Vec<1> force = port.command(Vec<1>(v > 0 ? 0.8 * v : 1.1 * v)).force;
    heard = port.observe({force, Vec<1>(to - x), kPeriod}, {.payable = 1, .wanted = force}).integral[0] / root;
    x = to;
  }
  EXPECT_NEAR(heard, 0, 1e-6) << "m; without the correction 60 rounds of 10 mm end 60 mm off";
}

TEST(WaveVariables, UseTheEnergyOfAMessageWhenItsWaveIsPlayed) {
  WavePort<1> port({.impedance = 2, .period = kPeriod, .smoothing = kPeriod});
  port.receive({1, 1ms, Vec<1>(kT), 0.125 * kT});  // a wave of 1 takes T/2
  port.receive({2, 2ms, Vec<1>(kT), 1.125 * kT});
  EXPECT_NEAR(port.command(Vec<1>(0)).force[0], 2 * 0.5, 1e-12);
}

TEST(WaveVariables, MayUseWhatTheAccountHasBeyondOneAndAHalfReserves) {
  const auto force = [](double reserve) {
    WavePort<1> port({.impedance = 2, .period = kPeriod, .smoothing = kPeriod});
    port.command(Vec<1>(0));
    port.observe({Vec<1>(0), Vec<1>(0), kPeriod}, {.payable = 1, .reserve = reserve});
    port.receive({1, 1ms, Vec<1>(kT), 0});  // its energy was not sent
    return port.command(Vec<1>(0)).force[0];
  };
  EXPECT_GT(force(0), 1.9);
  EXPECT_EQ(force(1), 0);
}

TEST(WaveVariables, SayWhatIsWrongWithTheirConfiguration) {
  EXPECT_THROW(WavePort<1>({.impedance = 0, .period = kPeriod}), std::invalid_argument);
  EXPECT_THROW(WavePort<1>({.impedance = 1, .period = Duration::zero()}), std::invalid_argument);
  EXPECT_THROW(WavePort<1>({.impedance = 1, .period = kPeriod, .smoothing = 257ms}), std::invalid_argument);
  EXPECT_THROW(WavePort<1>({.impedance = 1, .period = kPeriod, .smoothing = 0ms}), std::invalid_argument);
  EXPECT_THROW(WavePort<1>({.impedance = 1, .period = kPeriod, .max_playout = -1ms}), std::invalid_argument);
}

TEST(PlayoutClock, PlaysAsLateAsOneInAHundredComes) {
  PlayoutClock clock(60ms);
  Dice dice(3);
  Duration playing{};
  Duration before{};
  std::vector<double> late;
  for (int i = 1; i <= 20000; ++i) {
    const Duration now = i * 1ms;
    const Duration extra = dice.chance(0.005) ? 50ms : from_seconds(dice.within(0, 8e-3));
    clock.heard(now, now + 7h - 30ms - extra, 0ms);  // the peer's clock is 7 h ahead
    before = playing;
    playing = clock.advance(now);
    if (i > 1) {
      ASSERT_GE(playing, before);
    }
    if (i > 10000) late.push_back(seconds(now + 7h - 30ms - playing));
  }
  std::ranges::nth_element(late, late.begin() + 5000);
  EXPECT_NEAR(late[5000], 8e-3, 0.5e-3) << "s, the median";
}

TEST(PlayoutClock, WaitsForGapsAndForNoMoreThanItsMost) {
  PlayoutClock clock(60ms);
  clock.heard(10ms, 0ms, 9ms);
  EXPECT_EQ(clock.playout(), 9ms);
  clock.heard(100ms, 10ms, 0ms);
  EXPECT_EQ(clock.playout(), 60ms);
  PlayoutClock silent(60ms);
  EXPECT_EQ(silent.advance(50ms), 0ms);
  EXPECT_EQ(silent.playout(), 0ms);
}

TEST(PlayoutClock, FollowsALongerAndAShorterWayWithoutAJumpBack) {
  PlayoutClock clock(60ms);
  Duration before{};
  for (int i = 1; i <= 6000; ++i) {
    const Duration way = i > 2000 && i <= 4000 ? 300ms : 10ms;
    const Duration now = i * 1ms;
    clock.heard(now, now - way, 0ms);
    const Duration playing = clock.advance(now);
    if (i > 1) {
      ASSERT_GE(playing, before);
    }
    if (i > 1) {
      ASSERT_LE(playing - before, 2ms);
    }
    before = playing;
    if (i == 2000 || i == 6000) {
      EXPECT_NEAR(seconds(now - playing), 10e-3, 5e-4) << i;
    }
    if (i == 4000) {
      EXPECT_NEAR(seconds(now - playing), 300e-3, 1e-3) << i;
    }
  }
}

TEST(PlayoutClock, StopsUntilALateBurstArrivesAndSkipsNothing) {
  for (const int burst : {40, 100}) {
    PlayoutClock clock(120ms);
    Duration before = -10ms;
    Duration newest = -10ms;
    for (int i = 0; i < 6000; ++i) {
      const Duration now = i * 1ms;
      const bool bursts = i >= 2000 && i < 4000;
      for (int k = bursts && i % burst == 0 ? i - burst + 1 : i; !(bursts && i % burst != 0) && k <= i; ++k) {
        newest = k * 1ms - 10ms;
        clock.heard(now, newest, 0ms);
      }
      const Duration playing = clock.advance(now);
      ASSERT_LE(playing, newest) << burst << ' ' << i;
      ASSERT_GE(playing, before) << burst << ' ' << i;
      ASSERT_LE(playing - before, 2ms) << burst << ' ' << i;
      before = playing;
    }
  }
}

}  // namespace
}  // namespace tendon::wave_variables_test
