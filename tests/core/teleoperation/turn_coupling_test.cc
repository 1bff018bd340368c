// SPDX-License-Identifier: Apache-2.0
// No energy on closed paths in SO(3), equal torques without steps at both ends, and a passive pair with one account for
// force and torque.
#include "core/teleoperation/handle/turn_coupling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <numbers>
#include <string>

#include "tests/core/control/adversary.h"
#include "tests/core/teleoperation/expect_ports.h"
#include "tests/core/teleoperation/whole_ports.h"
#include "tests/support/dice.h"
#include "tests/support/refusal.h"

namespace tendon::turn_coupling_test {
namespace {

using std::chrono::milliseconds;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kNanojoule = 1e-9;

Quat minus(const Quat& q) { return {-q.w, -q.x, -q.y, -q.z}; }

class Spring {
 public:
  explicit Spring(double stiffness, const Quat& there = {})
      : law_({.stiffness = stiffness}, {.role = PortRole::kFollower, .adapts = false, .period = milliseconds(1)},
             PoseMap({})) {
    law_.receive(PortTurn{.turn = there});
    law_.follow({});
  }
  Vec3 torque(const Quat& q) {
    law_.move(q);
    return law_.command({.orientation = q}, {.live = true, .driven = true, .gain = 1});
  }

