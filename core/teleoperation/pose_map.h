// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "core/base/motion.h"

namespace tendon {

/// Maps values between the leader and the follower. For the displacement u of each handle from its offset:
///     u_f = s_x R u_l             F_l = s_f Rᵀ F_f
///     K_l = s_f s_x K_f           one joule of the leader is s_x/s_f joules of the follower
/// `R` rotates the leader's base frame to the follower's. If an axis of the frame of the LEADER is not coupled, its
/// displacement is 0 at the other end and its force is 0 at the leader. The same is true for the corresponding column
/// of R at the follower. Rotations and openings of grippers are not scaled. For the rotation r of each handle from its
/// offset (TurnCoupling) and the opening g at the fingers (GripCoupling):
///     r_f = R r_l R⁻¹         ω_f = R ω_l       τ_l = (s_f/s_x) Rᵀ τ_f,  so K_l = (s_f/s_x) K_f for rotations
///     g_f = g_l                                 F_l = s_f F_f,           so K_l = s_f K_f for grippers
/// With this scale of torques, τ·ω has the same factor s_x/s_f as F·ẋ, so force and torque can share an account.
/// Grippers have their own account, in which one joule of the leader is 1/s_f joules of the follower. For rotations,
/// `axes` is not used because they are always coupled about all axes.
/// Immutable. Thread-safe. Realtime-safe: yes, except the constructor.
class PoseMap {
 public:
  struct Config {
    double position_scale = 1;  ///< s_x, motion of the follower / motion of the leader; 0.01 … 100
    double force_scale = 1;     ///< s_f, force on the leader / force on the follower; 0.01 … 100
    Quat rotation{};            ///< R, a unit quaternion
    std::array<bool, 3> axes = {true, true, true};  ///< axes of the leader's frame, at least one of them
  };

  /// Throws std::invalid_argument with the name of the field, its value and the expected value.
  explicit PoseMap(const Config& config);

  /// The new scales must be within their bounds.
  PoseMap scaled(double position_scale, double force_scale) const noexcept;

  double position_scale() const noexcept { return position_scale_; }
  double force_scale() const noexcept { return force_scale_; }

  Vec3 to_follower(const Vec3& displacement) const noexcept;  ///< m, m/s: s_x R (coupled part of u_l)
  Vec3 to_leader(const Vec3& displacement) const noexcept;    ///< m, m/s: coupled part of Rᵀ u_f/s_x
  Vec3 force_to_leader(const Vec3& force) const noexcept;     ///< N: s_f (coupled part of Rᵀ F_f)
  /// √W, because half of the square of a wave is a power: √(s_x/s_f) R w_l and its inverse.
  Vec3 wave_to_follower(const Vec3& wave) const noexcept;
  Vec3 wave_to_leader(const Vec3& wave) const noexcept;
  /// These functions return the component along the coupled axes, in the frame of the named end.
  Vec3 coupled_at_leader(const Vec3& vector) const noexcept;
  Vec3 coupled_at_follower(const Vec3& vector) const noexcept;

  double stiffness_at_follower(double at_leader) const noexcept;  ///< K_l → K_f; also for damping
  Quat turn_to_follower(const Quat& turn) const noexcept;         ///< R r R⁻¹
  Quat turn_to_leader(const Quat& turn) const noexcept;           ///< R⁻¹ r R
  Vec3 spin_to_follower(const Vec3& spin) const noexcept;         ///< rad/s: R ω, about all axes
  Vec3 spin_to_leader(const Vec3& spin) const noexcept;
  double turn_stiffness_at_follower(double at_leader) const noexcept;  ///< N·m/rad; also for damping
  double grip_stiffness_at_follower(double at_leader) const noexcept;  ///< N/m; also for damping
  double leader_grip_joule() const noexcept;                           ///< s_f, see leader_joule
  double follower_grip_joule() const noexcept;                         ///< 1/s_f
  double leader_joule() const noexcept;    ///< value of one joule of the follower at the leader: s_f/s_x
  double follower_joule() const noexcept;  ///< value of one joule of the leader at the follower: s_x/s_f

 private:
  double position_scale_;
  double force_scale_;
  Mat3 rotation_;
  Vec3 axes_;  ///< 1 or 0
};

}  // namespace tendon
