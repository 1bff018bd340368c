// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "core/base/motion.h"

namespace tendon::lab {

/// The contact with the remote environment along the main axis. It can be beyond `above`, below `below`, or both (for
/// example in a slot). If it is a spring to a center, both values are the same.
struct Contact {
  std::optional<double> above;  ///< m; the force is negative there
  std::optional<double> below;  ///< m; the force is positive there
  double error = 0;             ///< m, one standard deviation of these positions; ∞ if it is unknown

  bool operator==(const Contact&) const = default;
  double depth(double x) const noexcept;
  /// Returns the part of a force at `x` that pushes the hand out of the contact, or 0 outside.
  double outward(double x, double force) const noexcept;
};

struct Push {
  Vec3 place;  ///< m, the position that the force answers
  Vec3 used;   ///< m, the position of the hand while the force was used
  Vec3 force;  ///< N, at `place`
};

struct FeltStep {
  Vec3 position;  ///< m
  Vec3 force;     ///< N, as applied by the device
};

/// Returns the common direction of the forces, up to sign, snapped to a device axis within 3°. Returns nullopt without
/// forces, or if the force-weighted mean of cos²(angle to the direction) is below 0.9.
std::optional<Vec3> common_direction(std::span<const Push> pushes);

/// Finds the position that separates pushes from free motion with the fewest misclassifications. A push is a force
/// along the axis above 1 % of the 99th percentile, which excludes single outliers. Between the last position without
/// and the first with a force, the contact begins at the zero of the line fitted to its forces.
///
/// At the end of a contact a model can pull the hand briefly; such pulls are in free motion and count as errors. A
/// contact requires at least five pushes, which must be at least three quarters of its forces; otherwise the force
/// depends on more than the position.
std::optional<Contact> find_contact(std::span<const Push> pushes, const Vec3& axis);

/// Returns the operational stiffness in N/m (RunObserver). Returns nullopt if its error exceeds 5 %, because the error
/// of `contact` is too large for the depth, or if fewer than 20 steps are in contact.
std::optional<double> felt_stiffness(std::span<const FeltStep> felt, const Vec3& axis, const Contact& contact);

}  // namespace tendon::lab
