// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/motion.h"

namespace tendon {

// Rotations as unit quaternions. Results are the same for q and −q, and bitwise identical on every processor
// (core/base/portable_math.h). The length is only checked by `unit` and `is_rotation`. Thread-safe, realtime-safe: yes.

/// Returns the rotation a b: first b, then a.
Quat product(const Quat& a, const Quat& b) noexcept;

Quat inverse(const Quat& q) noexcept;

/// Returns q / |q|, or the identity if the length is 0 or not finite.
Quat unit(const Quat& q) noexcept;

/// Returns whether the length is 1 ± 0.001, the tolerance on the wire and in samples.
bool is_rotation(const Quat& q) noexcept;

/// Returns the rotation about the axis of `vector` by its length (rad).
Quat rotation_by(const Vec3& vector) noexcept;

/// Returns the rotation vector of q, of length π at most: rotation_by(rotation_vector(q)) is q.
Vec3 rotation_vector(const Quat& q) noexcept;

/// Returns the rotation vector θ from `from` to `to` in base frame axes: to = rotation_by(θ) · from. If the handle is
/// rotated about one axis, the work of a constant torque is τ·θ, and −τ·θ is booked in the ledger.
Vec3 turn_between(const Quat& from, const Quat& to) noexcept;

/// Returns R v.
Vec3 rotated(const Quat& q, const Vec3& v) noexcept;

/// Returns whether the rotation from `rest` to `q` is at most 150°. A spring must not be used for larger angles,
/// because its torque decreases and is undefined at 180°.
bool is_within_reach(const Quat& rest, const Quat& q) noexcept;

/// The torque of a spring of stiffness K (N·m/rad, symmetric, base frame) from `rest` to `q`. With (w, v) = q · rest⁻¹:
///     τ = −2 (w K v + v × K v)          the gradient of U = 2 vᵀ K v;   −K θ for small turns θ
/// A closed path generates no energy for any symmetric K. (2 K sgn(w) v is the gradient of 4 K (1 − |w|) only for an
/// isotropic K, and jumps at 180°.)
Vec3 spring_torque(const Mat3& stiffness, const Quat& rest, const Quat& q) noexcept;

/// Returns the energy U of this spring in J.
double spring_energy(const Mat3& stiffness, const Quat& rest, const Quat& q) noexcept;

}  // namespace tendon
