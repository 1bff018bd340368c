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

/// The orientation of a handle in a Coupling: that class owns one for each end and calls it; phases, ramp, fade and the
/// account are the coupling's.
///
/// **Turns.** Each end has an offset q₀ and tells r = q q₀⁻¹, its turn since then, in its own base axes: for positions
/// that is u. While an end is not live its r stands still and q₀ moves with the handle. When the follower becomes live
/// it sets its r to the leader's as mapped, r_f = R r_l R⁻¹; the leader's r begins each act at 1, and goes on from
/// where it stood, after a clutch too. So nothing turns at the other end, however often the clutch is pressed, and
///
///     q_f = (R q_l q_l0⁻¹ R⁻¹) q_f0
///
/// Turns are not scaled: an angle is the same at both ends. They are coupled about all axes, whatever PoseMap::axes
/// says.
///
/// **Law**, with (w, v) = r · y⁻¹ and y the peer's turn as mapped, at each end by itself:
///
///     τ = −2 K sgn(w) v − B ω,   ‖τ‖ ≤ max_torque                  N·m, on whoever holds this end, base axes
///     K = min(stiffness, 2 B/T_loop)                              with `adapts` (QuietStiffness)
///
/// The spring is the gradient of U = 4 K (1 − |w|), ½ K θ² for a small angle θ. Proof: a turn dθ of the handle (base
/// axes) changes w by −½ v·dθ, so dU = −4 K sgn(w) dw = 2 K sgn(w) v·dθ = −τ·dθ. U is a function of the orientation
/// alone, and the same for q and −q: a closed way in SO(3) gives out nothing while y stands still. The size of the
/// torque is 2 K sin(θ/2), which rises up to 180° (that of 2 K vᵀv falls beyond 90°, and with it what is felt). At 180°
/// it would jump; the coupling disengages at 150° (`within_reach`).
///
/// y is y turned on by ω e when the newest state is by e late, as the position's (PositionPosition).
///
/// **One account for force and torque.** x_f = s_x x_l, θ_f = θ_l, and one joule of the leader has to be s_x/s_f of the
/// follower for both, so
///
///     K_l = (s_f/s_x) K_f,  B_l = (s_f/s_x) B_f          τ_l = (s_f/s_x) Rᵀ τ_f          (PoseMap)
///
/// `stiffness` and `damping` are the leader's. The law is not passive while y is late; the wrench's limiter and the
/// purse keep the pair so, as for the force.
///
/// **Methods.** The leader has the spring with position-position and waves (a line of waves carries no turns), so that
/// both ends hold the same torque; with all others its torque is −B ω alone, because nothing measures the torque of the
/// surroundings, and the follower's K does not adapt.
///
/// A robot that is not live holds the orientation where it stopped, with the whole K; one that is turned from it by
/// more than 150° stays where it was turned to.
///
/// The caller gives orientations of length 1 ± 0.001. Thread-safe: no. Realtime-safe: all but the constructor.
class TurnCoupling {
 public:
  struct Config {
    double stiffness = 0;  ///< most K, N·m/rad, the leader's; > 0
    double damping = 0;    ///< B, N·m·s/rad, the leader's; ≥ 0, and > 0 with `adapts`
    double max_torque = std::numeric_limits<double>::infinity();  ///< N·m, this end's; > 0
  };
  struct End {
    PortRole role = PortRole::kLeader;
    bool springs = true;  ///< the leader has the spring, too
    bool adapts = true;
    Duration period{};  ///< > 0
  };

  /// Throws std::invalid_argument naming the field ("turn.…"), its value and what was expected.
  TurnCoupling(const Config& config, const End& end, const PoseMap& map);

  /// Other scales: K and B of the follower follow.
  void remap(const PoseMap& map) noexcept;

  /// Of the peer's newest state; empty: nothing is heard of its turn, and there is no spring.
  void receive(const std::optional<PortTurn>& peer) noexcept;

  void begin_act() noexcept;                      ///< leader: r = 1; follower: r is the leader's
  void move(const Quat& orientation) noexcept;    ///< live: r follows the handle
  void follow(const Quat& orientation) noexcept;  ///< not live: q₀ does
  bool within_reach() const noexcept;             ///< of the peer: at most 150°

  /// N·m, to want in this period.
  Vec3 command(const Turning& hand, const CouplingPeriod& period) noexcept;
  /// A period without an orientation: no torque.
  void skip(const CouplingPeriod& period) noexcept;

  /// `torque`: N·m, really applied.
  PortTurn message(const Vec3& torque) const noexcept;

  double stiffness() const noexcept { return stiffness_.value(); }  ///< K in use, N·m/rad

 private:
  bool leads() const noexcept { return end_.role == PortRole::kLeader; }
  Vec3 law(const Vec3& angular_velocity, double ahead) noexcept;
  Vec3 bounded(const Vec3& torque) const noexcept;

  End end_;
  PoseMap map_;
  Config config_;
  double whole_;  ///< K of this end without delay, N·m/rad
  double damping_;
  double max_torque_;
  QuietStiffness stiffness_;

  bool heard_ = false;
  Quat there_{};               ///< y
  Vec3 spin_ = Vec3::Zero();   ///< rad/s, of y
  Quat offset_{};              ///< q₀
  Quat turn_{};                ///< r
  Vec3 told_ = Vec3::Zero();   ///< rad/s, of r
  std::optional<Quat> place_;  ///< that a robot holds
  Vec3 left_ = Vec3::Zero();   ///< N·m
  Vec3 last_ = Vec3::Zero();   ///< N·m, wanted last
};

}  // namespace tendon
