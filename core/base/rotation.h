// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/motion.h"

namespace tendon {

// Rotations as unit quaternions. Every result is the same for q and −q, and the same bits on every processor
// (core/base/portable_math.h). None of these checks its input: a quaternion that is not of length 1 is a mistake of the
// caller, but for `unit`, which mends it.
//
// Thread-safe, realtime-safe: yes.

/// a b: first b, then a.
Quat product(const Quat& a, const Quat& b) noexcept;

/// The rotation back.
Quat inverse(const Quat& q) noexcept;

/// q / |q|. A quaternion whose length is 0, or not a finite number, has no direction: the identity.
Quat unit(const Quat& q) noexcept;

/// Whether the length is 1 ± 0.001: what a rotation may be on the wire and in a sample.
bool is_rotation(const Quat& q) noexcept;

/// The rotation about the axis of `vector` by its length (rad).
Quat rotation_by(const Vec3& vector) noexcept;

/// The vector of that rotation, at most π long: rotation_by(rotation_vector(q)) is q.
Vec3 rotation_vector(const Quat& q) noexcept;

/// The turn from `from` to `to` in base frame axes: the vector θ with to = rotation_by(θ) · from. What a constant
/// torque works on while the handle turns about one axis: −τ·θ goes into the account.
Vec3 turn_between(const Quat& from, const Quat& to) noexcept;

/// R v.
Vec3 rotated(const Quat& q, const Vec3& v) noexcept;

/// Whether the turn from `rest` to `q` is at most 150°. Beyond that a spring between the two is no longer believed: its
/// torque has fallen to a half, and at 180° it has no direction.
bool is_within_reach(const Quat& rest, const Quat& q) noexcept;

/// The torque of a spring of `stiffness` K (N·m/rad, symmetric, base frame axes) that is turned from `rest` to `q`.
/// With (w, v) = q · rest⁻¹:
///
///     τ = −2 (w K v + v × K v)          the gradient of U = 2 vᵀ K v;   −K θ for small turns θ
///
/// It makes no energy on any way round, for any symmetric K. (The form 2 K sgn(w) v is a gradient too, of 4 K (1 −
/// |w|), but only for a K that is the same about every axis, and it jumps at 180°.)
Vec3 spring_torque(const Mat3& stiffness, const Quat& rest, const Quat& q) noexcept;

/// U of that spring, J.
double spring_energy(const Mat3& stiffness, const Quat& rest, const Quat& q) noexcept;

}  // namespace tendon
