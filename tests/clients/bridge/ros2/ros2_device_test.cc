// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/ros2/ros2_device.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <string>
#include <vector>

#include "tests/clients/bridge/world.h"

namespace tendon::bridge::ros2_device_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint64_t kWriter = 71;
constexpr std::uint64_t kOther = 72;
constexpr Duration kUnix = seconds(1'700'000'000);

std::vector<std::string> sentences_of(RosDevice& device) {
  std::vector<std::string> all;
  while (const auto sentence = device.next_sentence()) all.push_back(*sentence);
  return all;
}

bool has(const std::vector<std::string>& all, const std::string& words) {
  return std::ranges::any_of(all, [&](const auto& one) { return one.find(words) != std::string::npos; });
}

/// The y axis of REP 103 points left, which is −x of the simulated device (oriented like a Falcon).
RosWrench push(double left_n) { return {.header = {}, .force = {0, left_n, 0}, .torque = {0, 0.01, 0}}; }

RosInput input(std::uint64_t writer, const RosWrench& wrench, RosInput::Topic topic = RosInput::Topic::kWrenchCommand) {
  return {.topic = topic, .writer = writer, .called = "publisher " + std::to_string(writer), .wrench = wrench};
}

struct Stage {
  explicit Stage(const std::string& scene = "demo_parts.toml", RosDevice::Config config = {.name = "right"},
                 BridgedDevice::Config of_bridged = {}, int delay_ms = 0)
      : world(scene, {}, delay_ms),
        bridged(world.add_bridged(std::move(of_bridged))),
        device(bridged, std::move(config)) {
    world.handle.operator_from_device = Quat{};
    world.handle.buttons = {"stylus"};
    start_anew();
  }
  void start_anew() {
    world.kill_server();
    world.open_server();
  }
  void run(int ms, const std::function<void()>& program = nullptr) {
    world.run(ms, [&] {
      if (program) program();
      count(device.messages(world.now, kUnix));
    });
  }
  void count(const RosDevice::Messages& due) {
    poses += due.pose ? 1 : 0;
    joys += due.joy ? 1 : 0;
    if (due.pose) pose = *due.pose;
    if (due.wrench) wrench = *due.wrench;
    if (due.joy) joy = *due.joy;
  }
  void command(std::uint64_t writer, double left_n) { device.take(input(writer, push(left_n)), world.now); }

  World world;
  BridgedDevice& bridged;
  RosDevice device;
  int poses = 0;
  int joys = 0;
  RosPose pose;
  RosWrench wrench;
  RosJoy joy;
};

TEST(RosFreshness, IsThreeMedianGapsBetweenTwentyAndTwoHundredMilliseconds) {
  const auto after = [](std::vector<int> gaps_ms) {
    Freshness freshness;
    LocalTime now{};
    freshness.came(now);
    for (const int gap : gaps_ms) freshness.came(now += milliseconds(gap));
    return freshness.good_for();
  };
  EXPECT_EQ(after({}), milliseconds(200));
  EXPECT_EQ(after({1, 1}), milliseconds(200)) << "too few to tell";
  EXPECT_EQ(after({1, 1, 1}), milliseconds(20));
  EXPECT_EQ(after({30, 30, 30}), milliseconds(90));
  EXPECT_EQ(after({30, 2000, 30, 30, 1}), milliseconds(90)) << "a pause and a burst are not the rate";
  EXPECT_EQ(after({500, 500, 500}), milliseconds(200));
  EXPECT_EQ(after({500, 500, 500, 10, 10, 10, 10, 10, 10, 10, 10}), milliseconds(30)) << "the last eight";
}

TEST(RosDevice, EveryStateIsAPoseAndJoyIsFiftyASecond) {
  Stage stage;
  stage.run(100);
  const int poses = stage.poses;
  const int joys = stage.joys;
  stage.run(1000);
  EXPECT_EQ(stage.poses - poses, 1000);
  EXPECT_EQ(stage.joys - joys, 50);
  EXPECT_TRUE(stage.device.messages(stage.world.now, kUnix).pose == std::nullopt) << "once each";
}

TEST(RosDevice, ARateLeavesStatesOutAndSendsTheNewest) {
  Stage stage("demo_parts.toml", {.name = "right", .rate_hz = 100});
  stage.run(100);
  const int poses = stage.poses;
  stage.run(1000);
  EXPECT_NEAR(stage.poses - poses, 100, 1);
  while (stage.device.messages(stage.world.now, kUnix).pose == std::nullopt) stage.world.run(1);
}

TEST(RosDevice, AStampIsTheSystemsTimeOfTheSample) {
  constexpr int kDelay = 20;
  Stage stage("demo_parts.toml", {.name = "right"}, {}, kDelay);
  stage.run(1000);
  const Duration stamp =
      seconds(stage.pose.header.stamp.sec) + std::chrono::nanoseconds(stage.pose.header.stamp.nanosec);
  const Duration age = stage.world.now.time_since_epoch() + kUnix - stamp;
  EXPECT_GE(age, milliseconds(kDelay - 1));
  EXPECT_LE(age, milliseconds(kDelay + 2));
}

TEST(RosDevice, AWrenchCommandIsFeltWithItsSignAndIsToldBack) {
  Stage stage;
  stage.run(100);
  stage.run(300, [&] { stage.command(kWriter, 0.5); });
  EXPECT_NEAR(stage.world.step.applied.x(), -0.5, 1e-9) << "the hand is pushed to the left";
  EXPECT_NEAR(stage.wrench.force.y(), 0.5, 1e-9);
  EXPECT_TRUE(has(sentences_of(stage.device), "publisher 71 controls the device"));
  EXPECT_EQ(stage.device.diagnosis().message, "the hand feels a program's force");
}

TEST(RosDevice, ATorqueIsSentWhereTheHandleHasMotorsForItOnly) {
  for (const double most : {0.0, 0.2}) {
    World world("handle.toml");
    world.handle.operator_from_device = Quat{};
    world.handle.max_torque = most;
    world.kill_server();
    world.open_server();
    BridgedDevice& bridged = world.add_bridged();
    RosDevice device(bridged, {.name = "right"});
    world.run(200);
    ASSERT_TRUE(bridged.handle());
    world.run(300, [&] { device.take(input(kWriter, push(0.1)), world.now); });
    ASSERT_TRUE(bridged.state()->torque_applied);
    EXPECT_NEAR(bridged.state()->torque_applied->x(), most > 0 ? -0.01 : 0, 1e-9);
    EXPECT_NEAR(bridged.state()->force_applied.x(), -0.1, 1e-9);
  }
}

TEST(RosDevice, ASlowPublisherIsFeltBetweenItsCommands) {
  Stage stage;
  stage.run(100);
  int n = 0;
  double least = 1;
  stage.run(2000, [&] {
    if (n++ % 50 == 0) stage.command(kWriter, 0.5);
    if (n > 500) least = std::min(least, -stage.world.step.applied.x());
  });
  EXPECT_NEAR(least, 0.5, 1e-9) << "20 a second: good for 150 ms";
}

TEST(RosDevice, ASecondPublisherIsDroppedAndTold) {
  Stage stage;
  stage.run(100);
  stage.run(300, [&] {
    stage.command(kWriter, 0.5);
    stage.command(kOther, -0.5);
  });
  EXPECT_NEAR(stage.world.step.applied.x(), -0.5, 1e-9);
  const auto said = sentences_of(stage.device);
  EXPECT_EQ(std::ranges::count_if(said, [](const auto& s) { return s.find("publisher 72") != std::string::npos; }), 1)
      << "once";
  EXPECT_TRUE(has(said, "a wrench_command of publisher 72 was dropped: another program controls the device"));
  const RosDiagnosis diagnosis = stage.device.diagnosis();
  EXPECT_EQ(diagnosis.level, RosDiagnosis::Level::kWarn);
  EXPECT_NE(diagnosis.message.find("publisher 72"), std::string::npos) << diagnosis.message;
  EXPECT_EQ(stage.bridged.forces_dropped(), 300U);
}

TEST(RosDevice, WhenTheOwnerLeavesTheNextOneOwns) {
  Stage stage;
  stage.run(100);
  stage.run(300, [&] { stage.command(kWriter, 0.5); });
  stage.device.keep(std::array{kOther});
  EXPECT_EQ(stage.bridged.owner(), 0U);
  EXPECT_TRUE(has(sentences_of(stage.device), "publisher 71 has left"));
  stage.run(300, [&] { stage.command(kOther, -0.5); });
  EXPECT_NEAR(stage.world.step.applied.x(), 0.5, 1e-9);
}

TEST(RosDevice, AForeignFrameIsRefusedAndSaidOnce) {
  Stage stage;
  stage.run(100);
  RosWrench foreign = push(0.5);
  foreign.header.frame_id = "tool0";
  stage.run(500, [&] { stage.device.take(input(kWriter, foreign), stage.world.now); });
  EXPECT_TRUE(stage.world.step.applied.isZero());
  EXPECT_EQ(stage.device.refused(), 500U);
  const auto said = sentences_of(stage.device);
  ASSERT_EQ(said.size(), 1U);
  EXPECT_TRUE(has(said, "\"tool0\" is unknown"));
}

TEST(RosDevice, TheSeventeenthPublisherIsRefused) {
  Stage stage;
  stage.run(100);
  for (std::uint64_t writer = 1; writer <= 17; ++writer) stage.command(writer, 0.5);
  EXPECT_EQ(stage.device.refused(), 1U);
  stage.device.keep(std::array<std::uint64_t, 1>{1});
  stage.command(17, 0.5);
  EXPECT_EQ(stage.device.refused(), 1U) << "there is room again";
}

TEST(RosDevice, ObservingSendsNoForceAndSaysSo) {
  Stage stage("demo_parts.toml", {.name = "right"}, {.observe = true});
  stage.run(100);
  stage.run(300, [&] { stage.command(kWriter, 0.5); });
  EXPECT_TRUE(stage.world.step.applied.isZero());
  EXPECT_TRUE(has(sentences_of(stage.device), "--observe"));
}

TEST(RosDevice, AButtonIsToldAtOnceAndEachPressIsSeen) {
  Stage stage("handle.toml");
  int pressed = 0;
  int held = 0;
  double at_ms = 0;
  for (int ms = 1; ms <= 2500; ++ms) {
    const int joys = stage.joys;
    stage.run(1);
    const int now = !stage.joy.buttons.empty() ? stage.joy.buttons[0] : 0;
    if (now == 1 && held == 0) {
      ++pressed;
      EXPECT_EQ(stage.joys, joys + 1);
      if (pressed == 1) at_ms = ms;
    }
    held = now;
  }
  EXPECT_EQ(pressed, 2) << "handle.toml: at 1 s and at 2 s";
  EXPECT_NEAR(at_ms, 1000, 3) << "and not up to 20 ms later";
}

TEST(RosDevice, TheClutchLetsTheHandsMotionThroughWhileItIsHeld) {
  Stage stage("handle.toml",
              {.name = "right", .servo = RosServo(RosServo::Kind::kTwist, 2, "stand"), .clutch = "stylus"});
  int twists = 0;
  RosTwist twist;
  RosTwist hand;
  stage.world.run(1250, [&] {
    const auto due = stage.device.messages(stage.world.now, kUnix);
    if (due.servo.twist) {
      ++twists;
      twist = *due.servo.twist;
      hand = *due.twist;
    }
  });
  EXPECT_NEAR(twists, 250, 3) << "pressed from 1.0 to 1.3 s";
  EXPECT_TRUE(twist.linear.isApprox(2 * hand.linear));
  EXPECT_EQ(twist.header.frame_id, "stand");
}

TEST(RosDevice, AClutchThatTheDeviceDoesNotHaveIsSaid) {
  Stage stage("handle.toml",
              {.name = "right", .servo = RosServo(RosServo::Kind::kTwist, 2, "stand"), .clutch = "thumb"});
  stage.run(1500);
  EXPECT_TRUE(has(sentences_of(stage.device), "--clutch thumb: the device has no such button"));
}

TEST(RosDevice, ADeviceOfUnknownAxesIsSaidOnce) {
  Stage stage;
  stage.world.handle.operator_from_device.reset();
  stage.start_anew();
  stage.run(1000);
  const auto said = sentences_of(stage.device);
  ASSERT_EQ(said.size(), 1U);
  EXPECT_TRUE(has(said, "the scene does not specify the orientation of the device"));
}

}  // namespace
}  // namespace tendon::bridge::ros2_device_test
