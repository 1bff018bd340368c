// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/couplings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/core/teleoperation/expect_ports.h"
#include "tests/core/teleoperation/star.h"

namespace tendon::couplings_test {
namespace {

constexpr double kCoulomb = 0.02;  // N, each device

Star::Leader led(double share, const std::function<double(double)>& path, std::uint64_t seed = 1) {
  Star::Leader leader{.setup = port_of(PortRole::kLeader), .share = share};
  leader.setup.path = [path](double t) { return Vec3(path(t), 0, 0); };
  leader.there = {.delay = 0, .seed = 2 * seed};
  leader.back = {.delay = 0, .seed = 2 * seed + 1};
  return leader;
}

/// Ramp from 0 at `from` s to `goal` m within one second.
std::function<double(double)> to(double goal, double from = 0.5) {
  return [goal, from](double t) { return goal * std::clamp(t - from, 0.0, 1.0); };
}

/// The delay is 5 … 10 ms in each direction, and 10 % of the messages are lost.
void worsen(Star::Leader& leader, std::uint64_t seed) {
  leader.there = {.delay = 5, .jitter = 5, .loss = 0.1, .seed = 2 * seed};
  leader.back = {.delay = 5, .jitter = 5, .loss = 0.1, .seed = 2 * seed + 1};
}

/// The state that leader `i` tells in period `ms`; it engages after ten.
PortState told_by(std::size_t i, int ms) {
  PortState peer;
  peer.epoch = 5 + i;
  peer.sequence = static_cast<std::uint64_t>(ms) + 1;
  peer.answers_epoch = 1;
  peer.phase = ms < 10 ? PortPhase::kCoupled : PortPhase::kEngaged;
  peer.engagement = ms < 10 ? 0 : 1;
  return peer;
}

PortSetup follower_setup() { return port_of(PortRole::kFollower); }

PortSetup held_follower(double stiffness = 500) {
  PortSetup setup = follower_setup();
  setup.around[0] = {.stiffness = stiffness, .damping = 3};
  return setup;
}

TEST(Couplings, OfOneLeaderAreThatCouplingBitForBit) {
  const Coupling::Config config = coupling_of(PortRole::kFollower);
  Coupling alone(config);
  Couplings one(config);
  PortState told_alone;
  PortState told_one;
  for (int ms = 0; ms < 500; ++ms) {
    PortState peer = told_by(0, ms);
    peer.answers_epoch = told_alone.epoch;
    peer.answers = told_alone.sequence;
    peer.time = std::chrono::milliseconds(ms);
    peer.position = Vec3(1e-5 * ms, 0, 0);
    peer.account = 0.01;
    peer.need = 0.001;
    peer.given = 1e-5 * ms;
    alone.receive(peer, Port::at(ms));
    one[0].receive(peer, Port::at(ms));
    const Motion hand{Port::at(ms), Vec3(3e-6 * ms, 0, 0), Vec3(3e-3, 0, 0)};
    const Demand<3> a = alone.command(hand, 0, true);
    const Demand<3> b = one.command(hand, 0, true);
    ASSERT_EQ(a.force, b.force);
    ASSERT_EQ(a.stiffness, b.stiffness);
    const auto paid_a = alone.settle(0.02, 0.001, std::chrono::milliseconds(1));
    const auto paid_b = one.settle(0.02, 0.001, std::chrono::milliseconds(1));
    ASSERT_EQ(paid_a.credit, paid_b.credit);
    ASSERT_EQ(paid_a.withdraw, paid_b.withdraw);
    alone.conclude(a.force, std::nullopt);
    told_alone = alone.message();
    one[0].conclude(b.force, std::nullopt);
    told_one = one[0].message();
    ASSERT_EQ(told_alone.account, told_one.account);
    ASSERT_EQ(told_alone.given, told_one.given);
    ASSERT_FALSE(told_one.share);
  }
  EXPECT_TRUE(one.live());
  EXPECT_GT(told_one.given, 0);
}

TEST(Couplings, RefuseOneLeaderFiveAndMethodsThatCannotBeShared) {
  Coupling::Config config = coupling_of(PortRole::kFollower);
  const std::vector<CoupledLeader> two{{.channel = 0, .share = 0.5}, {.channel = 1, .share = 0.5}};
  EXPECT_NO_THROW(Couplings(config, two));
  EXPECT_THROW(Couplings(config, std::vector<CoupledLeader>(1, {.channel = 0, .share = 1})), std::invalid_argument);
  EXPECT_THROW(Couplings(config, std::vector<CoupledLeader>(5, {.channel = 0, .share = 0.2})), std::invalid_argument);
  EXPECT_THROW(Couplings(config, std::vector<CoupledLeader>(2, {.channel = 0, .share = 0.4})), std::invalid_argument);
  EXPECT_THROW(Couplings(coupling_of(PortRole::kLeader), two), std::invalid_argument);
  for (const CouplingMethod method : kCouplingMethods) {
    config.method = method;
    if (method == CouplingMethod::kPositionPosition || method == CouplingMethod::kPositionForce) {
      EXPECT_NO_THROW(Couplings(config, two));
    } else {
      EXPECT_THROW(Couplings(config, two), std::invalid_argument) << to_string(method);
    }
  }
}

TEST(Couplings, AFreeFollowerIsAtTheMeanOfItsLeadersByTheirShares) {
  for (const double share : {0.7, 0.5, 0.0}) {
    Star star(follower_setup(), {led(share, to(0.010)), led(1 - share, to(-0.005), 2)});
    ASSERT_TRUE(star.engage(0) && star.engage(1));
    star.run(4000);
    const double mean = share * 0.010 + (1 - share) * -0.005;
    EXPECT_NEAR(star.follower.x().x(), mean, kCoulomb / 400) << share;
    for (std::size_t i = 0; i < 2; ++i) {
      const double part = i == 0 ? share : 1 - share;
      const double apart = star.follower.x().x() - star.leaders[i].x().x();
      EXPECT_NEAR(star.leaders[i].applied.x(), part * 400 * apart, 1e-3) << share << " " << i;
    }
    expect_passive(star);
  }
}

TEST(Couplings, TheForcesOfAllEndsTogetherAreNone) {
  Star star(held_follower(), {led(0.6, to(0.010)), led(0.3, to(-0.004), 2), led(0.1, to(0.008), 3)});
  for (std::size_t i = 0; i < 3; ++i) ASSERT_TRUE(star.engage(i));
  star.run(4000);
  Vec3 sum = star.follower.applied;
  for (const Node& leader : star.leaders) sum += leader.applied;
  EXPECT_GT(star.follower.applied.norm(), 0.5);
  EXPECT_LT(sum.norm(), 1e-3);
}

TEST(Couplings, ALeaderThatIsNotEngagedCountsForNothing) {
  const auto twice = [](double t) { return t < 5 ? to(0.010)(t) - to(0.010, 3)(t) : to(0.010, 5)(t); };
  PortSetup follower = held_follower(20000);
  std::vector<Star::Leader> of{led(0.6, twice), led(0.4, to(-0.010), 2)};
  for (PortSetup* const end : {&follower, &of[0].setup, &of[1].setup}) end->coupling.spring.stiffness = 200;
  Star star(follower, of);
  ASSERT_TRUE(star.engage(0));
  star.run(2900 - star.now);
  EXPECT_NEAR(star.follower.applied.x(), 0.6 * 200 * 0.010, 0.05) << "and the other one's spring does not grow";
  EXPECT_EQ(star.leaders[1].applied, Vec3(0, 0, 0));
  EXPECT_EQ(star.leaders[1].coupling().phase(), PortPhase::kCoupled);
  star.run(1300);
  star.set_share(0, 1);  // springs are at rest
  star.run(3000);
  EXPECT_NEAR(star.follower.applied.x(), 200 * 0.010, 0.05) << "unless somebody says so";
}

TEST(Couplings, TheOwnDampingOfTheFollowerIsRenderedOnce) {
  const std::vector<CoupledLeader> three{
      {.channel = 0, .share = 0.5}, {.channel = 1, .share = 0.3}, {.channel = 2, .share = 0.2}};
  Couplings couplings(coupling_of(PortRole::kFollower), three);
  Demand<3> demand{Vec3::Zero()};
  for (int ms = 0; ms < 500; ++ms) {
    for (std::size_t i = 0; i < 3; ++i) couplings[i].receive(told_by(i, ms), Port::at(ms));
    demand = couplings.command({Port::at(ms), Vec3::Zero(), Vec3(0.1, 0, 0)}, 0, true);
  }
  ASSERT_TRUE(couplings[0].live() && couplings[1].live() && couplings[2].live());
  EXPECT_NEAR(demand.force.x(), -4 * 0.1, 1e-12);
  EXPECT_NEAR(demand.stiffness(0, 0), 400, 1e-9);
}

double largest_step(Star& star, int ticks) {
  double most = 0;
  star.run(ticks, [&](int) {
    most = std::max(most, (star.follower.applied - star.follower.was_applied).norm());
    for (const Node& leader : star.leaders) most = std::max(most, (leader.applied - leader.was_applied).norm());
  });
  return most;
}

TEST(Couplings, AHandOverUnderStretchMakesNoStepAndTakesNoEnergy) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    std::vector<Star::Leader> of{led(0.9, to(0.015)), led(0.1, to(-0.010), 2)};
    for (std::size_t i = 0; i < of.size(); ++i) worsen(of[i], 10 * seed + i);
    Star star(held_follower(), of);
    ASSERT_TRUE(star.engage(0) && star.engage(1));
    star.run(4000 - star.now);
    const double before = star.follower.x().x();
    star.set_share(1, 0.9);
    // K is lowered to 2B/T_loop. The follower's force changes by K Δα (x₁ − x₂) within half a second.
    const double slope = 400 * 0.8 * 0.025 / 500;
    const double most = largest_step(star, 700);
    EXPECT_LT(most, kCoulomb + slope) << seed;
    star.run(1500);
    const double after = star.follower.x().x();
    EXPECT_GT(before, 2e-3);
    EXPECT_LT(after, -1e-3);
    EXPECT_NEAR(star.follower.coupling(1).share(), 0.9, 1e-12);
    EXPECT_EQ(star.leaders[1].coupling().share(), star.follower.coupling(1).share());
    expect_passive(star, seed);
    std::cout << "seed " << seed << ": the follower goes from " << before * 1e3 << " to " << after * 1e3
              << " mm, no force changes by more than " << most << " N in a period (slope " << slope << ")\n";
  }
}

