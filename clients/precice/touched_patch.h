// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "clients/cpp/touch.h"

namespace tendon::precice_worker {

/// The contact area of a body for a solver with displacements as input and forces as output: a flat, round stamp at a
/// fixed position, because the mesh of such a solver is fixed.
///
///     depth δ = max(0, −(x − middle)·n)     0 if the hand is outside of the radius
///     displacement of each node             −δ·n
///     force on the hand                     F = max(0, −Σ fᵢ·n)·n,    with the holding force fᵢ of node i
///
/// The solver provides no stiffness. It is estimated as the secant of the last two depths that differ by at least
/// kLeastStep. The error of an answer is the difference between the force and the prediction of the previous secant.
///
/// Thread-safe: no. Realtime-safe: no.
class TouchedPatch {
 public:
  struct Config {
    Vec3 middle = Vec3::Zero();    ///< m, on the undeformed surface, in the frame of the hand
    Vec3 normal = Vec3(-1, 0, 0);  ///< points out of the body and can have any length > 0
    double radius = 0.01;          ///< m, > 0
    int rings = 3;                 ///< rings of nodes, 1 … 50: 1 + 3·rings·(rings + 1) nodes
  };
  static constexpr double kLeastStep = 1e-5;  ///< m; for smaller steps the secant would be dominated by solver noise

  /// Throws std::invalid_argument "FIELD = VALUE: expected …".
  explicit TouchedPatch(const Config& config);

  /// Returns the positions of the undeformed nodes (m) as x, y and z of each node.
  const std::vector<double>& places() const noexcept { return places_; }
  std::size_t nodes() const noexcept { return places_.size() / 3; }

  /// Returns the displacements for a position of the hand (m) as x, y and z of each node.
  std::vector<double> displacements(const DeviceState& hand) const;

  /// `held` contains the forces that are required to hold the nodes at displacements(hand), as x, y and z of each node,
  /// N. Throws std::invalid_argument if the size is wrong. If the sum is not finite, it is returned as the force.
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
