// SPDX-License-Identifier: Apache-2.0
// The follower's fingers move without a jump, grip forces are reflected, and a dead link neither drops nor crushes an
// object.
#include "core/teleoperation/handle/grip_coupling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "tests/core/teleoperation/expect_ports.h"
#include "tests/core/teleoperation/whole_ports.h"

namespace tendon::grip_coupling_test {
namespace {

constexpr double kNanojoule = 1e-9;
constexpr double kGripCoulomb = 0.05;  // N

/// An egg that touches the fingers at an opening of 12 mm.
Surroundings egg() {
  return {.stiffness = 2000, .damping = 1, .reference = [](double) { return -0.012; }, .wall = true};
}

/// m, down to 6 mm within a second, which stores the energy of the follower's grip.
double closing(double t) { return t < 1 ? 0.02 : std::max(0.02 - 0.014 * (t - 1), 0.006); }

/// A hand of 300 N/m with a target of `opening` m.
Surroundings squeezing(std::function<double(double)> opening) {
  return {.stiffness = 300, .damping = 3, .reference = [opening](double t) { return -opening(t); }};
}

TEST(GripCoupling, TheFollowersFingersGoToTheLeadersAtTheirSpeedAtMost) {
  WholeSetup leader = whole_of(PortRole::kLeader);
  WholeSetup follower = whole_of(PortRole::kFollower);
  leader.opened = [](double t) { return 0.005 + 1e-4 * std::sin(40 * t); };
  follower.opening = 0.025;
  WholePorts ports(leader, follower, 5);
  ASSERT_TRUE(ports.engage());
  const int began = ports.now;
  double fastest = 0;
  double strongest = 0;
  double before = ports.follower.opening();
  ports.run(2000, [&] {
    fastest = std::max(fastest, before - ports.follower.opening());
    strongest = std::max(strongest, std::abs(ports.leader.last.grip()->wanted));
    before = ports.follower.opening();
  });
  EXPECT_NEAR(ports.follower.opening(), 0.005, 4e-4);
  EXPECT_LT(fastest, 0.08 * 1e-3) << "asked to go with 50 mm/s; a ramp lets it fall behind at first";
  EXPECT_LT(strongest, 3.0) << "at once it would be 400 N/m over 20 mm: 8 N";
  EXPECT_GT(ports.now - began, 0);
  EXPECT_GE(ports.least_sum, -kNanojoule);
}

TEST(GripCoupling, BothEndsFeelWhatIsSqueezed) {
  for (const double force_scale : {1.0, 2.0}) {
    for (const int one_way : {0, 20}) {
      WholeSetup leader = whole_of(PortRole::kLeader);
      WholeSetup follower = whole_of(PortRole::kFollower);
      leader.closing = squeezing([](double t) { return t < 2 ? 0.02 : 0.005; });
      follower.closing = egg();
      leader.coupling.map.force_scale = follower.coupling.map.force_scale = force_scale;
      WholePorts ports(leader, follower, one_way);
      ASSERT_TRUE(ports.engage());
      ports.run(5000);
      const double felt = ports.leader.grip_force;
      EXPECT_GT(felt, 0.2) << "it opens the hand";
      EXPECT_NEAR(felt, -force_scale * ports.follower.grip_force, 0.01 * felt + 2 * kGripCoulomb);
      EXPECT_LT(ports.follower.opening(), 0.012);
      expect_passive(ports);
    }
  }
}

TEST(GripCoupling, ItHoldsWhileTheLeaderIsClutchedAndComesBackSlowly) {
  WholeSetup leader = whole_of(PortRole::kLeader);
  leader.opened = [](double t) { return t < 2.5 ? closing(t) : 0.025; };
  leader.coupling.clutch = Coupling::Button{.bit = 0};
  WholeSetup follower = whole_of(PortRole::kFollower);
  follower.closing = egg();
  WholePorts ports(leader, follower, 5);
  ASSERT_TRUE(ports.engage());
  ports.run(2400 - ports.now);
  const double held = ports.follower.grip_force;
  EXPECT_LT(held, -0.3);
  ports.leader.buttons = 1;
  ports.run(1000);  // the leader's fingers open meanwhile
  EXPECT_NEAR(ports.follower.grip_force, held, 0.02 * std::abs(held));
  ports.leader.buttons = 0;
  double fastest = 0;
  double before = ports.follower.opening();
  ports.run(1500, [&] {
    fastest = std::max(fastest, ports.follower.opening() - before);
    before = ports.follower.opening();
  });
  EXPECT_NEAR(ports.follower.opening(), 0.025, 4e-4);
  EXPECT_LT(fastest, 0.1 * 1e-3) << "with 50 mm/s, and what the egg gives back";
}

/// N. The link fails for three seconds and the leader engages again.
struct EggForce {
  double before = 0;
  double least_dead = 1e9;
  double most_dead = 0;
  double most_again = 0;  ///< after the second engagement
  double in_the_end = 0;
  double closed_further = 0;
  double least_sum = 0;
};

EggForce hold_an_egg(bool holds_place, int one_way) {
  WholeSetup leader = whole_of(PortRole::kLeader);
  WholeSetup follower = whole_of(PortRole::kFollower);
  // The fingers follow a path. A hand would close them further if there were no reflected force.
  leader.opened = [](double t) { return t < 12 ? closing(t) : 0.004; };
  follower.closing = egg();
  follower.coupling.holds_place = holds_place;
  WholePorts ports(leader, follower, one_way);
  EggForce force;
  const auto on_egg = [&] { return -ports.follower.grip_force; };
  EXPECT_TRUE(ports.engage());
  ports.run(4000);
  force.before = on_egg();
  ports.cut = true;
  ports.run(3000, [&] {
    force.least_dead = std::min(force.least_dead, on_egg());
    force.most_dead = std::max(force.most_dead, on_egg());
  });
  EXPECT_EQ(ports.follower.coupling().phase(), PortPhase::kLost);
  ports.cut = false;
  ports.run(1000, [&] { force.most_again = std::max(force.most_again, on_egg()); });
  EXPECT_EQ(ports.follower.coupling().phase(), PortPhase::kCoupled) << "nobody has acted";
  EXPECT_TRUE(ports.engage());
  ports.run(2500, [&] { force.most_again = std::max(force.most_again, on_egg()); });
  force.in_the_end = on_egg();
  EXPECT_LT(ports.now, 12000);
  ports.run(14000 - ports.now);
  force.closed_further = on_egg();
  force.least_sum = ports.least_sum;
  return force;
}

TEST(GripCoupling, AnEggIsNeitherDroppedNorCrushedWhileTheLinkDies) {
  for (const int one_way : {0, 10, 50}) {
    const EggForce force = hold_an_egg(true, one_way);
    std::cout << 2 * one_way << " ms: " << force.before << " N, dead " << force.least_dead << " … " << force.most_dead
              << " N, acted again at most " << force.most_again << " N and in the end " << force.in_the_end
              << " N, closed further " << force.closed_further << " N\n";
    EXPECT_GT(force.before, 0.1);
    EXPECT_GT(force.least_dead, 0.9 * force.before);
    EXPECT_LT(force.most_dead, 1.1 * force.before);
    EXPECT_LT(force.most_again, 1.1 * force.before);
    EXPECT_GT(force.in_the_end, 0.9 * force.before) << "the silence is not taken for a longer way";
    EXPECT_GT(force.closed_further, 1.1 * force.before) << "the operator has closed further";
    EXPECT_GE(force.least_sum, -kNanojoule);
  }
}

TEST(GripCoupling, AHandsGripFadesInstead) {
  const EggForce force = hold_an_egg(false, 10);
  EXPECT_GT(force.before, 0.3);
  EXPECT_LT(force.least_dead, 0.05 * force.before) << "without on_loss = hold the egg is dropped";
}

TEST(GripCoupling, AFaultEndsTheGripAtOnce) {
  WholeSetup leader = whole_of(PortRole::kLeader);
  WholeSetup follower = whole_of(PortRole::kFollower);
  leader.opened = closing;
  follower.closing = egg();
  follower.coupling.holds_place = true;
  WholePorts ports(leader, follower, 5);
  ASSERT_TRUE(ports.engage());
  ports.run(3000);
  ASSERT_LT(ports.follower.grip_force, -0.3);
  ports.follower.ready = false;
  ports.run(1);
  EXPECT_EQ(ports.follower.last.grip()->wanted, 0);
}

TEST(GripCoupling, NoActMakesAStep) {
  WholeSetup leader = whole_of(PortRole::kLeader);
  leader.closing = squeezing([](double t) { return 0.012 + 0.006 * std::sin(4 * t); });
  leader.coupling.clutch = Coupling::Button{.bit = 0};
  WholeSetup follower = whole_of(PortRole::kFollower);
  follower.closing = {.stiffness = 100, .damping = 3, .reference = [](double) { return -0.02; }};
  WholePorts ports(leader, follower, 8);
  double step = 0;
  double last_leader = 0;
  double last_follower = 0;
  const auto look = [&] {
    const double at_leader = ports.leader.last.grip()->wanted;
    const double at_follower = ports.follower.last.grip()->wanted;
    step = std::max({step, std::abs(at_leader - last_leader), std::abs(at_follower - last_follower)});
    last_leader = at_leader;
    last_follower = at_follower;
  };
  double strongest = 0;
  for (int act = 0; act < 4; ++act) {
    ASSERT_TRUE(ports.engage());
    ports.run(700, look);
    strongest = std::max(strongest, std::abs(last_follower));
    ports.leader.buttons = 1;
    ports.run(200, look);
    ports.leader.buttons = 0;
    ports.run(400, look);
    ports.leader.coupling().disengage();
    ports.run(150, look);
  }
  std::cout << "largest step " << step << " N, of " << strongest << " N\n";
  EXPECT_GT(strongest, 0.2);
  EXPECT_LT(step, 0.08);
}

TEST(GripCoupling, AStateThatTheGripsTankRefusesChangesNothing) {
  WholePorts ports(whole_of(PortRole::kLeader), whole_of(PortRole::kFollower), 2);
  ASSERT_TRUE(ports.engage());
  ports.run(100);
  Coupling& leader = ports.leader.coupling();
  const std::uint64_t refused = leader.refused();
  const PortState good = ports.follower.step(ports.now);
  ASSERT_TRUE(good.grip);
  PortState bad = good;
  bad.phase = PortPhase::kFault;
  bad.grip->taken = 1e3;  // this is more than we have given
  leader.receive(bad, WholePort::at(ports.now));
  EXPECT_EQ(leader.refused(), refused + 1);
  ports.leader.step(ports.now);
  EXPECT_TRUE(leader.live()) << "it would not be after a fault";
  leader.receive(good, WholePort::at(ports.now));
  EXPECT_EQ(leader.refused(), refused + 1) << "a good one of that number is heard";
}

}  // namespace
}  // namespace tendon::grip_coupling_test
