// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

#include "clients/softbody/fem/element.h"

namespace tendon::softbody {

/// The signed distance of a point from a surface, and its first two derivatives by the place of the point.
struct Distance {
  double value = 0;               ///< φ, m; below 0 inside
  Vec3 gradient = Vec3::Zero();   ///< ∇φ, away from the surface's inside; its length is 1 where φ is exact
  Mat3 curvature = Mat3::Zero();  ///< ∇∇φ, 1/m
};

/// A signed distance that is known on a grid, and between by cubic B-splines: within the box it has two continuous
/// derivatives everywhere, and they are exactly those of its value. The weight of each spline is
///
///     (−1, 8, −1)/6 of three samples, along each axis in turn
///
/// so that cubic functions are met, and every other smooth one to the fourth order of the cell. Where the distance has a
/// kink (an edge of the surface, halfway between two sides) it is rounded over about a cell, and wrong by up to a fifth
/// of a cell.
///
/// Outside of the box: the distance from the surface's point that is nearest to where the way there enters the box, in
/// two rounds. It is a little too large, and goes over into that of the box without a step in value and direction.
///
/// Without state. Thread-safe: yes. Realtime-safe: yes, once built.
class DistanceGrid {
 public:
  /// `distance` of each point of a grid of `cell` (m, above 0) on and around the box from `low` to `high`, which the
  /// surface may not leave; it is asked along x first. Throws std::invalid_argument when there would be more than
  /// kMostPoints, and when it is no distance: it changes by more than the way from point to point.
  DistanceGrid(const std::function<double(const Vec3&)>& distance, const Vec3& low, const Vec3& high, double cell);

  /// At `x`, m. A place that is not finite has a value that is not a number.
  Distance at(const Vec3& x) const;
  double value(const Vec3& x) const;  ///< of the same, for a quarter of the work

  std::size_t points() const noexcept { return weights_.size(); }
  std::size_t bytes() const noexcept { return weights_.size() * sizeof(float); }

  static constexpr std::size_t kMostPoints = 8'000'000;

 private:
  struct Around;
  Around around(const Vec3& x) const;
  Distance within(const Vec3& x) const;
  Vec3 foot_of(const Vec3& x) const;

  Vec3 low_;
  Vec3 high_;
  double cell_;
  std::array<int, 3> cells_{};
  std::vector<float> weights_;  ///< of the splines, x first: those of cell i along an axis are i to i + 3
};

}  // namespace tendon::softbody
