// SPDX-License-Identifier: Apache-2.0
// Tests VRPN programs with the logic of tendon-bridge vrpn and the loops of the server, in virtual time.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "clients/bridge/vrpn/vrpn_peer.h"
#include "tests/clients/bridge/vrpn/program.h"
#include "tests/clients/bridge/world.h"

namespace tendon::bridge::vrpn::vrpn_world_test {
namespace {

class Old {
 public:
  Old(World& world, BridgedDevice& bridged, Station& station, BridgedDevice::Program number)
      : world_(world),
        bridged_(bridged),
        station_(station),
        number_(number),
        peer(std::span(&station, 1), now()),
        asker(number, "client " + std::to_string(number), 0) {
    says(Program().hello());
    says(Program::description(Program::kSender, kSenderDescription, station.name));
    says(Program::all_types());
    says(Program::message(40001, kUdpDescription, Buffer(10)));
  }
  Moment now() const { return {world_.now, world_.now.time_since_epoch()}; }
  void says(const Buffer& bytes) { peer.take_stream(now(), bytes); }

  void turn() {
    if (const auto sentence = station_.learn(bridged_)) sentences.push_back(*sentence);
    if (bridged_.state() && bridged_.states() != seen_) {
      seen_ = bridged_.states();
      peer.report(now(), 0, *bridged_.state(), bridged_.link().smoothed_round_trip);
    }
    peer.end_of_batch(now());
    asker.turn(world_.now, now().since_1970, bridged_, station_, peer);
    if (const auto sentence = asker.next_sentence()) sentences.push_back(*sentence);
    take(peer.stream());
    peer.sent(peer.stream().size());
    for (const Buffer& datagram : peer.datagrams()) take(datagram);
    peer.datagrams().clear();
  }
  void leaves() { bridged_.release(number_); }
  bool said(const std::string& words) const {
    return std::ranges::any_of(sentences, [&](const auto& one) { return one.find(words) != std::string::npos; });
  }

 private:
  void take(Bytes bytes) {
    for (const Said& one : reader_.take(bytes, std::exchange(first_, false))) {
      if (one.type == "vrpn_Tracker Pos_Quat") pose = one;
      if (one.type == "vrpn_ForceDevice Force") force = Vec3(one.number(0), one.number(8), one.number(16));
      if (one.type == "vrpn_Base text_message") {
        texts.emplace_back(reinterpret_cast<const char*>(one.payload.data()) + 8);
      }
    }
  }

  World& world_;
  BridgedDevice& bridged_;
  Station& station_;
  BridgedDevice::Program number_;
  std::uint64_t seen_ = 0;
  Reader reader_;
  bool first_ = true;

 public:
  Peer peer;
  Asker asker;
  std::vector<std::string> sentences;
  std::vector<std::string> texts;
  std::optional<Said> pose;
  Vec3 force = Vec3::Zero();
};

const std::vector<std::string> kStill = {"limiter.kind=\"none\"", "device.hand.motion.amplitude_mm=0"};

Buffer constant(const Vec3& force) { return Program::draw(ForceField{.force = force, .radius = 1}); }

struct Stage {
  explicit Stage(const std::string& scene = "demo_parts.toml", const std::vector<std::string>& settings = {},
                 int delay_ms = 0)
      : world(scene, settings, delay_ms) {}

  void run(int milliseconds) {
    world.run(milliseconds, [&] { old.turn(); });
  }
  void push(int milliseconds, const Vec3& force) {
    world.run(milliseconds, [&] {
      old.says(constant(force));
      old.turn();
    });
  }

