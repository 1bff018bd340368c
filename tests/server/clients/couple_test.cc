// SPDX-License-Identifier: Apache-2.0
#include "server/clients/couple.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/base/rotation.h"
#include "tests/server/clients/place.h"
#include "tests/support/wire.h"

// Two servers with coupled devices, their haptic loops, and clients, in virtual time.

namespace tendon::couple_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

const Hello kViewer{.role = Role::kObserver, .name = "viewer", .features = {std::string(kFeatureTeleoperation)}};

class Coupled : public Places {
 protected:
  void start(const std::vector<std::string>& leader = {}, const std::vector<std::string>& follower = {},
             const std::string& handles = "") {
    follower_ = place(shipped(handles + "follower.toml", follower), ++epoch_);
    leader_ = place(shipped(handles + "leader.toml", leader), ++epoch_);
  }
  void start_engaged() {
    start();
    run(seconds(2));
    expect_phase(PortPhase::kEngaged);
  }

  std::uint64_t epoch_ = 0;
};

TEST_F(Coupled, AFollowerGoesWhereTheHandOfAnotherServerGoes) {
  start();
  run(milliseconds(900));
  expect_phase(PortPhase::kCoupled);
  const Vec3 rest = follower_->position;
  run(milliseconds(300));
  expect_phase(PortPhase::kEngaged);
  run(seconds(1));
  const Vec3 from = leader_->position;
  const Vec3 before = follower_->position;
  run(milliseconds(400));
  const Vec3 moved = leader_->position - from;
  EXPECT_GT(moved.norm(), 5e-3);
  EXPECT_LT((follower_->position - before - moved).norm(), 0.15 * moved.norm());
  EXPECT_GT((before - rest).norm(), 1e-3);
}

TEST_F(Coupled, EachMethodMovesTheFollowerAndNoAccountFallsBelowZero) {
  delay_ = milliseconds(10);
  jitter_ms_ = 5;
  loss_ = 0.05;
  for (const CouplingMethod method : kCouplingMethods) {
    const std::string name(to_string(method));
    std::vector<std::string> settings = {"teleoperation.method=" + name, "teleoperation.max_delay_ms=500"};
    if (method == CouplingMethod::kRate) {
      for (const char* const key : {"dead_zone_mm=3", "gain_per_s=4", "max_speed_mm_per_s=50"}) {
        settings.push_back(std::string("teleoperation.rate.") + key);
      }
    }
    start(settings, settings);
    run(seconds(1));
    const Vec3 before = follower_->position;
    double most = 0;
    run(seconds(3), [&] { most = std::max(most, (follower_->position - before).norm()); });
    EXPECT_EQ(leader_->phase(), PortPhase::kEngaged) << name;
    EXPECT_EQ(follower_->phase(), PortPhase::kEngaged) << name;
    EXPECT_GT(most, 5e-3) << name;
    expect_sound();
    leader_.reset();
    follower_.reset();
  }
}

TEST_F(Coupled, ACutNetworkIsLostAndOnlyAnActCouplesAgain) {
  start_engaged();
  cut_ = true;
  run(milliseconds(400));
  expect_phase(PortPhase::kLost);
  EXPECT_EQ(leader_->newest().sent.velocity, Vec3(0, 0, 0));
  run(milliseconds(600));
  cut_ = false;
  run(seconds(3));
  expect_phase(PortPhase::kCoupled);
  leader_->mail().orders.try_push({HapticOrder::Kind::kEngage});
  run(milliseconds(100));
  EXPECT_EQ(follower_->phase(), PortPhase::kEngaged);
  expect_sound();
}

/// The number identifies a sealed session.
TEST_F(Coupled, AnEndWhoseAddressChangesStaysEngaged) {
  const Key key = Ratchet(std::uint64_t{5}).next();
  follower_ = place(shipped("follower.toml"), ++epoch_, key);
  leader_ = place(shipped("leader.toml"), ++epoch_, key);
  run(seconds(2));
  ASSERT_EQ(follower_->phase(), PortPhase::kEngaged);
  leader_->end.self = parse_address("127.0.0.1:50123");
  bool left = false;
  run(seconds(2), [&] { left = left || follower_->phase() != PortPhase::kEngaged; });
  EXPECT_FALSE(left);
  EXPECT_EQ(leader_->phase(), PortPhase::kEngaged);
  EXPECT_EQ(follower_->server->network().stats().roamed, 1U);
  const Vec3 from = follower_->position;
  run(milliseconds(500));
  EXPECT_GT((follower_->position - from).norm(), 2e-3) << "it goes on following";
}