/// Leader 0 oscillates about a stiff follower, and leader 1 rests. Leader 0's share is large while its spring relaxes
/// and nearly zero while it is stretched, so the spring generates energy in each cycle.
Star pumped(bool limited) {
  constexpr double kPeriod = 4;  // s
  const auto swing = [](double t) { return t < 1 ? 0.0 : 0.02 * std::sin(2 * std::numbers::pi * (t - 1) / kPeriod); };
  PortSetup follower = held_follower(20000);
  std::vector<Star::Leader> of{led(0.02, swing), led(
                                                     0.98, [](double) { return 0.0; }, 2)};
  for (PortSetup* const end : {&follower, &of[0].setup, &of[1].setup}) {
    end->limited = limited;
    if (limited) continue;
    end->coupling.spring.stiffness = 1000;
    end->coupling.spring.own_damping = 0.5;
    end->coupling.spring.adapt_to_delay = false;
  }
  for (std::size_t i = 0; i < of.size(); ++i) worsen(of[i], 3 + i);
  Star star(follower, of);
  EXPECT_TRUE(star.engage(0) && star.engage(1));
  star.run(1000 - star.now);
  for (int quarter = 0; quarter < 20; ++quarter) {
    star.run(750);
    star.set_share(0, quarter % 2 == 0 ? 1 : 0);
    star.run(250);
  }
  return star;
}

