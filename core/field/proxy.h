// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/field/primitives.h"

namespace tendon::field {

inline constexpr int kProxyRounds = 2;      ///< more rounds do not reduce the error of the force noticeably
inline constexpr double kOnSurface = 2e-6;  ///< m, tolerance of contact

struct Proxy {
  Vec3 position = Vec3::Zero();  ///< p
  Vec3 normal = Vec3::UnitZ();   ///< unit vector out of the solid, at the last contact
  std::uint8_t material = 0;     ///< at the last contact
  bool touching = false;
};

/// Moves the proxy (god object) p towards the hand x. In contact, the proxy stays on the surface. In each
/// of kProxyRounds rounds, with h the spacing of the field:
///     φ(p) > 0    p towards x by max(φ, h/4), at most to x                 sphere tracing
///     otherwise   p ← p − φ ∇φ/‖∇φ‖²                                       Newton's step, at most 3 h
///                 p towards x by h/4 if x is outside of the tangent plane
///                 p along the tangent of p − x, by t − μ n if this is positive, at most 2 h, and a Newton step
/// where n and t are the normal and the tangential distance from p to x: the proxy stops on the border of the friction
/// cone. In a concave edge that is sharper than n, this overshoots: if t − μ n changes its sign by more than half, p
/// goes to the zero of the chord. The minimum of h/4 prevents drag near a surface. A wall must be at least h
/// thick. If the gradient is unknown, deep in a solid, p is x.
///
/// `Surface` has `SurfacePoint at(Vec3)` and `double spacing()` (h, m). Source: Zilles and Salisbury, "A
/// constraint-based god-object method for haptic display", IROS 1995; Ruspini, Kolarov and Khatib, SIGGRAPH 1997; Hart,
/// "Sphere tracing", The Visual Computer 12, 1996. `Surface::at` is called at most six times. Realtime-safe: yes, if
/// `Surface::at` is.
template <class Surface>
Proxy moved(const Surface& surface, const Proxy& before, const Vec3& x, double friction) noexcept {
  const double least = surface.spacing() / 4;
  const double most_newton = 3 * surface.spacing();
  const double most_slide = 2 * surface.spacing();
  Proxy proxy = before;
  proxy.touching = false;
  const auto go_towards_hand = [&](double way) {
    const Vec3 rest = x - proxy.position;
    const double far = rest.norm();
    proxy.position = far > way ? Vec3(proxy.position + rest * (way / far)) : x;
  };
  const auto newton = [&](const SurfacePoint& point, double steepness) {
    const double way = std::clamp(point.distance / steepness, -most_newton, most_newton);
    proxy.position -= point.gradient * (way / steepness);
  };
  for (int round = 0; round < kProxyRounds; ++round) {
    const SurfacePoint point = surface.at(proxy.position);
    if (point.distance > kOnSurface) {
      proxy.touching = false;
      if (proxy.position == x) break;
      go_towards_hand(std::max(point.distance, least));
      continue;
    }
    const double steepness = point.gradient.norm();
    if (!(steepness > 1e-6)) {
      proxy.position = x;
      proxy.touching = false;
      break;
    }
    newton(point, steepness);
    proxy.normal = point.gradient / steepness;
    proxy.material = point.material;
    const Vec3 rest = x - proxy.position;
    const double depth = -rest.dot(proxy.normal);
    if (depth <= 0) {
      proxy.touching = false;
      go_towards_hand(least);
      continue;
    }
    proxy.touching = true;
    const Vec3 along = rest + depth * proxy.normal;
    const double side = along.norm();
    const double slide = side - friction * depth;
    if (!(slide > 0)) break;
    const Vec3 from = proxy.position;
    const double way = std::min(slide, most_slide);
    proxy.position += along * (way / side);
    SurfacePoint there = surface.at(proxy.position);
    double there_steep = there.gradient.norm();
    if (!(there_steep > 1e-6)) continue;
    newton(there, there_steep);
    const Vec3 normal = there.gradient / there_steep;
    const Vec3 left = x - proxy.position;
    const double left_depth = -left.dot(normal);
    const double excess = (left + left_depth * normal).dot(along) / side - friction * std::max(left_depth, 0.0);
    if (!(excess < -0.5 * way)) continue;
    proxy.position = from + (proxy.position - from) * (way / (way - excess));
    there = surface.at(proxy.position);
    there_steep = there.gradient.norm();
    if (there_steep > 1e-6) newton(there, there_steep);
  }
  return proxy;
}

}  // namespace tendon::field
