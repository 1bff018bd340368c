// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "clients/cpp/force_client.h"
#include "clients/plug/view.h"
#include "clients/plug/vrpn/vrpn_message.h"

namespace tendon::plug::vrpn {

/// The hand, in the program's frame.
struct Hand {
  Vec3 position = Vec3::Zero();  ///< m
  Vec3 velocity = Vec3::Zero();  ///< m/s
};

/// A plane that is drawn, and the bristle of its friction.
struct Surface {
  Plane plane;                 ///< with a normal of length 1
  std::optional<Vec3> foot{};  ///< of the bristle; empty: the hand is outside
  bool slips = false;
};

/// What one program has drawn around one device: a force field and four planes. Their sum is felt:
///
///     field    F = force + J (x − origin)     where |x − origin| ≤ radius; stiffness −J, valid radius − |x − origin|
///     plane    gap = (n·x + d) / |n|          below 0: the hand is in it
///              N = k (−gap) − b n·v, ≥ 0      along +n; k = spring · stiffest, spring cut to 0 … 1
///              stiffness k n nᵀ               b = damping (N·s/m), but 0 below 0.1: those are in units of a library
///                                             that is gone
///     friction −μ N (bristle / 0.2 mm)        Dahl's rule: the bristle follows the hand along the plane, at most 0.2
///                                             mm behind, where it sticks with the static μ; once there it slips with
///                                             the dynamic one, until the hand turns back
///
/// A plane that is felt alone is a Contact too, so that it never pulls between two answers; together with another thing
/// it is not, because a Contact would cut that one's pull. Coefficients are cut to 0 … 1, as VRPN's server does, and
/// the dynamic one to the static one.
///
/// Thread-safe: no. Realtime-safe: yes.
class Drawing {
 public:
  static constexpr std::size_t kPlanes = 4;
  static constexpr double kLeastDamping = 0.1;
  static constexpr double kBristle = 0.2e-3;  ///< m
  /// The dynamic coefficient is at least this share of the static one: a bristle that is not bent at all would not know
  /// which way it slips, and would stick again at once.
  static constexpr double kLeastSlip = 0.1;

  /// Replaces the field. One without force and jacobian ends it.
  void draw(const ForceField& field);
  /// Replaces the plane of that index; false when there is no such index. One without a normal ends it.
  bool draw(const Plane& plane);
  bool empty() const;

  /// What the hand feels, in the program's frame. `stiffest` is the stiffness (N/m) of a plane with spring 1. A bristle
  /// is bent by this call.
  Touch touch(const Hand& hand, double stiffest);

 private:
  static Vec3 friction(Surface& surface, const Vec3& at, double pressure);

  std::optional<ForceField> field_;
  std::array<std::optional<Surface>, kPlanes> surfaces_;
};

/// The same in the device base frame.
Touch in_base_frame(Touch touch, const View& view);

/// Whether a program that has drawn something still means it. VRPN has no heartbeat: a frozen program looks like one
/// that wants its force to stay. But one that goes on sending can be told from one that has stopped:
///
///     stale after 10 × the median gap of the last 8, 100 ms … 2 s, once three have come
///
/// Messages within 10 ms of each other count as one: a burst of settings at the start is no stream. Before three have
/// come, and where the median gap is above 2 s, what was drawn lives as long as the program's connection.
///
/// Thread-safe: no. Realtime-safe: yes.
class Freshness {
 public:
  void heard(LocalTime now);
  void forget() { *this = {}; }
  /// LocalTime::max(): as long as the connection.
  LocalTime until() const;

 private:
  static constexpr std::size_t kGaps = 8;
  std::array<Duration, kGaps> gaps_{};
  std::size_t count_ = 0;  ///< of gaps, since the beginning
  LocalTime counted_{};    ///< the newest that counts for itself
  LocalTime newest_{};
  bool any_ = false;
};

}  // namespace tendon::plug::vrpn
