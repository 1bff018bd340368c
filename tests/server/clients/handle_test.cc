// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "protocol/wire/codec.h"
#include "tests/server/clients/sealed_server.h"

namespace tendon::handle_test {
namespace {

using std::chrono::milliseconds;

/// A handle that has four buttons and axes. One in 20 states is sent to the observer.
class Handle : public SealedServer {
 protected:
  Handle() {
    handle_ = HandleDescription{.operator_from_device = Quat{.w = 0.5, .x = -0.5, .y = 0.5, .z = 0.5},
                                .buttons = {"right", "forward", "centre", "left"}};
    restart();
  }

  Client observer_of_buttons(std::vector<std::uint32_t>& seen, const ForceClient::Config& config) {
    return observer(screen_, "192.0.2.2:4000", config,
                    [&seen](const DeviceState& state, const LinkStats&) { seen.push_back(state.buttons); });
  }

  /// Runs an observer that requests `feature` (none if empty) and calls `see` for each state. Returns their number.
  template <class See>
  std::size_t for_each_state_seen(std::string_view feature, Duration length, const See& see) {
    std::vector<std::string> features;
    if (!feature.empty()) features.emplace_back(feature);
    std::size_t states = 0;
    const auto agreed = run_seeing(features, length, [&](const Session::Event& event) {
      const auto* const seen = std::get_if<Session::StateArrived>(&event);
      if (seen == nullptr) return;
      ++states;
      see(seen->state);
    });
    EXPECT_EQ(agreed, features);
    return states;
  }
};

TEST_F(Handle, APressBetweenTwoStatesIsInTheNextOneAndThenOver) {
  std::vector<std::uint32_t> seen;
  Client b = observer_of_buttons(seen, {.state_hz = 50});
  run(milliseconds(505), {&b});
  for (int i = 0; i < 5; ++i) {
    seen.clear();
    look_.buttons = 0b1000;
    run(milliseconds(3), {&b});
    look_.buttons = 0;
    run(milliseconds(60), {&b});
    ASSERT_GE(seen.size(), 2U);
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 0b1000U), 1) << i;
    EXPECT_EQ(seen.back(), 0U);
  }
}

TEST_F(Handle, AChangeOfButtonsPassesADeadbandAtOnce) {
  std::vector<std::uint32_t> seen;
  const SetStateDeadband deadband{.share = 0.1, .floor = 1e-3, .max_silence = milliseconds(20)};
  Client b = observer_of_buttons(seen, {.state_deadband = deadband});
  run(milliseconds(505), {&b});
  for (const std::uint32_t buttons : {1U, 3U, 0U}) {
    look_.buttons = buttons;
    run(milliseconds(3), {&b});
    ASSERT_FALSE(seen.empty());
    EXPECT_EQ(seen.back(), buttons);
  }
}

TEST_F(Handle, IsDescribedToAClientOfOurs) {
  Client a = controller(wall_, "192.0.2.1:4000");
  run(milliseconds(500), {&a});
  const auto& about = a->handle();
  ASSERT_TRUE(about.has_value());
  EXPECT_EQ(about->operator_from_device, (Quat{.w = 0.5, .x = -0.5, .y = 0.5, .z = 0.5}));
  EXPECT_EQ(about->buttons, (std::vector<std::string>{"right", "forward", "centre", "left"}));
}

TEST_F(Handle, AForceOfTheHandThatNoFrameCarriesCostsNoState) {
  DeviceState seen;
  Client b = observer(screen_, "192.0.2.2:4000", {}, into(seen));
  look_.hand_force = Vec3(1, 2, 3);
  run(milliseconds(500), {&b});
  EXPECT_EQ(seen.hand_force, look_.hand_force);
  const std::uint64_t before = seen.tick;
  look_.hand_force->x() = std::numeric_limits<double>::quiet_NaN();
  run(milliseconds(100), {&b});
  EXPECT_GT(seen.tick, before + 50);
  EXPECT_EQ(seen.hand_force, std::nullopt);
}

TEST_F(Handle, TorqueAndGripForceReachTheLoopOfTheDevice) {
  look_.turning = Turning{.orientation = {.w = 0.6, .x = 0.8, .y = 0, .z = 0}};
  Client a = controller(wall_, "192.0.2.1:4000", {}, [](const DeviceState&) {
    Touch touch = Vec3(1, 0, 0);
    touch.torque = Vec3(0, 0, 0.1);
    touch.angular_stiffness = 0.2 * Mat3::Identity();
    touch.grip_force = -1.5;
    return touch;
  });
  run(milliseconds(500), {&a});
  const RemoteForce* const force = mail().forces[0].take();
  ASSERT_NE(force, nullptr);
  ASSERT_TRUE(force->torque && force->torque->model);
  EXPECT_EQ(force->torque->torque, Vec3(0, 0, 0.1));
  EXPECT_EQ(force->torque->model->at, look_.turning->orientation);
  EXPECT_EQ(force->torque->model->stiffness, Mat3(0.2 * Mat3::Identity()));
  EXPECT_EQ(force->grip_force, -1.5);
}

