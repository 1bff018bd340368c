// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "core/base/motion.h"

namespace tendon::lab {

/// The contact with the remote environment along the main axis. It can be beyond `above`, before `below`, or both (for
/// example in a slot). For a spring to a center, both have the same value.
struct Contact {
  std::optional<double> above;  ///< m; the force is negative there
  std::optional<double> below;  ///< m; the force is positive there
  double error = 0;             ///< m, one standard deviation of these positions; ∞ if it is unknown

  bool operator==(const Contact&) const = default;
  /// Returns the depth of `x` in the contact in m, or 0 outside.
  double depth(double x) const noexcept;
  /// Returns the part of a force at `x` that pushes the hand out of the contact, or 0 outside.
  double outward(double x, double force) const noexcept;
};

/// A force of the remote environment.
struct Push {
  Vec3 place;  ///< m, the position that the force answers
  Vec3 used;   ///< m, the position of the hand while the force was used
  Vec3 force;  ///< N, at `place`
};

/// The force on the hand in a step.
struct FeltStep {
  Vec3 position;  ///< m
  Vec3 force;     ///< N, as applied by the device
};

/// Returns the common direction of the forces, up to the sign. Returns nothing if there are no forces, or if the mean of
/// cos²(angle to the direction), weighted by the size of the force, is less than 0.9. If the direction is within 3° of an
/// axis of the device, returns the axis.
std::optional<Vec3> common_direction(std::span<const Push> pushes);

/// Finds the position that separates pushes from free motion with the fewest errors. A push is a force along the axis
/// above 1 % of the 99th percentile, so that a single wild force does not hide the others. Between the last position
/// without a force and the first position with a force, the contact begins at the zero of the line that is fitted to its
/// forces.
///
/// At the end of a contact, a model can pull the hand for a moment. These pulls are in free motion, and they are not a
/// contact. A contact needs at least five pushes, and at least three quarters of its forces must be pushes. Otherwise the
/// force does not only depend on the position.
std::optional<Contact> find_contact(std::span<const Push> pushes, const Vec3& axis);

/// Returns the operational stiffness in N/m (RunObserver). Returns nothing if it cannot be measured within 5 %, because
/// the error of `contact` is too large for its depth, or because there are fewer than 20 steps in the contact.
std::optional<double> felt_stiffness(std::span<const FeltStep> felt, const Vec3& axis, const Contact& contact);

}  // namespace tendon::lab
