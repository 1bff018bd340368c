// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/motion.h"
#include "devices/falcon/packet.h"

/// Kinematics of the Falcon, a delta robot as described by R. E. Stamper (University of Maryland, PhD 97-4). Lengths,
/// angles and gear ratios are from libnifalcon's FalconGeometry.h.
///
/// The device frame has its origin in the middle of the fixed plate, x to the right, y up, z towards the user, in m.
/// `kCentre` is the middle of the workspace. The thigh angles θ₁ (rad), from the plate, increase with the counts.
///
/// For each leg, in its own frame (U outwards, W along z): θ₃ = acos((V + f)/b), L = d + e + b sin θ₃, u = U + c, and
///
///     θ₁ = atan2(W, u) − acos((u² + W² + a² − L²) / (2 a √(u² + W²))),   θ₂ = atan2(W − a sin θ₁, u − a cos θ₁),
///     ∂θ₁/∂(U, V, W) = (sin θ₃ cos θ₂, cos θ₃, sin θ₃ sin θ₂) / (a sin θ₃ sin(θ₂ − θ₁)).
///
/// (libnifalcon uses sin² θ₂ instead of sin θ₃ sin θ₂; its z column is 6 to 47 % too small within 40 mm of the centre.)
///
/// All functions are thread-safe and realtime-safe.
namespace tendon::falcon {

inline const Vec3 kCentre(0, 0, 0.125);  ///< m; all points within 50 mm can be reached, with some margin

/// θ₁ of each leg: 35° at count 0. A count is 1/1280 turn of the motor's drum of 14.25 mm; the thigh's has 110 mm.
Vec3 angles_at(const Counts& encoders) noexcept;

struct Pose {
  Vec3 position;  ///< m
  Vec3 angles;    ///< rad, θ₁ of each leg
  Mat3 jacobian;  ///< rad/m: dangles = jacobian · dposition
};

/// Closed form. Returns nullopt for NaN, or if a leg is too short, stretched or folded (without a finite Jacobian).
std::optional<Pose> pose_at(const Vec3& position) noexcept;

/// Uses Newton's method with steps of at most 15 mm, which are halved until there is a pose. The error is at most 1e-9
/// m. A start at a distance of 0.2 mm requires about 4 of 25 steps. Nullopt if there is no pose, or none at `start`.
std::optional<Pose> pose_with(const Vec3& angles, const Vec3& start) noexcept;

/// The largest count known to work: ±0.41 N·m at the joint. libnifalcon's 300 000, sent in 16 bits, may reverse signs.
inline constexpr double kMostCounts = 4096;

/// Returns the motor counts for `force` (N, on the hand): τ = jacobian⁻ᵀ · force in counts, rounded towards zero. If a
/// count exceeds ±`kMostCounts`, all of them are reduced by the same factor. Infinity and NaN are treated as zero.
Counts counts_for(const Pose& pose, const Vec3& force) noexcept;

Vec3 force_of(const Pose& pose, const Counts& counts) noexcept;  ///< jacobianᵀ · τ (N, on the hand)

}  // namespace tendon::falcon
