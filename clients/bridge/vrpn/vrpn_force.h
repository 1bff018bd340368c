// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "clients/bridge/view.h"
#include "clients/bridge/vrpn/vrpn_message.h"
#include "clients/cpp/force_client.h"

namespace tendon::bridge::vrpn {

/// Motion of the hand in the frame of the program.
struct Hand {
  Vec3 position = Vec3::Zero();  ///< m
  Vec3 velocity = Vec3::Zero();  ///< m/s
};

struct Surface {
  Plane plane;                 ///< with a unit normal
  std::optional<Vec3> foot{};  ///< end point of the bristle; empty: the hand is outside
  bool slips = false;
};

/// The forces that a program has requested for a device, the sum of a force field and four planes:
///
///     plane    gap = (n·x + d) / |n|          negative: the hand is inside
///              N = k (−gap) − b n·v, ≥ 0      along +n; k = spring · stiffest, spring clamped to 0 … 1
///              stiffness k n nᵀ               b = damping (N·s/m); 0 if damping < 0.1, which is in units of an
///                                             obsolete library
///     friction −μ N (bristle / 0.2 mm)        Dahl model: the bristle follows the hand along the plane, at most 0.2 mm
///                                             behind. It sticks with the static μ; at the limit it slips with the
///                                             dynamic μ until the hand reverses
///
/// A single plane is also sent as a Contact, so that it never pulls between two answers. In combination with other
/// forces it is not, because a Contact would remove their pull. Coefficients are clamped to 0 … 1, as in VRPN's server,
/// and the dynamic coefficient to the static one.
///
/// Thread-safe: no. Realtime-safe: yes.
class Drawing {
 public:
  static constexpr std::size_t kPlanes = 4;
  static constexpr double kLeastDamping = 0.1;
  static constexpr double kBristle = 0.2e-3;  ///< m
  /// The minimum ratio of dynamic to static friction. A bristle with no deflection would have no slip direction and
  /// would stick again immediately.
  static constexpr double kLeastSlip = 0.1;

  void draw(const ForceField& field);  ///< replaces the field; one without force and jacobian removes it
  bool draw(const Plane& plane);       ///< replaces the plane of its index, false if invalid; a zero normal removes it
  bool empty() const;

  /// Returns the force on the hand in the program's frame. `stiffest` (N/m) is that of spring 1. Updates the bristles.
  Touch touch(const Hand& hand, double stiffest);

 private:
  static Vec3 friction(Surface& surface, const Vec3& at, double pressure);

  std::optional<ForceField> field_;
  std::array<std::optional<Surface>, kPlanes> surfaces_;
};

Touch in_base_frame(Touch touch, const View& view);  ///< transforms to the device base frame

}  // namespace tendon::bridge::vrpn
