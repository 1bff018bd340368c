// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <optional>

#include "core/base/motion.h"
#include "core/teleoperation/coupling_period.h"
#include "core/teleoperation/methods/quiet_stiffness.h"
#include "core/teleoperation/port_state.h"
#include "core/teleoperation/pose_map.h"

namespace tendon {

/// Couples the orientations of two handles. This uses the phases, the ramp, the fade and the account of the Coupling.
///
/// **Rotations.** Each end has an offset q₀ and sends its rotation r = q q₀⁻¹ in its base axes, which corresponds to u
/// for positions. If an end is not live, its r is constant and q₀ follows the handle. When the follower becomes live,
/// it sets r to the mapped rotation of the leader, r_f = R r_l R⁻¹. The r of the leader is 1 at the start of each act
/// and continues from its last value after the clutch, so the clutch does not rotate the other end, and
///     q_f = (R q_l q_l0⁻¹ R⁻¹) q_f0
/// Rotations are not scaled and are coupled about all axes, independent of PoseMap::axes.
///
/// **Law** at each end, with (w, v) = r · y⁻¹ and the mapped rotation y of the peer:
///     τ = −2 K sgn(w) v − B ω,   ‖τ‖ ≤ max_torque                  N·m, on the hand at this end, base axes
///     K = min(stiffness, 2 B/T_loop)                              with `adapts` (QuietStiffness)
/// The spring is the gradient of U = 4 K (1 − |w|), which is ½ K θ² for a small angle θ. Proof: a rotation dθ of the
/// handle (base axes) changes w by −½ v·dθ, so dU = −4 K sgn(w) dw = 2 K sgn(w) v·dθ = −τ·dθ. Since U only depends on
/// the orientation and is the same for q and −q, closed paths in SO(3) do not generate energy if y is constant. The
/// norm of the torque is 2 K sin(θ/2), which increases up to 180°. (For 2 K vᵀv, it would decrease for angles above
/// 90°.) It would be discontinuous at 180°, so the coupling disengages at 150° (`within_reach`). y is extrapolated by ω
/// e if the newest state is late by e, as in PositionPosition.
///
/// **Account.** Force and torque share one account. With x_f = s_x x_l and θ_f = θ_l, one joule of the leader must be
/// s_x/s_f joules of the follower for both, so
///     K_l = (s_f/s_x) K_f,  B_l = (s_f/s_x) B_f          τ_l = (s_f/s_x) Rᵀ τ_f          (PoseMap)
/// K and B are set at the leader. If y is delayed, the pair is only passive because of the limiter and the tank.
///
/// **Methods.** For position-position and waves, there is a spring at the leader, too, so that the torques at both ends
/// are the same (waves do not transfer rotations). With all other methods the torque of the leader is −B ω, because the
/// torque of the environment is not measured, and the K of the follower does not adapt.
///
/// If a robot is not live, it holds its last orientation using the full K. If it is rotated by more than 150°, it holds
/// the new orientation. Quaternions must have the norm 1 ± 0.001.
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
class TurnCoupling {
 public:
  struct Config {
    double stiffness = 0;  ///< N·m/rad, > 0; the maximum of K at the leader
    double damping = 0;    ///< N·m·s/rad, ≥ 0; B at the leader, which must not be 0 if `adapts`
    double max_torque = std::numeric_limits<double>::infinity();  ///< N·m, of this end; > 0
  };
  struct End {
    PortRole role = PortRole::kLeader;
    bool springs = true;  ///< the leader has the spring as well
    bool adapts = true;
    Duration period{};  ///< > 0
  };

  /// Throws std::invalid_argument with the name of the field ("turn.…"), its value and the expected value.
  TurnCoupling(const Config& config, const End& end, const PoseMap& map);

  void remap(const PoseMap& map) noexcept;  ///< changes K and B of the follower

  /// Uses the newest state of the peer. If it is empty, there is no spring.
  void receive(const std::optional<PortTurn>& peer) noexcept;

  void begin_act() noexcept;                      ///< leader: r = 1; follower: r is that of the leader
  void move(const Quat& orientation) noexcept;    ///< must be called if the end is live; r follows the handle
  void follow(const Quat& orientation) noexcept;  ///< must be called if the end is not live; q₀ follows the handle
  bool within_reach() const noexcept;             ///< the peer is within 150°

  Vec3 command(const Turning& hand, const CouplingPeriod& period) noexcept;  ///< requested torque, N·m
  /// Must be called instead of `command` if there is no orientation. The torque is 0.
  void skip(const CouplingPeriod& period) noexcept;

  PortTurn message(const Vec3& torque) const noexcept;  ///< `torque`: applied, N·m

  double stiffness() const noexcept { return stiffness_.value(); }  ///< current K, N·m/rad

 private:
  bool leads() const noexcept { return end_.role == PortRole::kLeader; }
  Vec3 law(const Vec3& angular_velocity, double ahead) noexcept;
  Vec3 bounded(const Vec3& torque) const noexcept;

  End end_;
  PoseMap map_;
  Config config_;
  double whole_;  ///< N·m/rad; K at this end if there is no delay
  double damping_;
  double max_torque_;
  QuietStiffness stiffness_;

  bool heard_ = false;
  Quat there_{};               ///< y
  Vec3 spin_ = Vec3::Zero();   ///< rad/s, of y
  Quat offset_{};              ///< q₀
  Quat turn_{};                ///< r
  Vec3 told_ = Vec3::Zero();   ///< rad/s, of r
  std::optional<Quat> place_;  ///< the held orientation
  Vec3 left_ = Vec3::Zero();   ///< N·m
  Vec3 last_ = Vec3::Zero();   ///< N·m, last requested torque
};

}  // namespace tendon