TEST_F(Coupled, AStylusTurnsAndGripsAsTheOneOfAnotherServer) {
  delay_ = milliseconds(10);
  jitter_ms_ = 5;
  loss_ = 0.02;
  start({}, {}, "stylus_");
  run(seconds(3));
  ASSERT_EQ(follower_->phase(), PortPhase::kEngaged);
  double turned = 0;
  double apart = 0;
  double gripped = 0;
  double grips_apart = 0;
  const Quat led_from = leader_->handle.turn->hand.orientation;
  const Quat from = follower_->handle.turn->hand.orientation;
  const double open_from = follower_->handle.grip->hand.opening;
  run(seconds(3), [&] {
    const Vec3 led = turn_between(led_from, leader_->handle.turn->hand.orientation);
    const Vec3 followed = turn_between(from, follower_->handle.turn->hand.orientation);
    turned = std::max(turned, followed.norm());
    apart = std::max(apart, (led - followed).norm());
    gripped = std::max(gripped, std::abs(follower_->handle.grip->hand.opening - open_from));
    grips_apart =
        std::max(grips_apart, std::abs(follower_->handle.grip->hand.opening - leader_->handle.grip->hand.opening));
  });
  EXPECT_GT(turned, 0.3) << "rad";
  EXPECT_LT(apart, 0.5 * turned) << "it is late";
  EXPECT_GT(gripped, 0.1) << "rad";
  EXPECT_LT(grips_apart, 0.5 * gripped);
  EXPECT_GT(leader_->newest().sent.grip->given, 0);
  expect_sound();
}

TEST_F(Coupled, APortWhoseHandleIsNotCoupledTellsNoTurnAndNoGrip) {
  start_engaged();
  EXPECT_FALSE(leader_->newest().sent.turn || leader_->newest().sent.grip);
}

TEST_F(Coupled, AServerThatComesBackWithALowerEpochIsHeard) {
  epoch_ = 10;
  start_engaged();
  follower_ = place(shipped("follower.toml"), 3);
  run(seconds(5));
  expect_phase(PortPhase::kCoupled);
}

/// The state is in the mailbox when the loop learns of the new peer.
TEST_F(Coupled, AStateOfTheEndBeforeIsNotTakenForOneOfTheNew) {
  Place follower(wire_, shipped("follower.toml"), 1, now_);
  PortState state;
  state.epoch = 9;
  state.sequence = 1;
  const auto taken = [&](std::uint32_t peer) {
    ++state.sequence;
    follower.mail().port_in[0].put({state, now_, peer});
    follower.step(now_ += milliseconds(1));
    return follower.newest().peer.has_value();
  };
  EXPECT_TRUE(taken(0));
  follower.mail().orders.try_push({.kind = HapticOrder::Kind::kRenew, .source = 1});
  EXPECT_FALSE(taken(0));
  EXPECT_TRUE(taken(1));
}

TEST_F(Coupled, ScenesThatDoNotFitAreNamedByTheirFirstKey) {
  start({"teleoperation.coupling.stiffness_n_per_m=300"});
  run(seconds(2));
  EXPECT_EQ(leader_->phase(), PortPhase::kAlone);
  EXPECT_TRUE(leader_->said("coupling.stiffness_n_per_m: 300 in your scene, 1000 in the scene of the other server"));
  EXPECT_EQ(std::count_if(leader_->notices.begin(), leader_->notices.end(),
                          [](const auto& said) { return said.find("in your scene") != std::string::npos; }),
            1)
      << "once";
}

