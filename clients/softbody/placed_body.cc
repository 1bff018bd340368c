// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/placed_body.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "clients/softbody/field_of.h"
#include "core/base/arithmetic.h"
#include "protocol/rotation.h"

namespace tendon::softbody {

PlacedBody::PlacedBody(const Scene& scene, Body body)
    : body_(std::move(body)),
      to_device_(to_device(scene)),
      origin_(scene.at - to_device_ * body_.touch_point()),
      normal_(to_device_ * body_.normal()),
      only_pushes_(scene.body.side == PatchContact::Side::kUnilateral),
      turns_(turns_the_hand(scene.body)),
      tool_(lowest_of_tool(scene.body, Mat3::Identity()).norm()),
      depths_(scene.table) {
  for (const Scene::Hand& hand : scene.hands) origins_.emplace_back(hand.at - to_device_ * body_.touch_point());
}

Pose PlacedBody::to_body(const Pose& handle, const Vec3& origin) const {
  return {to_device_.transpose() * (handle.position - origin), to_device_.transpose() * handle.turn};
}

Feel PlacedBody::touch(const Pose& handle) {
  const Pose placed = to_body(handle, origin_);
  Feel feel = turns_ ? body_.touch(placed) : body_.touch(placed.position);
  turn_to_device(feel);
  return feel;
}

void PlacedBody::turn_to_device(Feel& feel) const {
  feel.force = to_device_ * feel.force;
  feel.stiffness = to_device_ * feel.stiffness * to_device_.transpose();
  if (feel.torque) {
    feel.torque->torque = to_device_ * feel.torque->torque;
    feel.torque->stiffness = to_device_ * feel.torque->stiffness * to_device_.transpose();
  }
  if (feel.normal) feel.normal = to_device_ * *feel.normal;
}

Pose PlacedBody::pose(const DeviceState& hand) const {
  Pose pose{.position = hand.position};
  if (!turns_ || !hand.turning) return pose;
  const Quat q = unit(hand.turning->orientation);
  pose.turn << rotated(q, Vec3::UnitX()), rotated(q, Vec3::UnitY()), rotated(q, Vec3::UnitZ());
  return pose;
}

Touch PlacedBody::answer(const DeviceState& hand) {
  const DenormalsOff off;
  if (body_.has_clock()) tick(hand.sampled);
  return touch_of(body_.step() > 0 ? follow(hand) : touch(pose(hand)), hand);
}

std::vector<Touch> PlacedBody::answer(std::span<const std::optional<DeviceState>> hands) {
  const DenormalsOff off;
  std::vector<std::optional<Pose>> handles(hands.size());
  for (std::size_t i = 0; i < hands.size(); ++i) {
    if (hands[i]) handles[i] = to_body(pose(*hands[i]), origins_.at(i));
  }
  std::vector<Feel> feels = body_.touch(handles);
  std::vector<Touch> touches(hands.size());
  for (std::size_t i = 0; i < hands.size(); ++i) {
    turn_to_device(feels.at(i));
    if (hands[i]) {
      touches[i] = touch_of(feels[i], *hands[i]);
    } else {
      touches[i].unknown = true;
    }
  }
  return touches;
}

Field PlacedBody::field(const Scene::Upload& upload) const {
  Triangles shape = body_.rest_shape();
  for (Vec3& point : shape.points) point = origin_ + to_device_ * point;
  Field field;
  try {
    field = field_of(shape, {.spacing = upload.spacing}, "the surface of the body", tool_);
  } catch (const std::invalid_argument& refused) {
    std::ostringstream text;
    text << "[field] with spacing_mm = " << 1e3 * upload.spacing << ": " << refused.what();
    throw std::invalid_argument(text.str());
  }
  FieldMaterial& material = field.materials.front();
  material.stiffness = upload.stiffness;
  material.friction = upload.friction;
  material.relaxation = upload.relaxation.value_or(0);
  if (upload.relaxation) material.branch_stiffness = upload.branch_stiffness.value_or(upload.stiffness);
  return field;
}

Touch PlacedBody::touch_of(const Feel& feel, const DeviceState& hand) {
  deepest_ = std::max(deepest_, -feel.gap);
  Touch touch = feel.force;
  touch.stiffness = feel.stiffness;
  touch.valid_radius = feel.valid_radius;
  touch.error = feel.error;
  touch.way = static_cast<std::uint32_t>(feel.way);
  touch.topology_changed = feel.topology_changed;
  if (only_pushes_ && std::isfinite(feel.gap)) {
    touch.contact =
        Contact{.normal = feel.normal.value_or(normal_), .gap = feel.gap, .table = table(pose(hand), feel.gap)};
  }
  if (feel.torque) {
    touch.torque = feel.torque->torque;
    if (hand.turning) touch.angular_stiffness = feel.torque->stiffness;
  }
  return touch;
}

void PlacedBody::tick(PeerTime sampled) {
  if (!first_) first_ = sampled;
  body_.tick(seconds(sampled - *first_));
}

std::optional<ForceTable> PlacedBody::table(const Pose& handle, double gap) {
  if (depths_ <= 0 || gap > depths_) return std::nullopt;
  ForceTable table{.first = std::max(gap, -depths_ / 2), .step = depths_ / (ForceTable::kMaxEntries - 1)};
  for (; table.size < ForceTable::kMaxEntries; ++table.size) {
    const double depth = table.first + table.size * table.step;
    try {
      table.force[table.size] = normal_.dot(touch(Pose{handle.position - depth * normal_, handle.turn}).force);
    } catch (const std::out_of_range&) {
      break;  // outside the table
    }
  }
  return table.size >= ForceTable::kMinEntries ? std::optional(table) : std::nullopt;
}

Feel PlacedBody::follow(const DeviceState& hand) {
  const Duration step = std::max(Duration(1), from_seconds(body_.step()));
  const Pose now = pose(hand);
  const Duration past = followed_ ? hand.sampled - followed_->sampled : Duration(-1);
  if (past < Duration(0) || past > kMostBehind) {
    followed_ = {hand.sampled, now, Duration(0), touch(now)};
    return followed_->feel;
  }
  const Pose from = followed_->handle;
  Duration owed = followed_->owed + past;
  const auto steps = owed / step;
  bool changed = false;
  for (auto i = steps; i > 0; --i) {
    owed -= step;
    const double share = past > Duration(0) ? std::min(1.0, seconds(owed) / seconds(past)) : 0;
    // Interpolated as matrices, so that the center of the tool moves on a line.
    followed_->feel =
        touch(Pose{now.position + share * (from.position - now.position), now.turn + share * (from.turn - now.turn)});
    changed = changed || followed_->feel.topology_changed;
  }
  followed_->feel.topology_changed = changed;
  followed_->sampled = hand.sampled;
  followed_->handle = now;
  followed_->owed = owed;
  return followed_->feel;
}

}  // namespace tendon::softbody
