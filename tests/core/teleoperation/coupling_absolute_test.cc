// SPDX-License-Identifier: Apache-2.0
// Each leader position has a follower position, and engagement first aligns the two.
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/rotation.h"
#include "tests/core/teleoperation/expect_ports.h"
#include "tests/core/teleoperation/ports.h"
#include "tests/support/refusal.h"

namespace tendon::coupling_absolute_test {
namespace {

using std::chrono::milliseconds;

PortSetup end_of(PortRole role, double energy = 0) {
  PortSetup setup = port_of(role);
  setup.coupling.absolute = Coupling::Absolute{.within = 5e-3, .energy = energy};
  return setup;
}

/// Holds the handle at `begins` until `from` (s), then moves it to `to` within a second.
PortSetup hand_that_goes(const Vec3& begins, const Vec3& to, double from) {
  PortSetup leader = end_of(PortRole::kLeader);
  for (int i = 0; i < 3; ++i) {
    leader.around[static_cast<std::size_t>(i)] = {.stiffness = 300, .damping = 3, .reference = [=](double t) {
                                                    return begins[i] +
                                                           (to[i] - begins[i]) * std::clamp(t - from, 0.0, 1.0);
                                                  }};
  }
  return leader;
}

TEST(CouplingAbsolute, TheHandBringsTheHandleThereAndOnlyThenItEngages) {
  PortSetup leader = hand_that_goes({0.04, 0, 0}, {-0.01, 0.01, 0}, 0.5);
  PortSetup follower = end_of(PortRole::kFollower);
  leader.coupling.map.position_scale = follower.coupling.map.position_scale = 2;
  leader.coupling.map.rotation = follower.coupling.map.rotation = rotation_by({0, 0, 3.14159265358979323846 / 2});
  Ports ports(leader, follower, {.delay = 10, .seed = 1}, {.delay = 10, .seed = 2});
  const Vec3 place(-0.02, -0.02, 0);  // 2 R (−0.01, 0.01)
  ports.leader.put({0.04, 0, 0});
  ports.follower.put(place);
  ports.run(100);
  ASSERT_TRUE(ports.leader.coupling->engage());
  EXPECT_EQ(phase(ports.leader), PortPhase::kAligning);
  EXPECT_TRUE(ports.leader.coupling->engage()) << "it is at it already";
  int engaged_at = 0;
  int near_at = 0;
  double most = 0;
  ports.run(2500, [&](int now) {
    const Vec3 there(-0.01, 0.01, 0);
    if (near_at == 0 && (ports.leader.x() - there).norm() < 5e-3) near_at = now;
    if (phase(ports.leader) == PortPhase::kAligning) {
      most = std::max(most, ports.leader.demand.force.norm());
      EXPECT_LT((ports.follower.x() - place).norm(), 1e-9) << "the follower stands";
    } else if (engaged_at == 0) {
      engaged_at = now;
    }
  });
  ASSERT_GT(engaged_at, 0);
  EXPECT_NEAR(engaged_at - near_at, 200, 3);
  EXPECT_GT(most, 0.5);
  EXPECT_LE(most, Alignment::kForce * (1 + 1e-12));
  EXPECT_TRUE(ports.leader.coupling->live());
  EXPECT_TRUE(ports.follower.coupling->live());
  const Vec3 led = ports.leader.x();
  const Vec3 expected(-2 * led.y(), 2 * led.x(), 0);
  EXPECT_LT((ports.follower.x() - expected).norm(), 1e-3) << "the places are each other's";
  expect_passive(ports);
}

TEST(CouplingAbsolute, AHandThatDoesNotComeIsLeftAloneAfterFiveSeconds) {
  Ports ports(hand_that_goes({0.04, 0, 0}, {0.02, 0, 0}, 0.5), end_of(PortRole::kFollower));
  ports.leader.put({0.04, 0, 0});
  ports.run(100);
  ASSERT_TRUE(ports.leader.coupling->engage());
  int waited = 0;
  for (; phase(ports.leader) == PortPhase::kAligning && waited < 10'000; ++waited) ports.run(1);
  EXPECT_NEAR(waited, 5000, 2);
  expect_coupled(ports, "too far apart");
  ports.run(100);
  EXPECT_EQ(ports.leader.demand.force, Vec3(Vec3::Zero())) << "faded out";
  expect_no_engagement(ports, 300, "only another act");
}

TEST(CouplingAbsolute, AMotorWithEnergyOfItsOwnDrawsItThereAndGivesNoMore) {
  constexpr double kEnergy = 0.02;
  Ports ports(end_of(PortRole::kLeader, kEnergy), end_of(PortRole::kFollower));
  ports.leader.put({0.04, 0, 0});
  ports.run(100);
  ASSERT_TRUE(ports.leader.coupling->engage());
  double fastest = 0;
  double least = 0;
  Vec3 before = ports.leader.x();
  ports.run(2500, [&](int) {
    fastest = std::max(fastest, (ports.leader.x() - before).norm() * 1e3);
    before = ports.leader.x();
    least = std::min(least, ports.leader.truth.energy());
  });
  EXPECT_TRUE(ports.leader.coupling->live()) << ports.leader.x().transpose();
  EXPECT_LT(fastest, 1.4 * Alignment::kSpeed) << "it swings on its spring";
  EXPECT_GE(least, -kEnergy + kRounding);
  EXPECT_GE(ports.least_account(), kRounding);

  Ports none(end_of(PortRole::kLeader), end_of(PortRole::kFollower));
  none.leader.put({0.04, 0, 0});
  none.run(100);
  ASSERT_TRUE(none.leader.coupling->engage());
  none.run(2500);
  EXPECT_EQ(phase(none.leader), PortPhase::kAligning) << "without it a limiter draws nothing";
  EXPECT_GE(none.leader.truth.energy(), kRounding);
}

TEST(CouplingAbsolute, AligningEndsWithThePeerAFaultOrTheOperator) {
  const auto aligning = [] {
    Ports ports(hand_that_goes({0.04, 0, 0}, {0.04, 0, 0}, 0.5), end_of(PortRole::kFollower));
    ports.leader.put({0.04, 0, 0});
    ports.run(100);
    EXPECT_TRUE(ports.leader.coupling->engage());
    ports.run(50);
    EXPECT_EQ(phase(ports.leader), PortPhase::kAligning);
    return ports;
  };
  Ports silent = aligning();
  silent.cut_back = true;
  silent.run(400);
  EXPECT_EQ(phase(silent.leader), PortPhase::kAlone);
  Ports fault = aligning();
  fault.follower.ready = false;
  fault.run(3);
  EXPECT_EQ(phase(fault.leader), PortPhase::kCoupled);
  Ports ended = aligning();
  ended.leader.coupling->disengage();
  ended.run(1);
  expect_coupled(ended, "disengaged");
  Ports anew = aligning();
  anew.follower.begin(2);
  anew.run(3);
  EXPECT_EQ(phase(anew.leader), PortPhase::kCoupled);
  Ports own = aligning();
  own.leader.ready = false;
  own.run(1);
  EXPECT_EQ(phase(own.leader), PortPhase::kFault);
  EXPECT_EQ(own.leader.demand.force, Vec3(Vec3::Zero()));
}

TEST(CouplingAbsolute, RefusesImpossibleConfigurations) {
  expect_refusals(end_of(PortRole::kLeader).coupling, Makes<Coupling>(),
                  {
                      {"within", [](auto& c) { c.absolute->within = 0; }},
                      {"energy", [](auto& c) { c.absolute->energy = -1; }},
                  });
}

}  // namespace
}  // namespace tendon::coupling_absolute_test
