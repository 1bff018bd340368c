// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <iostream>
#include <numbers>
#include <string>

#include "core/base/rotation.h"
#include "tests/core/teleoperation/expect_felt.h"
#include "tests/core/teleoperation/expect_ports.h"
#include "tests/core/teleoperation/ports.h"
#include "tests/core/teleoperation/pressing.h"
#include "tests/support/refusal.h"

namespace tendon::coupling_more_methods_test {
namespace {

constexpr double kFriction = 0.02;  // N, Coulomb friction of each port

/// Periodically, with a free follower: rms position difference without the delay of the link, m.
double apart_while_waving(CouplingMethod method, double drift_rate, int one_way, double* least_sum = nullptr) {
  PortSetup leader = port_of(PortRole::kLeader);
  PortSetup follower = port_of(PortRole::kFollower);
  for (PortSetup* const end : {&leader, &follower}) {
    couple_by(method, end->coupling);
    end->coupling.drift_rate = drift_rate;
  }
  leader.path = [](double t) { return Vec3(0.01 * std::sin(2 * std::numbers::pi * 0.7 * t), 0, 0); };
  Ports ports(leader, follower, bad_way(one_way, 11), bad_way(one_way, 12));
  ports.run(800);
  EXPECT_TRUE(ports.engage());
  const double began = ports.follower.x().x() - ports.leader.x().x();
  double sum = 0;
  int n = 0;
  ports.run(10'000, [&](int now) {
    if (now < 4000) return;
    const double then = leader.path((now - one_way - bad_way(one_way, 1).jitter / 2) * 1e-3).x();
    const double apart = ports.follower.x().x() - began - then;
    sum += apart * apart;
    ++n;
  });
  if (least_sum != nullptr) *least_sum = ports.least_sum;
  return std::sqrt(sum / n);
}

TEST(CouplingSetPosition, IsFeltAlikeAtBothEndsAndThePairIsPassive) {
  const double felt_at_least[] = {2.7, 1.5, 0.55, 0.2};
  int i = 0;
  for (const int one_way : {0, 25, 100, 300}) {
    const Felt felt = feel({.method = CouplingMethod::kSetPosition, .one_way = one_way});
    print("set-position, round trip " + std::to_string(2 * one_way) + " ms", felt);
    expect_passive(felt, std::to_string(one_way));
    EXPECT_NEAR(felt.second, felt.wall, 2 * kFriction + 0.01 * felt.wall) << one_way;
    EXPECT_GT(felt.second, felt_at_least[i++]) << one_way;
    EXPECT_LT(felt.buzz, 2e-3) << one_way;
  }
}

TEST(CouplingSetPosition, WithSeldomStatesAPaidStiffSpringIsQuiet) {
  Pressing with{.stiffness = 400, .one_way = 100, .sent_each = 50, .adapts = false};
  with.method = CouplingMethod::kSetPosition;
  const Felt paid = feel(with);
  with.method = CouplingMethod::kPositionPosition;
  const Felt not_paid = feel(with);
  print("set-position, K 400 at 200 ms, a state each 50 ms", paid);
  print("position-position, the same", not_paid);
  expect_passive(paid, "paid");
  EXPECT_GT(paid.second, 2.7);
  EXPECT_LT(paid.buzz, 2e-3);
  EXPECT_GT(not_paid.buzz, 5e-3);
}

/// The account pays for the stretch, so the stiffness need not depend on the delay.
TEST(CouplingSetPosition, AStiffSpringThatDoesNotAdaptHoldsAtEveryDelay) {
  for (const int one_way : {0, 25, 100, 300}) {
    const Felt felt = feel({.method = CouplingMethod::kSetPosition, .one_way = one_way, .adapts = false});
    print("set-position, K 400 at round trip " + std::to_string(2 * one_way) + " ms", felt);
    expect_passive(felt, std::to_string(one_way));
    const double ideal = (kPressingDepth - kPressingWallAt) / (1 / kPressingHand + 1.0 / 400 + 1.0 / 500);
    EXPECT_NEAR(felt.first, ideal, 0.1 * ideal) << one_way;
    EXPECT_NEAR(felt.second, ideal, 0.02 * ideal + 0.04) << one_way;
    EXPECT_LT(felt.buzz, 2e-3) << one_way;
  }
}

TEST(CouplingSetPosition, TheFollowerGoesWhereTheHandGoes) {
  // A delayed spring drags with K·T_loop. The lag due to friction and B at 131 N/m is 2 mm.
  EXPECT_LT(apart_while_waving(CouplingMethod::kSetPosition, 100, 0), 0.6e-3);
  EXPECT_LT(apart_while_waving(CouplingMethod::kSetPosition, 100, 25), 2e-3);
}

TEST(CouplingPassivity, IsFeltAndWithATankThePairIsPassive) {
  const double felt_at_least[] = {2.7, 2.5, 1.5, 1.2};
  int i = 0;
  for (const int one_way : {0, 25, 100, 300}) {
    const Felt felt = feel({.method = CouplingMethod::kPassivity, .one_way = one_way});
    print("passivity, round trip " + std::to_string(2 * one_way) + " ms", felt);
    expect_passive(felt, std::to_string(one_way));
    EXPECT_GT(felt.second, felt_at_least[i++]) << one_way;
    EXPECT_LT(felt.buzz, 2e-3) << one_way;
  }
}

TEST(CouplingPassivity, WithALimiterAtTheHandAloneThePairGivesOutMillijoules) {
  for (const int one_way : {0, 25, 100, 300}) {
    Ports made = press({.method = CouplingMethod::kPassivity, .tank = false, .one_way = one_way});
    PortSetup follower = made.follower.setup;
    follower.limited = false;
    Ports ports(made.leader.setup, follower, bad_way(one_way, 1), bad_way(one_way, 2));
    ports.run(1200);
    ASSERT_TRUE(ports.engage());
    double hand = 0;
    ports.run(3000 + 4 * kPressMs - ports.now, [&](int) { hand = std::min(hand, ports.leader.truth.energy()); });
    std::cout << "passivity without an energy tank, round trip " << 2 * one_way << " ms: pair " << ports.least_sum * 1e3
              << " mJ\n";
    EXPECT_GE(ports.least_sum, -0.05) << one_way;
    EXPECT_GE(hand, kRounding) << one_way;
  }
}

TEST(CouplingPassivity, TheDriftRateDecidesHowFarTheTwoPlacesAreApart) {
  double sum = 0;
  const double fast = apart_while_waving(CouplingMethod::kPassivity, 100, 25, &sum);
  const double slow = apart_while_waving(CouplingMethod::kPassivity, 5, 25);
  std::cout << "passivity, round trip 50 ms, waving: " << fast * 1e3 << " mm rms apart with 100/s, " << slow * 1e3
            << " mm with 5/s\n";
  EXPECT_LT(fast, 1.2e-3);
  EXPECT_GT(slow, 2 * fast);
  EXPECT_GE(sum, kRounding);
}

class PlayedPassivity {
 public:
  PlayedPassivity()
      : played([] {
          auto config = coupling_of(PortRole::kFollower);
          config.method = CouplingMethod::kPassivity;
          return config;
        }()) {}

