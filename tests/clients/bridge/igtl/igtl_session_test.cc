// SPDX-License-Identifier: Apache-2.0
// Tests OpenIGTLink programs with the logic of tendon-bridge igtl and the loops of the server, in virtual time.
#include "clients/bridge/igtl/igtl_session.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "tests/clients/bridge/igtl/program.h"
#include "tests/clients/bridge/world.h"

namespace tendon::bridge::igtl::igtl_session_test {
namespace {

using std::chrono::milliseconds;

Station::Config of_frame(const std::string& name, double stiffness = 200) {
  Frame frame = *find_frame(name);
  frame.per_metre = 1000;
  return {.name = "right", .target = "", .frame = frame, .stiffness = stiffness};
}

class Program {
 public:
  Program(World& world, BridgedDevice& bridged, std::span<const Station> stations, BridgedDevice::Program number)
      : world_(world), bridged_(bridged), stations_(stations), number_(number), session(number, stations) {}

  void says(const Buffer& bytes) { session.take(world_.now, bytes); }
  void turn(Bytes news) {
    const Moment now{world_.now, world_.now.time_since_epoch()};
    session.send(news);
    session.ask(now, 0, bridged_);
    if (session.take_status_request()) session.send(stations_[0].greeting());
    while (const auto sentence = session.next_sentence()) sentences.push_back(*sentence);
    for (Said& one : reader_.take(session.stream())) {
      ++heard;
      if (one.type == "TRANSFORM" && one.name == "right") pose = one;
      if (one.type == "SENSOR") sensor = one;
      if (one.type == "TRANSFORM" && one.name == "rightForce") force = one.position();
      if (one.type == "STATUS") statuses.push_back(std::to_string(one.whole(0, 2)) + " " + one.text(30));
      if (one.type == "STRING") states.push_back(one.text(4));
    }
    session.sent(session.stream().size());
  }
  void leaves() { bridged_.release(number_); }
  bool said(const std::string& words) const {
    return std::ranges::any_of(sentences, [&](const auto& one) { return one.find(words) != std::string::npos; });
  }

 private:
  World& world_;
  BridgedDevice& bridged_;
  std::span<const Station> stations_;
  BridgedDevice::Program number_;
  Reader reader_;

 public:
  Session session;
  std::vector<std::string> sentences;
  std::vector<std::string> statuses;
  std::vector<std::string> states;
  std::optional<Said> pose;
  std::optional<Said> sensor;
  Vec3 force = Vec3::Zero();
  int heard = 0;
};

const std::vector<std::string> kStill = {"limiter.kind=\"none\"", "device.hand.motion.amplitude_mm=0"};

struct Stage {
  explicit Stage(const std::vector<std::string>& settings = kStill,
                 const Station::Config& config = of_frame("operator"), const std::string& scene = "left.toml",
                 int delay_ms = 0, BridgedDevice::Config of_bridged = {})
      : world(scene, settings, delay_ms),
        bridged(world.add_bridged(std::move(of_bridged))),
        stations{Station(config)} {}

  void run(int ms, const std::function<void()>& each = nullptr) {
    world.run(ms, [&] {
      if (each) each();
      const Bytes news = stations[0].turn({world.now, world.now.time_since_epoch()}, bridged);
      program.turn(news);
      for (Program* other : others) other->turn(news);
    });
  }
  /// Sends `message` every `gap_ms`.
  void stream(int ms, const Buffer& message, int gap_ms = 16) {
    int i = 0;
    run(ms, [&] {
      if (i++ % gap_ms == 0) program.says(message);
    });
  }

