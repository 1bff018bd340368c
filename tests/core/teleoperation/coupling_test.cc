// SPDX-License-Identifier: Apache-2.0
// Phases, engagement, the clutch, and bad input. coupling_loss_test.cc tests lost links, coupling_force_test.cc forces,
// and coupling_world_test.cc random worlds.
#include "core/teleoperation/coupling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "tests/core/control/adversary.h"
#include "tests/core/teleoperation/expect_ports.h"
#include "tests/core/teleoperation/ports.h"
#include "tests/support/refusal.h"

namespace tendon::coupling_test {
namespace {

using std::chrono::milliseconds;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Coupling, IsAloneThenCoupledAndEngagedOnlyByTheAct) {
  Ports ports = far_apart(10);
  EXPECT_FALSE(ports.leader.coupling->engage());
  ports.run(1);
  EXPECT_EQ(phase(ports.leader), PortPhase::kAlone);
  expect_no_engagement(ports, 1000, "nobody acted");
  expect_coupled(ports, "after a second");
  EXPECT_FALSE(ports.follower.coupling->engage()) << "the leader's business";
  EXPECT_TRUE(ports.leader.coupling->engage());
  EXPECT_EQ(phase(ports.leader), PortPhase::kEngaged);
  ports.run(11);
  EXPECT_TRUE(ports.follower.coupling->live()) << "one way later";
  EXPECT_FALSE(ports.leader.coupling->live());
  ports.run(10);
  EXPECT_TRUE(ports.leader.coupling->live()) << "a round trip later";
  EXPECT_TRUE(ports.leader.coupling->engage()) << "it was already";
  EXPECT_EQ(ports.told_there.engagement, 1U);
}

TEST(Coupling, AButtonIsTheActWhenItIsPressedAndNotWhileItIsHeld) {
  PortSetup leader = port_of(PortRole::kLeader);
  leader.coupling.engage_by = 3;
  Ports ports(leader, port_of(PortRole::kFollower));
  ports.leader.buttons = 1U << 3;
  expect_no_engagement(ports, 100, "held since before the start");
  ports.leader.buttons = 1U << 2;
  expect_no_engagement(ports, 100, "another button");
  ports.leader.buttons |= 1U << 3;
  ports.run(3);
  EXPECT_TRUE(ports.leader.coupling->live());
  ports.follower.coupling->disengage();
  ports.run(3);
  expect_no_engagement(ports, 100, "still held");
}

TEST(Coupling, TheActIsRefusedUnlessBothAreReadyAndFresh) {
  Ports ports = far_apart(0);
  ports.run(50);
  ports.leader.ready = false;
  ports.run(1);
  EXPECT_EQ(phase(ports.leader), PortPhase::kFault);
  EXPECT_FALSE(ports.leader.coupling->engage());
  ports.leader.ready = true;
  ports.follower.ready = false;
  ports.run(2);
  EXPECT_EQ(phase(ports.leader), PortPhase::kCoupled);
  EXPECT_FALSE(ports.leader.coupling->engage()) << "the follower has a fault";
  ports.follower.ready = true;
  ports.run(2);
  ports.cut_back = true;
  ports.run(21);
  EXPECT_TRUE(ports.leader.coupling->engage()) << "fresh: 20 ms";
  ports.leader.coupling->disengage();
  ports.run(1);
  EXPECT_FALSE(ports.leader.coupling->engage()) << "21 ms";
  ports.run(300);
  EXPECT_EQ(phase(ports.leader), PortPhase::kAlone);
  EXPECT_FALSE(ports.leader.coupling->engage());
}

TEST(Coupling, AFaultOfEitherDisengagesBothAndItsEndEngagesNobody) {
  for (const bool leads : {true, false}) {
    Ports ports = far_apart(5);
    ASSERT_TRUE(ports.engage());
    Port& port = leads ? ports.leader : ports.follower;
    port.ready = false;
    ports.run(1);
    EXPECT_EQ(phase(port), PortPhase::kFault);
    EXPECT_EQ(port.demand.force, Vec3(Vec3::Zero()));
    port.ready = true;
    ports.run(7);
    expect_no_engagement(ports, 500, "a fault of one period");
    expect_coupled(ports, "after the fault");
    EXPECT_TRUE(ports.engage());
  }
}

/// The new leader has a smaller epoch. The engagement of the previous leader has ended, and its force fades.
TEST(Coupling, AnotherLeaderIsHeardAfterARenewalAndEngagesByItsOwnAct) {
  Ports ports = far_apart(5);
  ports.leader.begin(9);
  ASSERT_TRUE(ports.engage());
  ports.leader.put({0.01, 0, 0});
  ports.run(400);
  const double pulled = ports.follower.demand.force.norm();
  ASSERT_GT(pulled, 0.1);
  const PortState last = ports.told_there;
  ports.leader.begin(4);
  ports.run(30);
  EXPECT_NE(phase(ports.leader), PortPhase::kEngaged);
  const std::uint64_t epoch = ports.told_back.epoch;
  ports.follower.coupling->renew();
  double step = 0;
  Vec3 before = ports.follower.demand.force;
  ports.run(60, [&](int) {
    step = std::max(step, (ports.follower.demand.force - before).norm());
    before = ports.follower.demand.force;
  });
  EXPECT_LT(step, 0.05 * pulled + 0.02) << "it fades";
  EXPECT_EQ(before, Vec3(Vec3::Zero()));
  expect_coupled(ports, "the new one is heard");
  EXPECT_EQ(ports.told_back.epoch, epoch + 1) << "no total that answers the former one counts again";
  ports.follower.coupling->receive(last, Port::at(ports.now));
  expect_no_engagement(ports, 300, "an act of the one before");
  ports.follower.coupling->renew();
  ports.run(20);
  EXPECT_TRUE(ports.engage());
  expect_passive(ports);
}

TEST(Coupling, AnActThatAFollowerHeardInItsFaultNeverEngagesIt) {
  Played follower(coupling_of(PortRole::kFollower));
  follower.step();
  follower.receive(follower.state(PortPhase::kCoupled));
  follower.step();
  follower.receive(follower.state(PortPhase::kEngaged, 1));
  follower.step(Vec3::Zero(), 0, false);
  for (int n = 0; n < 100; ++n) {
    follower.receive(follower.state(PortPhase::kEngaged, 1));
    follower.step();
    EXPECT_EQ(follower.port.phase(), PortPhase::kCoupled);
  }
  follower.receive(follower.state(PortPhase::kEngaged, 2));
  follower.step();
  EXPECT_TRUE(follower.port.live()) << "another act";
}

TEST(Coupling, ALeaderWaitsForTheAnswerButNotForOneThatDeclines) {
  const auto engaged = [] {
    Played leader(coupling_of(PortRole::kLeader));
    leader.step();
    leader.receive(leader.state(PortPhase::kCoupled));
    leader.step();
    EXPECT_TRUE(leader.port.engage());
    leader.step();
    return leader;
  };
  Played leader = engaged();
  int waited = 0;
  for (; leader.port.phase() == PortPhase::kEngaged && waited < 100'000; ++waited) {
    PortState late = leader.state(PortPhase::kCoupled);
    late.answers = 2;
    leader.receive(late);
    leader.step();
  }
  EXPECT_EQ(leader.port.phase(), PortPhase::kCoupled);
  EXPECT_NEAR(waited, 1e3 * seconds(Coupling::kAnswerWithin), 1);

  leader = engaged();
  leader.receive(leader.state(PortPhase::kCoupled));
  leader.step();
  EXPECT_EQ(leader.port.phase(), PortPhase::kCoupled) << "it heard the act and is not engaged";

  leader = engaged();
  PortState fault = leader.state(PortPhase::kFault);
  fault.answers = 2;
  leader.receive(fault);
  leader.step();
  EXPECT_EQ(leader.port.phase(), PortPhase::kCoupled) << "it cannot answer";
}

TEST(Coupling, DisengagingEitherEndDisengagesBoth) {
  for (const bool leads : {true, false}) {
    Ports ports = far_apart(20);
    ASSERT_TRUE(ports.engage());
    ports.leader.put(Vec3(0.01, 0, 0));
    ports.run(1);
    EXPECT_GT(ports.told_there.position.norm(), 5e-3);
    (leads ? ports.leader : ports.follower).coupling->disengage();
    ports.run(42);
    expect_no_engagement(ports, 1000, "disengaged");
    ports.leader.put(Vec3(0.02, 0, 0));
    EXPECT_TRUE(ports.engage());
    EXPECT_LT(ports.told_there.position.norm(), 1e-3) << "each act begins at 0";
  }
}

TEST(Coupling, TheClutchFreesTheLeaderAndKeepsItsDisplacement) {
  PortSetup leader = port_of(PortRole::kLeader);
  leader.path = [](double t) { return Vec3(0.1 * t, 0, 0); };
  leader.coupling.clutch = Coupling::Button{.bit = 1};
  Ports ports(leader, port_of(PortRole::kFollower));
  ASSERT_TRUE(ports.engage());
  ports.run(400);
  const double before = ports.told_there.position.x();
  EXPECT_NEAR(before, 0.04, 0.001);
  ports.leader.buttons = 2;
  ports.run(1);
  EXPECT_EQ(phase(ports.leader), PortPhase::kClutched);
  EXPECT_FALSE(ports.leader.coupling->live());
  EXPECT_EQ(ports.told_there.position.x(), before);
  EXPECT_EQ(ports.told_there.velocity, Vec3(Vec3::Zero()));
  double paid = 0;
  ports.run(700, [&](int) { paid += ports.leader.paid + ports.follower.paid; });
  EXPECT_EQ(paid, 0) << "nothing is given while clutched";
  EXPECT_EQ(ports.leader.demand.force, Vec3(Vec3::Zero()));
  EXPECT_EQ(ports.told_there.position.x(), before);
  EXPECT_EQ(phase(ports.follower), PortPhase::kEngaged);
  EXPECT_NEAR(ports.follower.x().x(), before, 1e-4) << "it holds its place";
  ports.leader.buttons = 0;
  ports.run(1);
  EXPECT_EQ(phase(ports.leader), PortPhase::kEngaged);
  EXPECT_EQ(ports.told_there.position.x(), before) << "in the period of the release, too";
  ports.run(1);
  EXPECT_NEAR(ports.told_there.position.x(), before + 1e-4, 1e-12);
}

TEST(Coupling, AClutchThatTogglesStaysUntilItIsPressedAgain) {
  PortSetup leader = port_of(PortRole::kLeader);
  leader.coupling.clutch = Coupling::Button{.bit = 31, .toggles = true};
  Ports ports(leader, port_of(PortRole::kFollower));
  ASSERT_TRUE(ports.engage());
  const auto press = [&] {
    ports.leader.buttons = 1U << 31;
    ports.run(5);
    ports.leader.buttons = 0;
    ports.run(5);
  };
  press();
  EXPECT_EQ(phase(ports.leader), PortPhase::kClutched);
  press();
  EXPECT_EQ(phase(ports.leader), PortPhase::kEngaged);
  press();
  ports.leader.coupling->disengage();
  ports.run(5);
  ASSERT_TRUE(ports.engage());
  EXPECT_EQ(phase(ports.leader), PortPhase::kEngaged) << "a new act begins unclutched";
}

TEST(Coupling, TheActCanBeMadeWithTheClutchHeld) {
  PortSetup leader = port_of(PortRole::kLeader);
  leader.coupling.clutch = Coupling::Button{.bit = 0};
  Ports ports(leader, port_of(PortRole::kFollower));
  ports.run(50);
  ports.leader.buttons = 1;
  EXPECT_TRUE(ports.leader.coupling->engage());
  ports.run(6000);
  EXPECT_EQ(phase(ports.leader), PortPhase::kClutched);
  EXPECT_EQ(phase(ports.follower), PortPhase::kEngaged);
  ports.leader.buttons = 0;
  ports.run(2);
  EXPECT_TRUE(ports.leader.coupling->live());
}

TEST(Coupling, AStateWithAValueOutOfItsBoundsChangesNothing) {
  using Change = void (*)(PortState&);
  const std::vector<Change> changes = {
      [](PortState& s) { s.epoch = 0; },
      [](PortState& s) { s.sequence = 0; },
      [](PortState& s) { s.answers += 1; },
      [](PortState& s) { s.time = std::chrono::hours(1'000'000); },
      [](PortState& s) { s.time = -std::chrono::hours(1'000'000); },
      [](PortState& s) { s.round_trip = milliseconds(-1); },
      [](PortState& s) { s.round_trip = milliseconds(10'001); },
      [](PortState& s) { s.phase = PortPhase{0}; },
      [](PortState& s) { s.phase = PortPhase{8}; },
      [](PortState& s) { s.position.y() = kNan; },
      [](PortState& s) { s.position.x() = 1.1e12; },
      [](PortState& s) { s.velocity.z() = -std::numeric_limits<double>::infinity(); },
      [](PortState& s) { s.force.x() = kNan; },
      [](PortState& s) { s.contact_force = Vec3(0, kNan, 0); },
      [](PortState& s) { s.account = -1001; },
      [](PortState& s) { s.need = -1e-9; },
      [](PortState& s) { s.need = kNan; },
      [](PortState& s) { s.given = 1e7; },
      [](PortState& s) { s.given = 0.001; },  // claims earlier gifts
      [](PortState& s) { s.taken = 0.5; },    // we have given nothing
  };
  for (std::size_t n = 0; n < changes.size(); ++n) {
    Played leader(coupling_of(PortRole::kLeader));
    leader.step();
    PortState good = leader.state(PortPhase::kCoupled);
    good.given = 0.002;
    leader.receive(good);
    leader.step();
    PortState bad = leader.state(PortPhase::kFault);
    bad.given = 0.003;
    changes[n](bad);
    leader.receive(bad);
    EXPECT_EQ(leader.port.refused(), 1U) << n;
    leader.step();
    EXPECT_TRUE(leader.port.engage()) << n << ": it would be refused after a fault";
    EXPECT_EQ(leader.told.answers, 1U) << n;
    EXPECT_EQ(leader.told.taken, 0.002) << n;
    PortState next = leader.state(PortPhase::kCoupled);
    next.given = 0.003;
    leader.receive(next);
    EXPECT_EQ(leader.port.refused(), 1U) << n << ": a good one is heard again";
  }
}

TEST(Coupling, AHandThatIsNotFiniteMovesNothing) {
  Ports ports = far_apart(0);
  ASSERT_TRUE(ports.engage());
  ports.run(500);
  for (const Vec3& bad : {Vec3(kNan, 0, 0), Vec3(0, 1e13, 0)}) {
    for (int n = 0; n < 3; ++n) {
      const Demand<3> demand = ports.leader.coupling->command({Port::at(ports.now), bad, Vec3::Zero()}, 0, true);
      EXPECT_FALSE(demand.force.allFinite());
      EXPECT_EQ(ports.leader.limiter->limit(demand).force, Vec3(Vec3::Zero()));
    }
  }
  ports.run(100);
  EXPECT_TRUE(ports.leader.coupling->live());
  EXPECT_EQ(ports.told_there.position, Vec3(Vec3::Zero()));
  ports.leader.coupling->conclude(Vec3(kNan, 0, 0), Vec3(0, kNan, 0));
  const PortState told = ports.leader.coupling->message();
  EXPECT_EQ(told.force, Vec3(Vec3::Zero()));
  EXPECT_FALSE(told.contact_force.has_value()) << "not measured is not zero";
}

TEST(Coupling, PeriodsWithoutAPositionHaveNoForceAndKeepThePhase) {
  PortSetup leader = port_of(PortRole::kLeader);
  PortSetup follower = port_of(PortRole::kFollower);
  leader.path = [](double t) { return Vec3(t < 0.5 ? 0 : 0.01, 0, 0); };
  follower.path = [](double) { return Vec3(Vec3::Zero()); };
  Ports ports(leader, follower);
  ASSERT_TRUE(ports.engage());
  ports.run(1000);
  const double before = ports.follower.demand.force.x();
  ports.follower.seen = false;
  ports.run(1);
  ports.follower.seen = true;
  ports.run(1);
  EXPECT_NEAR(ports.follower.demand.force.x(), before, 0.03 * before) << "one period does not undo the ramp";
  ports.follower.seen = false;
  ports.run(60);
  ports.follower.seen = true;
  ports.run(1);
  EXPECT_LT(ports.follower.demand.force.x(), 0.01 * before) << "sixty do";
  EXPECT_TRUE(ports.follower.coupling->live());
  ports.follower.seen = false;
  ports.cut_there = true;
  ports.run(272);
  EXPECT_EQ(phase(ports.follower), PortPhase::kLost) << "the ladder goes on";
}

TEST(Coupling, AFollowerEngagedInAnUnseenPeriodTakesTheLeadersPlace) {
  PortSetup leader = port_of(PortRole::kLeader);
  leader.path = [](double) { return Vec3(0.3, 0, 0); };
  PortSetup follower = port_of(PortRole::kFollower);
  follower.path = [](double t) { return Vec3(0.1 * t, 0, 0); };
  Ports ports(leader, follower);
  ASSERT_TRUE(ports.engage());
  ports.run(500);
  ports.leader.coupling->disengage();
  ports.run(100);
  ports.follower.seen = false;
  ASSERT_TRUE(ports.leader.coupling->engage());
  ports.run(5);
  ports.follower.seen = true;
  ports.run(1);
  EXPECT_NEAR(ports.told_back.position.x(), 0, 1e-12);
}

TEST(Coupling, RefusesImpossibleConfigurations) {
  expect_refusals(coupling_of(PortRole::kLeader), Makes<Coupling>(),
                  {
                      {"ramp", [](auto& c) { c.ramp = {}; }},
                      {"peer_period", [](auto& c) { c.peer_period = {}; }},
                      {"force_scale", [](auto& c) { c.map.force_scale = 0; }},
                      {"stiffness", [](auto& c) { c.spring.stiffness = -1; }},
                      {"max_power", [](auto& c) { c.tank->max_power = 0; }},
                      {"clutch.bit = 32", [](auto& c) { c.clutch = Coupling::Button{.bit = 32}; }},
                      {"engage_by = 32", [](auto& c) { c.engage_by = 32; }},
                      {"engage_by = 2",
                       [](auto& c) {
                         c.clutch = Coupling::Button{.bit = 2};
                         c.engage_by = 2;
                       }},
                  });
}

}  // namespace
}  // namespace tendon::coupling_test
