// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <variant>

#include "core/base/motion.h"

/// Fields: shapes that an engine describes once, and that the haptic thread renders. All lengths are in m. Positions
/// are in the frame of the object unless noted otherwise.
namespace tendon::field {

/// The signed distance and its gradient at a position.
struct SurfacePoint {
  double distance = 0;           ///< φ: m to the surface, negative inside the solid
  Vec3 gradient = Vec3::Zero();  ///< ∇φ, of length 1 for primitives; zero if the direction is unknown
  std::uint8_t material = 0;     ///< index of the material of the nearest surface
};

/// A half-space. n·(x − at) is negative inside the solid.
struct Plane {
  Vec3 at = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ();  ///< n, a unit vector out of the solid
};

struct Sphere {
  Vec3 centre = Vec3::Zero();
  double radius = 0;  ///< > 0
};

/// All points within `radius` of the line from `from` to `to`. The ends may be equal.
struct Capsule {
  Vec3 from = Vec3::Zero();
  Vec3 to = Vec3::Zero();
  double radius = 0;  ///< > 0
};

/// A box with sides of 2 `half` and edges that are rounded with `rounding`, turned by `turn` about its centre.
struct Box {
  Vec3 centre = Vec3::Zero();
  Vec3 half = Vec3::Zero();  ///< > 0
  double rounding = 0;       ///< 0 … the least of `half`
  Quat turn{};
};

struct Primitive {
  std::variant<Plane, Sphere, Capsule, Box> shape{};
  bool hollow = false;  ///< the solid is everything outside the shape: a bowl, a tube, a room
  std::uint8_t material = 0;
};

/// Throws std::invalid_argument with the name of the field if a value is not finite or out of range.
void expect_valid(const Primitive& primitive);

/// Returns φ and ∇φ of one primitive:
///     plane    n·(x − at)
///     sphere   ‖x − c‖ − r
///     capsule  ‖x − a − s (b − a)‖ − r,   s = clamp((x − a)·(b − a)/‖b − a‖², 0, 1)
///     box      ‖max(q, 0)‖ + min(max(q₁, q₂, q₃), 0) − r,   q = |R⁻¹(x − c)| − half + r
///     hollow   −φ, −∇φ
/// Where φ has no gradient, as in the centre of a sphere, ∇φ is one of the unit vectors beside it.
/// Realtime-safe: yes.
SurfacePoint distance(const Primitive& primitive, const Vec3& x) noexcept;

}  // namespace tendon::field