  /// Returns the final force of the spring, N.
  double run(int periods, double at, double energy_in, PortPhase phase = PortPhase::kEngaged) {
    Demand<3> demand{Vec3::Zero()};
    for (int i = 0; i < periods; ++i) {
      auto peer = played.state(phase, phase == PortPhase::kEngaged ? act : 0);
      peer.epoch = epoch;
      peer.position = Vec3(at, 0, 0);
      peer.energy_in = energy_in;
      played.receive(peer);
      demand = played.port.command({Port::at(played.now++), Vec3::Zero(), Vec3::Zero()}, 0, true);
      played.port.conclude(demand.force, std::nullopt);
      played.told = played.port.message();
    }
    return demand.force.x();
  }

  Played played;
  std::uint64_t epoch = 5;
  std::uint64_t act = 1;
};

TEST(CouplingPassivity, WhatAPeerTookInBeforeItWasHeardMovesNothing) {
  PlayedPassivity follower;
  follower.run(5, 0, 5.0, PortPhase::kCoupled);
  follower.run(10, 0, 5.0);
  ASSERT_TRUE(follower.played.port.live());
  EXPECT_NEAR(follower.run(500, 0.01, 5.0), 0, 1e-12) << "5 J of a time before";
  // ½ K (F/K)² = 0.5 mJ
  EXPECT_NEAR(follower.run(500, 0.01, 5.0005), std::sqrt(2 * 400 * 0.5e-3), 1e-3);
  EXPECT_NEAR(follower.run(500, 0.01, 5.0005), std::sqrt(2 * 400 * 0.5e-3), 1e-3) << "the same total again";
}

TEST(CouplingPassivity, APeerThatStartsAnewCountsAnew) {
  PlayedPassivity follower;
  follower.run(5, 0, 0, PortPhase::kCoupled);
  follower.run(10, 0, 0);
  follower.run(500, 0.01, 0.5e-3);
  follower.epoch = 6;
  follower.run(5, 0, 3.0, PortPhase::kCoupled);
  follower.run(10, 0, 3.0);
  ASSERT_TRUE(follower.played.port.live());
  EXPECT_NEAR(follower.run(500, 0.01, 3.0), 0, 1e-6) << "3 J that came before its new epoch was heard of";
  EXPECT_NEAR(follower.run(500, 0.01, 3.001), std::sqrt(2 * 400 * 1e-3), 2e-3);
}

TEST(CouplingPassivity, ATotalThatFallsIsRefused) {
  PlayedPassivity follower;
  follower.run(5, 0, 1.0, PortPhase::kCoupled);
  EXPECT_EQ(follower.played.port.refused(), 0U);
  follower.run(1, 0, 0.9, PortPhase::kCoupled);
  EXPECT_EQ(follower.played.port.refused(), 1U);
}

PortSetup rate_port(PortRole role) {
  PortSetup setup = port_of(role);
  couple_by(CouplingMethod::kRate, setup.coupling);
  setup.coupling.spring.max_force = 8;
  return setup;
}

TEST(CouplingRate, TheFollowerMovesAsFastAsTheHandleIsOut) {
  PortSetup leader = rate_port(PortRole::kLeader);
  PortSetup follower = rate_port(PortRole::kFollower);
  for (PortSetup* const end : {&leader, &follower}) {
    end->coupling.map.position_scale = 2;
    end->coupling.map.rotation = rotation_by(Vec3(0, 0, std::numbers::pi / 2));
  }
  // Displacements from the center: 10 mm (7 mm beyond the dead zone), then 40 mm, which exceeds the speed limit.
  leader.path = [](double t) { return Vec3(t < 2 ? 0.0 : t < 4 ? 0.01 : t < 6 ? 0.04 : 0.0, 0, 0); };
  for (const int one_way : {0, 25, 100, 300}) {
    Ports ports(leader, follower, bad_way(one_way, 3), bad_way(one_way, 4));
    ports.run(800);
    ASSERT_TRUE(ports.engage());
    const auto moved_in = [&](int until) {
      ports.run(until - 500 - ports.now);
      const Vec3 before = ports.follower.x();
      ports.run(500);
      return Vec3(ports.follower.x() - before);
    };
    const Vec3 slow = moved_in(3900);
    EXPECT_NEAR(slow.y(), 2 * 4 * 7e-3 * 0.5, 0.5e-3) << one_way;
    EXPECT_NEAR(std::hypot(slow.x(), slow.z()), 0, 1e-4) << one_way;
    EXPECT_NEAR(moved_in(5900).y(), 2 * 0.05 * 0.5, 2e-3) << one_way;
    EXPECT_NEAR(moved_in(7500).norm(), 0, 1e-4) << one_way;
    expect_passive(ports, one_way);
    EXPECT_TRUE(ports.leader.coupling->live()) << one_way;
  }
}

/// A scripted leader and a tool blocked at 0.
class PlayedRate {
 public:
  PlayedRate()
      : played([] {
          auto config = coupling_of(PortRole::kFollower);
          couple_by(CouplingMethod::kRate, config);
          config.ramp = std::chrono::milliseconds(1);
          return config;
        }()) {
    for (int i = 0; i < 5; ++i) period(PortPhase::kCoupled, 0);
    for (int i = 0; i < 100; ++i) period(PortPhase::kEngaged, 0);
  }
  double period(PortPhase phase, double handle) {
    auto peer = played.state(phase, phase == PortPhase::kCoupled ? 0 : 1);
    peer.position = Vec3(handle, 0, 0);
    played.receive(peer);
    return played.step().force.x();
  }

