// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/motion.h"
#include "devices/falcon/packet.h"

/// The kinematics of the Falcon: the position of the grip from the encoders of the three motors, and the torques that
/// exert a given force on the hand. The Falcon is a delta robot after R. E. Stamper (University of Maryland, PhD 97-4);
/// lengths, angles and gears are those of libnifalcon's FalconGeometry.h.
///
/// The frame is the device's: x to the right, y up, z towards the user, in m, with the origin in the middle of the
/// fixed plate. `kCentre` is the middle of the usable workspace. The thighs' angles θ₁ (rad) are measured from that
/// plate; each grows with the count of its encoder.
///
/// For one leg, in its own frame (U outwards, W along z): θ₃ = acos((V + f)/b), L = d + e + b sin θ₃, u = U + c, and
///
///     θ₁ = atan2(W, u) − acos((u² + W² + a² − L²) / (2 a √(u² + W²))),   θ₂ = atan2(W − a sin θ₁, u − a cos θ₁),
///     ∂θ₁/∂(U, V, W) = (sin θ₃ cos θ₂, cos θ₃, sin θ₃ sin θ₂) / (a sin θ₃ sin(θ₂ − θ₁)).
///
/// (libnifalcon has sin² θ₂ in place of sin θ₃ sin θ₂; its z column is 6 to 47 % too small within 40 mm of the centre.)
///
/// All functions: thread-safe, realtime-safe.
namespace tendon::falcon {

/// m. The grip reaches every point within 50 mm of it, with room to spare.
inline const Vec3 kCentre(0, 0, 0.125);

/// θ₁ of each leg. θ₁ = 35° at count 0; a count is 1/1280 turn of the motor's drum of 14.25 mm, which drives the
/// thigh's drum of 110 mm.
Vec3 angles_at(const Counts& encoders) noexcept;

/// The state of the mechanism at one position.
struct Pose {
  Vec3 position;  ///< m
  Vec3 angles;    ///< rad, θ₁ of each leg
  Mat3 jacobian;  ///< rad/m: dangles = jacobian · dposition
};

/// The pose at `position`, in closed form. Empty where the legs do not reach, where one of them is stretched or folded
/// so that its motor cannot move the grip (no finite Jacobian), and for NaN.
std::optional<Pose> pose_at(const Vec3& position) noexcept;

/// The pose with these thigh angles, by Newton's method from `start`, within 1e-9 m. Each step is at most 15 mm long,
/// and is halved until it ends at a pose. A start 0.2 mm away takes some 4 steps; 25 are the most. Empty when no pose
/// has these angles, or when `start` is not a pose.
std::optional<Pose> pose_with(const Vec3& angles, const Vec3& start) noexcept;

/// The largest count that the firmware is known to take: ±0.41 N·m at the joint. libnifalcon limits counts to 300 000
/// but sends only 16 bits: there the sign wraps.
inline constexpr double kMostCounts = 4096;

/// The motor counts that come closest to `force` (N, on the hand). They are τ = jacobian⁻ᵀ · force in counts; when one
/// is beyond ±`kMostCounts`, all three shrink by the same factor. Rounded towards zero. A force that is not finite
/// counts as zero.
Counts counts_for(const Pose& pose, const Vec3& force) noexcept;

/// The force (N, on the hand) that these counts exert: jacobianᵀ · τ.
Vec3 force_of(const Pose& pose, const Counts& counts) noexcept;

}  // namespace tendon::falcon
