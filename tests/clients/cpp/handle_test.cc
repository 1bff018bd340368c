// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "clients/cpp/force_client.h"
#include "tests/clients/cpp/a_and_z.h"

namespace tendon::handle_test {
namespace {

using a_and_z::kFineWeather;
using a_and_z::World;
constexpr Duration kSecond = std::chrono::seconds(1);

Touch answer_with_torque(const DeviceState& hand) {
  Touch touch = Vec3(-100 * hand.position);
  touch.torque = Vec3(0, 0, 0.1);
  touch.angular_stiffness = 0.2 * Mat3::Identity();
  touch.grip_force = -1.5;
  return touch;
}

TEST(ForceClientHandle, TorqueAngularStiffnessAndGripForceTravelWithTheForce) {
  World world(11);
  world.z->turning = Turning{.orientation = {.w = 0.6, .x = 0.8, .y = 0, .z = 0}, .angular_velocity = Vec3(0, 1, 0)};
  world.connect({.rate_hz = 100}, [&](const DeviceState& hand) {
    EXPECT_EQ(hand.turning, world.z->turning);
    return answer_with_torque(hand);
  });
  world.run(kSecond);
  ASSERT_FALSE(world.z->forces.empty());
  const ForceCommand& command = world.z->forces.back().second;
  ASSERT_TRUE(command.torque && command.torque->model);
  EXPECT_EQ(command.torque->torque, Vec3(0, 0, 0.1));
  EXPECT_EQ(command.torque->model->at, world.z->turning->orientation);
  EXPECT_EQ(command.torque->model->stiffness, Mat3(0.2 * Mat3::Identity()));
  EXPECT_EQ(command.grip_force, -1.5);
  EXPECT_FALSE(command.model) << "a rotation model needs no other";
  EXPECT_EQ(world.a->stats().left_out, "");
}

TEST(ForceClientHandle, APressInAStateThatIsSkippedIsInTheNextOneThatIsNot) {
  World world(12, kFineWeather);
  world.z->press_every = 100;
  int calls = 0;
  int pressed = 0;
  world.connect({.rate_hz = 20}, [&](const DeviceState& hand) {
    ++calls;
    pressed += hand.buttons == 2 ? 1 : 0;
    return Vec3(Vec3::Zero());
  });
  world.run(4 * kSecond);
  EXPECT_GT(calls, 75);
  EXPECT_NEAR(pressed, 40, 1) << "once each, of 1 ms in 100 ms";
}

TEST(ForceClientHandle, SaysWhatItCannotSendAndSendsTheForce) {
  for (const bool knows : {false, true}) {
    World world(11);
    world.z->features = knows;
    world.connect({.rate_hz = 100}, answer_with_torque);
    world.run(kSecond);
    ASSERT_GT(world.z->forces.size(), 50U);
    for (const auto& [at, command] : world.z->forces) {
      EXPECT_EQ(command.torque.has_value(), knows);
      EXPECT_FALSE(command.torque && command.torque->model);
      EXPECT_EQ(command.grip_force.has_value(), knows);
    }
    EXPECT_EQ(world.a->stats().left_out, knows ? "angular stiffness: the device does not measure its orientation"
                                               : "torque and grip force: the server does not support them");
  }
}

}  // namespace
}  // namespace tendon::handle_test
