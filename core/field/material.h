// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace tendon::field {

/// The correction of the force in N as a function of the depth. Knot i is for the depth i · step. The table is linear
/// between knots and constant beyond the last one. The correction at depth 0 is 0. An engine can describe a table, and
/// true forces change it (Residual).
struct DepthTable {
  static constexpr std::size_t kKnots = 16;
  static constexpr double kLeastStep = 1e-4;  ///< m
  static constexpr double kMostStep = 0.1;    ///< m
  double step = 1e-3;                         ///< m
  std::array<double, kKnots + 1> force{};     ///< N; force[0] = 0
  bool used = false;                          ///< false: all zero

  /// Returns a table with the given forces, which are for the depths step, 2 step, and so on. There must be between 1 and
  /// kKnots forces. The last force is also used for the remaining knots.
  static DepthTable of(double step, std::span<const double> forces) noexcept;

  bool operator==(const DepthTable&) const = default;
};

/// The force of a surface at the depth d = ‖p − x‖ of the hand x below the proxy p: a spring, beside a spring in series
/// with a damper (a Maxwell branch), whose dent z relaxes.
///     V(w, z) = ½ k₁ w² + C(w) + ½ k_m (w − z)²                    J;  C: integral of the table
///     U(d, z) = V(w, z),   w = max(d, w*),   w* = argmin V(·, z)
///     U′(d)   = k₁ d + c(d) + k_m (d − z) if d > w*, otherwise 0   N;  there is no force above the dent
///     z ← z + (w − z) T/(τ + T)                                    lowers U for every T
/// U is convex in d and in z, and U(0, 0) = 0. `most_stiffness` bounds U″ and U′/d. There is no parallel
/// damper.
///
/// Source: Fung, *Biomechanics*, 2nd ed., 1993, chapter 2 (standard linear solid). The proofs are in
/// core/field/README.md. Realtime-safe: yes.
struct Material {
  static constexpr double kMostFriction = 2;
  static constexpr double kLeastTau = 0.01;
  static constexpr double kMostTau = 10;
  static constexpr double kLeastShare = 0.1;  ///< c′ is at least −(1 − kLeastShare) k₁

  double stiffness = 1000;  ///< k₁, N/m, > 0
  double branch = 0;        ///< k_m, N/m, ≥ 0
  double tau = 0.2;         ///< s, kLeastTau … kMostTau
  double friction = 0;      ///< μ, 0 … kMostFriction
  DepthTable table{};

  /// Throws std::invalid_argument with the name of the field if a number is out of its range, if the stiffness with the
  /// branch exceeds `max_stiffness`, or if the table has a knot that bound_table would change.
  void expect_valid(double max_stiffness) const;

  double energy(double depth, double dent) const noexcept;                  ///< U, J
  double force(double depth, double dent) const noexcept;                   ///< U′, N
  double spring(double depth, double dent) const noexcept;                  ///< U′ without the table, N
  double slope(double depth, double dent) const noexcept;                   ///< U″, N/m
  double rest(double dent) const noexcept;                                  ///< w*, m
  double relaxed(double depth, double dent, double period) const noexcept;  ///< z after `period` s

  /// Returns the largest depth ≤ `most` with U(depth, dent) ≤ `energy`, or 0 if there is none.
  double depth_of(double energy, double dent, double most) const noexcept;

  double most_stiffness() const noexcept;          ///< K, N/m
  double correction(double depth) const noexcept;  ///< c, N

  bool operator==(const Material&) const = default;
};

/// Returns a material between two: `share` 0 is `from`, 1 is `to`. If the tables have different steps, the result has
/// the larger one, and the knots of the finer table that are not on it are lost.
Material blended(const Material& from, const Material& to, double share) noexcept;

/// Clamps the table from knot to knot. Its slope is then between −(1 − kLeastShare) k₁ and `max_stiffness` − k₁ − k_m.
void bound_table(Material& material, double max_stiffness) noexcept;

}  // namespace tendon::field
