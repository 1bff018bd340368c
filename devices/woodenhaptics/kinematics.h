// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/base/motion.h"
#include "devices/woodenhaptics/model.h"

/// The kinematics of the arms: the position of the tip from the three encoders, and the currents that exert a given
/// force on the hand. The source is haptikfabrikenapi's src/kinematics.cpp, for every model except Polhem v2 and v3.
///
/// The frame is the arm's: z up, x from the column to the tip when A is 0, y completes a right-handed frame, in m,
/// with the origin in the middle of the published workspace. B is measured from the upward vertical, C from the
/// downward vertical; both are angles of the link itself, not relative to the link before it (the motor of C stands on
/// body A). With lengths Lₐ, L_b, L_c and origin o:
///
///     ρ = L_b sin B + L_c sin C
///     p = (ρ cos A, ρ sin A, Lₐ + L_b cos B − L_c cos C) − o
///     θ = direction · 2π · count / counts_per_turn · capstan / body
///     τ_motor = direction · (capstan / body) · τ,   τ = (∂p/∂θ)ᵀ F,   current = τ_motor / torque_constant
///
/// and back, with the elbow bent outwards, e = B + C in (0, π), h = p_z + o_z − Lₐ:
///
///     cos e = (L_b² + L_c² − ρ² − h²) / (2 L_b L_c)
///     A = atan2(y, x),  B = atan2(ρ, h) − atan2(L_c sin e, L_b − L_c cos e),  C = e − B,
///     det ∂p/∂θ = ρ L_b L_c sin e up to sign: singular with the elbow straight or folded, and above the column.
///
/// All functions: thread-safe, realtime-safe.
namespace tendon::woodenhaptics {

/// Counts of the three encoders. The device sends 16 bits, which wrap; these do not.
using Counts = std::array<std::int32_t, 3>;

/// Currents of the three motors, mA.
using Currents = std::array<std::int16_t, 3>;

/// The angles A, B and C, rad.
Vec3 angles_at(const Model& model, const Counts& counts) noexcept;

/// The state of the arm at one position.
struct Pose {
  Vec3 position;  ///< m
  Vec3 angles;    ///< rad
  Mat3 jacobian;  ///< m/rad: dposition = jacobian · dangles
};

/// The pose with these angles. There is always one.
Pose pose_with(const Model& model, const Vec3& angles) noexcept;

/// The pose at `position`, in closed form. Empty where the links do not reach, on the column's axis, and for NaN.
std::optional<Pose> pose_at(const Model& model, const Vec3& position) noexcept;

/// The share of a force that may be exerted in this pose: 1, and less near a singular pose, down to 0. In a singular
/// pose the motors cannot exert a force in every direction, and the force that they do exert is badly known. With e
/// and ρ as above:
///
///     min((sin e − 0.1) / 0.1, (ρ − 20 mm) / 20 mm), not below 0 nor above 1
double force_share(const Model& model, const Pose& pose) noexcept;

/// The currents that come closest to `force` (N, on the hand) times the pose's share. When one is beyond ±`most` (mA,
/// at most 32 767), all three shrink by the same factor, so 16 bits never wrap. Rounded towards zero. A force that is
/// not finite counts as zero.
Currents currents_for(const Model& model, const Pose& pose, const Vec3& force, double most) noexcept;

/// The force (N, on the hand) that these currents exert. Empty where the pose's share is 0.
std::optional<Vec3> force_of(const Model& model, const Pose& pose, const Currents& currents) noexcept;

}  // namespace tendon::woodenhaptics
