// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "clients/cpp/touch.h"

namespace tendon::precice_worker {

/// The place of a body that the hand presses, for a solver that is told displacements and tells forces: a flat, round
/// stamp of fixed place and size. It does not wander with the hand, because a solver's mesh does not.
///
///     depth  δ = max(0, −(x − middle)·n)    0, too, where the hand is further aside than the radius
///     each node is displaced by −δ·n
///     force on the hand  F = max(0, −Σ fᵢ·n)·n,    fᵢ what it takes to hold node i there
///
/// A solver says no stiffness, so it is made from the last two depths that differ by kLeastStep or more: a secant. The
/// answer's error is how far the force is from what that secant, as it was before, says of it.
///
/// Thread-safe: no. Realtime-safe: no.
class TouchedPatch {
 public:
  struct Config {
    Vec3 middle = Vec3::Zero();    ///< m, on the body's surface at rest, in the hand's frame
    Vec3 normal = Vec3(-1, 0, 0);  ///< out of the body, to the hand; any length > 0
    double radius = 0.01;          ///< m, > 0
    int rings = 3;                 ///< of nodes around the one in the middle, 1 … 50: 1 + 3·rings·(rings + 1) nodes
  };
  static constexpr double kLeastStep = 1e-5;  ///< m: below it the noise of a solver would be taken for stiffness

  /// Throws std::invalid_argument "FIELD = VALUE: expected …".
  explicit TouchedPatch(const Config& config);

  /// Of the nodes at rest: x, y, z of each, m.
  const std::vector<double>& places() const noexcept { return places_; }
  std::size_t nodes() const noexcept { return places_.size() / 3; }

  /// For this hand: x, y, z of each node, m.
  std::vector<double> displacements(const DeviceState& hand) const;

  /// `held` are the forces that it takes to hold the nodes where displacements(hand) says: x, y, z of each, N. Throws
  /// std::invalid_argument when there are not as many. A sum that is not finite is the force, as it is.
  Touch answer(const DeviceState& hand, std::span<const double> held);

 private:
  struct Press {
    double depth = 0;  ///< m
    double force = 0;  ///< N
  };
  double depth(const DeviceState& hand) const;

  Config config_;
  std::vector<double> places_;
  std::optional<Press> last_;
  std::optional<double> secant_;  ///< N/m
};

}  // namespace tendon::precice_worker