 private:
  TurnCoupling law_;
};

TEST(TurnCoupling, IsASpringWhoseTorqueRisesUpToHalfATurn) {
  Spring spring(0.5);
  const Vec3 axis = Vec3(1, -2, 0.5).normalized();
  for (const double degrees : {0.001, 1.0, 30.0, 90.0, 149.0}) {
    const double angle = degrees * kDegree;
    const Vec3 torque = spring.torque(rotation_by(angle * axis));
    EXPECT_LT((torque + 2 * 0.5 * std::sin(angle / 2) * axis).norm(), 1e-12) << degrees << "°";
  }
  EXPECT_LT((spring.torque(rotation_by(1e-4 * axis)) + 0.5e-4 * axis).norm(), 1e-12) << "K θ";
}

TEST(TurnCoupling, DoesNotJumpWhereTheQuaternionChangesItsSign) {
  const Quat there = rotation_by(Vec3(0.3, -0.2, 1));
  Spring spring(0.5, there);
  Spring other(0.5, minus(there));
  Dice dice(1);
  for (int n = 0; n < 1000; ++n) {
    const Quat q = product(rotation_by(dice.direction() * dice.within(0, 149 * kDegree)), there);
    const Vec3 torque = spring.torque(q);
    EXPECT_LT((spring.torque(minus(q)) - torque).norm(), 1e-12);
    EXPECT_LT((other.torque(q) - torque).norm(), 1e-12);
  }
}

/// J, on the single-axis rotation from `from` to `to`: Simpson's rule in steps of 1 mrad.
double given_out(Spring& spring, const Quat& from, const Quat& to) {
  const Vec3 turn = turn_between(from, to);
  const int steps = 1 + static_cast<int>(turn.norm() / 1e-3);
  const auto torque = [&](double share) { return spring.torque(product(rotation_by(share * turn), from)).dot(turn); };
  double work = 0;
  for (int i = 0; i < steps; ++i) {
    const double a = static_cast<double>(i) / steps;
    const double b = static_cast<double>(i + 1) / steps;
    work += (torque(a) + 4 * torque((a + b) / 2) + torque(b)) * (b - a) / 6;
  }
  return work;
}

TEST(TurnCoupling, GivesOutNothingOnClosedWaysOfTurns) {
  Dice dice(2);
  double most = 0;
  for (int loop = 0; loop < 200; ++loop) {
    const Quat there = rotation_by(dice.direction() * dice.within(0, std::numbers::pi));
    Spring spring(0.5, there);
    const auto drawn = [&] { return product(rotation_by(dice.direction() * dice.within(0, 100 * kDegree)), there); };
    const Quat start = drawn();
    Quat at = start;
    double work = 0;
    const auto go = [&](const Quat& to) {
      work += given_out(spring, at, to);
      at = to;
    };
    for (int corner = 0; corner < 3; ++corner) {
      // Draws a path inside the valid range of the spring.
      for (Quat to = drawn();; to = drawn()) {
        const Quat half = product(rotation_by(Vec3(turn_between(at, to) / 2)), at);
        if (!is_within_reach(there, half)) continue;
        go(to);
        break;
      }
    }
    go(there);
    go(start);
    most = std::max(most, std::abs(work));
  }
  std::cout << "200 closed ways: at most " << most << " J\n";
  EXPECT_LT(most, kNanojoule);
}

TEST(TurnCoupling, TurnsAreTheSameAtBothEndsAndTorquesInTheRatioOfTheJoules) {
  for (const int one_way : {0, 25}) {
    WholeSetup leader = whole_of(PortRole::kLeader);
    WholeSetup follower = whole_of(PortRole::kFollower);
    const Vec3 wanted(0.4, 0.3, -0.5);
    leader.turn_hand = [wanted](double t) { return Vec3(wanted * std::clamp(t - 1, 0.0, 1.0)); };
    follower.turned = [](double) { return rotation_by(Vec3(0, 1, 0)); };  // a vice
    for (WholeSetup* const end : {&leader, &follower}) {
      end->coupling.map = {.position_scale = 0.5, .force_scale = 2, .rotation = rotation_by(Vec3(0, 0, 90 * kDegree))};
    }
    WholePorts ports(leader, follower, one_way);
    ASSERT_TRUE(ports.engage());
    ports.run(4000);
    const PoseMap map(leader.coupling.map);
    const Vec3 felt = ports.leader.torque;
    const Vec3 there = map.leader_joule() * map.spin_to_leader(ports.follower.torque);
    EXPECT_GT(felt.norm(), 0.05);
    EXPECT_LT((felt + there).norm(), 0.01 * felt.norm() + 2e-3) << one_way << " ms";
    EXPECT_LT(felt.normalized().dot(wanted.normalized()), -0.99) << "against the hand, about its axis";
    EXPECT_GE(ports.least_sum, -kNanojoule);
  }
}

TEST(TurnCoupling, AFreeFollowerTurnsAsTheLeaderDoesAboutTheMappedAxis) {
  WholeSetup leader = whole_of(PortRole::kLeader);
  WholeSetup follower = whole_of(PortRole::kFollower);
  leader.turn_hand_stiffness = 2;
  leader.turn_hand = [](double t) { return Vec3(0.6 * std::clamp(t - 1, 0.0, 1.0), 0, 0); };
  for (WholeSetup* const end : {&leader, &follower}) {
    end->coupling.map.rotation = rotation_by(Vec3(0, 0, 90 * kDegree));
    end->flips = true;
  }
  WholePorts ports(leader, follower, 5);
  ASSERT_TRUE(ports.engage());
  const Quat from = ports.follower.turner.q;
  ports.run(3000);
  const Vec3 turned = turn_between(from, ports.follower.turner.q);
  EXPECT_NEAR(turned.y(), 0.6, 0.02);
  EXPECT_LT(std::hypot(turned.x(), turned.z()), 0.01);
}

TEST(TurnCoupling, NoActAndNoClutchMakesAStepOrTurnsTheOtherEnd) {
  WholeSetup leader = whole_of(PortRole::kLeader);
  leader.turn_hand = [](double t) { return Vec3(0, 0.3 * std::sin(3 * t), 0.2 * std::sin(2 * t)); };
  leader.coupling.clutch = Coupling::Button{.bit = 0};
  WholePorts ports(leader, whole_of(PortRole::kFollower), {.delay = 7, .jitter = 4, .loss = 0.1, .seed = 1},
                   {.delay = 7, .jitter = 4, .loss = 0.1, .seed = 2});
  double step = 0;
  double torque = 0;
  double turned = 0;
  Vec3 last_leader = Vec3::Zero();
  Vec3 last_follower = Vec3::Zero();
  Quat last = ports.follower.turner.q;
  const auto look = [&] {
    const Vec3 at_leader = ports.leader.last.turn()->wanted;
    const Vec3 at_follower = ports.follower.last.turn()->wanted;
    step = std::max({step, (at_leader - last_leader).norm(), (at_follower - last_follower).norm()});
    torque = std::max(torque, at_leader.norm());
    turned = std::max(turned, turn_between(last, ports.follower.turner.q).norm());
    last_leader = at_leader;
    last_follower = at_follower;
    last = ports.follower.turner.q;
  };
  for (int act = 0; act < 5; ++act) {
    ASSERT_TRUE(ports.engage());
    ports.run(500, look);
    for (int press = 0; press < 4; ++press) {
      ports.leader.buttons = 1;
      ports.run(150, look);
      ports.leader.buttons = 0;
      ports.run(230, look);
    }
    (act % 2 == 0 ? ports.leader : ports.follower).coupling().disengage();
    ports.run(100, look);
  }
  std::cout << "largest step " << step << " of " << torque << " N·m, the follower turned by at most " << turned
            << " rad in a period\n";
  EXPECT_GT(torque, 0.01);
  EXPECT_LT(step, 2e-3);
  EXPECT_LT(turned, 5e-3);
  EXPECT_GE(ports.least_sum, -kNanojoule);
}

TEST(TurnCoupling, ALeaderThatIsTurnedWhileItIsClutchedTurnsNobody) {
  WholeSetup leader = whole_of(PortRole::kLeader);
  leader.turned = [](double t) { return rotation_by(Vec3(0, 0, t < 2 ? 0 : std::min(t - 2, 1.0))); };
  leader.coupling.clutch = Coupling::Button{.bit = 0};
  WholePorts ports(leader, whole_of(PortRole::kFollower), 5);
  ASSERT_TRUE(ports.engage());
  ports.run(1900 - ports.now);
  ports.leader.buttons = 1;
  ports.run(1500);
  ports.leader.buttons = 0;
  ports.run(1000);
  EXPECT_LT(turn_between(Quat{}, ports.follower.turner.q).norm(), 1e-3);
}

TEST(TurnCoupling, EndsThatAre150DegreesApartDisengage) {
  WholeSetup leader = whole_of(PortRole::kLeader);
  WholeSetup follower = whole_of(PortRole::kFollower);
  leader.turned = [](double t) { return rotation_by(Vec3(0, std::max(t - 1, 0.0), 0)); };
  follower.turned = [](double) { return Quat{}; };
  WholePorts ports(leader, follower, 5);
  ASSERT_TRUE(ports.engage());
  ports.run(1000 + static_cast<int>(148 * kDegree * 1000) - ports.now);
  EXPECT_EQ(ports.leader.coupling().phase(), PortPhase::kEngaged);
  ports.run(100);
  EXPECT_EQ(ports.leader.coupling().phase(), PortPhase::kCoupled);
  EXPECT_EQ(ports.follower.coupling().phase(), PortPhase::kCoupled);
  ports.run(60);
  EXPECT_EQ(ports.leader.last.turn()->wanted, Vec3(Vec3::Zero()));
  EXPECT_EQ(ports.follower.last.turn()->wanted, Vec3(Vec3::Zero()));
  EXPECT_TRUE(ports.engage()) << "by another act, from where they are now";
}

TEST(TurnCoupling, ARobotHoldsItsOrientationWhenItsLeaderFallsSilent) {
  WholeSetup leader = whole_of(PortRole::kLeader);
  leader.turn_hand = [](double t) { return Vec3(0, 0, 0.5 * std::clamp(t - 1, 0.0, 1.0)); };
  WholeSetup follower = whole_of(PortRole::kFollower);
  follower.coupling.holds_place = true;
  WholePorts ports(leader, follower, 10);
  ASSERT_TRUE(ports.engage());
  ports.run(3000);
  const Quat held = ports.follower.turner.q;
  EXPECT_GT(turn_between(Quat{}, held).norm(), 0.3);
  ports.cut = true;
  double moved = 0;
  ports.run(2000, [&] { moved = std::max(moved, turn_between(held, ports.follower.turner.q).norm()); });
  EXPECT_EQ(ports.follower.coupling().phase(), PortPhase::kLost);
  EXPECT_LT(moved, 0.02);
}

TEST(TurnCoupling, WithoutASpringAtTheLeaderItFeelsItsDampingOnly) {
  for (const auto method : {CouplingMethod::kPositionForce, CouplingMethod::kSurface}) {
    WholeSetup leader = whole_of(PortRole::kLeader);
    WholeSetup follower = whole_of(PortRole::kFollower);
    leader.coupling.method = follower.coupling.method = method;
    leader.turned = [](double t) { return rotation_by(Vec3(std::clamp(t - 1, 0.0, 0.5), 0, 0)); };
    WholePorts ports(leader, follower, 20);
    ASSERT_TRUE(ports.engage());
    ports.run(1300 - ports.now);
    EXPECT_LT((ports.leader.last.turn()->wanted - Vec3(-5e-3, 0, 0)).norm(), 1e-6) << to_string(method);
    ports.run(2000);
    EXPECT_LT(ports.leader.last.turn()->wanted.norm(), 1e-9);
    EXPECT_NEAR(ports.follower.coupling().turn()->stiffness(), 0.5, 1e-9) << "it adapts to no delay";
  }
}

TEST(WholeHandles, NoPairAndNoAccountGivesOutEnergy) {
  double least_pair = 0;
  double least_account = 0;
  int turned = 0;
  constexpr CouplingMethod kMethods[] = {CouplingMethod::kPositionPosition, CouplingMethod::kPositionPosition,
                                         CouplingMethod::kWaves, CouplingMethod::kPositionForce};
  constexpr int kWorlds = 24;
  for (int seed = 1; seed <= kWorlds; ++seed) {
    Dice dice(static_cast<std::uint64_t>(seed));
    WholeSetup leader = whole_of(PortRole::kLeader);
    WholeSetup follower = whole_of(PortRole::kFollower);
    const PoseMap::Config map{.position_scale = dice.decades(-0.5, 0.5),
                              .force_scale = dice.decades(-0.5, 0.5),
                              .rotation = rotation_by(dice.direction() * dice.within(0, 3))};
    const double turn = dice.decades(-1, 0.7);
    const double grip = dice.decades(1.5, 3.3);
    for (WholeSetup* const end : {&leader, &follower}) {
      end->coupling.map = map;
      end->coupling.method = kMethods[seed % 4];
      end->coupling.turn->stiffness = turn;
      end->coupling.grip->stiffness = grip;
      end->coupling.spring.adapt_to_delay = seed % 3 != 0;
      end->limiter.law = seed % 5 == 0 ? Law::kAol : Law::kAolPlus;
      end->flips = seed % 2 == 0;
    }
    follower.coupling.holds_place = dice.chance(0.3);
    const double hertz = dice.within(0.3, 3);
    const Vec3 axis = dice.direction();
    leader.along_x = {.stiffness = dice.within(150, 600), .damping = 3, .reference = [hertz](double t) {
                        return 0.02 * std::sin(6 * hertz * t);
                      }};
    leader.turn_hand = [hertz, axis](double t) {
      return Vec3(0.5 * std::sin(6 * hertz * t) * axis + Vec3(0.2 * std::sin(5 * t), 0, 0.3 * std::cos(4 * t)));
    };
    leader.closing = {.stiffness = 300, .damping = 3, .reference = [hertz](double t) {
                        return -0.015 + 0.01 * std::sin(6 * hertz * t);
                      }};
    follower.along_x = {.stiffness = 2000, .damping = 1, .reference = [](double) { return 0.005; }, .wall = true};
    if (dice.chance(0.5)) follower.turn_hand = [axis](double t) { return Vec3(-0.3 * std::sin(7 * t) * axis); };
    follower.closing = {.stiffness = 2000, .damping = 1, .reference = [](double) { return -0.012; }, .wall = true};
    const int one_way = seed % 6 == 0 ? 0 : static_cast<int>(dice.decades(0, 2.48));
    const Network there{
        .delay = one_way, .jitter = std::max(5, one_way / 5), .loss = 0.1, .seed = dice.bits(), .repeated = 0.1};
    Network back = there;
    back.seed = dice.bits();
    WholePorts ports(leader, follower, there, back);
    ASSERT_TRUE(ports.engage()) << "seed " << seed;
    for (int part = 0; part < 3; ++part) {
      ports.run(900);
      ports.cut = dice.chance(0.3);
      ports.run(static_cast<int>(dice.within(10, 400)));
      ports.cut = false;
      if (part == 1 && dice.chance(0.5)) ports.follower.begin(2);
      ports.run(one_way * 3 + 100);
      ports.leader.coupling().engage();
    }
    expect_passive(ports, seed);
    least_pair = std::min(least_pair, ports.least_sum);
    least_account = std::min(least_account, ports.least_account());
    turned += turn_between(Quat{}, ports.follower.turner.q).norm() > 0.02 ? 1 : 0;
  }
  std::cout << kWorlds << " worlds: least pair " << least_pair << " J, least account " << least_account << " J, "
            << turned << " turned\n";
  EXPECT_GT(turned, kWorlds / 2);
}

TEST(WholeHandles, WithoutLimitersTheSamePairGivesOutEnergy) {
  WholeSetup leader = whole_of(PortRole::kLeader);
  WholeSetup follower = whole_of(PortRole::kFollower);
  leader.turn_hand = [](double t) { return Vec3(0.5 * std::sin(6 * t), 0, 0); };
  for (WholeSetup* const end : {&leader, &follower}) {
    end->coupling.tank.reset();
    end->coupling.spring.adapt_to_delay = false;
    end->coupling.turn->stiffness = 3;
    end->coupling.turn->damping = 0;
    end->limiter.law = Law::kNone;
  }
  WholePorts ports(leader, follower, 50);
  ASSERT_TRUE(ports.engage());
  ports.run(3000);
  EXPECT_LT(ports.least_sum, -0.1);
}

TEST(WholeHandles, APositionAloneIsCoupledOnADeviceWithMoreMotors) {
  WholeSetup leader = whole_of(PortRole::kLeader);
  WholeSetup follower = whole_of(PortRole::kFollower);
  for (WholeSetup* const end : {&leader, &follower}) {
    end->coupling.turn.reset();
    end->coupling.grip.reset();
  }
  leader.along_x = {.stiffness = 400, .damping = 3, .reference = [](double t) { return t < 1 ? 0.0 : 0.02; }};
  WholePorts ports(leader, follower, 5);
  ASSERT_TRUE(ports.engage());
  ports.run(3000);
  EXPECT_NEAR(ports.follower.x(), ports.leader.x(), 1e-3);
  EXPECT_GT(ports.follower.x(), 0.015);
  EXPECT_EQ(ports.follower.torque, Vec3(Vec3::Zero()));
  EXPECT_GE(ports.least_sum, -kNanojoule);
}

/// Recomputes the step without the coupling, from its recorded demand and settlement of two tanks.
TEST(WholeHandles, ARecordedStepIsTakenAgainToTheLastBit) {
  WholeSetup leader = whole_of(PortRole::kLeader);
  leader.along_x = {.stiffness = 400, .damping = 3, .reference = [](double t) { return 0.02 * std::sin(4 * t); }};
  leader.turn_hand = [](double t) { return Vec3(0, 0.4 * std::sin(5 * t), 0); };
  leader.closing = {.stiffness = 300, .damping = 3, .reference = [](double t) { return -0.015 + 0.01 * std::sin(t); }};
  WholePorts ports(leader, whole_of(PortRole::kFollower), 10);
  HapticController::Config config = ports.follower.control(1);
  config.coupling.reset();
  HapticController again(config);
  int same = 0;
  double given = 0;
  bool acted = false;
  ports.run(3000, [&] {
    if (!acted) acted = ports.leader.coupling().engage();
    WholePort& port = ports.follower;
    const Step& last = port.last;
    ForceChannels::Wanted wanted;
    wanted.force = last.wanted;
    wanted.stiffness = last.stiffness;
    wanted.mode = last.mode;
    wanted.handle = HandleWanted{.torque = last.turn()->wanted, .grip = last.grip()->wanted};
    const Step step = again.step(last.hand, last.was_applied, {}, wanted, &port.seen,
                                 port.controller->couplings()->settled(0), port.controller->grip_settled());
    given += port.controller->grip_settled().credit;
    same += step.force == last.force && step.turn()->torque == last.turn()->torque &&
                    step.grip()->force == last.grip()->force && step.energy == last.energy &&
                    step.grip()->energy == last.grip()->energy
                ? 1
                : 0;
  });
  EXPECT_EQ(same, 3000);
  EXPECT_GT(given, 1e-3) << "J: otherwise nothing was tested";
}

TEST(WholeHandles, RefuseImpossibleSprings) {
  expect_refusals(whole_of(PortRole::kLeader).coupling, Makes<Coupling>(),
                  {
                      {"turn.stiffness", [](auto& c) { c.turn->stiffness = 0; }},
                      {"turn.damping", [](auto& c) { c.turn->damping = 0; }},
                      {"turn.max_torque", [](auto& c) { c.turn->max_torque = 0; }},
                      {"grip.stiffness", [](auto& c) { c.grip->stiffness = -1; }},
                      {"grip.damping", [](auto& c) { c.grip->damping = 0; }},
                      {"grip.speed", [](auto& c) { c.grip->speed = 0; }},
                      {"grip.arm", [](auto& c) { c.grip->arm = 0; }},
                      {"grip.max_force", [](auto& c) { c.grip->max_force = 0; }},
                  });
}

TEST(WholeHandles, APeriodThatLacksWhatIsCoupledGivesNothing) {
  Coupling coupling(whole_of(PortRole::kLeader).coupling);
  const auto demands = [&](const HandleSample* handle) {
    return coupling.command({WholePort::at(1), Vec3::Zero(), Vec3::Zero()}, 0, true, handle).force.allFinite();
  };
  const HandleSample whole{.turning = Turning{}, .grip = Grip{}};
  HandleSample without_turn = whole;
  without_turn.turning.reset();
  HandleSample without_grip = whole;
  without_grip.grip.reset();
  HandleSample wild = whole;
  wild.turning->orientation = {.w = 2, .x = 0, .y = 0, .z = 0};
  EXPECT_TRUE(demands(&whole));
  EXPECT_FALSE(demands(nullptr));
  EXPECT_FALSE(demands(&without_turn));
  EXPECT_FALSE(demands(&without_grip));
  EXPECT_FALSE(demands(&wild));
}

}  // namespace
}  // namespace tendon::turn_coupling_test
