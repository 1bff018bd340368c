// SPDX-License-Identifier: Apache-2.0
#include "server/guests/couple.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "core/base/rotation.h"
#include "devices/simulated/simulated_device.h"
#include "server/haptic_loop.h"
#include "server/network_loop.h"
#include "server/scene/scene.h"
#include "tests/support/dice.h"
#include "tests/support/wire.h"

// Two servers whose devices are coupled, each with its haptic loop, on virtual time; and clients that ask for it.

namespace tendon {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

std::string text_of(const std::string& scene) {
  std::ifstream file(std::filesystem::path(TENDON_SOURCE_DIR) / "deploy" / "scenes" / scene);
  return {std::istreambuf_iterator<char>(file), {}};
}

Scene scene_of(const std::string& name, const std::vector<std::string>& settings = {}) {
  return parse_scene(text_of(name), name, ".", settings);
}

/// A server with one coupled device.
struct Place {
  Place(Wire& wire, const Scene& the_scene, std::uint64_t epoch, LocalTime now)
      : scene(the_scene), end(wire, scene.network.listen), device(scene.simulated()) {
    scene.loop.control.coupling->spring.epoch = epoch;
    haptic = std::make_unique<HapticLoop>(scene.loop, device, *mail);
    NetworkLoop::Config config;
    config.secret.fill(std::byte{7});
    config.first_connection_id = static_cast<std::uint32_t>(epoch);
    config.devices = {{.name = scene.name, .model = "device", .loop_hz = 1000, .channels = {{.name = "main"}}}};
    config.couplings = {couple_of(*scene.loop.control.coupling)};
    if (scene.teleoperation->dial) {
      config.dials.push_back(
          {0,
           {.server = *scene.teleoperation->dial, .name = scene.name, .seed = epoch, .couple = *config.couplings[0]}});
    }
    network = std::make_unique<NetworkLoop>(config, end, std::vector<Mailboxes*>{mail.get()});
    network->turn(now);
  }

  void step(LocalTime now) {
    haptic->step(now);
    network->turn(now);
    for (const PortRecord* port = mail->ports.front(); port != nullptr; port = mail->ports.front()) {
      newest = *port;
      mail->ports.pop();
    }
    while (const StepRecord* record = mail->steps.front()) {
      least_energy = std::min(least_energy, record->energy);
      if (record->grip() != nullptr) least_energy = std::min(least_energy, record->grip()->energy);
      if (record->handle) handle = *record->handle;
      position = record->hand.position;
      force = record->applied;
      mail->steps.pop();
    }
    for (const auto& said : network->take_notices()) notices.push_back(said.text);
  }
  PortPhase phase() const { return newest.sent.phase; }
  bool said(const std::string& words) const {
    return std::any_of(notices.begin(), notices.end(),
                       [&](const std::string& one) { return one.find(words) != std::string::npos; });
  }

  Scene scene;
  End end;
  SimulatedDevice device;
  std::unique_ptr<Mailboxes> mail =
      std::make_unique<Mailboxes>(Mailboxes::Capacities{.steps = 16, .ports = 16, .flight = 2, .datagrams = 1});
  std::unique_ptr<HapticLoop> haptic;
  std::unique_ptr<NetworkLoop> network;
  PortRecord newest;
  double least_energy = 0;  // J
  Vec3 position = Vec3::Zero();
  Vec3 force = Vec3::Zero();
  HandleStep handle;
  std::vector<std::string> notices;
};

class Coupled : public testing::Test {
 protected:
  void place(const std::vector<std::string>& leader = {}, const std::vector<std::string>& follower = {},
             const std::string& handles = "") {
    follower_ = std::make_unique<Place>(wire_, scene_of(handles + "follower.toml", follower), ++epoch_, now_);
    leader_ = std::make_unique<Place>(wire_, scene_of(handles + "leader.toml", leader), ++epoch_, now_);
  }

  struct Under {
    LocalTime at;
    Datagram datagram;
  };

