// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/foxglove_message.h"

#include <google/protobuf/descriptor.pb.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "foxglove.pb.h"
#include "protocol/rotation.h"
#include "protocol/wire/codec.h"
#include "recording.pb.h"
#include "tendon.pb.h"

namespace tendon::dash {
namespace {

namespace recorded = tendon::recording::v1;

constexpr double kLeastDrawn = 0.01;       ///< N, smaller forces have no arrow
constexpr double kBall = 0.02;             ///< m, diameter of the handle
constexpr double kStylusLength = 0.1;      ///< m
constexpr double kStylusDiameter = 0.008;  ///< m

/// Rotates the operator frame (x right, y up, z to the user) to the world frame (x forward, y left, z up).
constexpr Quat kWorldFromOperator{.w = 0.5, .x = 0.5, .y = -0.5, .z = -0.5};

const google::protobuf::Descriptor* descriptor_of(FoxgloveKind kind) {
  switch (kind) {
    case FoxgloveKind::kStep:
      return recorded::Step::descriptor();
    case FoxgloveKind::kDevice:
      return tendon::v1::DeviceReport::descriptor();
    case FoxgloveKind::kPeer:
      return tendon::v1::PeerReport::descriptor();
    case FoxgloveKind::kTransforms:
      return foxglove::FrameTransforms::descriptor();
    case FoxgloveKind::kScene:
      return foxglove::SceneUpdate::descriptor();
  }
  throw std::logic_error("unknown kind of channel");
}

void add_file(const google::protobuf::FileDescriptor& file, google::protobuf::FileDescriptorSet& set) {
  if (std::ranges::any_of(set.file(), [&](const auto& one) { return one.name() == file.name(); })) return;
  for (int i = 0; i < file.dependency_count(); ++i) add_file(*file.dependency(i), set);
  file.CopyTo(set.add_file());
}

void put_recorded(recorded::Vec3* out, const Vec3& v) {
  out->set_x(v.x());
  out->set_y(v.y());
  out->set_z(v.z());
}

void put_reasons(recorded::Reason* out, Reasons reasons) {
  out->set_energy(reasons.has(Reason::kEnergy));
  out->set_max_force(reasons.has(Reason::kMaxForce));
  out->set_slew(reasons.has(Reason::kSlew));
  out->set_ramp_in(reasons.has(Reason::kRampIn));
  out->set_held(reasons.has(Reason::kHeld));
  out->set_decaying(reasons.has(Reason::kDecaying));
  out->set_safe_stop(reasons.has(Reason::kSafeStop));
  out->set_not_finite(reasons.has(Reason::kNotFinite));
  out->set_fault(reasons.has(Reason::kFault));
  out->set_device_clamp(reasons.has(Reason::kDeviceClamp));
  out->set_overrun(reasons.has(Reason::kOverrun));
  out->set_watchdog(reasons.has(Reason::kWatchdog));
  out->set_unseen(reasons.has(Reason::kUnseen));
  out->set_disarmed(reasons.has(Reason::kDisarmed));
  out->set_damped(reasons.has(Reason::kDamped));
  out->set_acceleration(reasons.has(Reason::kAcceleration));
}

template <class Vector>
void put_drawn(Vector* out, const Vec3& v) {
  out->set_x(v.x());
  out->set_y(v.y());
  out->set_z(v.z());
}

void put_drawn(foxglove::Quaternion* out, const Quat& q) {
  out->set_w(q.w);
  out->set_x(q.x);
  out->set_y(q.y);
  out->set_z(q.z);
}

void put_pose(foxglove::Pose* out, const Vec3& position, const Quat& orientation) {
  put_drawn(out->mutable_position(), position);
  put_drawn(out->mutable_orientation(), orientation);
}

struct Shade {
  double r = 0;
  double g = 0;
  double b = 0;
  double a = 1;
};
// The wanted force is drawn thicker and transparent because the two arrows often coincide.
constexpr Shade kWantedShade{0.55, 0.6, 0.65, 0.4};
constexpr Shade kAppliedShade{0.9, 0.45, 0.1};
constexpr Shade kHandleShade{0.2, 0.45, 0.8};

void put_shade(foxglove::Color* out, const Shade& shade) {
  out->set_r(shade.r);
  out->set_g(shade.g);
  out->set_b(shade.b);
  out->set_a(shade.a);
}

template <class Stamp>
void put_stamp(Stamp* out, UnixTime at) {
  out->set_seconds(at / 1'000'000'000);
  out->set_nanos(static_cast<std::int32_t>(at % 1'000'000'000));
}

/// Returns the shortest rotation from +x to the unit vector `direction`.
Quat from_x_to(const Vec3& direction) {
  // At 180° any perpendicular axis is valid.
  if (direction.x() < -0.999999) return {.w = 0, .x = 0, .y = 0, .z = 1};
  return unit({.w = 1 + direction.x(), .x = 0, .y = -direction.z(), .z = direction.y()});  // 1 + x·d, x × d
}

void add_arrow(foxglove::SceneEntity& entity, const Vec3& from, const Vec3& force, double diameter,
               const Shade& shade) {
  const double size = force.norm();
  if (!std::isfinite(size) || size < kLeastDrawn) return;
  const double length = size * kArrowLength;
  const double head = std::min(length / 2, 3 * diameter);
  foxglove::ArrowPrimitive& arrow = *entity.add_arrows();
  put_pose(arrow.mutable_pose(), from, from_x_to(force / size));
  arrow.set_shaft_length(length - head);
  arrow.set_shaft_diameter(diameter);
  arrow.set_head_length(head);
  arrow.set_head_diameter(2 * diameter);
  put_shade(arrow.mutable_color(), shade);
}

Quat orientation_of(const DeviceState& state) { return state.turning ? state.turning->orientation : Quat{}; }

}  // namespace

std::string foxglove_schema_name(FoxgloveKind kind) { return descriptor_of(kind)->full_name(); }

std::string foxglove_schema(FoxgloveKind kind) {
  google::protobuf::FileDescriptorSet set;
  add_file(*descriptor_of(kind)->file(), set);
  return set.SerializeAsString();
}

std::string step_payload(const DeviceState& state) {
  recorded::Step out;
  out.set_tick(state.tick);
  put_recorded(out.mutable_position_m(), state.position);
  put_recorded(out.mutable_velocity_mps(), state.velocity);
  if (state.force_wanted) {
    put_recorded(out.mutable_force_wanted_n(), *state.force_wanted);
    out.set_force_wanted_norm_n(state.force_wanted->norm());
  }
  put_recorded(out.mutable_force_applied_n(), state.force_applied);
  out.set_force_applied_norm_n(state.force_applied.norm());
  out.set_permitted_n(state.permitted_force);
  out.set_energy_j(state.energy);
  const Reasons reasons = Reasons::from_bits(state.reasons);
  out.set_reason_bits(state.reasons);
  put_reasons(out.mutable_reason(), reasons);
  out.set_mode(static_cast<recorded::Mode>(state.mode));
  out.set_force_sequence(state.force_sequence);
  out.set_force_age_ns(state.force_age.count());
  if (state.hand_force) put_recorded(out.mutable_hand_force_n(), *state.hand_force);
  out.set_channel(state.channel);
  if (state.stiffness_wanted) {
    for (const auto row : state.stiffness_wanted->rowwise()) {
      for (const double entry : row) out.add_stiffness_wanted_n_per_m(entry);
    }
  }
  out.set_disarmed(reasons.has(Reason::kDisarmed));
  out.set_buttons(state.buttons);
  if (state.turning) {
    recorded::Turn& turn = *out.mutable_turn();
    const Quat& q = state.turning->orientation;
    turn.mutable_orientation()->set_w(q.w);
    turn.mutable_orientation()->set_x(q.x);
    turn.mutable_orientation()->set_y(q.y);
    turn.mutable_orientation()->set_z(q.z);
    put_recorded(turn.mutable_angular_velocity_radps(), state.turning->angular_velocity);
    if (state.torque_applied) {
      put_recorded(turn.mutable_torque_applied_nm(), *state.torque_applied);
      turn.set_torque_applied_norm_nm(state.torque_applied->norm());
    }
  }
  if (state.grip) {
    recorded::Grip& grip = *out.mutable_grip();
    grip.set_opening_rad(state.grip->opening);
    grip.set_velocity_radps(state.grip->velocity);
    if (state.grip_applied) grip.set_force_applied_n(*state.grip_applied);
  }
  if (state.field) {
    recorded::Field& field = *out.mutable_field();
    field.set_generation(state.field->generation);
    field.set_depth_m(state.field->depth);
    put_recorded(field.mutable_proxy_m(), state.field->proxy);
  }
  return out.SerializeAsString();
}

std::string report_payload(const DeviceReport& report) { return message_of(report); }
std::string report_payload(const PeerReport& report) { return message_of(report); }

std::string transforms_payload(std::span<const Drawn> devices) {
  foxglove::FrameTransforms out;
  for (const Drawn& device : devices) {
    const std::string base = device.name + "_base";
    foxglove::FrameTransform& stand = *out.add_transforms();
    put_stamp(stand.mutable_timestamp(), device.at);
    stand.set_parent_frame_id("world");
    stand.set_child_frame_id(base);
    put_drawn(stand.mutable_translation(), Vec3(0, -kPlaceWidth * device.place, 0));
    put_drawn(stand.mutable_rotation(),
              device.operator_from_device ? product(kWorldFromOperator, *device.operator_from_device) : Quat{});
    foxglove::FrameTransform& handle = *out.add_transforms();
    put_stamp(handle.mutable_timestamp(), device.at);
    handle.set_parent_frame_id(base);
    handle.set_child_frame_id(device.name + "_handle");
    put_drawn(handle.mutable_translation(), device.state.position);
    put_drawn(handle.mutable_rotation(), orientation_of(device.state));
  }
  return out.SerializeAsString();
}

std::string scene_payload(const Drawn& device) {
  foxglove::SceneUpdate out;
  foxglove::SceneEntity& entity = *out.add_entities();
  put_stamp(entity.mutable_timestamp(), device.at);
  entity.set_frame_id(device.name + "_base");
  entity.set_id(device.name);
  entity.mutable_lifetime()->set_seconds(1);
  const Vec3& at = device.state.position;
  foxglove::SpherePrimitive& ball = *entity.add_spheres();
  const double diameter = device.state.turning ? 1.5 * kStylusDiameter : kBall;
  put_pose(ball.mutable_pose(), at, Quat{});
  put_drawn(ball.mutable_size(), Vec3::Constant(diameter));
  put_shade(ball.mutable_color(), kHandleShade);
  if (device.state.turning) {
    const Quat& q = device.state.turning->orientation;
    foxglove::CylinderPrimitive& stylus = *entity.add_cylinders();
    put_pose(stylus.mutable_pose(), at + rotated(q, Vec3(0, 0, kStylusLength / 2)), q);
    put_drawn(stylus.mutable_size(), Vec3(kStylusDiameter, kStylusDiameter, kStylusLength));
    stylus.set_bottom_scale(1);
    stylus.set_top_scale(1);
    put_shade(stylus.mutable_color(), kHandleShade);
  }
  if (device.state.force_wanted) add_arrow(entity, at, *device.state.force_wanted, 0.005, kWantedShade);
  add_arrow(entity, at, device.state.force_applied, 0.003, kAppliedShade);
  return out.SerializeAsString();
}

}  // namespace tendon::dash