TEST_F(Coupled, AnObserverThatNamesTheFeatureIsToldBothEnds) {
  delay_ = milliseconds(10);
  start({"teleoperation.map.position_scale=0.5"}, {"teleoperation.map.position_scale=0.5"});
  Viewer at_leader(wire_, "127.0.0.1:4000", leader_->end.self, kViewer, now_);
  Viewer at_follower(wire_, "127.0.0.1:4001", follower_->end.self, kViewer, now_);
  clients_ = {&at_leader, &at_follower};
  std::map<std::uint64_t, Vec3> leads;
  std::map<std::uint64_t, Vec3> follows;
  run(seconds(3), [&] {
    leads[leader_->newest().sent.sequence] = leader_->newest().sent.position;
    follows[follower_->newest().sent.sequence] = follower_->newest().sent.position;
  });
  ASSERT_GT(at_leader.own.size(), 100U);
  ASSERT_GT(at_leader.peers.size(), 100U);
  ASSERT_GT(at_follower.own.size(), 100U);
  ASSERT_GT(at_follower.peers.size(), 100U);
  EXPECT_EQ(at_leader.own.back().port.phase, PortPhase::kEngaged);
  const auto same = [](const std::vector<Viewer::Seen>& seen, const std::map<std::uint64_t, Vec3>& told) {
    return std::ranges::all_of(seen, [&](const Viewer::Seen& one) {
      return told.contains(one.port.sequence) && one.port.position == told.at(one.port.sequence);
    });
  };
  EXPECT_TRUE(same(at_leader.own, leads));
  EXPECT_TRUE(same(at_leader.peers, follows));
  EXPECT_TRUE(same(at_follower.own, follows));
  EXPECT_TRUE(same(at_follower.peers, leads));
  EXPECT_EQ(at_leader.own.back().port.position_scale, 0.5) << "an observer has seen no Couple";
  EXPECT_EQ(at_leader.own.back().port.force_scale, 1);
  EXPECT_EQ(at_leader.peers.back().port.position_scale, 0) << "a follower's end has no scales";
  EXPECT_EQ(at_follower.own.back().port.position_scale, 0);
  EXPECT_EQ(at_follower.peers.back().port.position_scale, 0.5);
}

TEST_F(Coupled, AnObserverIsToldTheEndsAtMost50TimesASecond) {
  start();
  Viewer viewer(wire_, "127.0.0.1:4000", leader_->end.self, kViewer, now_);
  clients_ = {&viewer};
  run(seconds(2));
  const auto told = [&](std::vector<Viewer::Seen>& seen) {
    seen.clear();
    run(seconds(1));
    for (std::size_t i = 1; i < seen.size(); ++i) EXPECT_GE(seen[i].at - seen[i - 1].at, milliseconds(20));
    return seen.size();
  };
  EXPECT_GE(told(viewer.own), 49U);
  EXPECT_LE(told(viewer.peers), 51U);
  ASSERT_TRUE(viewer.session()->request(SetStateRate{.hz = 10, .device = 0}));
  run(milliseconds(100));
  EXPECT_NEAR(static_cast<double>(told(viewer.own)), 10, 1);
  EXPECT_NEAR(static_cast<double>(told(viewer.peers)), 10, 1) << "as often as states";
}

TEST_F(Coupled, APeerThatIsGoneIsToldNoMore) {
  start();
  Viewer early(wire_, "127.0.0.1:4001", leader_->end.self, kViewer, now_);
  clients_ = {&early};
  run(seconds(2));
  ASSERT_FALSE(early.peers.empty());
  cut_ = true;
  run(milliseconds(100));
  cut_ = false;
  follower_.reset();
  Viewer late(wire_, "127.0.0.1:4000", leader_->end.self, kViewer, now_);
  clients_ = {&early, &late};
  early.peers.clear();
  run(milliseconds(500));
  EXPECT_GT(late.own.size(), 20U);
  EXPECT_TRUE(late.peers.empty()) << "what it told before this observer came is old";
  EXPECT_LE(early.peers.size(), 1U) << "and was told";
}

TEST_F(Coupled, OtherObserversAndDevicesAreToldOfNoEnds) {
  follower_ = place(shipped("follower.toml", {"teleoperation="}), ++epoch_);
  leader_ = place(shipped("leader.toml"), ++epoch_);
  Viewer silent(wire_, "127.0.0.1:4000", leader_->end.self, {.role = Role::kObserver, .name = "silent", .features = {}},
                now_);
  Viewer named(wire_, "127.0.0.1:4001", follower_->end.self, kViewer, now_);
  clients_ = {&silent, &named};
  run(seconds(1));
  EXPECT_GT(silent.states, 900U);
  EXPECT_EQ(silent.own.size() + silent.peers.size(), 0U) << "it names no feature";
  EXPECT_GT(named.states, 900U);
  EXPECT_EQ(named.own.size() + named.peers.size(), 0U) << "its device has no coupling";
}