  /// `each` is called in each millisecond.
  void run(Duration length, const std::function<void()>& each = {}) {
    for (const LocalTime until = now_ + length; now_ < until; now_ += milliseconds(1)) {
      for (Place* one : {leader_.get(), follower_.get()}) {
        if (one != nullptr) one->step(now_);
      }
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
  Dice dice_{7};
  std::uint64_t epoch_ = 0;
  std::unique_ptr<Place> leader_;
  std::unique_ptr<Place> follower_;
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

TEST_F(Coupled, NeitherAccountFallsBelowZeroOnABadNetwork) {
  delay_ = milliseconds(20);
  jitter_ms_ = 10;
  loss_ = 0.05;
  place();
  run(seconds(6));
  EXPECT_EQ(leader_->phase(), PortPhase::kEngaged);
  EXPECT_GE(leader_->least_energy, -1e-9);
  EXPECT_GE(follower_->least_energy, -1e-9);
  EXPECT_GT(leader_->newest.sent.given, 0);
  EXPECT_LT(leader_->newest.stiffness, 1000) << "2 B over the round trip";
}

TEST_F(Coupled, ACutNetworkIsLostAndOnlyAnActCouplesAgain) {
  place();
  run(seconds(2));
  ASSERT_EQ(follower_->phase(), PortPhase::kEngaged);
  cut_ = true;
  run(milliseconds(400));
  EXPECT_EQ(leader_->phase(), PortPhase::kLost);
  EXPECT_EQ(follower_->phase(), PortPhase::kLost);
  EXPECT_EQ(leader_->newest.sent.velocity, Vec3(0, 0, 0));
  run(milliseconds(600));
  cut_ = false;
  run(seconds(3));
  EXPECT_EQ(leader_->phase(), PortPhase::kCoupled) << "nobody has pressed";
  EXPECT_EQ(follower_->phase(), PortPhase::kCoupled);
  leader_->mail->orders.try_push({HapticOrder::Kind::kEngage});
  run(milliseconds(100));
  EXPECT_EQ(follower_->phase(), PortPhase::kEngaged);
  EXPECT_GE(leader_->least_energy, -1e-9);
  EXPECT_GE(follower_->least_energy, -1e-9);
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
  EXPECT_GT(leader_->newest.sent.grip->given, 0);
  EXPECT_GE(leader_->least_energy, -1e-9);
  EXPECT_GE(follower_->least_energy, -1e-9);
}

TEST_F(Coupled, APortWhoseHandleIsNotCoupledTellsNoTurnAndNoGrip) {
  place();
  run(seconds(2));
  ASSERT_EQ(leader_->phase(), PortPhase::kEngaged);
  EXPECT_FALSE(leader_->newest.sent.turn || leader_->newest.sent.grip);
}

TEST_F(Coupled, ScenesThatDoNotFitAreNamedByTheirFirstKey) {
  place({"teleoperation.coupling.stiffness_n_per_m=300"});
  run(seconds(2));
  EXPECT_EQ(leader_->phase(), PortPhase::kAlone);
  EXPECT_TRUE(leader_->said("coupling.stiffness_n_per_m: yours 300, mine 1000"));
  EXPECT_EQ(std::count_if(leader_->notices.begin(), leader_->notices.end(),
                          [](const auto& said) { return said.find("yours") != std::string::npos; }),
            1)
      << "once";
}

TEST(FirstDifference, NamesEachKeyThatTwoEndsMustHaveAlike) {
  const Couple mine = couple_of(*scene_of("leader.toml").loop.control.coupling);
  Couple theirs = mine;
  EXPECT_EQ(first_difference(theirs, mine), "role: yours and mine leader, expected one of each");
  theirs.role = PortRole::kFollower;
  EXPECT_EQ(first_difference(theirs, mine), "");
  const std::pair<const char*, void (*)(Couple&)> cases[] = {
      {"method: yours position-force, mine position-position",
       [](Couple& c) { c.method = CouplingMethod::kPositionForce; }},
      {"map.position_scale: yours 0.5, mine 1", [](Couple& c) { c.position_scale = 0.5; }},
      {"map.force_scale: yours 2, mine 1", [](Couple& c) { c.force_scale = 2; }},
      {"coupling.stiffness_n_per_m: yours 1001, mine 1000", [](Couple& c) { c.stiffness = 1001; }},
      {"coupling.damping_n_s_per_m: yours 5, mine 4", [](Couple& c) { c.damping = 5; }},
      {"coupling.mutual_damping_n_s_per_m: yours 1, mine 0", [](Couple& c) { c.mutual_damping = 1; }},
      {"turn.stiffness_nm_per_rad: yours 1, mine 0", [](Couple& c) { c.turn_stiffness = 1; }},
      {"turn.damping_nm_s_per_rad: yours 2, mine 0", [](Couple& c) { c.turn_damping = 2; }},
      {"grip.stiffness_n_per_m: yours 300, mine 0", [](Couple& c) { c.grip_stiffness = 300; }},
      {"grip.damping_n_s_per_m: yours 3, mine 0", [](Couple& c) { c.grip_damping = 3; }},
      {"map.rotation_deg: yours [0, 0, 180], mine [0, 0, 0]",
       [](Couple& c) { c.rotation = {.w = 0, .x = 0, .y = 0, .z = 1}; }},
      {"map.axes: yours xz, mine xyz", [](Couple& c) { c.axes = 5; }},
      {"coupling.adapt_to_delay: yours false, mine true", [](Couple& c) { c.adapt_to_delay = false; }},
      {"purse: yours false, mine true", [](Couple& c) { c.purse = false; }}};
  for (const auto& [words, change] : cases) {
    Couple other = theirs;
    change(other);
    EXPECT_EQ(first_difference(other, mine), words);
  }
  Couple rounded = theirs;
  rounded.stiffness *= 1 + 1e-12;
  EXPECT_EQ(first_difference(rounded, mine), "") << "what writing it twice does";
}

}  // namespace
}  // namespace tendon
