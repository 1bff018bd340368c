// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "core/base/motion.h"

namespace tendon::lab {

/// The contact is beyond `above`, below `below`, or both (a slot). Both values are equal for a spring to a center.
struct Contact {
  std::optional<double> above;  ///< m; below this value, the force is negative
  std::optional<double> below;  ///< m; beyond this value, the force is positive
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

/// Up to sign, snapped to a device axis within 3°. nullopt without forces, or if the force-weighted mean of cos²(angle
/// to the direction) is below 0.9.
std::optional<Vec3> common_direction(std::span<const Push> pushes);

/// The position that separates pushes from free motion with the fewest misclassifications. A push is a force along the
/// axis above 1 % of the 99th percentile, which excludes single outliers. Between the last position without and the
/// first with a force, the contact begins at the zero of the line fitted to its forces.
///
/// At its end a model can pull the hand briefly; such pulls count as errors. With fewer than five pushes, or if they
/// are less than three quarters of its forces, the force depends on more than the position: nullopt.
std::optional<Contact> find_contact(std::span<const Push> pushes, const Vec3& axis);

/// N/m (RunObserver). nullopt if the error of `contact` makes its error exceed 5 %, or if fewer than 20 steps are in
/// contact.
std::optional<double> felt_stiffness(std::span<const FeltStep> felt, const Vec3& axis, const Contact& contact);

}  // namespace tendon::lab