TEST(Couplings, AShareMovedUnderStretchIsPaidForByLimiterAndTanks) {
  const Star with = pumped(true);
  const Star without = pumped(false);
  std::cout << "sum of the ports: with " << with.least_sum << " J, without " << without.least_sum << " J\n";
  EXPECT_GE(with.least_sum, kRounding);
  EXPECT_GE(with.least_account(), kRounding);
  EXPECT_LT(without.least_sum, -0.5);
}

TEST(Couplings, OfThreePortsOneIsLostAndTheOthersGoOn) {
  std::vector<Star::Leader> of{led(0.5, to(0.012)), led(0.5, to(0.004), 2)};
  for (std::size_t i = 0; i < of.size(); ++i) worsen(of[i], 5 + i);
  Star star(held_follower(), of);
  ASSERT_TRUE(star.engage(0) && star.engage(1));
  star.run(3000 - star.now);
  const double before = star.follower.applied.x();
  star.cut[1] = true;
  double most_change = 0;
  bool one_alone = true;
  star.run(1000, [&](int) {
    most_change = std::max(most_change, (star.follower.applied - star.follower.was_applied).norm());
    one_alone = one_alone && star.leaders[0].coupling().live() && star.follower.coupling(0).live();
  });
  EXPECT_TRUE(one_alone);
  EXPECT_EQ(star.follower.coupling(1).phase(), PortPhase::kLost);
  EXPECT_EQ(star.leaders[1].coupling().phase(), PortPhase::kLost);
  EXPECT_LT(most_change, before / 20) << "its part fades within 50 ms";
  EXPECT_LT(star.leaders[1].applied.norm(), 1e-12);
  EXPECT_NE(star.follower.applied.x(), 0);
  star.cut[1] = false;
  star.run(2000);
  EXPECT_EQ(star.leaders[1].coupling().phase(), PortPhase::kCoupled) << "nobody has acted";
  EXPECT_EQ(star.follower.coupling(1).phase(), PortPhase::kCoupled);
  const Vec3 alone = star.follower.applied;
  EXPECT_TRUE(star.engage(1));
  star.run(1000);
  EXPECT_LT((star.follower.applied - alone).norm(), 0.1) << "from where both are";
  expect_passive(star);
}

