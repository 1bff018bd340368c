// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/vrpn/vrpn_force.h"

#include <algorithm>
#include <utility>

namespace tendon::bridge::vrpn {
namespace {

constexpr double kRounding = 1e-9;  ///< the hand can slip while it does not move

}  // namespace

void Drawing::draw(const ForceField& field) {
  field_.reset();
  if (!field.force.isZero(0) || !field.jacobian.isZero(0)) field_ = field;
}

bool Drawing::draw(const Plane& plane) {
  if (plane.index < 0 || static_cast<std::size_t>(plane.index) >= kPlanes) return false;
  auto& surface = surfaces_[static_cast<std::size_t>(plane.index)];
  const double length = plane.normal.norm();
  if (!(length > 0)) {
    surface.reset();
    return true;
  }
  if (!surface) surface.emplace();
  surface->plane = plane;  // the bristle keeps its deflection when the plane moves
  surface->plane.normal /= length;
  surface->plane.offset /= length;
  surface->plane.spring = std::clamp(plane.spring, 0.0, 1.0);
  surface->plane.static_friction = std::clamp(plane.static_friction, 0.0, 1.0);
  const double sticks = surface->plane.static_friction;
  surface->plane.dynamic_friction = std::clamp(plane.dynamic_friction, kLeastSlip * sticks, sticks);
  return true;
}

bool Drawing::empty() const {
  return !field_ && std::ranges::none_of(surfaces_, [](const auto& surface) { return surface.has_value(); });
}

Vec3 Drawing::friction(Surface& surface, const Vec3& at, double pressure) {
  const Vec3 along = at - surface.plane.normal.dot(at) * surface.plane.normal;
  if (!surface.foot) {
    surface.foot = along;
    surface.slips = false;
  }
  const Vec3 bend = along - *surface.foot;
  const double length = bend.norm();
  const double sticks = surface.plane.static_friction;
  if (sticks <= 0) return Vec3::Zero();
  const double share = surface.plane.dynamic_friction / sticks;
  const double longest = surface.slips ? share * kBristle : kBristle;
  surface.slips = length >= longest * (1 - kRounding);
  if (!surface.slips) return -sticks * pressure / kBristle * bend;
  const Vec3 bent = share * kBristle / length * bend;
  surface.foot = along - bent;
  return -sticks * pressure / kBristle * bent;
}

Touch Drawing::touch(const Hand& hand, double stiffest) {
  Touch touch;
  Mat3 stiffness = Mat3::Zero();
  int felt = 0;
  if (field_) {
    const Vec3 from_origin = hand.position - field_->origin;
    const double left = field_->radius - from_origin.norm();
    if (left >= 0) {
      touch.force = field_->force + field_->jacobian * from_origin;
      stiffness = -field_->jacobian;
      touch.valid_radius = left;
      ++felt;
    }
  }
  std::optional<Contact> contact;
  for (auto& surface : surfaces_) {
    if (!surface) continue;
    const Vec3& normal = surface->plane.normal;
    const double gap = normal.dot(hand.position) + surface->plane.offset;
    if (gap >= 0) {
      surface->foot.reset();
      continue;
    }
    const double spring = surface->plane.spring * stiffest;
    const double damping = surface->plane.damping >= kLeastDamping ? surface->plane.damping : 0;
    const double pressure = std::max(0.0, -spring * gap - damping * normal.dot(hand.velocity));
    touch.force += pressure * normal + friction(*surface, hand.position, pressure);
    stiffness += spring * normal * normal.transpose();
    contact = Contact{.normal = normal, .gap = gap};
    ++felt;
  }
  if (felt > 0) touch.stiffness = stiffness;
  if (felt == 1) touch.contact = contact;
  return touch;
}

Touch in_base_frame(Touch touch, const View& view) {
  touch.force = view.base_force(touch.force);
  if (touch.stiffness) touch.stiffness = view.base_stiffness(*touch.stiffness);
  if (touch.contact) touch.contact->normal = view.base_force(touch.contact->normal);
  return touch;
}

}  // namespace tendon::bridge::vrpn
