// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/base/motion.h"
#include "devices/woodenhaptics/model.h"

/// Where the arm's tip is, from its three encoders, and which currents give the hand a force. The kinematics of
/// haptikfabrikenapi's src/kinematics.cpp for every model but Polhem v2 and v3.
///
/// The frame is the arm's: z up, x from the column to the tip where A is 0, y to complete a right-handed frame, in m,
/// with the origin in the middle of the published workspace. B is counted from the vertical, C from the vertical
/// downwards; both are the links' own (the motor of C stands on body A). With lengths Lₐ, L_b, L_c and origin o:
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

/// Of the three encoders, without the wrap of the 16 bits that are sent.
using Counts = std::array<std::int32_t, 3>;

/// mA, of the three motors.
using Currents = std::array<std::int16_t, 3>;

/// A, B and C, rad.
Vec3 angles_at(const Model& model, const Counts& counts) noexcept;

/// What the arm does at one place.
struct Pose {
  Vec3 position;  ///< m
  Vec3 angles;    ///< rad
  Mat3 jacobian;  ///< m/rad: dposition = jacobian · dangles
};

/// The pose with these angles. There is always one.
Pose pose_with(const Model& model, const Vec3& angles) noexcept;

/// The pose at `position`, in closed form. Empty where the links do not reach, and on the column's axis; NaN is
/// nowhere.
std::optional<Pose> pose_at(const Model& model, const Vec3& position) noexcept;

/// How much of a force may be given in this pose: 1, and near its singular poses less, down to 0, where motors cannot
/// give a force in every direction and what they give is known badly. In terms of e and ρ above:
///
///     min((sin e − 0.1) / 0.1, (ρ − 20 mm) / 20 mm), not below 0 nor above 1
double force_share(const Model& model, const Pose& pose) noexcept;

/// The currents that come closest to `force` (N, on the hand) times the pose's share, as a vector no longer than keeps
/// each within ±`most` (mA, at most 32 767), in its direction, rounded towards zero: 16 bits never wrap. A force that
/// is not finite is none.
Currents currents_for(const Model& model, const Pose& pose, const Vec3& force, double most) noexcept;

/// The force (N, on the hand) that these currents give. Empty where the pose's share is 0.
std::optional<Vec3> force_of(const Model& model, const Pose& pose, const Currents& currents) noexcept;

}  // namespace tendon::woodenhaptics