  Played played;
};

TEST(CouplingRate, TheFollowerStopsInThePeriodOfTheDeadZone) {
  PlayedRate follower;
  ASSERT_TRUE(follower.played.port.live());
  double before = follower.period(PortPhase::kEngaged, 8e-3);
  for (int i = 0; i < 20; ++i) {
    const double force = follower.period(PortPhase::kEngaged, 8e-3);
    EXPECT_NEAR(force - before, 400 * 4 * 5e-3 * 1e-3, 1e-12);
    before = force;
  }
  EXPECT_EQ(follower.period(PortPhase::kEngaged, 3e-3), before);
  EXPECT_EQ(follower.period(PortPhase::kEngaged, -2e-3), before);
}

TEST(CouplingRate, TheFollowerStopsWhenTheLeaderFallsSilentOrClutches) {
  PlayedRate follower;
  double before = 0;
  for (int i = 0; i < 20; ++i) before = follower.period(PortPhase::kEngaged, 8e-3);
  EXPECT_EQ(follower.period(PortPhase::kClutched, 8e-3), before) << "whatever place a clutched handle tells";
  for (int i = 0; i < 20; ++i) before = follower.period(PortPhase::kEngaged, 8e-3);
  double moved_until = 0;
  for (int i = 1; i <= 30; ++i) {
    const double force = follower.played.step().force.x();
    if (force != before) moved_until = i;
    before = force;
  }
  EXPECT_LE(moved_until, 20) << "v of the ladder";
  EXPECT_GT(moved_until, 15);
}

TEST(CouplingRate, ACutLinkStopsARobotThatStaysWhereItIs) {
  PortSetup leader = rate_port(PortRole::kLeader);
  PortSetup follower = rate_port(PortRole::kFollower);
  follower.coupling.holds_place = true;
  leader.path = [](double t) { return Vec3(t < 1 ? 0.0 : 0.02, 0, 0); };
  Ports ports(leader, follower);
  ASSERT_TRUE(ports.engage());
  ports.run(3000 - ports.now);
  const Vec3 cut_at = ports.follower.x();
  ports.cut_there = true;
  ports.run(60);
  const Vec3 stopped = ports.follower.x();
  EXPECT_LT((stopped - cut_at).norm(), 0.05 * 0.04) << "50 mm/s for at most the second rung";
  ports.run(1500);
  EXPECT_LT((ports.follower.x() - stopped).norm(), 0.3e-3);
  EXPECT_EQ(phase(ports.follower), PortPhase::kLost);
  EXPECT_GE(ports.least_sum, kRounding);
}

TEST(CouplingRate, TheLeaderIsPulledBackToWhereItBecameLive) {
  PortSetup leader = rate_port(PortRole::kLeader);
  leader.coupling.clutch = Coupling::Button{.bit = 0};
  leader.path = [](double t) { return Vec3(0.03 + (t < 2 ? 0.0 : 0.005), t < 4 ? 0 : 0.01, 0); };
  Ports ports(leader, rate_port(PortRole::kFollower));
  ASSERT_TRUE(ports.engage());
  ports.run(1500 - ports.now);
  EXPECT_NEAR(ports.leader.demand.force.norm(), 0, 1e-12);
  ports.run(1500);
  EXPECT_NEAR((ports.leader.demand.force - Vec3(-200 * 0.005, 0, 0)).norm(), 0, 1e-9);
  ports.leader.buttons = 1;
  ports.run(1500);
  EXPECT_EQ(ports.told_there.position, Vec3(0, 0, 0));
  ports.leader.buttons = 0;
  const Vec3 before = ports.follower.x();
  ports.run(1000);
  EXPECT_TRUE(ports.leader.coupling->live());
  EXPECT_NEAR(ports.leader.demand.force.norm(), 0, 1e-12) << "the centre is where the clutch was released";
  EXPECT_LT((ports.follower.x() - before).norm(), 1e-4);
}

TEST(CouplingRate, AnUnseenHandleStopsTheFollower) {
  PortSetup leader = rate_port(PortRole::kLeader);
  leader.path = [](double t) { return Vec3(t < 1 ? 0.0 : 0.02, 0, 0); };
  Ports ports(leader, rate_port(PortRole::kFollower));
  ASSERT_TRUE(ports.engage());
  ports.run(3000 - ports.now);
  ports.leader.seen = false;
  ports.run(50);
  const Vec3 before = ports.follower.x();
  ports.run(100);
  EXPECT_LT((ports.follower.x() - before).norm(), 0.3e-3);
  ports.leader.seen = true;
  ports.run(300);
  EXPECT_NEAR(ports.told_there.position.x(), 0.02, 1e-12);
}

TEST(CouplingRate, AContactIsFeltButNeverMovesTheFollower) {
  PortSetup leader = rate_port(PortRole::kLeader);
  PortSetup follower = rate_port(PortRole::kFollower);
  follower.measures_contact = true;
  // 10 mm from the center for 3 s while the follower is at a wall, then released.
  leader.around[0] = {
      .stiffness = 1000, .damping = 3, .reference = [](double t) { return t < 2 ? 0.0 : 0.01; }, .until = 5};
  follower.around[0] = {.stiffness = 500, .damping = 1, .reference = [](double) { return 0.005; }, .wall = true};
  for (const int one_way : {0, 25, 100, 300}) {
    Ports ports(leader, follower, bad_way(one_way, 7), bad_way(one_way, 8));
    ports.run(800);
    ASSERT_TRUE(ports.engage());
    ports.run(4900 - ports.now);
    EXPECT_LT(ports.follower.outside().x(), -0.5) << one_way;
    EXPECT_LT(ports.leader.demand.force.x(), -200 * ports.told_there.position.x() - 0.5) << one_way;
    ports.run(3000);
    const double rests = ports.told_there.position.x();
    EXPECT_LT(std::abs(rests), 3e-3 + kFriction / 200) << one_way << ": in the dead zone";
    const Vec3 before = ports.follower.x();
    ports.run(1000);
    EXPECT_LT((ports.follower.x() - before).norm(), 1e-4) << one_way;
    EXPECT_LT(ports.follower.outside().x(), -0.5) << one_way << ": it goes on pressing";
    expect_passive(ports, one_way);
  }
}

TEST(CouplingRate, TheReferenceRunsNoFartherAheadThanTheForceReaches) {
  PlayedRate follower;
  auto config = coupling_of(PortRole::kFollower);
  couple_by(CouplingMethod::kRate, config);
  config.spring.max_force = 2;
  follower.played.port = Coupling(config);
  follower.played.now = 0;
  for (int i = 0; i < 5; ++i) follower.period(PortPhase::kCoupled, 0);
  double force = 0;
  for (int i = 0; i < 3000; ++i) force = follower.period(PortPhase::kEngaged, 0.02);
  EXPECT_NEAR(force, 2, 1e-9);
  for (int i = 0; i < 10; ++i) force = follower.period(PortPhase::kEngaged, -0.02);
  EXPECT_NEAR(force, 2 - 10 * 400 * 0.05e-3, 1e-9) << "it turns back at once";
}

TEST(CouplingRate, SaysWhatIsWrongWithItsConfiguration) {
  auto good = coupling_of(PortRole::kLeader);
  couple_by(CouplingMethod::kRate, good);
  expect_refusals(good, Makes<Coupling>(),
                  {
                      {"dead_zone = -1", [](auto& c) { c.rate->dead_zone = -1; }},
                      {"gain = 0", [](auto& c) { c.rate->gain = 0; }},
                      {"max_speed = 0", [](auto& c) { c.rate->max_speed = 0; }},
                      {"centring = -1", [](auto& c) { c.centring = -1; }},
                      {"drift_rate = -1", [](auto& c) { c.drift_rate = -1; }},
                      {"max_delay = 0", [](auto& c) { c.max_delay = Duration::zero(); }},
                  });
  auto follower = coupling_of(PortRole::kFollower);
  couple_by(CouplingMethod::kRate, follower);
  expect_refusals(follower, Makes<Coupling>(), {{"centring", [](auto& c) { c.centring = 1; }}});
}

TEST(CouplingMaxDelay, AWayThatIsLongerIsALostLinkAndNobodyEngages) {
  PortSetup leader = port_of(PortRole::kLeader);
  PortSetup follower = port_of(PortRole::kFollower);
  leader.coupling.max_delay = follower.coupling.max_delay = std::chrono::milliseconds(50);
  Network there{.delay = 20, .seed = 1};
  there.longer_from = 2000;
  there.longer_by = 80;
  Ports ports(leader, follower, there, {.delay = 20, .seed = 2});
  ASSERT_TRUE(ports.engage());
  ports.run(2000 - ports.now);
  EXPECT_TRUE(ports.leader.coupling->live()) << "20 ms are not above 50 ms";
  bool lost[2] = {};
  ports.run(1000, [&](int) {
    lost[0] = lost[0] || phase(ports.leader) == PortPhase::kLost;
    lost[1] = lost[1] || phase(ports.follower) == PortPhase::kLost;
  });
  EXPECT_TRUE(lost[0] && lost[1]);
  EXPECT_FALSE(ports.leader.coupling->engage());
  ports.run(1000);
  EXPECT_FALSE(ports.leader.coupling->live() || ports.follower.coupling->live());
  EXPECT_TRUE(ports.leader.applied.isZero() && ports.follower.applied.isZero());
}

TEST(CouplingMaxDelay, AWayThatHasBecomeShortAgainCouplesAndWaitsForAnAct) {
  PortSetup leader = port_of(PortRole::kLeader);
  PortSetup follower = port_of(PortRole::kFollower);
  leader.coupling.max_delay = follower.coupling.max_delay = std::chrono::milliseconds(50);
  // The delay grows for a second, and later messages take the longer delay.
  Network there{.delay = 100, .seed = 1};
  there.longer_from = 1000;
  there.longer_by = -80;
  Ports ports(leader, follower, there, {.delay = 20, .seed = 2});
  ports.run(900);
  EXPECT_FALSE(ports.leader.coupling->engage());
  // The round-trip estimate falls after one or two windows of 5 s.
  ports.run(11'500);
  EXPECT_EQ(phase(ports.leader), PortPhase::kCoupled);
  EXPECT_TRUE(ports.engage());
}

}  // namespace
}  // namespace tendon::coupling_more_methods_test
