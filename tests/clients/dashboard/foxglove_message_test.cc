// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/foxglove_message.h"

#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <set>
#include <string>

#include "core/base/rotation.h"
#include "foxglove.pb.h"
#include "recording.pb.h"
#include "tendon.pb.h"

namespace tendon::dash::foxglove_message_test {
namespace {

constexpr std::array kKinds = {FoxgloveKind::kStep, FoxgloveKind::kDevice, FoxgloveKind::kPeer,
                               FoxgloveKind::kTransforms, FoxgloveKind::kScene};

template <class Message>
Message parsed(const std::string& bytes) {
  Message message;
  EXPECT_TRUE(message.ParseFromString(bytes));
  return message;
}

template <class Vector>
Vec3 vec3(const Vector& v) {
  return {v.x(), v.y(), v.z()};
}
template <class Quaternion>
Quat quat(const Quaternion& q) {
  return {q.w(), q.x(), q.y(), q.z()};
}

DeviceState full_state() {
  DeviceState state;
  state.tick = 77;
  state.position = Vec3(0.01, -0.02, 0.03);
  state.velocity = Vec3(0.1, 0.2, 0.3);
  state.force_applied = Vec3(0, 3, 4);
  state.force_wanted = Vec3(-6, 0, 8);
  state.energy = 0.25;
  state.permitted_force = std::numeric_limits<double>::infinity();
  state.reasons = (Reasons(Reason::kEnergy) |= Reason::kDisarmed).bits();
  state.force_sequence = 9;
  state.force_age = std::chrono::microseconds(1500);
  state.mode = Mode::kHolding;
  state.channel = 2;
  state.stiffness_wanted = Mat3::Zero();
  (*state.stiffness_wanted)(0, 1) = 500;
  state.buttons = 5;
  state.turning = Turning{.orientation = {.w = 0, .x = 1, .y = 0, .z = 0}, .angular_velocity = Vec3(1, 2, 3)};
  state.torque_applied = Vec3(0, 0.3, 0.4);
  state.grip = Grip{.opening = 0.5, .velocity = -1};
  state.grip_applied = 2.5;
  state.field = FieldState{.generation = 3, .depth = 0.25, .proxy = Vec3(1, 2, 4)};
  state.hand_force = Vec3(1, 0, 0);
  return state;
}

TEST(FoxgloveMessage, EachSchemaHoldsItsTypeAndAllThatItImportsBeforeIt) {
  for (const FoxgloveKind kind : kKinds) {
    const auto set = parsed<google::protobuf::FileDescriptorSet>(foxglove_schema(kind));
    std::set<std::string> known;
    google::protobuf::DescriptorPool pool;
    for (const auto& file : set.file()) {
      for (const auto& import : file.dependency()) EXPECT_TRUE(known.contains(import)) << import;
      EXPECT_TRUE(known.insert(file.name()).second) << file.name() << " is there twice";
      ASSERT_NE(pool.BuildFile(file), nullptr);
    }
    EXPECT_NE(pool.FindMessageTypeByName(foxglove_schema_name(kind)), nullptr) << foxglove_schema_name(kind);
  }
  EXPECT_EQ(foxglove_schema_name(FoxgloveKind::kStep), "tendon.recording.v1.Step");
  EXPECT_EQ(foxglove_schema_name(FoxgloveKind::kScene), "foxglove.SceneUpdate");
}

TEST(FoxgloveMessage, AStateIsAStepUnderTheNamesOfARecording) {
  const DeviceState state = full_state();
  const auto step = parsed<recording::v1::Step>(step_payload(state));
  EXPECT_EQ(step.tick(), 77U);
  EXPECT_EQ(vec3(step.position_m()), state.position);
  EXPECT_EQ(vec3(step.velocity_mps()), state.velocity);
  EXPECT_EQ(vec3(step.force_applied_n()), state.force_applied);
  EXPECT_EQ(vec3(step.force_wanted_n()), *state.force_wanted);
  EXPECT_EQ(step.force_applied_norm_n(), 5);
  EXPECT_EQ(step.force_wanted_norm_n(), 10);
  EXPECT_EQ(step.permitted_n(), state.permitted_force);
  EXPECT_EQ(step.energy_j(), 0.25);
  EXPECT_EQ(step.reason_bits(), state.reasons);
  EXPECT_TRUE(step.reason().energy() && step.reason().disarmed() && step.disarmed());
  EXPECT_FALSE(step.reason().max_force());
  EXPECT_EQ(step.mode(), recording::v1::MODE_HOLDING);
  EXPECT_EQ(step.force_sequence(), 9U);
  EXPECT_EQ(step.force_age_ns(), 1'500'000);
  EXPECT_EQ(step.channel(), 2U);
  ASSERT_EQ(step.stiffness_wanted_n_per_m_size(), 9);
  EXPECT_EQ(step.stiffness_wanted_n_per_m(1), 500) << "by rows";
  EXPECT_EQ(step.buttons(), 5U);
  EXPECT_EQ(quat(step.turn().orientation()), state.turning->orientation);
  EXPECT_EQ(vec3(step.turn().angular_velocity_radps()), state.turning->angular_velocity);
  EXPECT_EQ(step.turn().torque_applied_norm_nm(), 0.5);
  EXPECT_EQ(step.grip().opening_rad(), 0.5);
  EXPECT_EQ(step.grip().velocity_radps(), -1);
  EXPECT_EQ(step.grip().force_applied_n(), 2.5);
  EXPECT_EQ(step.field().generation(), 3U);
  EXPECT_EQ(step.field().depth_m(), 0.25);
  EXPECT_EQ(step.field().proxy_m().z(), 4);
  EXPECT_EQ(vec3(step.hand_force_n()), *state.hand_force);
}

TEST(FoxgloveMessage, WhatAStateDoesNotKnowIsAbsent) {
  const auto step = parsed<recording::v1::Step>(step_payload({}));
  EXPECT_FALSE(step.has_force_wanted_n() || step.has_turn() || step.has_grip() || step.has_hand_force_n() ||
               step.has_field());
  EXPECT_FALSE(step.has_force_held_n() || step.has_force_commanded_n());
  EXPECT_EQ(step.stiffness_wanted_n_per_m_size(), 0);
}

TEST(FoxgloveMessage, EachReasonHasItsOwnField) {
  const auto* const fields = recording::v1::Reason::descriptor();
  for (int bit = 0; bit < fields->field_count(); ++bit) {
    DeviceState state;
    state.reasons = 1U << bit;
    const auto step = parsed<recording::v1::Step>(step_payload(state));
    for (int i = 0; i < fields->field_count(); ++i) {
      EXPECT_EQ(step.reason().GetReflection()->GetBool(step.reason(), fields->field(i)), i == bit)
          << fields->field(i)->name() << " of bit " << bit;
    }
  }
}

TEST(FoxgloveMessage, ReportsAreAsOnTheWire) {
  DeviceReport report;
  report.number = 3;
  report.steps = 1000;
  report.lateness[2] = 999;
  report.safety = Safety::kArmed;
  const auto device = parsed<v1::DeviceReport>(report_payload(report));
  EXPECT_EQ(device.steps(), 1000U);
  ASSERT_EQ(device.lateness_us_log2_size(), 3);
  EXPECT_EQ(device.safety(), v1::SAFETY_ARMED);
  PeerReport engine;
  engine.name = "wall";
  engine.link.lost = 4;
  const auto peer = parsed<v1::PeerReport>(report_payload(engine));
  EXPECT_EQ(peer.name(), "wall");
  EXPECT_EQ(peer.link().lost(), 4U);
}

TEST(FoxgloveMessage, TheOperatorsRightIsTheWorldsRightAndUpIsUp) {
  // In the base frame of a Falcon, x points to the user, y to the right, and z up.
  const Quat falcon{.w = 0.5, .x = -0.5, .y = -0.5, .z = -0.5};
  ASSERT_LT((rotated(falcon, Vec3::UnitZ()) - Vec3::UnitY()).norm(), 1e-12) << "z is up";
  const std::array devices = {Drawn{.name = "a", .operator_from_device = Quat{}, .state = full_state()},
                              Drawn{.name = "b", .place = 1, .operator_from_device = falcon},
                              Drawn{.name = "c", .place = 2}};
  const auto frames = parsed<foxglove::FrameTransforms>(transforms_payload(devices));
  ASSERT_EQ(frames.transforms_size(), 6);
  const auto in_world = [&](int device, const Vec3& v) {
    const auto& stand = frames.transforms(2 * device);
    EXPECT_EQ(stand.parent_frame_id(), "world");
    return rotated(quat(stand.rotation()), v);
  };
  EXPECT_LT((in_world(0, Vec3::UnitX()) - Vec3(0, -1, 0)).norm(), 1e-12) << "right is −y";
  EXPECT_LT((in_world(0, Vec3::UnitY()) - Vec3(0, 0, 1)).norm(), 1e-12) << "up is z";
  EXPECT_LT((in_world(0, Vec3::UnitZ()) - Vec3(-1, 0, 0)).norm(), 1e-12) << "to the user is −x";
  EXPECT_LT((in_world(1, Vec3::UnitZ()) - Vec3(0, 0, 1)).norm(), 1e-12);
  EXPECT_LT((in_world(1, Vec3::UnitY()) - Vec3(0, -1, 0)).norm(), 1e-12);
  EXPECT_LT((in_world(2, Vec3::UnitX()) - Vec3(1, 0, 0)).norm(), 1e-12) << "not known: the base frame's own axes";
  EXPECT_EQ(vec3(frames.transforms(2).translation()), Vec3(0, -kPlaceWidth, 0)) << "device 1 is to the right";
  const auto& handle = frames.transforms(1);
  EXPECT_EQ(handle.parent_frame_id() + " " + handle.child_frame_id(), "a_base a_handle");
  EXPECT_EQ(vec3(handle.translation()), full_state().position);
  EXPECT_EQ(quat(handle.rotation()), full_state().turning->orientation);
}

TEST(FoxgloveMessage, ArrowsBeginAtTheHandleAndAreACentimetreForEachNewton) {
  const DeviceState state = full_state();
  const auto update =
      parsed<foxglove::SceneUpdate>(scene_payload({.name = "a", .state = state, .at = 1'700'000'000'123'456'789}));
  ASSERT_EQ(update.entities_size(), 1);
  const auto& entity = update.entities(0);
  EXPECT_EQ(entity.frame_id() + " " + entity.id(), "a_base a");
  EXPECT_EQ(entity.timestamp().seconds(), 1'700'000'000);
  EXPECT_EQ(entity.timestamp().nanos(), 123'456'789);
  EXPECT_EQ(entity.lifetime().seconds(), 1);
  ASSERT_EQ(entity.arrows_size(), 2);
  const std::array forces = {*state.force_wanted, state.force_applied};
  for (int i = 0; i < 2; ++i) {
    const auto& arrow = entity.arrows(i);
    const Vec3& force = forces[static_cast<std::size_t>(i)];
    EXPECT_EQ(vec3(arrow.pose().position()), state.position);
    EXPECT_NEAR(arrow.shaft_length() + arrow.head_length(), kArrowLength * force.norm(), 1e-12);
    const Vec3 direction = rotated(quat(arrow.pose().orientation()), Vec3::UnitX());
    EXPECT_LT((direction - force.normalized()).norm(), 1e-12) << i;
  }
}

TEST(FoxgloveMessage, AnArrowMayPointAnyWayAndNoneIsDrawnOfNothing) {
  for (const Vec3& force : {Vec3(-1, 0, 0), Vec3(1, 0, 0), Vec3(-1, 1e-9, 0), Vec3(0, 0, -2), Vec3(-1, 1, 1)}) {
    DeviceState state;
    state.force_applied = force;
    const auto update = parsed<foxglove::SceneUpdate>(scene_payload({.name = "a", .state = state}));
    ASSERT_EQ(update.entities(0).arrows_size(), 1);
    const Vec3 direction = rotated(quat(update.entities(0).arrows(0).pose().orientation()), Vec3::UnitX());
    EXPECT_LT((direction - force.normalized()).norm(), 1e-6) << force.transpose();
  }
  DeviceState state;
  state.force_wanted = Vec3(0.005, 0, 0);
  state.force_applied = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(parsed<foxglove::SceneUpdate>(scene_payload({.name = "a", .state = state})).entities(0).arrows_size(), 0);
}

TEST(FoxgloveMessage, AStylusLiesBehindItsTipAndABallHasNoDirection) {
  DeviceState state = full_state();
  const auto stylus = parsed<foxglove::SceneUpdate>(scene_payload({.name = "a", .state = state})).entities(0);
  ASSERT_EQ(stylus.cylinders_size(), 1);
  const Vec3 middle = vec3(stylus.cylinders(0).pose().position()) - state.position;
  // After half a turn about x, the tip (−z of the handle frame) points along +z of the base frame.
  EXPECT_LT((middle.normalized() - Vec3(0, 0, -1)).norm(), 1e-12);
  EXPECT_NEAR(middle.norm(), stylus.cylinders(0).size().z() / 2, 1e-12);
  state.turning.reset();
  const auto ball = parsed<foxglove::SceneUpdate>(scene_payload({.name = "a", .state = state})).entities(0);
  EXPECT_EQ(ball.cylinders_size(), 0);
  EXPECT_EQ(vec3(ball.spheres(0).pose().position()), state.position);
}

}  // namespace
}  // namespace tendon::dash::foxglove_message_test
