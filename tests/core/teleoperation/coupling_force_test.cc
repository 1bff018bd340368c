// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <string>

#include "core/base/rotation.h"
#include "tests/core/teleoperation/expect_ports.h"
#include "tests/core/teleoperation/ports.h"

namespace tendon::coupling_force_test {
namespace {

using std::chrono::milliseconds;

constexpr double kCoulomb = 0.02;  // N, both devices
constexpr double kTurn = 6.283185307179586;

std::array<Surroundings, 3> hand_of(double stiffness, std::function<double(double)> along_x) {
  std::array<Surroundings, 3> hand{};
  for (Surroundings& axis : hand) axis = {.stiffness = stiffness, .damping = 3};
  hand[0].reference = std::move(along_x);
  return hand;
}

PortSetup leader_of(std::function<double(double)> along_x, double stiffness = 300) {
  PortSetup leader = port_of(PortRole::kLeader);
  leader.coupling.clutch = Coupling::Button{.bit = 0};
  leader.around = hand_of(stiffness, std::move(along_x));
  return leader;
}

class Steps {
 public:
  void look(const Ports& ports) {
    leader = std::max(leader, (ports.leader.demand.force - before_leader_).norm());
    follower = std::max(follower, (ports.follower.demand.force - before_follower_).norm());
    from(ports);
  }
  void from(const Ports& ports) {
    before_leader_ = ports.leader.demand.force;
    before_follower_ = ports.follower.demand.force;
  }
  double leader = 0;  ///< N
  double follower = 0;

