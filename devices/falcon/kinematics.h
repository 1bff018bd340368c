// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/motion.h"
#include "devices/falcon/packet.h"

/// Kinematics of the Falcon: the position of the grip from the encoders of the three motors, and the torques that
/// render a given force. The Falcon is a delta robot after R. E. Stamper (University of Maryland, PhD 97-4). Lengths,
/// angles and gear ratios are from libnifalcon's FalconGeometry.h.
///
/// The frame is that of the device: x to the right, y up, z towards the user, in m, with the origin in the middle of
/// the fixed plate. `kCentre` is the middle of the usable workspace. The thigh angles θ₁ (rad) are measured from that
/// plate and increase with the encoder counts.
///
/// For one leg, in its own frame (U outwards, W along z): θ₃ = acos((V + f)/b), L = d + e + b sin θ₃, u = U + c, and
///
///     θ₁ = atan2(W, u) − acos((u² + W² + a² − L²) / (2 a √(u² + W²))),   θ₂ = atan2(W − a sin θ₁, u − a cos θ₁),
///     ∂θ₁/∂(U, V, W) = (sin θ₃ cos θ₂, cos θ₃, sin θ₃ sin θ₂) / (a sin θ₃ sin(θ₂ − θ₁)).
///
/// (libnifalcon uses sin² θ₂ instead of sin θ₃ sin θ₂; its z column is 6 to 47 % too small within 40 mm of the centre.)
///
/// All functions are thread-safe and realtime-safe.
namespace tendon::falcon {

/// m. The grip can reach every point within 50 mm of it, with some margin.
inline const Vec3 kCentre(0, 0, 0.125);

/// Returns θ₁ of each leg. θ₁ = 35° at count 0. One count is 1/1280 turn of the motor's drum of 14.25 mm, which drives
/// the thigh's drum of 110 mm.
Vec3 angles_at(const Counts& encoders) noexcept;

struct Pose {
  Vec3 position;  ///< m
  Vec3 angles;    ///< rad, θ₁ of each leg
  Mat3 jacobian;  ///< rad/m: dangles = jacobian · dposition
};

/// Returns the pose at `position` in closed form. Returns nullopt if the legs do not reach it, if a leg is stretched or
/// folded so that its motor cannot move the grip (no finite Jacobian), and for NaN.
std::optional<Pose> pose_at(const Vec3& position) noexcept;

/// Returns the pose with these thigh angles, computed by Newton's method from `start` with an error of at most 1e-9 m.
/// Each step is at most 15 mm long and is halved until it ends at a pose. From 0.2 mm away it takes about 4 steps; 25
/// are permitted. Returns nullopt if no pose has these angles or `start` is not a pose.
std::optional<Pose> pose_with(const Vec3& angles, const Vec3& start) noexcept;

/// Largest count that the firmware is known to accept: ±0.41 N·m at the joint. libnifalcon limits counts to 300 000 but
/// sends only 16 bits, so that the sign can wrap.
inline constexpr double kMostCounts = 4096;

/// Returns the motor counts closest to `force` (N, on the hand): τ = jacobian⁻ᵀ · force in counts. If one exceeds
/// ±`kMostCounts`, all three are reduced by the same factor. Rounds towards zero. A force that is not finite counts as
/// zero.
Counts counts_for(const Pose& pose, const Vec3& force) noexcept;

/// Returns the force (N, on the hand) of these counts: jacobianᵀ · τ.
Vec3 force_of(const Pose& pose, const Counts& counts) noexcept;

}  // namespace tendon::falcon
