// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

#include "clients/softbody/fem/element.h"

namespace tendon::softbody {

/// A signed distance with its first two derivatives.
struct Distance {
  double value = 0;               ///< φ, m, negative inside
  Vec3 gradient = Vec3::Zero();   ///< ∇φ, outward
  Mat3 curvature = Mat3::Zero();  ///< ∇∇φ, 1/m
};

/// A signed distance sampled on a grid and interpolated by cubic B-splines. Within the box it has two continuous
/// derivatives, exactly those of the interpolant. Each spline weight is
///
///     (−1, 8, −1)/6 of three samples, along each axis in turn
///
/// so cubic functions are reproduced, and other smooth ones are approximated to fourth order in the cell size. Kinks
/// (edges of the surface, the medial axis) are rounded over about one cell, with an error of up to a fifth of a cell.
///
/// Outside the box: the distance from the surface point nearest to where the path enters the box, found in two
/// iterations. Slightly too large; continuous in value and direction at the box.
///
/// Stateless. Thread-safe: yes. Realtime-safe: yes, after construction.
class DistanceGrid {
 public:
  /// Calls `distance` for a grid around the box from `low` to `high`, which must contain the surface. `cell` is the
  /// step (m). Throws std::invalid_argument if there are more than kMostPoints, or if two neighbors differ by more than
  /// their distance.
  DistanceGrid(const std::function<double(const Vec3&)>& distance, const Vec3& low, const Vec3& high, double cell);

  /// Returns NaN if `x` (m) is not finite.
  Distance at(const Vec3& x) const;
  double value(const Vec3& x) const;

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
  std::vector<float> weights_;  ///< x first; cell i along an axis uses i to i + 3
};

}  // namespace tendon::softbody
