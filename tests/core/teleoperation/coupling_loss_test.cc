// SPDX-License-Identifier: Apache-2.0
// A peer stops sending, returns, or restarts; messages are late or repeated. Nothing engages without a request.
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "tests/core/teleoperation/expect_ports.h"
#include "tests/core/teleoperation/ports.h"

namespace tendon::coupling_loss_test {
namespace {

using std::chrono::milliseconds;

/// The leader moves at 0.1 m/s when the follower receives its last state, at age 0. Every later age is checked.
struct Ladder {
  explicit Ladder(bool robot = false, int sent_every = 1) {
    PortSetup leader = port_of(PortRole::kLeader);
    PortSetup follower = port_of(PortRole::kFollower);
    leader.every = sent_every;
    follower.coupling.peer_period = milliseconds(sent_every);
    for (auto* config : {&leader.coupling, &follower.coupling}) {
      config->spring.damping = 10;
      config->spring.adapt_to_delay = false;
    }
    follower.coupling.holds_place = robot;
    leader.path = [](double t) { return Vec3(0.1 * t, 0, 0); };
    follower.path = [](double) { return Vec3(Vec3::Zero()); };
    ports.emplace(leader, follower);
    EXPECT_TRUE(ports->engage());
    ports->run(601 - ports->now % 100);
    ports->cut_there = true;
    forces.push_back(ports->follower.demand.force.x());
    phases.push_back(phase(ports->follower));
    ports->run(600, [&](int) {
      forces.push_back(ports->follower.demand.force.x());
      phases.push_back(phase(ports->follower));
    });
  }
  std::optional<Ports> ports;
  std::vector<double> forces;  ///< indexed by age, ms
  std::vector<PortPhase> phases;
};

TEST(Coupling, TheLadderOfAHandHasItsStagesWithinAPeriod) {
  const Ladder ladder;
  const auto& force = ladder.forces;
  EXPECT_NEAR(force[20] - force[19], 400 * 0.1e-3, 0.01) << "carried on with its velocity";
  EXPECT_NEAR(force[19] - force[22], 10 * 0.1, 0.1) << "the velocity is gone";
  EXPECT_EQ(force[40], force[22]) << "and so is the feed-forward";
  EXPECT_EQ(force[41], force[40]) << "the fade begins without a step";
  EXPECT_NEAR(force[41 + 25], force[40] / 2, 1e-9);
  EXPECT_GT(force[41 + 49], 0);
  for (std::size_t age = 41 + 50; age < force.size(); ++age) ASSERT_EQ(force[age], 0) << age;
  EXPECT_EQ(ladder.phases[270], PortPhase::kEngaged);
  EXPECT_EQ(ladder.phases[271], PortPhase::kLost);
  EXPECT_GE(ladder.ports->least_account(), kRounding);
}

TEST(Coupling, ARobotHoldsTheLastPlaceAndThenWhereItsToolIs) {
  Ladder ladder(true);
  const auto& force = ladder.forces;
  for (std::size_t age = 23; age < 271; ++age) ASSERT_EQ(force[age], force[22]) << age;
  EXPECT_EQ(ladder.phases[271], PortPhase::kLost);
  EXPECT_EQ(force[271], force[270]) << "no step";
  for (std::size_t age = 271 + 50; age < force.size(); ++age) ASSERT_EQ(force[age], 0) << age;
  Ports& ports = *ladder.ports;
  ports.follower.setup.path = [](double) { return Vec3(0.002, 0.001, 0); };
  ports.run(2);
  EXPECT_LT((ports.follower.demand.force - 400 * Vec3(-0.002, -0.001, 0)).norm(), 1e-9);
  ports.cut_there = false;
  ports.run(100);
  EXPECT_EQ(phase(ports.follower), PortPhase::kCoupled);
  EXPECT_LT((ports.follower.demand.force - 400 * Vec3(-0.002, -0.001, 0)).norm(), 1e-9) << "until it is engaged";
  ports.follower.ready = false;
  ports.run(1);
  EXPECT_EQ(ports.follower.demand.force, Vec3(Vec3::Zero())) << "a fault ends that, too";
}

TEST(Coupling, TheLadderWaitsForStatesThatAreSentSeldom) {
  const Ladder ladder(false, 20);
  EXPECT_EQ(ladder.phases[310], PortPhase::kEngaged);
  EXPECT_EQ(ladder.phases[311], PortPhase::kLost) << "three periods of 20 ms, and 250 ms";
}

TEST(Coupling, TheLadderForgetsALongGapAfterTenSeconds) {
  Ports ports = far_apart(0);
  ASSERT_TRUE(ports.engage());
  ports.cut_there = true;
  ports.run(60);
  ports.cut_there = false;
  ports.run(11'000);
  ports.cut_there = true;
  ports.run(271);
  EXPECT_EQ(phase(ports.follower), PortPhase::kLost) << "lately: that gap is forgotten";
}

TEST(Coupling, AStateBeforeTheLastStageRampsTheForceInAgain) {
  PortSetup leader = port_of(PortRole::kLeader);
  PortSetup follower = port_of(PortRole::kFollower);
  leader.path = [](double t) { return Vec3(t < 0.5 ? 0 : 0.01, 0, 0); };
  follower.path = [](double) { return Vec3(Vec3::Zero()); };
  for (auto* config : {&leader.coupling, &follower.coupling}) config->spring.adapt_to_delay = false;
  Ports ports(leader, follower);
  ASSERT_TRUE(ports.engage());
  ports.run(1000);
  EXPECT_NEAR(ports.follower.demand.force.x(), 4, 1e-9);
  ports.cut_there = true;
  ports.run(200);
  EXPECT_EQ(ports.follower.demand.force.x(), 0);
  ports.cut_there = false;
  ports.run(1);
  EXPECT_EQ(ports.follower.demand.force.x(), 0);
  ports.run(150);
  EXPECT_NEAR(ports.follower.demand.force.x(), 2, 1e-9);
  ports.run(150);
  EXPECT_NEAR(ports.follower.demand.force.x(), 4, 1e-9);
}

TEST(Coupling, AfterALossOfEitherOrBothWaysOnlyAnActEngages) {
  for (int ways = 1; ways <= 3; ++ways) {
    for (const int one_way : {0, 50, 300}) {
      for (const int cut : {300, 700, 3000}) {
        Ports ports = far_apart(one_way);
        ports.run(2 * one_way);
        ASSERT_TRUE(ports.engage());
        ports.cut_there = (ways & 1) != 0;
        ports.cut_back = (ways & 2) != 0;
        ports.run(cut);
        ports.cut_there = ports.cut_back = false;
        const std::string when = std::to_string(ways) + ", " + std::to_string(one_way) + ", " + std::to_string(cut);
        ports.run(2 * one_way + 2);
        expect_no_engagement(ports, 4 * one_way + 1000, when);
        expect_coupled(ports, when);
        EXPECT_TRUE(ports.engage()) << when;
        EXPECT_GE(ports.least_account(), kRounding) << when;
      }
    }
  }
}

TEST(Coupling, AnEndThatHearsALostPeerIsCoupledWithoutForce) {
  for (const bool cut_there : {false, true}) {
    for (const int one_way : {0, 50}) {
      Ports ports = far_apart(one_way);
      ports.run(2 * one_way);
      ASSERT_TRUE(ports.engage());
      (cut_there ? ports.cut_there : ports.cut_back) = true;
      ports.run(400 + 2 * one_way);
      const Port& deaf = cut_there ? ports.follower : ports.leader;
      const Port& hearing = cut_there ? ports.leader : ports.follower;
      EXPECT_EQ(deaf.coupling->phase(), PortPhase::kLost) << one_way;
      EXPECT_EQ(hearing.coupling->phase(), PortPhase::kCoupled) << one_way;
      EXPECT_EQ(hearing.demand.force.norm(), 0) << one_way;
    }
  }
}

TEST(Coupling, AnActFromBeforeTheLossThatComesAfterItEngagesNobody) {
  // The forward link fails, and the leader disengages and requests engagement again. The link returns after the
  // follower has declared the peer lost, before the leader knows: the return delay is 250 ms.
  for (int again = 1; again < 250; again += 9) {
    Ports ports(port_of(PortRole::kLeader), port_of(PortRole::kFollower), {.delay = 5, .seed = 1},
                {.delay = 250, .seed = 2});
    ports.run(300);
    ASSERT_TRUE(ports.engage());
    ports.run(300);
    ports.cut_there = true;
    ports.run(again);
    ports.leader.coupling->disengage();
    ASSERT_TRUE(ports.leader.coupling->engage());
    ports.run(300 - again % 20);
    const bool lost = phase(ports.follower) == PortPhase::kLost;
    ports.cut_there = false;
    if (!lost) continue;
    bool engaged = false;
    ports.run(1500, [&](int) { engaged = engaged || phase(ports.follower) == PortPhase::kEngaged; });
    EXPECT_FALSE(engaged) << again;
    expect_coupled(ports, std::to_string(again));
  }
}

TEST(Coupling, AFaultAfterTheLossDoesNotMakeThePeerKnowOfIt) {
  Played follower(coupling_of(PortRole::kFollower));
  follower.step();
  follower.receive(follower.state(PortPhase::kCoupled));
  follower.step();
  const PortState then = follower.state(PortPhase::kEngaged, 1);
  follower.receive(then);
  follower.step();
  ASSERT_TRUE(follower.port.live());
  for (int n = 0; n < 300; ++n) follower.step();
  ASSERT_EQ(follower.port.phase(), PortPhase::kLost);
  follower.step(Vec3::Zero(), 0, false);
  for (int n = 0; n < 20; ++n) {
    PortState act = follower.state(PortPhase::kEngaged, 2);
    act.answers = then.answers;  // issued before the loss
    follower.receive(act);
    follower.step();
    EXPECT_EQ(follower.port.phase(), PortPhase::kAlone);
  }
  follower.receive(follower.state(PortPhase::kCoupled, 2));
  follower.step();
  EXPECT_EQ(follower.port.phase(), PortPhase::kCoupled) << "the leader knows";
}

TEST(Coupling, AnAnswerToAFormerActOrToAFormerLeaderIsNone) {
  Ports ports = far_apart(50);
  ports.run(200);
  ASSERT_TRUE(ports.engage());
  ports.leader.coupling->disengage();
  ASSERT_TRUE(ports.leader.coupling->engage());
  for (int n = 0; n < 100; ++n) {
    ports.run(1);
    EXPECT_FALSE(ports.leader.coupling->live()) << n << ": the follower has not heard of the second act";
  }
  ports.run(2);
  EXPECT_TRUE(ports.leader.coupling->live());

  auto config = coupling_of(PortRole::kLeader);
  config.spring.epoch = 2;
  Played leader(config);
  leader.step();
  leader.receive(leader.state(PortPhase::kCoupled));
  leader.step();
  ASSERT_TRUE(leader.port.engage());
  leader.step();
  PortState old = leader.state(PortPhase::kEngaged, 1);
  old.answers_epoch = 1;
  leader.receive(old);
  leader.step();
  EXPECT_FALSE(leader.port.live());
}

TEST(Coupling, OldStatesThatComeLateOrTwiceEngageNobody) {
  Ports ports = far_apart(3);
  std::vector<PortState> there;
  std::vector<PortState> back;
  const auto record = [&](int) {
    there.push_back(ports.told_there);
    back.push_back(ports.told_back);
  };
  ports.run(50, record);
  ASSERT_TRUE(ports.leader.coupling->engage());
  ports.run(300, record);
  ports.leader.coupling->disengage();
  ports.run(20, record);
  const auto replay = [&] {
    bool engaged = false;
    for (std::size_t n = 0; n < there.size(); ++n) {
      for (const PortState& state : {there[n], there[there.size() - 1 - n]}) ports.there.send(ports.now, state);
      for (const PortState& state : {back[n], back[back.size() - 1 - n]}) ports.back.send(ports.now, state);
      ports.run(1, [&](int) {
        engaged = engaged || phase(ports.follower) == PortPhase::kEngaged || phase(ports.leader) == PortPhase::kEngaged;
      });
    }
    return engaged;
  };
  EXPECT_FALSE(replay());
  expect_coupled(ports, "replayed");
  EXPECT_EQ(ports.leader.coupling->refused() + ports.follower.coupling->refused(), 0U) << "late is not wrong";
  ports.leader.begin(2);
  EXPECT_FALSE(replay()) << "the leader is new";
  ports.follower.begin(2);
  EXPECT_FALSE(replay()) << "both are new";
  ports.run(50);
  EXPECT_TRUE(ports.engage());
}

TEST(Coupling, OnePeerThatStartsAnewDisengagesTheOther) {
  for (const bool leads : {true, false}) {
    for (const int one_way : {0, 30}) {
      Ports ports = far_apart(one_way);
      ports.run(200);
      ASSERT_TRUE(ports.engage());
      ports.run(500);
      (leads ? ports.leader : ports.follower).begin(2);
      ports.run(2 * one_way + 2);
      expect_no_engagement(ports, 1000, leads ? "leader" : "follower");
      expect_coupled(ports, leads ? "leader" : "follower");
      EXPECT_TRUE(ports.engage());
      EXPECT_EQ(ports.told_there.engagement, leads ? 1U : 2U);
    }
  }
}

TEST(Coupling, AnActThatWasMadeForAFormerFollowerDoesNotEngageTheNewOne) {
  for (int later = 0; later < 60; ++later) {
    Ports ports = far_apart(30);
    ports.run(200);
    ASSERT_TRUE(ports.leader.coupling->engage());
    ports.run(later);
    ports.follower.begin(2);
    bool live = false;
    ports.run(1000, [&](int) { live = live || ports.follower.coupling->live(); });
    EXPECT_FALSE(live) << later;
    expect_coupled(ports, std::to_string(later));
  }
}

}  // namespace
}  // namespace tendon::coupling_loss_test
