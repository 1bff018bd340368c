// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "core/base/motion.h"

namespace tendon {

/// How the two ends of a coupling correspond. With u the displacement of each handle from its own offset:
///
///     u_f = s_x R u_l             F_l = s_f Rᵀ F_f
///     K_l = s_f s_x K_f           one joule of the leader is s_x/s_f joules of the follower
///
/// `R` turns the leader's base frame into the follower's. An axis of the LEADER's frame that is not coupled is left
/// out: its displacement is 0 for the other end, and its force is 0 at the leader; likewise at the follower along R's
/// columns.
///
/// The rest of a handle: turns and openings of a gripper are not scaled. With r the turn of each handle from its own
/// offset (TurnCoupling) and g the opening at the fingers (GripCoupling):
///
///     r_f = R r_l R⁻¹         ω_f = R ω_l       τ_l = (s_f/s_x) Rᵀ τ_f,  so K_l = (s_f/s_x) K_f of turning
///     g_f = g_l                                 F_l = s_f F_f,           so K_l = s_f K_f of gripping
///
/// With that scale of torques τ·ω is worth what F·ẋ is, s_x/s_f at the follower: force and torque share an account. A
/// grip has one of its own, in which a joule of the leader is 1/s_f joules of the follower. Turns are coupled about all
/// axes, whatever `axes` says.
///
/// Immutable. Thread-safe. Realtime-safe: all but the constructor.
class PoseMap {
 public:
  struct Config {
    double position_scale = 1;                      ///< s_x, follower / leader; 0.01 … 100
    double force_scale = 1;                         ///< s_f, leader / follower; 0.01 … 100
    Quat rotation{};                                ///< R, of length 1
    std::array<bool, 3> axes = {true, true, true};  ///< of the leader's frame; one at least
  };

  /// Throws std::invalid_argument naming the field, its value and what was expected.
  explicit PoseMap(const Config& config);

  /// The same with other scales, each within its bounds.
  PoseMap scaled(double position_scale, double force_scale) const noexcept;

  double position_scale() const noexcept { return position_scale_; }
  double force_scale() const noexcept { return force_scale_; }

  Vec3 to_follower(const Vec3& displacement) const noexcept;  ///< m, m/s: s_x R (the coupled part of u_l)
  Vec3 to_leader(const Vec3& displacement) const noexcept;    ///< m, m/s: the coupled part of Rᵀ u_f/s_x
  Vec3 force_to_leader(const Vec3& force) const noexcept;     ///< N: s_f (the coupled part of Rᵀ F_f)
  /// √W: a wave, half of whose square is a power: √(s_x/s_f) R w_l, and back.
  Vec3 wave_to_follower(const Vec3& wave) const noexcept;
  Vec3 wave_to_leader(const Vec3& wave) const noexcept;
  /// The part of a vector along the coupled axes, in the frame of either end.
  Vec3 coupled_at_leader(const Vec3& vector) const noexcept;
  Vec3 coupled_at_follower(const Vec3& vector) const noexcept;

  double stiffness_at_follower(double at_leader) const noexcept;  ///< K_l → K_f; dampers likewise
  Quat turn_to_follower(const Quat& turn) const noexcept;         ///< R r R⁻¹
  Quat turn_to_leader(const Quat& turn) const noexcept;           ///< R⁻¹ r R
  Vec3 spin_to_follower(const Vec3& spin) const noexcept;         ///< rad/s: R ω, about all axes
  Vec3 spin_to_leader(const Vec3& spin) const noexcept;
  double turn_stiffness_at_follower(double at_leader) const noexcept;  ///< N·m/rad; dampers likewise
  double grip_stiffness_at_follower(double at_leader) const noexcept;  ///< N/m; dampers likewise
  double leader_grip_joule() const noexcept;                           ///< as leader_joule, of grippers: s_f
  double follower_grip_joule() const noexcept;                         ///< 1/s_f
  double leader_joule() const noexcept;    ///< what one joule of the follower is worth at the leader: s_f/s_x
  double follower_joule() const noexcept;  ///< … and the other way round: s_x/s_f

 private:
  double position_scale_;
  double force_scale_;
  Mat3 rotation_;
  Vec3 axes_;  ///< 1 or 0
};

}  // namespace tendon