TEST(FirstDifference, NamesEachKeyThatTwoEndsMustHaveAlike) {
  const Couple mine = couple_of(*shipped("leader.toml").loop.control.coupling);
  Couple theirs = mine;
  EXPECT_EQ(first_difference(theirs, mine), "role: leader in both scenes, expected a leader and a follower");
  theirs.role = PortRole::kFollower;
  EXPECT_EQ(first_difference(theirs, mine), "");
  const struct {
    const char* key;
    const char* in_yours;
    const char* in_the_other;
    void (*change)(Couple&);
  } cases[] = {
      {"method", "position-force", "position-position", [](Couple& c) { c.method = CouplingMethod::kPositionForce; }},
      {"map.position_scale", "0.5", "1", [](Couple& c) { c.position_scale = 0.5; }},
      {"map.force_scale", "2", "1", [](Couple& c) { c.force_scale = 2; }},
      {"coupling.stiffness_n_per_m", "1001", "1000", [](Couple& c) { c.stiffness = 1001; }},
      {"coupling.damping_n_s_per_m", "5", "4", [](Couple& c) { c.damping = 5; }},
      {"coupling.mutual_damping_n_s_per_m", "1", "0", [](Couple& c) { c.mutual_damping = 1; }},
      {"turn.stiffness_nm_per_rad", "1", "0", [](Couple& c) { c.turn_stiffness = 1; }},
      {"turn.damping_nm_s_per_rad", "2", "0", [](Couple& c) { c.turn_damping = 2; }},
      {"grip.stiffness_n_per_m", "300", "0", [](Couple& c) { c.grip_stiffness = 300; }},
      {"grip.damping_n_s_per_m", "3", "0", [](Couple& c) { c.grip_damping = 3; }},
      {"map.rotation_deg", "[0, 0, 180]", "[0, 0, 0]",
       [](Couple& c) { c.rotation = {.w = 0, .x = 0, .y = 0, .z = 1}; }},
      {"map.axes", "xz", "xyz", [](Couple& c) { c.axes = 5; }},
      {"coupling.adapt_to_delay", "false", "true", [](Couple& c) { c.adapt_to_delay = false; }},
      {"map.absolute", "true", "false", [](Couple& c) { c.absolute = true; }},
      {"purse", "false", "true", [](Couple& c) { c.purse = false; }},
      {"coupling.drift_rate_per_s", "5", "0", [](Couple& c) { c.drift_rate = 5; }},
      {"rate", "true", "false", [](Couple& c) { c.rate = RateControl{}; }}};
  const auto words = [](const std::string& key, const std::string& in_yours, const std::string& in_the_other) {
    return key + ": " + in_yours + " in your scene, " + in_the_other + " in the scene of the other server";
  };
  for (const auto& [key, in_yours, in_the_other, change] : cases) {
    Couple other = theirs;
    change(other);
    EXPECT_EQ(first_difference(other, mine), words(key, in_yours, in_the_other));
  }
  Couple by_rate = mine;
  by_rate.rate = RateControl{.dead_zone = 3e-3, .gain = 4, .max_speed = 0.05};
  const std::pair<std::string, double RateControl::*> rates[] = {
      {words("rate.dead_zone_mm", "6", "3"), &RateControl::dead_zone},
      {words("rate.gain_per_s", "8", "4"), &RateControl::gain},
      {words("rate.max_speed_mm_per_s", "100", "50"), &RateControl::max_speed}};
  for (const auto& [said, value] : rates) {
    Couple other = by_rate;
    other.role = PortRole::kFollower;
    EXPECT_EQ(first_difference(other, by_rate), "");
    *other.rate.*value *= 2;
    EXPECT_EQ(first_difference(other, by_rate), said);
  }
  Couple rounded = theirs;
  rounded.stiffness *= 1 + 1e-12;
  EXPECT_EQ(first_difference(rounded, mine), "") << "what writing it twice does";
}

}  // namespace
}  // namespace tendon::couple_test
