// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/engine/penalty_contact.h"

#include <cmath>
#include <limits>

#include "protocol/expect.h"

namespace tendon {

PenaltyContact::PenaltyContact(const Config& config) : config_(config) {
  expect_not_negative(config.stiffness, "stiffness");
  expect_not_negative(config.damping, "damping");
}

Touch PenaltyContact::touch(const SurfacePoint& surface, const Vec3& velocity) const noexcept {
  const double length = surface.normal.norm();
  if (!std::isfinite(surface.distance) || !(length > 0) || !std::isfinite(length) || !velocity.allFinite())
    return Vec3(Vec3::Constant(std::numeric_limits<double>::quiet_NaN()));
  Touch felt;
  felt.stiffness = Mat3::Zero();
  if (surface.distance >= 0) return felt;
  const Vec3 normal = surface.normal / length;
  const double push = -config_.stiffness * surface.distance - config_.damping * velocity.dot(normal);
  if (push <= 0) return felt;
  felt.force = push * normal;
  felt.stiffness = config_.stiffness * (normal * normal.transpose() + surface.distance * surface.curvature);
  return felt;
}

}  // namespace tendon
