// SPDX-License-Identifier: Apache-2.0
#include "server/guests/couple.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/rotation.h"
#include "protocol/handshake.h"
#include "protocol/session.h"
#include "tests/server/guests/place.h"
#include "tests/support/dice.h"
#include "tests/support/wire.h"

// Two servers with coupled devices and haptic loops in virtual time, and clients that send requests.

namespace tendon::couple_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

class Viewer {
 public:
  Viewer(Wire& wire, const std::string& address, const Address& server, bool names_it, LocalTime now)
      : end(wire, parse_address(address)),
        server_(server),
        handshake_({.hello = {.role = Role::kObserver,
                              .name = "viewer",
                              .features = names_it ? std::vector{std::string(kFeatureTeleoperation)}
                                                   : std::vector<std::string>()}},
                   now) {}

  void turn(LocalTime now) {
    std::array<std::byte, kMaxDatagram> buffer;
    Address from;
    while (const std::size_t size = end.receive(from, buffer)) {
      const auto datagram = std::span(buffer).first(size);
      session ? void(session->receive(now, datagram)) : void(handshake_.receive(now, datagram));
      if (session || !handshake_.outcome()) continue;
      const auto& accepted = std::get<ClientHandshake::Accepted>(*handshake_.outcome());
      session.emplace(Session::Config{.connection_id = accepted.connection_id}, now);
    }
    while (const auto event = session ? session->next_event() : nullptr) {
      if (const auto* port = std::get_if<Session::PortArrived>(&*event)) {
        (port->port.of_peer ? peers : own).push_back({now, port->port});
      }
      states += std::holds_alternative<Session::StateArrived>(*event) ? 1 : 0;
    }
    while (const std::size_t size =
               session ? session->next_datagram(now, buffer) : handshake_.next_datagram(now, buffer)) {
      end.send(server_, std::span(buffer).first(size));
    }
  }

  End end;
  std::optional<Session> session;
  struct Seen {
    LocalTime at;
    PortFrame port;
  };
  std::vector<Seen> own;
  std::vector<Seen> peers;
  std::size_t states = 0;

 private:
  Address server_;
  ClientHandshake handshake_;
};

class Coupled : public ::testing::Test {
 protected:
  void place(const std::vector<std::string>& leader = {}, const std::vector<std::string>& follower = {},
             const std::string& handles = "") {
    follower_ = std::make_unique<Place>(wire_, scene_of(handles + "follower.toml", follower), ++epoch_, now_);
    const std::string name = handles + "leader.toml";
    std::string text = text_of(name);
    const std::string clutch = "[teleoperation.clutch]\nbutton = 1\n";
    if (without_clutch_) text.erase(text.find(clutch), clutch.size());
    leader_ = std::make_unique<Place>(wire_, parse_scene(text, name, ".", leader), ++epoch_, now_);
  }

  struct Under {
    LocalTime at;
    Datagram datagram;
  };

  void run(Duration length, const std::function<void()>& each = {}) {
    for (const LocalTime until = now_ + length; now_ < until; now_ += milliseconds(1)) {
      for (Place* one : {leader_.get(), follower_.get()}) {
        if (one != nullptr) one->step(now_);
      }
      for (Viewer* one : viewers_) one->turn(now_);
      for (const std::size_t count = wire_.size(); count_ < count; ++count_) {
        if (cut_ || dice_.chance(loss_)) continue;
        under_way_.push_back({now_ + delay_ + dice_.milliseconds(0, jitter_ms_), wire_[count_]});
      }
      for (std::size_t i = 0; i < under_way_.size();) {
        if (under_way_[i].at > now_) {
          ++i;
          continue;
        }
        for (Place* one : {leader_.get(), follower_.get()}) {
          if (one != nullptr && one->end.self == under_way_[i].datagram.to) {
            one->end.inbox.push_back(under_way_[i].datagram);
          }
        }
        for (Viewer* one : viewers_) {
          if (one->end.self == under_way_[i].datagram.to) one->end.inbox.push_back(under_way_[i].datagram);
        }
        under_way_.erase(under_way_.begin() + static_cast<std::ptrdiff_t>(i));
      }
      if (each) each();
    }
  }

