// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/ros2/ros2_messages.h"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <variant>

#include "clients/bridge/ros2/ros2_servo.h"
#include "core/base/rotation.h"

namespace tendon::bridge::ros2_messages_test {
namespace {

constexpr double kQuarter = std::numbers::pi / 2;

/// A Falcon has the operator's axes (x right, y up, z to the user). REP 103 has x forward, y left, z up.
const std::optional<Quat> kFalcon = Quat{};
/// The axes of WoodenHaptics are the same as in REP 103.
const std::optional<Quat> kWooden = quaternion_of(operator_from_device("right=-y up=z user=-x"));

DeviceState at(const Vec3& position) {
  DeviceState state;
  state.position = position;
  return state;
}

TEST(RosMessages, AHandThatMovesAlongOneAxisMovesAlongRep103s) {
  const RosView view("right", kFalcon);
  EXPECT_TRUE(view.pose(at({1, 0, 0}), {}).position.isApprox(Vec3(0, -1, 0))) << "right is −y";
  EXPECT_TRUE(view.pose(at({0, 1, 0}), {}).position.isApprox(Vec3(0, 0, 1))) << "up is z";
  EXPECT_TRUE(view.pose(at({0, 0, 1}), {}).position.isApprox(Vec3(-1, 0, 0))) << "to the user is −x";
  const RosView wooden("left", kWooden);
  EXPECT_TRUE(wooden.pose(at({1, 2, 3}), {}).position.isApprox(Vec3(1, 2, 3)));
}

TEST(RosMessages, EachHasItsOwnFieldInTheBasesAxes) {
  const RosView view("right", kFalcon);
  DeviceState state;
  state.velocity = {1, 2, 3};
  state.force_applied = {4, 5, 6};
  state.torque_applied = Vec3(7, 8, 9);
  state.turning = Turning{.orientation = {}, .angular_velocity = {10, 11, 12}};
  const RosTwist twist = view.twist(state, {3, 4});
  EXPECT_EQ(twist.header.frame_id, "right_base");
  EXPECT_EQ(twist.header.stamp, (RosTime{3, 4}));
  EXPECT_TRUE(twist.linear.isApprox(Vec3(-3, -1, 2)));
  EXPECT_TRUE(twist.angular.isApprox(Vec3(-12, -10, 11)));
  const RosWrench wrench = view.wrench(state, {});
  EXPECT_TRUE(wrench.force.isApprox(Vec3(-6, -4, 5)));
  EXPECT_TRUE(wrench.torque.isApprox(Vec3(-9, -7, 8)));
}

TEST(RosMessages, AHandleThatIsTurnedAboutUpIsTurnedAboutZ) {
  const RosView view("right", kFalcon);
  DeviceState state;
  EXPECT_EQ(view.pose(state, {}).orientation, Quat{}) << "not measured";
  state.turning = Turning{.orientation = rotation_by({0, kQuarter, 0}), .angular_velocity = Vec3::Zero()};
  const Quat about_z = rotation_by({0, 0, kQuarter});
  EXPECT_TRUE(matrix_of(view.pose(state, {}).orientation).isApprox(matrix_of(about_z)));
  state.turning->orientation = rotation_by({0, 0, kQuarter});
  EXPECT_TRUE(matrix_of(view.pose(state, {}).orientation).isApprox(matrix_of(rotation_by({-kQuarter, 0, 0}))));
}

RosWrench command(const Vec3& force, const std::string& frame) {
  return {.header = {{}, frame}, .force = force, .torque = {0, 0, 0.5}};
}

TEST(RosMessages, ACommandIsInTheAxesThatItsFrameNames) {
  const RosView view("right", kFalcon);
  for (const char* frame : {"", "right_base"}) {
    const auto wish = view.wish(command({0, 0, 1}, frame), false);
    ASSERT_TRUE(std::holds_alternative<RosView::Wish>(wish)) << frame;
    EXPECT_TRUE(std::get<RosView::Wish>(wish).force.isApprox(Vec3(0, 1, 0))) << "up";
    EXPECT_TRUE(std::get<RosView::Wish>(wish).torque.isApprox(Vec3(0, 0.5, 0)));
  }
  const auto wish = view.wish(command({0, 0, 1}, "right_operator"), false);
  EXPECT_TRUE(std::get<RosView::Wish>(wish).force.isApprox(Vec3(0, 0, 1))) << "to the user";
  const auto wooden = RosView("left", kWooden).wish(command({0, 0, 1}, "left_operator"), false);
  EXPECT_TRUE(std::get<RosView::Wish>(wooden).force.isApprox(Vec3(-1, 0, 0))) << "to the user is its −x";
}

TEST(RosMessages, NegateGivesTheHandTheOpposite) {
  const auto wish = RosView("right", kFalcon).wish(command({0, 0, 1}, ""), true);
  EXPECT_TRUE(std::get<RosView::Wish>(wish).force.isApprox(Vec3(0, -1, 0)));
  EXPECT_TRUE(std::get<RosView::Wish>(wish).torque.isApprox(Vec3(0, -0.5, 0)));
}

TEST(RosMessages, ACommandOfAnotherFrameOrNoNumberIsRefusedWithTheReason) {
  const RosView view("right", kFalcon);
  const auto foreign = view.wish(command({0, 0, 1}, "tool\n0"), false);
  EXPECT_EQ(std::get<std::string>(foreign),
            "the frame_id \"tool?0\" is unknown: expected no frame_id, right_base or right_operator");
  const auto other_device = view.wish(command({0, 0, 1}, "left_base"), false);
  EXPECT_TRUE(std::holds_alternative<std::string>(other_device));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(std::get<std::string>(view.wish(command({0, nan, 1}, ""), false)),
            "it contains a number that is not finite");
}

TEST(RosMessages, JoyHasTheButtonsInOrderAndTheGripperFromClosedToOpen) {
  HandleDescription handle;
  handle.buttons = {"trigger", "clutch", "a"};
  handle.gripper_open = 0.5;
  DeviceState state;
  state.buttons = 0b010;
  state.grip = Grip{.opening = 0.125, .velocity = 0};
  const RosJoy joy = joy_of(state, handle, {});
  EXPECT_EQ(joy.buttons, (std::vector<std::int32_t>{0, 1, 0}));
  EXPECT_EQ(joy.axes, (std::vector<float>{0.25F}));
  state.grip.reset();
  state.buttons = 0b10000;
  EXPECT_EQ(joy_of(state, {}, {}).buttons, (std::vector<std::int32_t>{0, 0, 0, 0, 1})) << "names are not known";
  EXPECT_TRUE(joy_of(state, {}, {}).axes.empty());
}

TEST(RosMessages, JointsAreToldWithTheirNamesOrNotAtAll) {
  HandleDescription handle;
  handle.joints = {"waist", "shoulder", "elbow"};
  DeviceState state;
  EXPECT_FALSE(joints_of(state, handle, {}));
  state.joints = Joints::three({1, 2, 3}, {4, 5, 6});
  EXPECT_FALSE(joints_of(state, {}, {}));
  const auto joints = joints_of(state, handle, {{}, "right_base"});
  ASSERT_TRUE(joints);
  EXPECT_EQ(joints->name, handle.joints);
  EXPECT_EQ(joints->position, (std::vector<double>{1, 2, 3}));
  EXPECT_EQ(joints->velocity, (std::vector<double>{4, 5, 6}));
}

TEST(RosMessages, NamesAreWhatRosAllows) {
  EXPECT_EQ(ros_name("right"), "right");
  EXPECT_EQ(ros_name("left-arm.2"), "left_arm_2");
  EXPECT_EQ(ros_name("2nd"), "_2nd");
  EXPECT_EQ(ros_name("ö"), "__");
}

TEST(RosMessages, ATimeIsWholeSecondsAndTheRest) {
  EXPECT_EQ(ros_time(std::chrono::nanoseconds(1'795'618'182'807'085'500)), (RosTime{1'795'618'182, 807'085'500}));
}

RosPose pose_at(double x, double turned = 0) {
  return {.header = {{7, 8}, "right_base"}, .position = {x, 0, 0}, .orientation = rotation_by({0, 0, turned})};
}

TEST(RosServo, SendsAScaledTwistWhileTheClutchIsHeldAndOneOfZeroAtItsEnd) {
  RosServo servo(RosServo::Kind::kTwist, 3, "stand");
  const RosTwist moving{.header = {{7, 8}, "right_base"}, .linear = {1, 0, 0}, .angular = {0, 2, 0}};
  EXPECT_FALSE(servo.take(pose_at(0), moving, false).twist);
  const auto held = servo.take(pose_at(0), moving, true);
  ASSERT_TRUE(held.twist);
  EXPECT_FALSE(held.pose);
  EXPECT_EQ(held.twist->header.frame_id, "stand");
  EXPECT_EQ(held.twist->header.stamp, (RosTime{7, 8}));
  EXPECT_TRUE(held.twist->linear.isApprox(Vec3(3, 0, 0)));
  EXPECT_TRUE(held.twist->angular.isApprox(Vec3(0, 2, 0))) << "turns are not scaled";
  const auto end = servo.take(pose_at(0), moving, false);
  ASSERT_TRUE(end.twist);
  EXPECT_TRUE(end.twist->linear.isZero() && end.twist->angular.isZero());
  EXPECT_FALSE(servo.take(pose_at(0), moving, false).twist) << "once";
}

TEST(RosServo, APoseGoesOnWhereTheLastHoldHasEnded) {
  RosServo servo(RosServo::Kind::kPose, 2, "stand");
  EXPECT_FALSE(servo.take(pose_at(5), {}, false).pose);
  EXPECT_TRUE(servo.take(pose_at(5), {}, true).pose->position.isZero()) << "it begins where the robot is";
  EXPECT_TRUE(servo.take(pose_at(5.5, 0.3), {}, true).pose->position.isApprox(Vec3(1, 0, 0)));
  EXPECT_FALSE(servo.take(pose_at(9), {}, false).pose);
  const auto again = servo.take(pose_at(9, 1), {}, true);
  EXPECT_TRUE(again.pose->position.isApprox(Vec3(1, 0, 0))) << "no jump";
  EXPECT_TRUE(matrix_of(again.pose->orientation).isApprox(matrix_of(rotation_by({0, 0, 0.3}))));
  const auto on = servo.take(pose_at(8, 1.2), {}, true);
  EXPECT_TRUE(on.pose->position.isApprox(Vec3(-1, 0, 0)));
  EXPECT_TRUE(matrix_of(on.pose->orientation).isApprox(matrix_of(rotation_by({0, 0, 0.5}))));
}

TEST(RosServo, ALostSessionEndsTheHoldSoThatNothingJumps) {
  RosServo servo(RosServo::Kind::kPose, 1, "stand");
  servo.take(pose_at(0), {}, true);
  servo.take(pose_at(1), {}, true);
  servo.lose();
  EXPECT_TRUE(servo.take(pose_at(7), {}, true).pose->position.isApprox(Vec3(1, 0, 0)));
}

}  // namespace
}  // namespace tendon::bridge::ros2_messages_test