TEST_F(Handle, TorqueAndGripOfAClientWithoutTheFeatureAreIgnoredAndCounted) {
  for (const bool names : {false, true}) {
    restart_without_keys();
    if (names) foreign_.features.emplace_back(kFeatureHandle);
    run_foreign(milliseconds(500), [](ForceCommand& force) {
      force.torque.emplace().torque = Vec3(0, 0, 0.05);
      force.grip_force = 0.5;
    });
    const RemoteForce* const force = mail().forces[0].take();
    ASSERT_NE(force, nullptr);
    EXPECT_EQ(force->force, Vec3(1, 0, 0)) << "the rest of it is rendered";
    EXPECT_EQ(force->torque.has_value(), names);
    EXPECT_EQ(force->grip_force.has_value(), names);
    EXPECT_EQ(stats().denied > 100, !names);
  }
}

TEST_F(Handle, IsSeenOnlyByThoseThatNamedTheFeature) {
  for (const bool names : {false, true}) {
    restart_without_keys();
    look_.buttons = 1;
    look_.turning = Turning{.orientation = {.w = 0.6, .x = 0.8, .y = 0, .z = 0}, .angular_velocity = Vec3(0, 1, 0)};
    look_.torque_applied = Vec3(0, 0, 0.1);
    look_.grip = Grip{.opening = 0.2, .velocity = 0.3};
    look_.grip_applied = 1.5;
    look_.hand_force = Vec3(1, 2, 3);
    const auto states =
        for_each_state_seen(names ? kFeatureHandle : "", milliseconds(300), [&](const DeviceState& seen) {
          EXPECT_EQ(seen.buttons, names ? 1U : 0U);
          EXPECT_EQ(seen.turning, names ? look_.turning : std::nullopt);
          EXPECT_EQ(seen.torque_applied, names ? look_.torque_applied : std::nullopt);
          EXPECT_EQ(seen.grip, names ? look_.grip : std::nullopt);
          EXPECT_EQ(seen.grip_applied, names ? look_.grip_applied : std::nullopt);
          EXPECT_EQ(seen.hand_force, names ? look_.hand_force : std::nullopt);
        });
    EXPECT_GT(states, 100U);
  }
}

TEST_F(Handle, ColumnsAreSentOnlyToThoseThatNamedTheFeature) {
  for (const bool names : {false, true}) {
    restart_without_keys();
    look_.velocity = Vec3(0.1, 0.2, 0.3);
    DeviceState rounded = look_;
    round_to_columns(rounded);
    ASSERT_NE(rounded.velocity, look_.velocity);
    const std::string_view feature = names ? kFeatureStateColumns : "";
    const auto states = for_each_state_seen(feature, milliseconds(100), [&](const DeviceState& seen) {
      EXPECT_EQ(seen.position, look_.position);
      EXPECT_EQ(seen.velocity, names ? rounded.velocity : look_.velocity);
    });
    EXPECT_GT(states, 50U);
  }
}

/// For clients that did not request the feature, the states have the same size as before.
TEST_F(Handle, JointsAreToldToThoseThatNamedTheFeature) {
  for (const bool asks : {false, true}) {
    handle_ = HandleDescription{.buttons = {"right"}, .joints = {"upper", "lower"}};
    restart();
    look_.joints = Joints{.count = 2, .angle = {0.5, -0.25}, .velocity = {0.125, 2}};
    DeviceState seen;
    Client b = observer(screen_, "192.0.2.2:4000", {.joints = asks}, into(seen));
    run(milliseconds(500), {&b});
    EXPECT_GT(seen.tick, 100U);
    EXPECT_EQ(seen.joints, asks ? look_.joints : std::nullopt);
    ASSERT_TRUE(b->handle().has_value());
    EXPECT_EQ(b->handle()->joints, asks ? handle_->joints : std::vector<std::string>{});

    const std::uint64_t before = seen.tick;
    look_.joints->velocity[1] = std::numeric_limits<double>::infinity();  // in a singular pose
    run(milliseconds(100), {&b});
    EXPECT_GT(seen.tick, before + 50) << "a number that no frame carries costs no state";
    EXPECT_EQ(seen.joints, std::nullopt);
  }
}

}  // namespace
}  // namespace tendon::handle_test