  Wire wire_;
  std::size_t count_ = 0;
  std::vector<Under> under_way_;
  LocalTime now_{seconds(1)};
  Duration delay_{};
  double jitter_ms_ = 0;
  double loss_ = 0;
  bool cut_ = false;
  bool without_clutch_ = false;  ///< leader only
  Dice dice_{7};
  std::uint64_t epoch_ = 0;
  std::unique_ptr<Place> leader_;
  std::unique_ptr<Place> follower_;
  std::vector<Viewer*> viewers_;
};

TEST_F(Coupled, AFollowerGoesWhereTheHandOfAnotherServerGoes) {
  place();
  run(milliseconds(900));
  EXPECT_EQ(leader_->phase(), PortPhase::kCoupled);
  EXPECT_EQ(follower_->phase(), PortPhase::kCoupled);
  const Vec3 rest = follower_->position;
  run(milliseconds(300));
  EXPECT_EQ(leader_->phase(), PortPhase::kEngaged) << "the hand has pressed its button";
  EXPECT_EQ(follower_->phase(), PortPhase::kEngaged);
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
    place(settings, settings);
    run(seconds(1));
    const Vec3 before = follower_->position;
    double most = 0;
    run(seconds(3), [&] { most = std::max(most, (follower_->position - before).norm()); });
    EXPECT_EQ(leader_->phase(), PortPhase::kEngaged) << name;
    EXPECT_EQ(follower_->phase(), PortPhase::kEngaged) << name;
    EXPECT_GT(most, 5e-3) << name;
    EXPECT_GE(leader_->least_energy, -1e-9) << name;
    EXPECT_GE(follower_->least_energy, -1e-9) << name;
    leader_.reset();
    follower_.reset();
  }
}

TEST_F(Coupled, ACutNetworkIsLostAndOnlyAnActCouplesAgain) {
  place();
  run(seconds(2));
  ASSERT_EQ(follower_->phase(), PortPhase::kEngaged);
  cut_ = true;
  run(milliseconds(400));
  EXPECT_EQ(leader_->phase(), PortPhase::kLost);
  EXPECT_EQ(follower_->phase(), PortPhase::kLost);
  EXPECT_EQ(leader_->newest().sent.velocity, Vec3(0, 0, 0));
  run(milliseconds(600));
  cut_ = false;
  run(seconds(3));
  EXPECT_EQ(leader_->phase(), PortPhase::kCoupled) << "nobody has pressed";
  EXPECT_EQ(follower_->phase(), PortPhase::kCoupled);
  leader_->mail().orders.try_push({HapticOrder::Kind::kEngage});
  run(milliseconds(100));
  EXPECT_EQ(follower_->phase(), PortPhase::kEngaged);
  EXPECT_GE(leader_->least_energy, -1e-9);
  EXPECT_GE(follower_->least_energy, -1e-9);
}

TEST_F(Coupled, BothEndsTakeNewScalesWhileTheClutchIsHeld) {
  place();
  run(seconds(2));
  ASSERT_EQ(follower_->phase(), PortPhase::kEngaged);
  const HapticOrder order{.kind = HapticOrder::Kind::kSetScale, .scales = {0.25, 2}};
  leader_->mail().orders.try_push(order);
  run(milliseconds(50));
  EXPECT_EQ(follower_->newest().sent.position_scale, 0) << "it is engaged: nothing changes";
  run(milliseconds(4200));  // the clutch is held by the hand from 6 s on
  ASSERT_EQ(leader_->phase(), PortPhase::kClutched);
  leader_->mail().orders.try_push(order);
  run(milliseconds(10));
  EXPECT_EQ(follower_->newest().sent.position_scale, 0.25);
  EXPECT_EQ(follower_->newest().sent.force_scale, 2);
  run(milliseconds(900));
  ASSERT_EQ(leader_->phase(), PortPhase::kEngaged);
  const Vec3 from = leader_->position;
  const Vec3 before = follower_->position;
  run(milliseconds(500));
  const Vec3 moved = 0.25 * (leader_->position - from);
  EXPECT_GT(moved.norm(), 1e-3);
  EXPECT_LT((follower_->position - before - moved).norm(), 0.3 * moved.norm());
  EXPECT_GE(leader_->least_energy, -1e-9);
  EXPECT_GE(follower_->least_energy, -1e-9);
}

