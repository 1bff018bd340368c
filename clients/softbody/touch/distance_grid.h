// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

#include "clients/softbody/fem/element.h"

namespace tendon::softbody {

struct Distance {
  double value = 0;               ///< φ, m, negative inside
  Vec3 gradient = Vec3::Zero();   ///< ∇φ, outward
  Mat3 curvature = Mat3::Zero();  ///< ∇∇φ, 1/m
};

/// A signed distance on a grid with cubic B-splines. In the box it is C². The weight of a spline is
///
///     (−1, 8, −1)/6 of three samples, along each axis in turn
///
/// This is exact for cubic functions and of fourth order for other smooth ones. Edges are rounded over about one cell,
/// with an error of up to a fifth of a cell. Outside the box it is the distance from the surface point nearest to where
/// the line to the surface enters the box, after two iterations: a little too large, but without a step at the box.
///
/// Stateless. Thread-safe: yes. Realtime-safe: yes, after construction.
class DistanceGrid {
 public:
  /// Calls `distance` on a grid of step `cell` (m) around the box from `low` to `high`, which must contain the surface.
  /// Throws std::invalid_argument above kMostPoints, or if two neighbors differ by more than their distance.
  DistanceGrid(const std::function<double(const Vec3&)>& distance, const Vec3& low, const Vec3& high, double cell);

  Distance at(const Vec3& x) const;  ///< NaN if `x` (m) is not finite
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
  std::vector<float> weights_;  ///< x is first
};

}  // namespace tendon::softbody