TEST(Couplings, AnEngineAndALeaderAreBoundedByTheSameAccount) {
  struct Outcome {
    double sum;
    double account;
    bool both;
  };
  // A fixture force of an engine with 20 ms of delay: 3000 N/m towards x = 0, which excites any motion through it.
  const auto run = [](bool limited) {
    Star::Leader leader{.setup = port_of(PortRole::kLeader)};
    leader.setup.around[0] = {.stiffness = 300, .damping = 3, .reference = [](double t) {
                                return 0.015 * std::sin(2 * std::numbers::pi * t);
                              }};
    leader.setup.limited = limited;
    worsen(leader, 9);
    PortSetup follower = held_follower(200);
    follower.limited = limited;
    Star star(follower, {leader});
    EXPECT_TRUE(star.engage(0));
    std::deque<double> seen(20, 0.0);
    bool both = false;
    star.run(4000, [&](int now) {
      seen.push_back(star.follower.x().x());
      if (now % 5 == 0) {
        RemoteForce force;
        force.sequence = static_cast<std::uint64_t>(now) + 1;
        force.received = force.answers = Port::at(now);
        force.valid_for = std::chrono::milliseconds(20);
        force.force = Vec3(-3000 * seen.front(), 0, 0);
        star.follower.controller->observe(force);
      }
      seen.pop_front();
      both = both || (star.follower.coupling().live() && star.follower.taken.mode == Mode::kActive &&
                      star.follower.taken.force_sequence > 0);
    });
    return Outcome{star.least_sum, star.least_account(), both};
  };
  const Outcome with = run(true);
  const Outcome without = run(false);
  std::cout << "a fixture of 3000 N/m and a leader: with " << with.sum << " J, without " << without.sum << " J\n";
  EXPECT_TRUE(with.both);
  EXPECT_GE(with.sum, kRounding);
  EXPECT_GE(with.account, kRounding);
  EXPECT_LT(without.sum, -0.1);
}

TEST(Couplings, ByPositionForceALeaderFeelsItsShareOfTheContact) {
  PortSetup follower = held_follower(5000);
  follower.measures_contact = true;
  follower.coupling.method = CouplingMethod::kPositionForce;
  std::vector<Star::Leader> of{led(0.7, to(0.010)), led(0.3, to(0.006), 2)};
  follower.coupling.spring.stiffness = 150;
  for (Star::Leader& one : of) {
    one.setup.coupling.method = CouplingMethod::kPositionForce;
    one.setup.coupling.spring.stiffness = 150;
  }
  Star star(follower, of);
  ASSERT_TRUE(star.engage(0) && star.engage(1));
  star.run(4000);
  const double contact = star.follower.outside().x();
  EXPECT_LT(contact, -0.5);
  EXPECT_NEAR(star.leaders[0].applied.x(), 0.7 * contact, 0.01);
  EXPECT_NEAR(star.leaders[1].applied.x(), 0.3 * contact, 0.01);
  EXPECT_GE(star.least_sum, kRounding);
}

TEST(Couplings, ARobotHoldsItsPlaceAsFarAsNobodyLeadsIt) {
  PortSetup robot = follower_setup();
  robot.coupling.holds_place = true;
  robot.around[0] = {.stiffness = 20, .reference = [](double) { return 0.05; }};
  Star star(robot, {led(0.5, to(0.010, 4)), led(0.5, to(0.010, 40), 2)});
  star.run(1000);
  EXPECT_NEAR(star.follower.x().x(), 1.0 / 420, 0.3e-3) << "with its whole stiffness, once";
  ASSERT_TRUE(star.engage(0));
  const double most = largest_step(star, 5000 - star.now + 1000);
  const double led_to = star.follower.x().x();
  EXPECT_GT(led_to, 0.009) << "the place does not hold it back";
  EXPECT_LT(most, 0.05);
  star.cut[0] = true;
  while (star.follower.coupling(0).phase() != PortPhase::kLost) EXPECT_LT(largest_step(star, 1), 0.05);
  const double lost_at = star.follower.x().x();
  EXPECT_LT(largest_step(star, 3000), 0.05);
  EXPECT_NEAR(star.follower.x().x(), lost_at, 2e-3) << "it stays where it is, on its spring";
  EXPECT_GE(star.least_sum, kRounding);
}