/// The leader's hand oscillates about a point 15 mm from the follower and passes its position.
TEST_F(Coupled, AnAbsoluteMapEngagesWhereTheTwoMeet) {
  const std::vector<std::string> absolute = {"teleoperation.map.absolute=true"};
  std::vector<std::string> of_leader = absolute;
  of_leader.push_back("teleoperation.engage.within_mm=8");
  without_clutch_ = true;
  place(of_leader, absolute);
  bool aligned = false;
  run(seconds(4), [&] { aligned = aligned || leader_->phase() == PortPhase::kAligning; });
  EXPECT_TRUE(aligned);
  EXPECT_EQ(leader_->phase(), PortPhase::kEngaged);
  EXPECT_EQ(follower_->phase(), PortPhase::kEngaged);
  EXPECT_LT((leader_->position - follower_->position).norm(), 6e-3) << "the places are each other's";
}

/// A sealed session is identified by its number, so the coupling is not affected.
TEST_F(Coupled, AnEndWhoseAddressChangesStaysEngaged) {
  const Key key = Ratchet(std::uint64_t{5}).next();
  follower_ = std::make_unique<Place>(wire_, scene_of("follower.toml"), ++epoch_, now_, true, key);
  leader_ = std::make_unique<Place>(wire_, scene_of("leader.toml"), ++epoch_, now_, true, key);
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

TEST_F(Coupled, AServerThatWasKilledIsFoundAgainAndWaitsForAnAct) {
  place();
  run(seconds(2));
  ASSERT_EQ(leader_->phase(), PortPhase::kEngaged);
  follower_.reset();
  run(milliseconds(500));
  EXPECT_EQ(leader_->phase(), PortPhase::kLost);
  follower_ = std::make_unique<Place>(wire_, scene_of("follower.toml"), ++epoch_, now_);
  run(seconds(5));
  EXPECT_EQ(leader_->phase(), PortPhase::kCoupled);
  EXPECT_EQ(follower_->phase(), PortPhase::kCoupled);
}

TEST_F(Coupled, AStylusTurnsAndGripsAsTheOneOfAnotherServer) {
  delay_ = milliseconds(10);
  jitter_ms_ = 5;
  loss_ = 0.02;
  place({}, {}, "stylus_");
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
  EXPECT_GE(leader_->least_energy, -1e-9);
  EXPECT_GE(follower_->least_energy, -1e-9);
}

TEST_F(Coupled, APortWhoseHandleIsNotCoupledTellsNoTurnAndNoGrip) {
  place();
  run(seconds(2));
  ASSERT_EQ(leader_->phase(), PortPhase::kEngaged);
  EXPECT_FALSE(leader_->newest().sent.turn || leader_->newest().sent.grip);
}

/// The clock of the machine was set back. The epoch is therefore smaller than the one that the leader knows.
TEST_F(Coupled, AServerThatComesBackWithALowerEpochIsHeard) {
  epoch_ = 10;
  place();
  run(seconds(2));
  ASSERT_EQ(leader_->phase(), PortPhase::kEngaged);
  follower_ = std::make_unique<Place>(wire_, scene_of("follower.toml"), 3, now_);
  run(seconds(5));
  EXPECT_EQ(leader_->phase(), PortPhase::kCoupled);
  EXPECT_EQ(follower_->phase(), PortPhase::kCoupled);
}

/// The state is in the mailbox when the loop learns of the new peer.
TEST_F(Coupled, AStateOfTheEndBeforeIsNotTakenForOneOfTheNew) {
  Place follower(wire_, scene_of("follower.toml"), 1, now_);
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
  place({"teleoperation.coupling.stiffness_n_per_m=300"});
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
  place({"teleoperation.map.position_scale=0.5"}, {"teleoperation.map.position_scale=0.5"});
  Viewer at_leader(wire_, "127.0.0.1:4000", leader_->end.self, true, now_);
  Viewer at_follower(wire_, "127.0.0.1:4001", follower_->end.self, true, now_);
  viewers_ = {&at_leader, &at_follower};
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
  place();
  Viewer viewer(wire_, "127.0.0.1:4000", leader_->end.self, true, now_);
  viewers_ = {&viewer};
  run(seconds(2));
  const auto told = [&](std::vector<Viewer::Seen>& seen) {
    seen.clear();
    run(seconds(1));
    for (std::size_t i = 1; i < seen.size(); ++i) EXPECT_GE(seen[i].at - seen[i - 1].at, milliseconds(20));
    return seen.size();
  };
  EXPECT_GE(told(viewer.own), 49U);
  EXPECT_LE(told(viewer.peers), 51U);
  ASSERT_TRUE(viewer.session->request(SetStateRate{.hz = 10, .device = 0}));
  run(milliseconds(100));
  EXPECT_NEAR(static_cast<double>(told(viewer.own)), 10, 1);
  EXPECT_NEAR(static_cast<double>(told(viewer.peers)), 10, 1) << "as often as states";
}

TEST_F(Coupled, APeerThatIsGoneIsToldNoMore) {
  place();
  Viewer early(wire_, "127.0.0.1:4001", leader_->end.self, true, now_);
  viewers_ = {&early};
  run(seconds(2));
  ASSERT_FALSE(early.peers.empty());
  cut_ = true;
  run(milliseconds(100));
  cut_ = false;
  follower_.reset();
  Viewer late(wire_, "127.0.0.1:4000", leader_->end.self, true, now_);
  viewers_ = {&early, &late};
  early.peers.clear();
  run(milliseconds(500));
  EXPECT_GT(late.own.size(), 20U);
  EXPECT_TRUE(late.peers.empty()) << "what it told before this observer came is old";
  EXPECT_LE(early.peers.size(), 1U) << "and was told";
}

TEST_F(Coupled, OtherObserversAndDevicesAreToldOfNoEnds) {
  follower_ = std::make_unique<Place>(wire_, scene_of("follower.toml"), ++epoch_, now_, false);
  leader_ = std::make_unique<Place>(wire_, scene_of("leader.toml"), ++epoch_, now_);
  Viewer silent(wire_, "127.0.0.1:4000", leader_->end.self, false, now_);
  Viewer named(wire_, "127.0.0.1:4001", follower_->end.self, true, now_);
  viewers_ = {&silent, &named};
  run(seconds(1));
  EXPECT_GT(silent.states, 900U);
  EXPECT_EQ(silent.own.size() + silent.peers.size(), 0U) << "it names no feature";
  EXPECT_GT(named.states, 900U);
  EXPECT_EQ(named.own.size() + named.peers.size(), 0U) << "its device has no coupling";
}

TEST(FirstDifference, NamesEachKeyThatTwoEndsMustHaveAlike) {
  const Couple mine = couple_of(*scene_of("leader.toml").loop.control.coupling);
  Couple theirs = mine;
  EXPECT_EQ(first_difference(theirs, mine), "role: leader in both scenes, expected a leader and a follower");
  theirs.role = PortRole::kFollower;
  EXPECT_EQ(first_difference(theirs, mine), "");
  const std::pair<const char*, void (*)(Couple&)> cases[] = {
      {"method: position-force in your scene, position-position in the scene of the other server",
       [](Couple& c) { c.method = CouplingMethod::kPositionForce; }},
      {"map.position_scale: 0.5 in your scene, 1 in the scene of the other server",
       [](Couple& c) { c.position_scale = 0.5; }},
      {"map.force_scale: 2 in your scene, 1 in the scene of the other server", [](Couple& c) { c.force_scale = 2; }},
      {"coupling.stiffness_n_per_m: 1001 in your scene, 1000 in the scene of the other server",
       [](Couple& c) { c.stiffness = 1001; }},
      {"coupling.damping_n_s_per_m: 5 in your scene, 4 in the scene of the other server",
       [](Couple& c) { c.damping = 5; }},
      {"coupling.mutual_damping_n_s_per_m: 1 in your scene, 0 in the scene of the other server",
       [](Couple& c) { c.mutual_damping = 1; }},
      {"turn.stiffness_nm_per_rad: 1 in your scene, 0 in the scene of the other server",
       [](Couple& c) { c.turn_stiffness = 1; }},
      {"turn.damping_nm_s_per_rad: 2 in your scene, 0 in the scene of the other server",
       [](Couple& c) { c.turn_damping = 2; }},
      {"grip.stiffness_n_per_m: 300 in your scene, 0 in the scene of the other server",
       [](Couple& c) { c.grip_stiffness = 300; }},
      {"grip.damping_n_s_per_m: 3 in your scene, 0 in the scene of the other server",
       [](Couple& c) { c.grip_damping = 3; }},
      {"map.rotation_deg: [0, 0, 180] in your scene, [0, 0, 0] in the scene of the other server",
       [](Couple& c) { c.rotation = {.w = 0, .x = 0, .y = 0, .z = 1}; }},
      {"map.axes: xz in your scene, xyz in the scene of the other server", [](Couple& c) { c.axes = 5; }},
      {"coupling.adapt_to_delay: false in your scene, true in the scene of the other server",
       [](Couple& c) { c.adapt_to_delay = false; }},
      {"map.absolute: true in your scene, false in the scene of the other server",
       [](Couple& c) { c.absolute = true; }},
      {"purse: false in your scene, true in the scene of the other server", [](Couple& c) { c.purse = false; }},
      {"coupling.drift_rate_per_s: 5 in your scene, 0 in the scene of the other server",
       [](Couple& c) { c.drift_rate = 5; }},
      {"rate: true in your scene, false in the scene of the other server", [](Couple& c) { c.rate = RateControl{}; }}};
  for (const auto& [words, change] : cases) {
    Couple other = theirs;
    change(other);
    EXPECT_EQ(first_difference(other, mine), words);
  }
  Couple by_rate = mine;
  by_rate.rate = RateControl{.dead_zone = 3e-3, .gain = 4, .max_speed = 0.05};
  const std::pair<const char*, double RateControl::*> rates[] = {
      {"rate.dead_zone_mm: 6 in your scene, 3 in the scene of the other server", &RateControl::dead_zone},
      {"rate.gain_per_s: 8 in your scene, 4 in the scene of the other server", &RateControl::gain},
      {"rate.max_speed_mm_per_s: 100 in your scene, 50 in the scene of the other server", &RateControl::max_speed}};
  for (const auto& [words, value] : rates) {
    Couple other = by_rate;
    other.role = PortRole::kFollower;
    EXPECT_EQ(first_difference(other, by_rate), "");
    *other.rate.*value *= 2;
    EXPECT_EQ(first_difference(other, by_rate), words);
  }
  Couple rounded = theirs;
  rounded.stiffness *= 1 + 1e-12;
  EXPECT_EQ(first_difference(rounded, mine), "") << "what writing it twice does";
}

}  // namespace
}  // namespace tendon::couple_test
