// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iostream>
#include <string>
#include <vector>

#include "core/base/rotation.h"
#include "tests/core/teleoperation/ports.h"
#include "tests/support/dice.h"

namespace tendon::coupling_scale_test {
namespace {

constexpr double kTurn = 6.283185307179586;

PortSetup led(std::function<double(double)> along_x) {
  PortSetup leader = port_of(PortRole::kLeader);
  leader.coupling.clutch = Coupling::Button{.bit = 0};
  for (Surroundings& axis : leader.around) axis = {.stiffness = 300, .damping = 3};
  leader.around[0].reference = std::move(along_x);
  return leader;
}

TEST(CouplingScale, IsSetByALeaderThatIsNotEngagedAndByNobodyElse) {
  Ports ports(led([](double) { return 0.0; }), port_of(PortRole::kFollower));
  EXPECT_FALSE(ports.follower.coupling->set_scale(2, 1)) << "the follower takes the leader's";
  EXPECT_TRUE(ports.leader.coupling->set_scale(2, 1)) << "alone";
  EXPECT_FALSE(ports.leader.coupling->set_scale(0.0099, 1));
  EXPECT_FALSE(ports.leader.coupling->set_scale(1, 100.1));
  EXPECT_FALSE(ports.leader.coupling->set_scale(1, std::nan("")));
  ASSERT_TRUE(ports.engage());
  EXPECT_EQ(ports.follower.coupling->position_scale(), 2);
  EXPECT_FALSE(ports.leader.coupling->set_scale(1, 1)) << "engaged";
  ports.leader.buttons = 1;
  ports.run(1);
  EXPECT_TRUE(ports.leader.coupling->set_scale(0.5, 4)) << "clutched";
  ports.run(2);
  EXPECT_EQ(ports.follower.coupling->position_scale(), 0.5);
  EXPECT_EQ(ports.follower.coupling->force_scale(), 4);

  PortSetup waves = led([](double) { return 0.0; });
  waves.coupling.method = CouplingMethod::kWaves;
  EXPECT_FALSE(Coupling(waves.coupling).set_scale(2, 1)) << "sums of waves have one scale";
}

/// Runs the pair through a clutch, a disengagement, a fault, a loss, and a new peer. `look` is called in each period of
/// the last engagement.
template <class Look>
void go_through_phases(Ports& ports, const Look& look) {
  ASSERT_TRUE(ports.engage());
  ports.run(500);
  ports.leader.buttons = 1;
  ports.run(100);
  ports.leader.buttons = 0;
  ports.run(300);
  ports.follower.coupling->disengage();
  ports.run(100);
  ASSERT_TRUE(ports.engage());
  ports.follower.ready = false;
  ports.run(100);
  ports.follower.ready = true;
  ports.run(100);
  ASSERT_TRUE(ports.engage());
  ports.cut_there = ports.cut_back = true;
  ports.run(500);
  ports.cut_there = ports.cut_back = false;
  ports.run(100);
  ASSERT_TRUE(ports.engage());
  ports.leader.coupling->renew();
  ports.run(100);
  ASSERT_TRUE(ports.engage());
  ports.run(3000, look);
}

// Regression: with set-position, a change of the scales brought back the mutual damping, which this method does not use.
TEST(CouplingScale, ScalesThatWereSetAreThoseOfAScene) {
  for (const CouplingMethod method : kCouplingMethods) {
    if (info(method).keeps_scales) continue;
    const auto forces = [&](bool set) {
      PortSetup leader = led([](double t) { return 0.02 * std::sin(kTurn * t / 2); });
      PortSetup follower = port_of(PortRole::kFollower);
      follower.around[0] = {.stiffness = 300, .reference = [](double) { return 0.01; }, .wall = true};
      follower.measures_contact = true;
      for (PortSetup* const end : {&leader, &follower}) {
        couple_by(method, end->coupling);
        end->coupling.spring.damping = 3;
        end->coupling.map.rotation = rotation_by(Vec3(0, 0, 0.3));
        if (set) continue;
        end->coupling.map.position_scale = 0.7;
        end->coupling.map.force_scale = 1.3;
      }
      Ports ports(leader, follower, {.delay = 20, .seed = 1}, {.delay = 20, .seed = 2});
      ports.run(50);
      if (set) {
        EXPECT_TRUE(ports.leader.coupling->set_scale(0.7, 1.3));
      }
      ports.run(950);
      std::vector<Vec3> all;
      go_through_phases(ports, [&](int) {
        all.push_back(ports.leader.applied);
        all.push_back(ports.follower.applied);
      });
      return all;
    };
    const std::vector<Vec3> of_scene = forces(false);
    const std::vector<Vec3> set = forces(true);
    ASSERT_EQ(set.size(), of_scene.size());
    double most = 0;
    double apart = 0;
    for (std::size_t i = 0; i < set.size(); ++i) {
      most = std::max(most, of_scene[i].norm());
      apart = std::max(apart, (set[i] - of_scene[i]).norm());
    }
    std::cout << to_string(method) << ": " << most << " N, apart by " << apart << " N\n";
    EXPECT_GT(most, 0.1) << to_string(method);
    EXPECT_LT(apart, 1e-5 * most) << to_string(method);
  }
}

/// The clutch is held in free space. After that, the follower moves ten times as far.
TEST(CouplingScale, ATenthBecomesTenBetweenClutchesAndNothingMoves) {
  PortSetup leader = led([](double t) { return t < 2 ? 5e-3 * t : 0.01 + 1e-3 * std::min(t - 2, 2.0); });
  PortSetup follower = port_of(PortRole::kFollower);
  leader.coupling.map.position_scale = follower.coupling.map.position_scale = 0.1;
  Ports ports(leader, follower, {.delay = 10, .seed = 1}, {.delay = 10, .seed = 2});
  ASSERT_TRUE(ports.engage());
  ports.run(2000 - ports.now + 900);
  const double tenth = ports.follower.x().x();
  EXPECT_NEAR(tenth, 1e-3, 2e-4) << "a tenth of what the hand went";
  ports.leader.buttons = 1;
  ports.run(30);
  Vec3 at = ports.follower.x();
  Vec3 force = ports.follower.applied;
  double moved = 0;
  double step = 0;
  ASSERT_TRUE(ports.leader.coupling->set_scale(10, 1));
  const auto look = [&](int) {
    moved = std::max(moved, (ports.follower.x() - at).norm());
    step = std::max(step, (ports.follower.applied - force).norm());
    force = ports.follower.applied;
  };
  ports.run(200, look);
  EXPECT_LT(moved, 40e-6) << "two counts of 20 µm";
  EXPECT_LT(step, 0.02) << "f_c";
  const double hand = ports.leader.x().x();
  const double tool = ports.follower.x().x();
  ports.leader.buttons = 0;
  ports.run(2000);
  const double led_by = ports.leader.x().x() - hand;
  EXPECT_GT(led_by, 3e-4);
  EXPECT_NEAR(ports.follower.x().x() - tool, 10 * led_by, 2e-3 + 0.1 * 10 * led_by);
  EXPECT_GE(ports.least_account(), kRounding);
}

/// A robot that presses while its leader is clutched has a new spring afterwards.
TEST(CouplingScale, UnderForceTheForceFadesToTheNewOne) {
  PortSetup leader = led([](double t) { return t < 0.5 ? 0 : 0.02; });
  PortSetup follower = port_of(PortRole::kFollower);
  follower.around[0] = {.stiffness = 2000, .reference = [](double) { return 0.005; }, .wall = true};
  Ports ports(leader, follower, {.delay = 5, .seed = 1}, {.delay = 5, .seed = 2});
  ASSERT_TRUE(ports.engage());
  ports.run(1500);
  ports.leader.buttons = 1;
  ports.run(200);
  const double pressed = ports.follower.demand.force.norm();
  ASSERT_GT(pressed, 0.5);
  ASSERT_TRUE(ports.leader.coupling->set_scale(1, 4));
  Vec3 force = ports.follower.demand.force;
  double step = 0;
  ports.run(1500, [&](int) {
    step = std::max(step, (ports.follower.demand.force - force).norm());
    force = ports.follower.demand.force;
  });
  EXPECT_LT(step, 0.04 * pressed) << "within 50 ms: at most 2 % of it in each";
  EXPECT_LT(force.norm(), 0.7 * pressed) << "a quarter of the stiffness";
  EXPECT_GE(ports.least_account(), kRounding);
}

TEST(CouplingScale, ARobotThatHoldsItsPlaceIsNotJolted) {
  PortSetup follower = port_of(PortRole::kFollower);
  follower.coupling.holds_place = true;
  Ports ports(led([](double) { return 0.0; }), follower);
  ports.run(100);
  ports.follower.setup.path = [](double) { return Vec3(2e-3, 0, 0); };  // the position is different
  ports.run(200);
  Vec3 force = ports.follower.demand.force;
  const double held = force.norm();
  ASSERT_GT(held, 0.5);
  ASSERT_TRUE(ports.leader.coupling->set_scale(1, 4));
  double step = 0;
  ports.run(200, [&](int) {
    step = std::max(step, (ports.follower.demand.force - force).norm());
    force = ports.follower.demand.force;
  });
  EXPECT_LT(step, 0.04 * held);
  EXPECT_NEAR(force.norm(), held / 4, 0.05 * held);
}

/// Returns the minimum energy of the pair in joules of the leader, each joule of the follower at its current worth.
double least_sum(std::uint64_t seed, double& given) {
  Dice dice(seed);
  PortSetup leader = port_of(PortRole::kLeader);
  PortSetup follower = port_of(PortRole::kFollower);
  leader.coupling.clutch = Coupling::Button{.bit = 0};
  for (PortSetup* const setup : {&leader, &follower}) {
    const double size = dice.decades(-3, -1.5);
    const double often = dice.decades(0.5, 1.5);
    const double late = dice.within(0, 6);
    setup->path = [=](double t) { return Vec3(size * std::sin(often * t + late), 0, 0); };
  }
  const auto network = [&] {
    return Network{.delay = static_cast<int>(dice.decades(0, 1.7)),
                   .jitter = static_cast<int>(dice.decades(0, 1.3)),
                   .loss = dice.within(0, 0.5),
                   .seed = dice.bits()};
  };
  const Network there = network();
  Ports ports(leader, follower, there, network());
  for (int attempt = 0; attempt < 10 && !ports.engage(); ++attempt) continue;
  EXPECT_TRUE(ports.leader.coupling->live()) << "seed " << seed;
  double led = ports.leader.truth.energy();
  double followed = ports.follower.truth.energy();
  double sum = led + followed;
  double least = 0;
  double worth = 1;
  ports.run(4000, [&](int) {
    if (dice.chance(0.01)) ports.leader.buttons ^= 1U;
    if (dice.chance(0.02)) ports.leader.coupling->set_scale(dice.decades(-1, 1), dice.decades(-1, 1));
    sum += ports.leader.truth.energy() - led + worth * (ports.follower.truth.energy() - followed);
    led = ports.leader.truth.energy();
    followed = ports.follower.truth.energy();
    least = std::min(least, sum);
    worth = ports.follower.coupling->force_scale() / ports.follower.coupling->position_scale();
    given += ports.leader.paid + ports.follower.paid;
  });
  EXPECT_GE(ports.least_account(), kRounding) << "seed " << seed;
  return least;
}

TEST(CouplingScale, NoChangeOfScaleMakesEnergyInAHundredDrawnPairs) {
  double least = 0;
  double given = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    const double sum = least_sum(seed, given);
    EXPECT_GE(sum, kRounding) << "seed " << seed;
    least = std::min(least, sum);
  }
  EXPECT_GT(given, 1) << "nothing was paid: nothing was tested";
  std::cout << "least " << least << " J, paid " << given << " J\n";
}

}  // namespace
}  // namespace tendon::coupling_scale_test