TEST(Couplings, ARobotThatIsLetGoOnTheMoveFeelsNoStep) {
  PortSetup robot = follower_setup();
  robot.coupling.holds_place = true;
  std::vector<Star::Leader> of{led(0.3, [](double t) { return 0.02 * std::sin(6 * t); }),
                               led(
                                   0.7, [](double) { return 0.0; }, 2)};
  Star star(robot, of);
  ASSERT_TRUE(star.engage(0));
  star.run(2100 - star.now);
  const Vec3 before = star.follower.x();
  star.run(1);
  ASSERT_GT((star.follower.x() - before).norm(), 0.08e-3) << "0.08 m/s";
  star.leaders[0].coupling().disengage();
  EXPECT_LT(largest_step(star, 500), 0.05);
}

TEST(Couplings, TogetherGiveNoMoreThanTheAccountHas) {
  std::vector<CoupledLeader> four;
  for (std::uint32_t i = 0; i < 4; ++i) four.push_back({.channel = i, .share = 0.25});
  Couplings couplings(coupling_of(PortRole::kFollower), four);
  double given = 0;
  for (int ms = 0; ms < 50; ++ms) {
    for (std::size_t i = 0; i < 4; ++i) {
      PortState peer = told_by(i, ms);
      peer.need = 1;  // share of the total
      couplings[i].receive(peer, Port::at(ms));
    }
    couplings.command({Port::at(ms), Vec3::Zero(), Vec3::Zero()}, 0, true);
    const EnergyTank::Settlement paid = couplings.settle(0.01, 0, std::chrono::milliseconds(1));
    EXPECT_LE(paid.withdraw, 0.01) << ms;
    given += paid.withdraw;
  }
  EXPECT_GT(given, 0.005);
}

TEST(Couplings, NoWorldWithTwoToFourLeadersGivesOutEnergy) {
  double least_sum = 0;
  double least_account = 0;
  double moved = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Dice dice(seed);
    const std::size_t count = 2 + dice.bits() % 3;
    std::vector<Star::Leader> of;
    for (std::size_t i = 0; i < count; ++i) {
      Star::Leader leader{.setup = port_of(PortRole::kLeader), .share = 1.0 / static_cast<double>(count)};
      const double reach = dice.within(0, 0.02);
      const double hz = dice.within(0.2, 3);
      leader.setup.around[0] = {.stiffness = dice.within(0, 600), .damping = 3, .reference = [reach, hz](double t) {
                                  return reach * std::sin(2 * std::numbers::pi * hz * t);
                                }};
      leader.there = {.delay = static_cast<int>(dice.within(0, 60)), .jitter = 8, .loss = 0.1, .seed = dice.bits()};
      leader.back = {.delay = static_cast<int>(dice.within(0, 60)), .jitter = 8, .loss = 0.1, .seed = dice.bits()};
      of.push_back(leader);
    }
    Star star(held_follower(dice.decades(1, 4)), of);
    for (int act = 0; act < 18; ++act) {
      star.run(static_cast<int>(dice.within(20, 250)));
      const std::size_t which = dice.bits() % count;
      switch (dice.bits() % 9) {
        case 0:
          star.cut[which] = !star.cut[which];
          break;
        case 1:
          star.leaders[which].coupling().disengage();
          break;
        case 2:
        case 3:
          star.set_share(which, dice.uniform());
          break;
        case 4:
          if (dice.chance(0.3)) star.leaders[which].begin(100 + static_cast<std::uint64_t>(act));
          if (dice.chance(0.1)) star.follower.begin(100 + static_cast<std::uint64_t>(act));
          break;
        default:
          star.leaders[which].coupling().engage();
      }
    }
    least_sum = std::min(least_sum, star.least_sum);
    least_account = std::min(least_account, star.least_account());
    for (std::size_t i = 0; i < count; ++i) moved += star.follower.message(i).given + star.leaders[i].message(0).given;
    expect_passive(star, seed);
  }
  std::cout << "60 worlds: least sum " << least_sum << " J, least account " << least_account << " J, given " << moved
            << " J\n";
  EXPECT_GT(moved, 0.1);
}

}  // namespace
}  // namespace tendon::couplings_test
