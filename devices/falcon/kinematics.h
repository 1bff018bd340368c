// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/motion.h"
#include "devices/falcon/packet.h"

/// Where the Falcon's grip is, from its three motors' encoders, and which torques give the hand a force. The Falcon is
/// a delta robot after R. E. Stamper (University of Maryland, PhD 97-4); lengths, angles and gears are those of
/// libnifalcon's FalconGeometry.h.
///
/// The frame is the device's: x to the right, y up, z towards the user, in m, with the origin in the middle of the
/// fixed plate. `kCentre` is the middle of the part of it that can be used. Angles θ₁ (rad) of the thighs are counted
/// from that plate; each grows as its encoder does.
///
/// Of one leg, in its own frame (U outwards, W along z): θ₃ = acos((V + f)/b), L = d + e + b sin θ₃, u = U + c, and
///
///     θ₁ = atan2(W, u) − acos((u² + W² + a² − L²) / (2 a √(u² + W²))),   θ₂ = atan2(W − a sin θ₁, u − a cos θ₁),
///     ∂θ₁/∂(U, V, W) = (sin θ₃ cos θ₂, cos θ₃, sin θ₃ sin θ₂) / (a sin θ₃ sin(θ₂ − θ₁)).
///
/// (libnifalcon has sin² θ₂ where sin θ₃ sin θ₂ stands here; its z column is 6 to 47 % too small within 40 mm of the
/// centre.)
///
/// All functions: thread-safe, realtime-safe.
namespace tendon::falcon {

/// m. A ball of 50 mm around it can be reached, with room.
inline const Vec3 kCentre(0, 0, 0.125);

/// θ₁ = 35° at count 0; a count is 1/1280 turn of the motor's drum of 14.25 mm, which drives the thigh's of 110 mm.
Vec3 angles_at(const Counts& encoders) noexcept;

/// What the device does at one place.
struct Pose {
  Vec3 position;  ///< m
  Vec3 angles;    ///< rad, θ₁ of each leg
  Mat3 jacobian;  ///< rad/m: dangles = jacobian · dposition
};

/// The pose at `position`, in closed form. Empty where the legs do not reach, and where one of them is stretched or
/// folded so that its motor cannot move the grip (no finite Jacobian); NaN is nowhere.
std::optional<Pose> pose_at(const Vec3& position) noexcept;

/// The pose with these thigh angles, by Newton's method from `start`: each step is 15 mm or shorter, and halved until
/// it ends where there is a pose. Empty when there is none, or when `start` is no pose. Within 1e-9 m; some 4 steps
/// from 0.2 mm away, at most 25.
std::optional<Pose> pose_with(const Vec3& angles, const Vec3& start) noexcept;

/// The largest count that the firmware is known to take: ±0.41 N·m at the joint. libnifalcon's own limit is 300 000,
/// of which 16 bits are sent: the sign wraps.
inline constexpr double kMostCounts = 4096;

/// The motor counts that come closest to `force` (N, on the hand): of τ = jacobian⁻ᵀ · force, as a vector no longer
/// than keeps each within ±`kMostCounts`, in its direction, rounded towards zero. A force that is not finite is none.
Counts counts_for(const Pose& pose, const Vec3& force) noexcept;

/// The force (N, on the hand) that these counts give: jacobianᵀ · τ.
Vec3 force_of(const Pose& pose, const Counts& counts) noexcept;

}  // namespace tendon::falcon