 private:
  Vec3 before_leader_ = Vec3::Zero();
  Vec3 before_follower_ = Vec3::Zero();
};

/// A minute. The difference of the two positions (m) and its bound.
std::pair<double, double> drift_after(int clutches, double loss, std::uint64_t seed) {
  constexpr double kCount = 20e-6;
  const auto wave = [](double t) { return t < 60 ? 0.02 * std::sin(kTurn * 0.7 * t) : 0.0; };
  PortSetup leader = leader_of(wave);
  PortSetup follower = port_of(PortRole::kFollower);
  leader.encoder_step = follower.encoder_step = kCount;
  const Network bad{.delay = 5, .jitter = 5, .loss = loss, .seed = seed};
  Network back = bad;
  back.seed += 1000;
  Ports ports(leader, follower, bad, back);
  EXPECT_TRUE(ports.engage());
  const double follower_began = ports.follower.measured().x();
  double led = 0;
  double before = ports.leader.measured().x();
  bool live = true;
  const int every = clutches > 0 ? 60'000 / clutches : 1'000'000;
  ports.run(63'000, [&](int now) {
    ports.leader.buttons = now < 60'000 && now % every > every / 2 ? 1 : 0;
    const bool lives = ports.leader.coupling->live();
    const double x = ports.leader.measured().x();
    if (live && lives) led += x - before;
    before = x;
    live = lives;
  });
  EXPECT_TRUE(live);
  expect_passive(ports, std::to_string(seed));
  const double softest = std::min(ports.leader.coupling->stiffness(), ports.follower.coupling->stiffness());
  const double drift = std::abs(ports.follower.measured().x() - follower_began - led);
  return {drift, 2 * kCoulomb / softest + 2 * kCount};
}

TEST(CouplingForce, AMinuteOfWavingWithAHundredClutchesLeavesNoDrift) {
  for (const double loss : {0.01, 0.1, 0.3}) {
    for (const int clutches : {0, 100, 400}) {
      const auto [drift, bound] = drift_after(clutches, loss, 7);
      EXPECT_LE(drift, bound) << clutches << " clutches, loss " << loss;
      std::cout << clutches << " clutches, loss " << loss << ": " << drift * 1e3 << " of " << bound * 1e3 << " mm\n";
    }
  }
}

TEST(CouplingForce, EngagingAndClutchingInTheOpenMovesNothing) {
  PortSetup leader = leader_of([](double) { return 0.0; });
  PortSetup follower = port_of(PortRole::kFollower);
  leader.around[0].reference = [](double) { return 0.05; };
  Ports ports(leader, follower, {.delay = 7, .jitter = 4, .loss = 0.1, .seed = 3},
              {.delay = 7, .jitter = 4, .loss = 0.1, .seed = 4});
  ports.leader.put(Vec3(0.05, 0, 0));
  Steps steps;
  const auto look = [&](int) { steps.look(ports); };
  ports.run(100, look);
  ASSERT_TRUE(ports.leader.coupling->engage());
  ports.run(500, look);
  ASSERT_TRUE(ports.leader.coupling->live());
  for (int n = 0; n < 20; ++n) {
    ports.leader.buttons ^= 1U;
    ports.run(100, look);
  }
  ports.leader.coupling->disengage();
  ports.run(200, look);
  EXPECT_LT(steps.leader, kCoulomb);
  EXPECT_LT(steps.follower, kCoulomb);
  EXPECT_LT(ports.follower.x().norm(), 2 * 20e-6) << "two counts of 20 µm";
  EXPECT_LT((ports.leader.x() - Vec3(0.05, 0, 0)).norm(), 2 * 20e-6);
}

/// Returns ports where the leader presses its follower against a wall with 3 N at both ends.
Ports pressing(int one_way, PortSetup follower = port_of(PortRole::kFollower)) {
  PortSetup leader = leader_of([](double t) { return 0.02 * std::clamp((t - 1) / 0.5, 0.0, 1.0); });
  follower.around[0] = {.stiffness = 2000, .damping = 5, .reference = [](double) { return 0.005; }, .wall = true};
  leader.coupling.spring.adapt_to_delay = follower.coupling.spring.adapt_to_delay = false;
  Ports ports(leader, follower, {.delay = one_way, .seed = 3}, {.delay = one_way, .seed = 4});
  ports.run(50);
  EXPECT_TRUE(ports.engage());
  ports.run(3000);
  return ports;
}

TEST(CouplingForce, AClutchUnderForceFadesItAndTakesItUpAgainWithoutAStep) {
  Ports ports = pressing(3);
  const double felt = -ports.leader.demand.force.x();
  ASSERT_GT(felt, 1.5);
  const Vec3 follower_at = ports.follower.x();
  Steps steps;
  steps.from(ports);
  ports.leader.buttons = 1;
  ports.run(1, [&](int) { steps.look(ports); });
  EXPECT_LT(steps.leader, kCoulomb) << "in the period of the clutch";
  ports.run(200, [&](int) { steps.look(ports); });
  EXPECT_LT(steps.leader, felt / 50 + kCoulomb) << "faded within 50 ms";
  EXPECT_EQ(ports.leader.demand.force, Vec3(Vec3::Zero()));
  EXPECT_LT((ports.follower.x() - follower_at).norm(), 2e-4) << "it goes on pressing: " << felt << " N";
  EXPECT_GT(ports.follower.demand.force.x(), 0.8 * felt);
  const double kept = ports.follower.x().x();
  steps = {};
  steps.from(ports);
  ports.leader.buttons = 0;
  ports.run(1, [&](int) { steps.look(ports); });
  EXPECT_LT(steps.leader, kCoulomb);
  EXPECT_LT(steps.follower, kCoulomb);
  ports.run(20, [&](int) { steps.look(ports); });
  EXPECT_LT(std::abs(ports.follower.x().x() - kept), 2 * 20e-6) << "the release moves nothing";
  EXPECT_LT(-ports.leader.demand.force.x(), 0.15 * felt) << "the ramp has hardly begun";
  ports.run(1000, [&](int) { steps.look(ports); });
  EXPECT_LT(steps.leader, 0.1);
  EXPECT_GT(-ports.leader.demand.force.x(), 0.5) << "felt again";
  expect_passive(ports, "clutch under force");
}

TEST(CouplingForce, AClutchThatChattersUnderForceMovesNothing) {
  Ports ports = pressing(3);
  const double kept = ports.follower.x().x();
  const double felt = -ports.leader.demand.force.x();
  Steps steps;
  steps.from(ports);
  ports.run(2000, [&](int now) {
    ports.leader.buttons = now / 10 % 2 == 0 ? 1 : 0;
    steps.look(ports);
  });
  EXPECT_LT(steps.leader, felt / 50 + 0.1);
  EXPECT_LT(std::abs(ports.follower.x().x() - kept), 0.002);
  expect_passive(ports, "chatter");
}

TEST(CouplingForce, AScaledAndTurnedPairHoldsScaledForcesAndStaysPassive) {
  struct Case {
    double position_scale, force_scale;
  };
  for (const auto& [s_x, s_f] : {Case{0.2, 5}, Case{10, 0.1}, Case{0.5, 0.5}, Case{2, 3}}) {
    // The mass of the follower is chosen so that it feels like the leader's.
    PoseMap::Config map{.position_scale = s_x, .force_scale = s_f, .rotation = rotation_by(Vec3(0, 0, kTurn / 4))};
    PortSetup leader = leader_of([](double t) { return 0.02 * std::clamp((t - 1) / 0.5, 0.0, 1.0); });
    PortSetup follower = port_of(PortRole::kFollower);
    leader.coupling.map = follower.coupling.map = map;
    const double impedance = 1 / (s_x * s_f);
    follower.mass *= impedance;
    follower.friction = {kCoulomb / s_f, 0.26 * impedance};
    // The wall is along the follower's y, 5 mm of the leader's x away.
    follower.around[1] = {.stiffness = 2000 * impedance,
                          .damping = 5 * impedance,
                          .reference = [s = s_x](double) { return 0.005 * s; },
                          .wall = true};
    Ports ports(leader, follower, {.delay = 4, .jitter = 5, .loss = 0.1, .seed = 3},
                {.delay = 4, .jitter = 5, .loss = 0.1, .seed = 4});
    ASSERT_TRUE(ports.engage());
    ports.run(3000);
    const std::string when = std::to_string(s_x) + ", " + std::to_string(s_f);
    const double felt = -ports.leader.applied.x();
    const double wall = ports.follower.applied.y();
    EXPECT_GT(felt, 1) << when;
    EXPECT_NEAR(felt, s_f * wall, 2 * kCoulomb + 0.01 * felt) << when;
    EXPECT_NEAR(ports.follower.x().y(), 0.005 * s_x + wall / (2000 * impedance), 3e-4 * s_x) << when;
    EXPECT_LT(std::abs(ports.follower.x().x()), 1e-4 * s_x) << when << ": the other axis";
    expect_passive(ports, when);
  }
}

TEST(CouplingForce, AnAxisThatIsNotCoupledIsFreeAtBothEnds) {
  PortSetup leader = port_of(PortRole::kLeader);
  PortSetup follower = port_of(PortRole::kFollower);
  leader.coupling.map.axes = follower.coupling.map.axes = {true, false, true};
  leader.path = [](double t) { return Vec3(0.01 * std::sin(3 * t), 0.02 * std::sin(5 * t), 0); };
  Ports ports(leader, follower);
  ASSERT_TRUE(ports.engage());
  double across = 0;
  double along = 0;
  ports.run(3000, [&](int) {
    for (const Port* port : {&ports.leader, &ports.follower}) {
      across = std::max(across, std::abs(port->demand.force.y()));
      across = std::max(across, port->demand.stiffness.row(1).norm());
      along = std::max(along, std::abs(port->demand.force.x()));
    }
  });
  EXPECT_EQ(across, 0);
  EXPECT_GT(along, 0.05);
  EXPECT_EQ(ports.follower.x().y(), 0);
}

TEST(CouplingForce, AnotherScaleInTheNextSessionIsNoStep) {
  PortSetup leader = leader_of([](double t) { return 0.01 * std::sin(3 * t); });
  PortSetup follower = port_of(PortRole::kFollower);
  leader.coupling.map.position_scale = follower.coupling.map.position_scale = 0.1;
  Ports ports(leader, follower);
  ASSERT_TRUE(ports.engage());
  ports.run(1500);
  const Vec3 kept = ports.follower.x();
  for (Port* port : {&ports.leader, &ports.follower}) {
    port->setup.coupling.map.position_scale = 10;
    port->begin(2);
  }
  Steps steps;
  ports.run(1);  // discards the force held in the previous sessions
  steps.from(ports);
  ports.run(100, [&](int) { steps.look(ports); });
  ASSERT_TRUE(ports.leader.coupling->engage());
  ports.run(5, [&](int) { steps.look(ports); });
  ASSERT_TRUE(ports.follower.coupling->live());
  EXPECT_LT(std::max(steps.leader, steps.follower), kCoulomb);
  EXPECT_LT((ports.follower.x() - kept).norm(), 2e-3);
  ports.run(500);
  EXPECT_GE(ports.least_account(), kRounding);
}

Ports touching(bool measures, double position_scale = 1, double force_scale = 1) {
  PortSetup leader = leader_of([](double t) { return 0.02 * std::clamp((t - 1) / 0.5, 0.0, 1.0); });
  PortSetup follower = port_of(PortRole::kFollower);
  for (PortSetup* setup : {&leader, &follower}) {
    setup->coupling.method = CouplingMethod::kPositionForce;
    setup->coupling.map.position_scale = position_scale;
    setup->coupling.map.force_scale = force_scale;
    setup->coupling.map.rotation = rotation_by(Vec3(0, 0, kTurn / 4));
  }
  follower.measures_contact = measures;
  follower.around[1] = {.stiffness = 500,
                        .damping = 5,
                        .reference = [position_scale](double) { return 0.005 * position_scale; },
                        .wall = true};
  Ports ports(leader, follower, {.delay = 4, .seed = 3}, {.delay = 4, .seed = 4});
  EXPECT_TRUE(ports.engage());
  ports.run(3000);
  return ports;
}

TEST(CouplingForce, PositionForceFeelsTheScaledContactAndNotTheMotor) {
  for (const auto& [s_x, s_f] : {std::pair{1.0, 1.0}, {0.5, 2.0}}) {
    Ports ports = touching(true, s_x, s_f);
    const double contact = -ports.follower.outside().y();
    ASSERT_GT(contact, 0.5);
    EXPECT_TRUE(ports.leader.coupling->contact_measured());
    EXPECT_NEAR(-ports.leader.demand.force.x(), s_f * contact, 0.01 * s_f * contact);
    EXPECT_NEAR(ports.leader.demand.force.y(), 0, 0.02) << "turned into the leader's frame";
    EXPECT_EQ(ports.leader.demand.stiffness, Mat3(Mat3::Zero()));
    EXPECT_GE(ports.least_account(), kRounding);
  }
}

TEST(CouplingForce, WithoutAMeasuredContactThereIsOnlyDamping) {
  Ports ports = touching(false);
  EXPECT_FALSE(ports.leader.coupling->contact_measured());
  const Demand<3> demand =
      ports.leader.coupling->command({Port::at(ports.now), ports.leader.x(), Vec3(0.1, 0, 0)}, 0, true);
  EXPECT_LT((demand.force - Vec3(-0.4, 0, 0)).norm(), 1e-12);
}

TEST(CouplingForce, HandsAtBothEndsThatPushEachOtherFeelTheSame) {
  const auto push = [](double to) { return [to](double t) { return to * std::clamp((t - 1) / 0.5, 0.0, 1.0); }; };
  PortSetup leader = leader_of(push(0.02));
  PortSetup follower = port_of(PortRole::kFollower);
  follower.around = hand_of(500, push(-0.02));
  Ports ports(leader, follower, {.delay = 4, .jitter = 5, .loss = 0.1, .seed = 3},
              {.delay = 4, .jitter = 5, .loss = 0.1, .seed = 4});
  ASSERT_TRUE(ports.engage());
  ports.run(4000);
  EXPECT_GT(-ports.leader.applied.x(), 2);
  EXPECT_NEAR(-ports.leader.applied.x(), ports.follower.applied.x(), 2 * kCoulomb + 0.03);
  expect_passive(ports, "two hands");
  ports.follower.setup.around = {};
  ports.run(2000);
  expect_passive(ports, "one hand");
}

}  // namespace
}  // namespace tendon::coupling_force_test
