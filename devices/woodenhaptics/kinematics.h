// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/base/motion.h"
#include "devices/woodenhaptics/model.h"

/// Kinematics of the arms, from haptikfabrikenapi's src/kinematics.cpp, for all models except Polhem v2 and v3.
///
/// The frame has its origin in the middle of the published workspace, z up, x from the column to the tip when A is 0,
/// in m. B is measured from the upward vertical and C from the downward vertical. Both are absolute angles, because the
/// motor of C is mounted on body A. With lengths Lₐ, L_b, L_c and origin o:
///
///     ρ = L_b sin B + L_c sin C
///     p = (ρ cos A, ρ sin A, Lₐ + L_b cos B − L_c cos C) − o
///     θ = direction · 2π · count / counts_per_turn · capstan / body
///     τ_motor = direction · (capstan / body) · τ,   τ = (∂p/∂θ)ᵀ F,   current = τ_motor / torque_constant
///
/// The inverse, with the elbow bent outwards, e = B + C in (0, π), h = p_z + o_z − Lₐ:
///
///     cos e = (L_b² + L_c² − ρ² − h²) / (2 L_b L_c)
///     A = atan2(y, x),  B = atan2(ρ, h) − atan2(L_c sin e, L_b − L_c cos e),  C = e − B,
///     det ∂p/∂θ = ρ L_b L_c sin e up to sign: singular with the elbow straight or folded, and above the column.
///
/// All functions are thread-safe and realtime-safe.
namespace tendon::woodenhaptics {

using Counts = std::array<std::int32_t, 3>;  ///< counts of the encoders, without the overflow of 16 bits

using Currents = std::array<std::int16_t, 3>;  ///< mA, for each motor

Vec3 angles_at(const Model& model, const Counts& counts) noexcept;

struct Pose {
  Vec3 position;  ///< m
  Vec3 angles;    ///< rad
  Mat3 jacobian;  ///< m/rad: dposition = jacobian · dangles
};

Pose pose_with(const Model& model, const Vec3& angles) noexcept;

/// Returns nullopt if the arm does not reach `position`, on the axis of the column, and for NaN. Closed form.
std::optional<Pose> pose_at(const Model& model, const Vec3& position) noexcept;

/// Returns a factor for reducing forces near singular poses, where the motors cannot render all directions, and the
/// rendered force is not known accurately. With e and ρ as above:
///
///     min((sin e − 0.1) / 0.1, (ρ − 20 mm) / 20 mm), clamped to 0 … 1
double force_share(const Model& model, const Pose& pose) noexcept;

/// Returns the currents for `force` (N, on the hand) times force_share(), rounded towards zero. If a current exceeds
/// ±`most` (mA, at most 32 767), all of them are reduced by the same factor. Infinity and NaN are treated as zero.
Currents currents_for(const Model& model, const Pose& pose, const Vec3& force, double most) noexcept;

/// In N, on the hand. Returns nullopt if force_share() is 0.
std::optional<Vec3> force_of(const Model& model, const Pose& pose, const Currents& currents) noexcept;

}  // namespace tendon::woodenhaptics