  World world;
  BridgedDevice& bridged;
  std::vector<Station> stations;
  Program program{world, bridged, stations, 1};
  std::vector<Program*> others;
};

TEST(IgtlWorld, ACommandAlongEachAxisPushesThatWayAndIsSeenThere) {
  for (const std::string frame : {"operator", "ras"}) {
    for (const std::string axes : {"", "right=y up=z user=x", "right=-y up=z user=-x"}) {
      for (int axis = 0; axis < 3; ++axis) {
        Stage stage(kStill, of_frame(frame));
        if (!axes.empty()) {
          stage.world.handle.operator_from_device = quaternion_of(operator_from_device(axes));
          stage.world.open_server();
        }
        stage.run(100);
        const Vec3 before = stage.program.pose.value().position();
        const Vec3 there = 0.8 * Vec3::Unit(axis);
        stage.stream(1000, sensor("rightCommand", there));
        const Mat3 from_operator = find_frame(frame)->from_operator;
        const Mat3 turn = from_operator * (axes.empty() ? Mat3(Mat3::Identity()) : operator_from_device(axes));
        EXPECT_TRUE(stage.world.step.applied.isApprox(turn.transpose() * there, 1e-6))
            << frame << axes << ": " << stage.world.step.applied.transpose();
        EXPECT_TRUE(stage.program.force.isApprox(there, 1e-6)) << "1 mm per N";
        EXPECT_EQ(read_force(stage.program.sensor.value().body).value_or(Vec3::Zero()).cast<float>(),
                  stage.program.force.cast<float>());
        const Vec3 moved = stage.program.pose->position() - before;
        EXPECT_GT(moved[axis], 1) << "mm: the hand gives way: " << moved.transpose();
        EXPECT_LT((moved - moved[axis] * Vec3::Unit(axis)).norm(), 0.1 * moved[axis]);
      }
    }
  }
}

TEST(IgtlWorld, TheSpringPullsToTheTargetAndFollowsTheHandInEachStep) {
  Stage stage(kStill, of_frame("ras", 100));
  stage.run(100);
  stage.program.says(transform("rightTarget", Vec3(0, 0, 20)));  // superior
  int followed = 0;
  stage.run(2000, [&] {
    if (stage.world.step.mode != Mode::kActive) return;
    const Vec3 target(0, 0.02, 0);  // up
    const Vec3 spring = 100 * (target - stage.world.step.hand.position);
    followed += (stage.world.step.wanted - spring).norm() < 0.01 ? 1 : 0;
  });
  EXPECT_GT(followed, 1800) << "in nearly every step, though it was sent once";
  EXPECT_TRUE(stage.world.step.stiffness.isApprox(100 * Mat3::Identity(), 1e-3)) << stage.world.step.stiffness;
  EXPECT_GT(stage.program.pose->position().z(), 3) << "mm; a hand of 300 N/m holds it at a quarter of the way";
  EXPECT_EQ(stage.bridged.owner(), 1U) << "it stays until it disconnects";
}

TEST(IgtlWorld, AMovedTargetIsFeltWithinTwoSteps) {
  Stage stage(kStill, of_frame("operator", 100));
  stage.stream(500, transform("rightTarget", Vec3::Zero()));
  const double before = stage.world.step.wanted.y();
  stage.program.says(transform("rightTarget", Vec3(0, 10, 0)));
  int later = 0;
  while (stage.world.step.wanted.y() < before + 0.9 && later < 50) {
    stage.run(1);
    ++later;
  }
  EXPECT_LE(later, 2) << "ms";
}

struct Fade {
  int ms = 0;
  double largest_step = 0;  ///< N/ms
};
Fade fade(Stage& stage) {
  Fade fade;
  for (double last = stage.world.step.applied.norm(); last != 0 && fade.ms < 2000; ++fade.ms) {
    stage.run(1);
    fade.largest_step = std::max(fade.largest_step, std::abs(stage.world.step.applied.norm() - last));
    last = stage.world.step.applied.norm();
  }
  return fade;
}

TEST(IgtlWorld, AProgramThatFreezesIsNotFeltAfterItsStaleTimeAndTheStages) {
  Stage targets(kStill, of_frame("operator", 100));
  targets.stream(800, transform("rightTarget", Vec3(0, 10, 0)));
  ASSERT_GT(targets.world.step.applied.norm(), 0.5);
  const Fade of_target = fade(targets);
  EXPECT_GT(of_target.ms, 100);
  EXPECT_LE(of_target.ms, 160 + 300) << "ten gaps of 16 ms";
  EXPECT_LT(of_target.largest_step, 0.05);
  EXPECT_TRUE(targets.program.said("has stopped sending rightTarget"));

  Stage commands;
  commands.stream(800, sensor("rightCommand", Vec3(0, 1, 0)));
  ASSERT_NEAR(commands.world.step.applied.y(), 1, 1e-6);
  const Fade of_command = fade(commands);
  EXPECT_GT(of_command.ms, 150);
  EXPECT_LE(of_command.ms, 200 + 300);
  EXPECT_LT(of_command.largest_step, 0.05);
}

TEST(IgtlWorld, AProgramThatLeavesFadesAndIsFeltAgainWhenItComesBack) {
  Stage stage;
  stage.stream(800, sensor("rightCommand", Vec3(0, 1, 0)));
  stage.program.leaves();
  stage.world.run(1, nullptr);
  Program back(stage.world, stage.bridged, stage.stations, 2);  // with the same names
  int zero_after = 0;
  for (; stage.world.step.applied.y() != 0 && zero_after < 1000; ++zero_after) stage.world.run(1);
  EXPECT_LE(zero_after, 300);
  stage.world.run(1000, [&] {
    back.says(sensor("rightCommand", Vec3(0, 1, 0)));
    back.turn({});
  });
  EXPECT_NEAR(stage.world.step.applied.y(), 1, 1e-6);
  EXPECT_EQ(stage.bridged.owner(), 2U);
}

TEST(IgtlWorld, ASecondProgramIsToldAndTakesOverWhenTheFirstIsSilent) {
  Stage stage;
  Program other(stage.world, stage.bridged, stage.stations, 2);
  stage.others.push_back(&other);
  stage.stream(500, sensor("rightCommand", Vec3(0, 1, 0)));
  stage.run(500, [&] {
    stage.program.says(sensor("rightCommand", Vec3(0, 1, 0)));
    other.says(sensor("rightCommand", Vec3(0, -1, 0)));
  });
  EXPECT_NEAR(stage.world.step.applied.y(), 1, 1e-6);
  EXPECT_EQ(other.statuses.back(), "5 your force is not rendered: another program controls the force of this device");
  EXPECT_TRUE(other.pose) << "it looks on";
  stage.run(3000, [&] { other.says(sensor("rightCommand", Vec3(0, -1, 0))); });
  EXPECT_NEAR(stage.world.step.applied.y(), -1, 1e-6);
  EXPECT_EQ(other.statuses.back(), "1 your force is rendered now");
}

TEST(IgtlWorld, AnObserverSendsNothingAndSaysSo) {
  Stage stage(kStill, of_frame("operator"), "left.toml", 0, {.observe = true});
  stage.stream(500, transform("rightTarget", Vec3(0, 10, 0)));
  EXPECT_EQ(stage.bridged.forces(), 0U);
  const auto& told = stage.program.statuses;
  EXPECT_EQ(std::ranges::count(told, "5 your force is not rendered: forces are disabled by --observe"), 1);
}

TEST(IgtlWorld, PosesComeAtTheirRateWithTheTimesOfTheirStates) {
  Stage stage;
  stage.run(200);
  const std::uint64_t before = stage.stations[0].reports();
  Duration latest{};
  stage.run(1000, [&] {
    EXPECT_GE(stage.program.pose->since_1970, latest);
    latest = stage.program.pose->since_1970;
  });
  EXPECT_NEAR(static_cast<double>(stage.stations[0].reports() - before), 60, 1);
  EXPECT_LE(stage.world.now.time_since_epoch() - latest, milliseconds(20));
  EXPECT_EQ(stage.bridged.owner(), 0U) << "it only watches";
}

TEST(IgtlWorld, TheStateIsToldOnChangeAndWhenAsked) {
  Stage stage;
  stage.run(500);
  EXPECT_EQ(stage.program.statuses.back(), "1 ready");
  const std::size_t told = stage.program.statuses.size();
  stage.run(500);
  EXPECT_EQ(stage.program.statuses.size(), told);
  stage.program.says(announced("GET_STATUS", "", 0));
  stage.run(1);
  EXPECT_EQ(stage.program.statuses.size(), told + 1);
  stage.stream(500, sensor("rightCommand", Vec3(0, 1, 0)));
  EXPECT_EQ(stage.program.states.back(), "force active; buttons none; limits none");
  stage.run(3000);
  EXPECT_EQ(stage.program.statuses.size(), told + 1) << "not when it gains or loses control";
  stage.world.kill_server();
  stage.run(3000);
  EXPECT_EQ(stage.program.statuses.back(), "7 no state from the Tendon server");
  stage.world.open_server();
  stage.run(3000);
  EXPECT_EQ(stage.program.statuses.back(), "1 ready");
}

TEST(IgtlSession, WhatIsNotForThisBridgeIsSkippedAndSaidOnce) {
  Stage stage;
  Buffer image = announced("IMAGE", "MR", 1'000'000);
  for (int i = 0; i < 3; ++i) {
    stage.program.says(image);
    for (int sent = 0; sent < 1'000'000; sent += 1000) stage.program.says(Buffer(1000, std::byte{7}));
    stage.program.says(transform("Tracker", Vec3(1, 2, 3)));
  }
  stage.program.says(transform("rightTarget", Vec3(1, 2, 3)));
  stage.run(1);
  EXPECT_EQ(stage.program.session.counts().ignored, 6U);
  EXPECT_EQ(stage.program.session.counts().used, 1U);
  EXPECT_EQ(stage.program.session.end(), "");
  EXPECT_TRUE(stage.program.said("its TRANSFORM Tracker is ignored; expected TRANSFORM rightTarget or SENSOR rightC"));
  EXPECT_EQ(stage.program.sentences.size(), 2U);
}

TEST(IgtlSession, WrongMessagesAreRefusedWithTheReasonAndLiesEndIt) {
  const auto after = [](const Buffer& bytes) {
    Stage stage;
    stage.program.says(bytes);
    stage.run(1);
    const Session& session = stage.program.session;
    EXPECT_EQ(session.counts().used, 0U);
    return (stage.program.sentences.empty() ? "" : stage.program.sentences[0]) + session.end();
  };
  Buffer wrong = transform("rightTarget", Vec3(1, 2, 3));
  wrong.back() ^= std::byte{1};
  EXPECT_EQ(after(wrong), "its TRANSFORM rightTarget is refused: wrong CRC");
  EXPECT_EQ(after(transform("rightTarget", Vec3(0, 0, 20'000))),
            "its TRANSFORM rightTarget is refused: expected a position within 10 m, in mm");
  Buffer pressure = sensor("rightCommand", Vec3(1, 2, 3));
  put(pressure, kHeaderSize + 2, std::uint64_t{0x0c} << 54U | std::uint64_t{1} << 50U);
  EXPECT_EQ(after(sealed(pressure)), "its SENSOR rightCommand is refused: expected three values, in N");
  Buffer newer = transform("rightTarget", Vec3(1, 2, 3));
  put(newer, 0, std::uint16_t{2});
  EXPECT_EQ(after(newer), "its TRANSFORM rightTarget is refused: header version 2; expected version 1");
  EXPECT_EQ(after(announced("IMAGE", "MR", std::uint64_t{1} << 63U)),
            "it announced a IMAGE MR of 9223372036854775808 bytes");
  EXPECT_EQ(after(Buffer(kHeaderSize, std::byte{'G'})), "it does not use OpenIGTLink");
  EXPECT_EQ(after(announced("TRANSFORM", "rightTarget", 5000)),
            "its TRANSFORM rightTarget is refused: 5000 bytes; expected at most 4096");
}

TEST(IgtlSession, AProgramThatDoesNotReadIsDroppedAfter64Kilobytes) {
  Stage stage;
  stage.run(100);
  Session session(7, stage.stations);
  std::size_t most = 0;
  stage.world.run(10'000, [&] {
    session.send(stage.stations[0].turn({stage.world.now, {}}, stage.bridged));
    if (session.end().empty()) most = std::max(most, session.stream().size());
  });
  EXPECT_EQ(session.end(), "it does not read its data");
  EXPECT_LE(most, Session::kMaxUnread);
}

TEST(IgtlSession, AFloodMakesNoFloodOfForcesAndItsNewestIsUsed) {
  Stage stage;
  stage.stream(300, sensor("rightCommand", Vec3(0, 1e-3, 0)));
  const std::uint64_t before = stage.bridged.forces();
  for (int i = 1; i <= 300; ++i) {
    stage.run(1, [&] {
      for (int k = 0; k < 100; ++k) stage.program.says(sensor("rightCommand", Vec3(0, 1e-3 * i + 1e-6 * k, 0)));
    });
  }
  stage.run(1);
  EXPECT_NEAR(stage.world.step.wanted.y(), 0.3 + 99e-6, 1e-9);
  EXPECT_LE(stage.bridged.forces() - before, 603U) << "one for each state, and one for each request";
}

TEST(IgtlSession, AHundredThousandMutatedMessagesAreReadOnlyIfWhole) {
  std::mt19937_64 random(64);
  const std::vector<Station> stations{Station(of_frame("operator"))};
  const std::vector<Buffer> originals = {transform("rightTarget", Vec3(1, 2, 3)), sensor("rightCommand", Vec3(1, 2, 3)),
                                         announced("GET_STATUS", "", 0), transform("Tracker", Vec3(1, 2, 3))};
  std::uint64_t used = 0, invalid = 0, ignored = 0, ended = 0;
  for (int i = 0; i < 100'000; ++i) {
    const Buffer& original = originals[random() % originals.size()];
    Buffer bytes = original;
    for (std::uint64_t changes = 1 + random() % 4; changes > 0; --changes) {
      const auto at = static_cast<std::ptrdiff_t>(random() % bytes.size());
      switch (random() % 4) {
        case 0:
          bytes.erase(bytes.begin() + at);
          break;
        case 1:
          bytes.insert(bytes.begin() + at, static_cast<std::byte>(random()));
          break;
        default:
          bytes[static_cast<std::size_t>(at)] ^= static_cast<std::byte>(1 + random() % 255);
      }
    }
    bytes.insert(bytes.end(), original.begin(), original.end());  // what follows a broken message
    Session session(1, stations);
    for (std::size_t at = 0; at < bytes.size();) {
      const std::size_t size = std::min<std::size_t>(1 + random() % 100, bytes.size() - at);
      session.take(LocalTime(std::chrono::seconds(i)), std::span(bytes).subspan(at, size));
      at += size;
    }
    used += session.counts().used;
    invalid += session.counts().invalid;
    ignored += session.counts().ignored;
    ended += session.end().empty() ? 0 : 1;
    // A message must only be used if its size, CRC and body have not changed.
    std::uint64_t whole = 0;
    for (auto at = bytes.begin(); at != bytes.end(); ++at) {
      at = std::search(at, bytes.end(), original.begin() + kSizeAt, original.end());
      if (at == bytes.end()) break;
      ++whole;
    }
    ASSERT_LE(session.counts().used, whole) << "message " << i;
  }
  EXPECT_GT(used, 10'000U);
  EXPECT_GT(invalid, 5'000U);
  EXPECT_GT(ignored, 10'000U);
  EXPECT_GT(ended, 10'000U);
  RecordProperty("used", static_cast<int>(used));
}

TEST(IgtlWorld, ATarget20MsAwayGivesOutNoEnergyWithTheLimiter) {
  Stage stage({}, of_frame("operator", 1000), "demo_parts.toml", 20);
  stage.stream(5000, transform("rightTarget", Vec3::Zero()));
  EXPECT_GE(stage.world.least_energy, -1e-9);
  EXPECT_GT(stage.world.step.wanted.norm(), 0);
}

}  // namespace
}  // namespace tendon::bridge::igtl::igtl_session_test