  World world;
  BridgedDevice& bridged = world.add_bridged();
  Station station{.name = "Phantom0"};
  Old old{world, bridged, station, 1};
};

TEST(VrpnWorld, AForceAlongEachAxisPushesThatWayAndTheHandsMotionIsSeenThere) {
  // The x axis of the device points to the user, y points to the right, and z points up.
  for (const std::string axes : {"", "right=y up=z user=x", "right=-y up=z user=-x"}) {
    for (int axis = 0; axis < 3; ++axis) {
      Stage stage("left.toml", kStill);
      World& world = stage.world;
      Old& old = stage.old;
      if (!axes.empty()) {
        world.handle.operator_from_device = quaternion_of(operator_from_device(axes));
        world.open_server();
      }
      stage.run(100);
      const Vec3 there = 0.8 * Vec3::Unit(axis);
      const Vec3 before(old.pose.value().number(8), old.pose->number(16), old.pose->number(24));
      stage.push(1000, there);
      const Mat3 turn = axes.empty() ? Mat3(Mat3::Identity()) : operator_from_device(axes);
      EXPECT_TRUE(world.step.applied.isApprox(turn.transpose() * there, 1e-6))
          << axes << ": " << world.step.applied.transpose();
      EXPECT_TRUE(old.force.isApprox(there, 1e-6)) << "as the program is told";
      const Vec3 moved = Vec3(old.pose->number(8), old.pose->number(16), old.pose->number(24)) - before;
      EXPECT_GT(moved[axis], 1e-3) << axes << ": the hand gives way: " << moved.transpose();
      EXPECT_LT((moved - moved[axis] * Vec3::Unit(axis)).norm(), 0.1 * moved[axis]);
    }
  }
}

TEST(VrpnWorld, AChangeOfAFieldIsInTheNextDatagram) {
  Stage stage;
  stage.push(200, Vec3(0, 1e-3, 0));
  double asked = 1e-3;
  for (int i = 0; i < 100; ++i) {
    stage.world.run(1, [&] {
      EXPECT_NEAR(stage.world.step.wanted.y(), asked, 1e-9) << "the step after what was said";
      asked += 1e-3;
      stage.old.says(constant(Vec3(0, static_cast<float>(asked), 0)));
      stage.old.turn();
    });
    asked = static_cast<double>(static_cast<float>(asked));
  }
}

TEST(VrpnWorld, AProgramThatSendsWithoutAPauseMakesNoFloodOfForces) {
  Stage stage;
  stage.run(200);
  std::uint64_t before = 0;
  double asked = 0;
  for (int i = 0; i < 400; ++i) {
    if (i == 300) before = stage.bridged.forces();
    stage.world.run(1, [&] {
      if (i > 300) {
        EXPECT_NEAR(stage.world.step.wanted.y(), asked, 1.1e-3) << "the newest of them with the next state";
      }
      for (int k = 0; k < 60; ++k) {
        asked = static_cast<double>(static_cast<float>(1e-3 * i + 1e-5 * k));
        stage.old.says(constant(Vec3(0, asked, 0)));
        stage.old.turn();
        for (int turns = 0; turns < 4; ++turns) stage.bridged.turn(stage.world.now);
      }
    });
  }
  EXPECT_LE(stage.bridged.forces() - before, 250U) << "one for each state, and one more";
}

TEST(VrpnWorld, EveryStateIsOnePoseAndNoForceIsAskedForByOneThatWatches) {
  Stage stage;
  stage.run(100);
  const std::uint64_t before = stage.old.peer.counts().reports;
  stage.run(1000);
  EXPECT_EQ(stage.old.peer.counts().reports - before, 1000U);
  EXPECT_EQ(stage.bridged.owner(), 0U);
  EXPECT_FALSE(stage.bridged.pushes());
}

TEST(VrpnWorld, AFrozenProgramIsNotFeltAfterItsStaleTimeAndTheStages) {
  Stage stage("left.toml", kStill);
  stage.push(400, Vec3(0, 1, 0));
  ASSERT_NEAR(stage.world.step.applied.y(), 1, 1e-6);
  int zero_after = 0;  // ms
  for (double last = 1; last != 0 && zero_after < 700; ++zero_after) {
    stage.run(1);
    EXPECT_LT(std::abs(stage.world.step.applied.y() - last), 0.05) << "no jump";
    last = stage.world.step.applied.y();
  }
  EXPECT_GT(zero_after, 100) << "ten gaps, at least 100 ms";
  EXPECT_LE(zero_after, 100 + 300);
  EXPECT_TRUE(stage.old.said("is silent and has not stopped its force"));
  stage.push(300, Vec3(0, 1, 0));
  EXPECT_TRUE(stage.old.said("sends effects again"));
  EXPECT_NEAR(stage.world.step.applied.y(), 1, 1e-6);
}

TEST(VrpnWorld, AFieldThatIsSentOnceStaysAndItIsSaid) {
  Stage stage("left.toml", kStill);
  stage.run(100);
  stage.old.says(constant(Vec3(0, 1, 0)));
  stage.run(5000);
  EXPECT_NEAR(stage.world.step.applied.y(), 1, 1e-6);
  EXPECT_TRUE(stage.old.said("stays until it disconnects"));
  EXPECT_EQ(stage.bridged.owner(), 1U);
}

TEST(VrpnWorld, AFieldThatEndsIsZeroAndLetsTheDeviceGo) {
  Stage stage("left.toml", kStill);
  stage.push(400, Vec3(0, 1, 0));
  stage.old.says(constant(Vec3::Zero()));
  stage.run(100);
  EXPECT_NEAR(stage.world.step.wanted.y(), 0, 1e-12);
  EXPECT_EQ(stage.bridged.owner(), 1U);
  stage.run(1000);
  EXPECT_EQ(stage.bridged.owner(), 0U);
  EXPECT_FALSE(stage.bridged.pushes());
}

TEST(VrpnWorld, ASecondProgramIsToldAndTakesOverWhenTheFirstLeaves) {
  Stage stage("left.toml", kStill);
  stage.push(400, Vec3(0, 1, 0));
  Old other(stage.world, stage.bridged, stage.station, 2);
  other.says(constant(Vec3(0, -1, 0)));
  stage.world.run(1000, [&] {
    stage.old.says(constant(Vec3(0, 1, 0)));
    stage.old.turn();
    other.turn();
  });
  EXPECT_NEAR(stage.world.step.applied.y(), 1, 1e-6);
  ASSERT_EQ(other.texts.size(), 1U);
  EXPECT_NE(other.texts[0].find("not rendered: another program"), std::string::npos) << other.texts[0];
  EXPECT_TRUE(other.pose) << "it looks on";
  stage.old.leaves();
  stage.world.run(1000, [&] { other.turn(); });
  EXPECT_NEAR(stage.world.step.applied.y(), -1, 1e-6);
  ASSERT_EQ(other.texts.size(), 2U);
  EXPECT_NE(other.texts[1].find("is rendered now"), std::string::npos);
}

/// Returns the energy (J) with 20 ms of delay in each direction and the force of a wall for each pose.
double given_out(bool limited, bool as_plane) {
  // The same hand, without the parts of the limiter, which cannot be used if there is no limiter.
  Stage stage(limited ? "demo_parts.toml" : "left.toml",
              limited ? std::vector<std::string>{} : std::vector<std::string>{"limiter.kind=\"none\""}, 20);
  World& world = stage.world;
  Old& old = stage.old;
  if (as_plane) old.says(Program::draw(Plane{.normal = -Vec3::UnitX(), .spring = 1}));
  double pressed = 0;
  world.run(8000, [&] {
    if (old.pose && !as_plane) {
      old.says(constant(Vec3(std::min(-1e-9, -1000 * old.pose->number(8)), 0, 0)));
    }
    old.turn();
    pressed = std::max(pressed, std::abs(world.step.applied.x()));
  });
  EXPECT_GT(pressed, 1) << "it is felt";
  return -world.least_energy;
}

TEST(VrpnWorld, AWall20MsAwayGivesOutNothingWithTheLimiterAndOver1JWithout) {
  EXPECT_LE(given_out(true, false), 1e-9);
  EXPECT_LE(given_out(true, true), 1e-9);
  EXPECT_GT(given_out(false, false), 1);
}

}  // namespace
}  // namespace tendon::bridge::vrpn::vrpn_world_test
