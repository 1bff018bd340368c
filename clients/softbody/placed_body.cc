// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/placed_body.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/base/arithmetic.h"

namespace tendon::softbody {

PlacedBody::PlacedBody(const Scene& scene)
    : body_(scene.body),
      to_device_(Eigen::Quaterniond::FromTwoVectors(body_.normal(), scene.towards_hand).toRotationMatrix()),
      origin_(scene.at - to_device_ * body_.touch_point()),
      normal_(to_device_ * body_.normal()),
      only_pushes_(scene.body.side == PatchContact::Side::kUnilateral),
      depths_(scene.table) {}

Feel PlacedBody::touch(const Vec3& position) {
  Feel feel = body_.touch(to_device_.transpose() * (position - origin_));
  feel.force = to_device_ * feel.force;
  feel.stiffness = to_device_ * feel.stiffness * to_device_.transpose();
  return feel;
}

Touch PlacedBody::answer(const DeviceState& hand) {
  const DenormalsOff off;
  if (body_.has_clock()) tick(hand.sampled);
  const Feel feel = body_.step() > 0 ? follow(hand) : touch(hand.position);
  deepest_ = std::max(deepest_, -feel.gap);
  Touch touch = feel.force;
  touch.stiffness = feel.stiffness;
  touch.valid_radius = feel.valid_radius;
  touch.error = feel.error;
  touch.topology_changed = feel.topology_changed;
  if (only_pushes_ && std::isfinite(feel.gap)) {
    touch.contact = Contact{.normal = normal_, .gap = feel.gap, .table = table(hand.position, feel.gap)};
  }
  return touch;
}

void PlacedBody::tick(PeerTime sampled) {
  if (!first_) first_ = sampled;
  body_.tick(seconds(sampled - *first_));
}

std::optional<ForceTable> PlacedBody::table(const Vec3& position, double gap) {
  if (depths_ <= 0 || gap > depths_) return std::nullopt;
  ForceTable table{.first = std::max(gap, -depths_ / 2), .step = depths_ / (ForceTable::kMaxEntries - 1)};
  for (; table.size < ForceTable::kMaxEntries; ++table.size) {
    const double depth = table.first + table.size * table.step;
    try {
      table.force[table.size] = normal_.dot(touch(position - depth * normal_).force);
    } catch (const std::out_of_range&) {
      break;  // at this depth the tool would touch more than the condensed part
    }
  }
  return table.size >= ForceTable::kMinEntries ? std::optional(table) : std::nullopt;
}

Feel PlacedBody::follow(const DeviceState& hand) {
  const Duration step = std::max(Duration(1), from_seconds(body_.step()));
  const Duration past = followed_ ? hand.sampled - followed_->sampled : Duration(-1);
  if (past < Duration(0) || past > kMostBehind) {
    followed_ = {hand.sampled, hand.position, Duration(0), touch(hand.position)};
    return followed_->feel;
  }
  const Vec3 from = followed_->position;
  Duration owed = followed_->owed + past;
  const auto steps = owed / step;
  bool changed = false;
  for (auto i = steps; i > 0; --i) {
    owed -= step;
    const double share = past > Duration(0) ? std::min(1.0, seconds(owed) / seconds(past)) : 0;  // of the way, ahead
    followed_->feel = touch(hand.position + share * (from - hand.position));
    changed = changed || followed_->feel.topology_changed;
  }
  followed_->feel.topology_changed = changed;
  followed_->sampled = hand.sampled;
  followed_->position = hand.position;
  followed_->owed = owed;
  return followed_->feel;
}

}  // namespace tendon::softbody
