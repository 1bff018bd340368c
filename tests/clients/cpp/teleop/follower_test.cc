// SPDX-License-Identifier: Apache-2.0
// Runs the cases in tests/clients/follower_cases.json. The Python and TypeScript clients run the same cases.
#include "clients/cpp/teleop/follower.h"

#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "tests/support/refusal.h"

namespace tendon::follower_test {
namespace {

using Json = nlohmann::json;
using std::chrono::milliseconds;

Json cases() {
  std::ifstream file(TENDON_FOLLOWER_CASES);
  return Json::parse(file);
}

double number(const Json& value) {
  return value.is_string() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>();
}
Vec3 vector(const Json& v) { return {number(v[0]), number(v[1]), number(v[2])}; }
Quat quat(const Json& q) { return {q[0], q[1], q[2], q[3]}; }

Follower::Config config(const Json& given) {
  Follower::Config config;
  const std::map<std::string, double*> numbers{{"scale", &config.scale},           {"force_scale", &config.force_scale},
                                               {"speed", &config.speed},           {"spin", &config.spin},
                                               {"ramp_s", &config.ramp_s},         {"grip_ratio", &config.grip_ratio},
                                               {"grip_speed", &config.grip_speed}, {"rate_hz", &config.rate_hz}};
  for (const auto& [key, value] : given.items()) {
    if (numbers.contains(key)) {
      *numbers.at(key) = number(value);
    } else if (key == "rotation") {
      config.rotation = quat(value);
    } else if (key == "axes") {
      config.axes = value;
    } else if (key == "clutch_button") {
      config.clutch_button = value.get<std::uint32_t>();
    } else if (key == "toggle") {
      config.toggle = value;
    } else if (key == "engage_by") {
      config.engage_by = value == "call" ? Follower::EngageBy::kCall : Follower::EngageBy::kButton;
    } else {
      ADD_FAILURE() << "no such key: " << key;
    }
  }
  return config;
}

DeviceState hand_of(const Json& now, const Json& step) {
  DeviceState hand;
  const int sampled = step.value("sampled", now["at"].get<int>() - 50);
  hand.tick = static_cast<std::uint64_t>(step.value("tick", sampled + 1000));
  hand.sampled = PeerTime(milliseconds(sampled));
  hand.position = vector(now["hand"]);
  hand.buttons = now.value("buttons", 0U);
  hand.mode = static_cast<Mode>(now.value("mode", 2));
  hand.reasons = now.value("reasons", 0U);
  if (now.contains("turn")) hand.turning = Turning{.orientation = quat(now["turn"])};
  if (now.contains("opening")) hand.grip = Grip{.opening = now["opening"]};
  return hand;
}

Pose pose_of(const Json& now) {
  Pose pose{.position = vector(now["pose"])};
  if (now.contains("turned")) pose.orientation = quat(now["turned"]);
  if (now.contains("grip")) pose.grip = now["grip"];
  return pose;
}

std::optional<ToolContact> contact_of(const Json& given) {
  if (given.is_null()) return {};
  ToolContact contact{.force = vector(given["force"])};
  if (given.contains("torque")) contact.torque = vector(given["torque"]);
  if (given.contains("stiffness")) contact.stiffness = given["stiffness"];
  if (given.contains("normal")) contact.normal = vector(given["normal"]);
  if (given.contains("grip_force")) contact.grip_force = given["grip_force"];
  return contact;
}

::testing::AssertionResult near(const Vec3& value, const Json& expected) {
  if ((value - vector(expected)).norm() < 1e-9) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << value.transpose() << ", not " << expected;
}

void check_felt(const Touch& touch, const Json& feels) {
  ASSERT_EQ(touch.unknown, feels.is_null());
  if (touch.unknown) return;
  EXPECT_TRUE(near(touch.force, feels["force"]));
  ASSERT_EQ(touch.stiffness.has_value(), feels.contains("stiffness"));
  for (int row = 0; touch.stiffness && row < 3; ++row) {
    EXPECT_TRUE(near(touch.stiffness->row(row), feels["stiffness"][static_cast<std::size_t>(row)]));
  }
  ASSERT_EQ(touch.contact.has_value(), feels.contains("gap"));
  if (touch.contact) {
    EXPECT_TRUE(near(touch.contact->normal, feels["normal"]));
    EXPECT_NEAR(touch.contact->gap, feels["gap"], 1e-9);
  }
  ASSERT_EQ(touch.torque.has_value(), feels.contains("torque"));
  if (touch.torque) {
    EXPECT_TRUE(near(*touch.torque, feels["torque"]));
  }
  EXPECT_NEAR(touch.grip_force.value_or(0), feels.value("grip_force", 0.), 1e-9);
}

void check_target(const std::optional<Pose>& target, const Json& step) {
  ASSERT_EQ(target.has_value(), !step["target"].is_null());
  if (!target) return;
  EXPECT_TRUE(near(target->position, step["target"]));
  if (step.contains("target_turned")) {
    const Quat expected = quat(step["target_turned"]);
    ASSERT_TRUE(target->orientation);
    EXPECT_NEAR(target->orientation->w, expected.w, 1e-9);
    EXPECT_NEAR(target->orientation->x, expected.x, 1e-9);
    EXPECT_NEAR(target->orientation->y, expected.y, 1e-9);
    EXPECT_NEAR(target->orientation->z, expected.z, 1e-9);
  }
  if (step.contains("target_grip")) {
    EXPECT_NEAR(target->grip.value(), step["target_grip"], 1e-9);
  }
}

void check(Follower& follow, const Json& step, const Json& now) {
  SCOPED_TRACE("at " + now["at"].dump());
  if (step.contains("set_scale")) {
    EXPECT_EQ(follow.set_scale(step["set_scale"][0], step["set_scale"][1]), step["changed"].get<bool>());
  }
  if (step.contains("engage")) follow.engage();
  const LocalTime at{milliseconds(now["at"].get<int>())};
  check_target(step.contains("silence") ? follow.silence(at) : follow.target(hand_of(now, step), pose_of(now), at),
               step);
  EXPECT_EQ(static_cast<int>(follow.phase()), step["phase"].get<int>());
  if (step.contains("touch")) check_felt(follow.touch(contact_of(step["touch"])), step["feels"]);
  if (step.contains("words")) {
    EXPECT_EQ(follow.words(), step["words"].get<std::string>());
  }
}

TEST(Follower, AnswersAsTheSharedCasesSay) {
  const Json suite = cases();
  ASSERT_GE(suite["cases"].size(), 16U);
  for (const Json& one : suite["cases"]) {
    SCOPED_TRACE(one["name"].get<std::string>());
    Follower follow(config(one["config"]));
    Json now = Json::object();
    for (const Json& step : one["steps"]) {
      now.update(step);
      check(follow, step, now);
    }
  }
}

TEST(Follower, AnImpossibleConfigIsRefusedWithTheField) {
  const Json suite = cases();
  ASSERT_FALSE(suite["refused"].empty());
  for (const Json& one : suite["refused"]) {
    EXPECT_EQ(thrown_by([&] { Follower{config(one["config"])}; }), one["what"].get<std::string>());
  }
}

TEST(Follower, AnImpossibleScaleIsRefused) {
  Follower follow({.engage_by = Follower::EngageBy::kCall});
  EXPECT_THROW(follow.set_scale(1000, 1), std::invalid_argument);
}

TEST(Follower, EngagingBeforeTheFirstStateIsRefused) {
  Follower follow({.engage_by = Follower::EngageBy::kCall});
  EXPECT_FALSE(follow.engage());
}

}  // namespace
}  // namespace tendon::follower_test
