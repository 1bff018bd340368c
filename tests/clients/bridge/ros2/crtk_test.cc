// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/ros2/crtk.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <limits>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "clients/bridge/ros2/ros2_device.h"
#include "tests/clients/bridge/world.h"

namespace tendon::bridge::crtk_test {
namespace {

using std::chrono::milliseconds;
using Topic = RosInput::Topic;

constexpr Duration kUnix = std::chrono::seconds(1'700'000'000);
constexpr std::uint64_t kForce = 81;
constexpr std::uint64_t kState = 82;

BridgedDevice::Config watching() {
  BridgedDevice::Config config;
  config.client.diagnostics = true;
  config.always_observe = true;
  return config;
}

struct Stage {
  explicit Stage(RosDevice::Config config = {.name = "right", .crtk = true},
                 BridgedDevice::Config bridged_config = watching())
      : world("demo_parts.toml"),
        bridged(world.add_bridged(std::move(bridged_config))),
        device(bridged, std::move(config)) {
    world.handle.operator_from_device = Quat{};
    world.safety = Safety::kUnguarded;
    world.kill_server();
    world.open_server();
  }
  void run(int ms, const std::function<void()>& program = nullptr) {
    world.run(ms, [&] {
      if (program) program();
      const RosDevice::Messages due = device.messages(world.now, kUnix);
      if (due.measured_cf) measured_cf = *due.measured_cf;
      if (!due.operating_state) return;
      ++states;
      if (told.empty() || told.back().state != due.operating_state->state) told.push_back(*due.operating_state);
      state = *due.operating_state;
    });
    while (auto sentence = device.next_sentence()) said.push_back(*sentence);
    while (auto sentence = bridged.next_sentence()) said.push_back(*sentence);
  }
  void push(double left_n, std::uint64_t writer = kForce) {
    device.take({.topic = Topic::kServoCf,
                 .writer = writer,
                 .called = "a client",
                 .wrench = {.header = {}, .force = {0, left_n, 0}}},
                world.now);
  }
  void command(const std::string& text) {
    device.take({.topic = Topic::kStateCommand, .writer = kState, .called = "a client", .text = text}, world.now);
  }
  bool has_said(const std::string& words) const {
    return std::ranges::any_of(said, [&](const std::string& one) { return one.find(words) != std::string::npos; });
  }

  World world;
  BridgedDevice& bridged;
  RosDevice device;
  RosOperatingState state;
  std::vector<RosOperatingState> told;
  RosWrench measured_cf;
  int states = 0;
  std::vector<std::string> said;
};

TEST(CrtkState, FollowsTheReportsOfTheServerAlsoWhileAForceIsOn) {
  for (const bool pushes : {false, true}) {
    Stage stage;
    const auto program = [&] {
      if (pushes) stage.push(0);
    };
    for (const auto& [safety, state, homed] : {std::tuple(Safety::kUnhomed, "DISABLED", false),
                                               {Safety::kHomed, "DISABLED", true},
                                               {Safety::kArmed, "ENABLED", true},
                                               {Safety::kFault, "FAULT", true},
                                               {Safety::kAbsent, "DISABLED", false},
                                               {Safety::kUnguarded, "ENABLED", true}}) {
      stage.world.safety = safety;
      stage.run(2500, program);
      EXPECT_EQ(stage.state.state, state) << static_cast<int>(safety);
      EXPECT_EQ(stage.state.is_homed, homed) << static_cast<int>(safety);
      EXPECT_FALSE(stage.state.is_busy);
    }
    EXPECT_EQ(stage.bridged.pushes(), pushes);
  }
}

TEST(CrtkState, IsToldAtLeastTwentyTimesPerSecondWithTheTimeOfTheMessage) {
  Stage stage;
  stage.run(3000);
  const int before = stage.states;
  stage.run(1000);
  EXPECT_EQ(stage.states - before, 20);
  EXPECT_EQ(stage.state.header.frame_id, "right_base");
  const RosTime least = ros_time(stage.world.now.time_since_epoch() + kUnix - milliseconds(50));
  EXPECT_GE(std::pair(stage.state.header.stamp.sec, stage.state.header.stamp.nanosec),
            std::pair(least.sec, least.nanosec));
}

TEST(CrtkState, IsUnknownBeforeTheFirstStateAndAFaultWithoutTheServer) {
  Stage stage;
  stage.world.connected = false;
  stage.run(3000);
  EXPECT_TRUE(stage.told.empty());
  stage.world.connected = true;
  stage.run(6000);
  EXPECT_EQ(stage.state.state, "ENABLED");
  stage.world.kill_server();
  stage.run(3000);
  EXPECT_EQ(stage.state.state, "FAULT");
  EXPECT_FALSE(stage.state.is_homed);
  stage.world.open_server();
  stage.run(6000);
  EXPECT_EQ(stage.state.state, "ENABLED") << "the clock of a new server is not compared with the old one";
}

TEST(CrtkState, EnableArmsNothingAndSaysWhoArms) {
  Stage stage;
  stage.world.safety = Safety::kHomed;
  stage.run(2500);
  stage.command("enable");
  stage.run(2500);
  EXPECT_EQ(stage.state.state, "DISABLED");
  EXPECT_FALSE(stage.world.step.rearmed);
  EXPECT_TRUE(stage.has_said("a client requested \"enable\": the operator arms the device"));
  for (int i = 0; i < 2; ++i) {  // the warning is repeated until the device is armed
    EXPECT_NE(stage.device.diagnosis().message.find("the operator arms the device"), std::string::npos);
  }
  stage.world.safety = Safety::kArmed;
  stage.run(2500);
  EXPECT_EQ(stage.state.state, "ENABLED");
  EXPECT_EQ(stage.device.diagnosis().message.find("the operator arms the device"), std::string::npos);
}

TEST(CrtkState, EnableIsForgottenWhenItsPublisherLeaves) {
  Stage stage;
  stage.world.safety = Safety::kHomed;
  stage.run(2500);
  stage.command("enable");
  stage.device.keep({});
  EXPECT_EQ(stage.device.diagnosis().message.find("the operator arms the device"), std::string::npos);
}

TEST(CrtkState, DisableDisarmsWithAndWithoutAForce) {
  for (const bool pushes : {false, true}) {
    Stage stage;
    const auto program = [&] {
      if (pushes) stage.push(0.5);
    };
    stage.run(2500, program);
    EXPECT_EQ(stage.state.state, "ENABLED");
    EXPECT_EQ(stage.world.step.applied.isZero(0), !pushes);
    stage.command("disable");
    stage.run(50, program);
    EXPECT_EQ(stage.state.state, "DISABLED") << "at once, although the newest report says that it is armed";
    EXPECT_TRUE(stage.world.step.disarmed);
    EXPECT_TRUE(stage.world.step.applied.isZero(0));
    stage.run(3000, program);
    EXPECT_TRUE(stage.world.step.applied.isZero(0));
    EXPECT_EQ(stage.told.back().state, "DISABLED");
    EXPECT_TRUE(stage.has_said("was disarmed for a program"));
    EXPECT_EQ(stage.bridged.pushes(), pushes) << "the session for the order has ended";
  }
}

TEST(CrtkState, AFloodOfDisableIsOneOrderAtATime) {
  Stage stage;
  stage.run(2500);
  stage.run(2000, [&] {
    for (int i = 0; i < 10; ++i) stage.command("disable");
  });
  EXPECT_TRUE(stage.world.step.disarmed);
  EXPECT_LE(
      std::ranges::count_if(stage.said, [](const auto& s) { return s.find("was disarmed") != std::string::npos; }), 2);
}

TEST(CrtkState, DisableWaitsForTheServerAndGivesUp) {
  Stage stage;
  stage.run(2500);
  stage.world.connected = false;
  stage.command("disable");
  stage.run(1000);
  stage.world.connected = true;
  stage.run(3000);
  EXPECT_TRUE(stage.world.step.disarmed) << "the order is repeated";

  Stage gone;
  gone.run(2500);
  gone.world.connected = false;
  gone.command("disable");
  gone.run(6000);
  EXPECT_TRUE(gone.has_said("could not be disarmed"));
}

TEST(CrtkState, ObservingDoesNotDisarm) {
  BridgedDevice::Config config = watching();
  config.observe = true;
  Stage stage({.name = "right", .crtk = true}, std::move(config));
  stage.run(2500);
  stage.command("disable");
  stage.run(1000);
  EXPECT_FALSE(stage.world.step.disarmed);
  EXPECT_TRUE(stage.has_said("refused, because of --observe"));
}

TEST(CrtkState, AnotherCommandIsRefusedWithItsBytesMadePrintable) {
  Stage stage;
  stage.run(2500);
  stage.command("home\n\x1b[31m" + std::string(100'000, 'x'));
  stage.run(10);
  EXPECT_TRUE(stage.has_said("\"home??[31mxxx"));
  EXPECT_TRUE(stage.has_said("x\": refused; expected enable or disable"));
  EXPECT_TRUE(std::ranges::all_of(stage.said, [](const std::string& one) { return one.size() < 200; }));
}

TEST(CrtkState, DisableIsObeyedAlsoWhenSixteenPublishersPush) {
  Stage stage;
  stage.run(2500);
  for (std::uint64_t writer = 1; writer <= 16; ++writer) stage.push(0.1, writer);
  stage.command("disable");
  stage.run(100);
  EXPECT_TRUE(stage.world.step.disarmed);
}

TEST(CrtkForce, IsOnTheHandInTheAxesOfTheBaseAlsoWithNegate) {
  Stage stage({.name = "right", .negate = true, .crtk = true});
  stage.run(2500);
  stage.run(300, [&] { stage.push(0.5); });
  EXPECT_NEAR(stage.world.step.applied.x(), -0.5, 1e-9) << "y is left";
  EXPECT_NEAR(stage.measured_cf.force.y(), 0.5, 1e-9);
  EXPECT_TRUE(stage.has_said("a client controls the device: the hand feels its servo_cf"));
}

TEST(CrtkForce, NegateMeasuredGivesTheForceOfTheHand) {
  Stage stage({.name = "right", .crtk = true, .negate_measured = true});
  stage.run(2500);
  stage.run(300, [&] { stage.push(0.5); });
  EXPECT_NEAR(stage.measured_cf.force.y(), -0.5, 1e-9);
}

TEST(CrtkForce, IsZero300MillisecondsAfterTheLastMessageOfAKilledClient) {
  for (const int period_ms : {1, 5, 20}) {  // the example of crtk_python_client uses 5 ms
    Stage stage;
    stage.run(2500);
    int ms = 0;
    stage.run(1200, [&] {
      if (ms++ % period_ms == 0) stage.push(0.5);
    });
    EXPECT_LT(stage.world.step.applied.x(), -0.4) << period_ms << ": the limiter takes a part";
    stage.run(300);
    EXPECT_TRUE(stage.world.step.applied.isZero(0)) << period_ms;
  }
}

TEST(CrtkForce, APoseIsRefusedAndSaidOnce) {
  Stage stage;
  stage.run(2500);
  stage.run(2000, [&] {
    stage.device.take({.topic = Topic::kServoCp, .writer = kForce, .called = "a client"}, stage.world.now);
  });
  EXPECT_EQ(stage.device.refused(), 2000U);
  EXPECT_EQ(std::ranges::count_if(stage.said, [](const auto& s) { return s.find("servo_cp") != std::string::npos; }),
            1);
  EXPECT_TRUE(stage.world.step.applied.isZero(0));
}

TEST(CrtkForce, ANumberThatIsNotFiniteIsRefused) {
  Stage stage;
  stage.run(2500);
  stage.run(100, [&] { stage.push(std::numeric_limits<double>::quiet_NaN()); });
  EXPECT_EQ(stage.device.refused(), 100U);
  EXPECT_TRUE(stage.has_said("a servo_cf of a client was dropped: it contains a number that is not finite"));
}

TEST(CrtkForce, OneThatComesBackUnderItsNameIsFeltAgain) {
  Stage stage;
  stage.run(2500);
  stage.run(500, [&] { stage.push(0.5, 1); });
  stage.run(1200);  // the program was killed, but DDS does not know this yet
  stage.run(500, [&] { stage.push(0.5, 2); });
  EXPECT_NEAR(stage.world.step.applied.x(), -0.5, 1e-9);
  stage.device.keep(std::array<std::uint64_t, 1>{2});  // now DDS knows it
  stage.run(100, [&] { stage.push(0.5, 2); });
  EXPECT_NEAR(stage.world.step.applied.x(), -0.5, 1e-9);
}

TEST(CrtkForce, WithoutCrtkThereAreNoMessagesOfIt) {
  Stage stage({.name = "right"});
  stage.run(2500);
  EXPECT_TRUE(stage.told.empty());
  EXPECT_TRUE(stage.measured_cf.header.frame_id.empty());
}

}  // namespace
}  // namespace tendon::bridge::crtk_test
