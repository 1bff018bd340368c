// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <optional>

#include "core/base/motion.h"
#include "core/teleoperation/coupling_period.h"
#include "core/teleoperation/energy_tank.h"
#include "core/teleoperation/methods/quiet_stiffness.h"
#include "core/teleoperation/port_state.h"
#include "core/teleoperation/pose_map.h"

namespace tendon {

/// Couples the grippers of two handles. This uses the phases, the ramp and the fade of the Coupling that owns this
/// object. A gripper is a separate port (PortGrip) with its own account and tank. There are springs at both ends for
/// all methods, because both openings are measured.
///
/// **Openings.** g = arm · opening, m at the fingers, > 0 open. Openings are not scaled and have no offset. The coupled
/// quantity is w, the opening that the leader requests and sends instead of g:
///     not engaged                  w = g_l
///     start of an act              w = g_f + F_f/K_f: the current target of the follower's gripper
///     live                         w → g_l with at most `speed`; once they are equal, w = g_l
///     clutched or not answered     w is constant, so the follower's grip is held
/// Neither gripper jumps when it is coupled. The follower computes z from w in the same way: z starts at the last
/// target of its gripper (for a hand: g_f) and changes to w with at most `speed` until they are equal.
///
/// **Law** at each end, in N on the fingers, positive to open them:
///     F_l = K (g_f − w) − B v_l        F_f = K (z − g_f) − B v_f        |F| ≤ max_force
///     K = min(stiffness, 2 B/T_loop)   with `adapts` (QuietStiffness), K_l = s_f K_f, B_l = s_f B_f
/// At rest, the leader feels the grasped object, F_l = −s_f F_f. If the newest state of the peer is late by e, its
/// opening is extrapolated by v e. K follows T_loop only in periods with a new state. A spring to a constant position
/// is not in a loop, so the grip keeps its force while the link is interrupted. K and B are set at the leader.
///
/// **Account.** One joule of the follower's gripper is s_f joules of the leader's, since openings are not scaled. The
/// grippers have a separate tank, with the same messages (PortGrip) and limits, so the theorem of EnergyTank is also
/// true for the pair of grippers. The leader's fingers provide the energy for the motion of the follower's.
///
/// **Robots.** A follower with `holds_place` that is not live holds the opening z_h with the full K_f, where z_h = g_f
/// + F/K_f is chosen once such that the force does not change. An object is neither dropped nor squeezed harder. This
/// is also true when the leader engages again, because w then starts at this opening. A fault ends the force. The grip
/// of a hand fades.
///
/// **Bad input.** A state that the tank would refuse is refused entirely (`accepts`). Openings must be finite.
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
class GripCoupling {
 public:
  struct Config {
    double stiffness = 0;  ///< N/m at the fingers, > 0; the maximum of K at the leader
    double damping = 0;    ///< N·s/m, ≥ 0; B at the leader, which must not be 0 if `adapts`
    double speed = 0.05;   ///< m/s, > 0
    double arm = 0;        ///< m/rad, > 0; for the gripper at this end
    double max_force = std::numeric_limits<double>::infinity();  ///< N, of this end; > 0
  };
  struct End {
    PortRole role = PortRole::kLeader;
    bool adapts = true;
    Duration period{};  ///< > 0
    /// See Coupling::Config. `joule`, `peers` and `start` are set from the map.
    std::optional<EnergyTank::Config> tank{};
  };

  /// Throws std::invalid_argument with the name of the field ("grip.…"), its value and the expected value.
  GripCoupling(const Config& config, const End& end, const PoseMap& map);

  /// Returns false if the tank would refuse the state.
  bool accepts(const PortState& peer) const noexcept;
  void receive(const PortState& peer) noexcept;

  /// Must be called if the peer has been replaced (Coupling::renew).
  void renew(std::uint64_t epoch) noexcept;

  void begin_act() noexcept;

  double command(const Grip& hand, const CouplingPeriod& period) noexcept;  ///< requested force on the fingers, N
  /// Must be called instead of `command` if there is no opening. The force is 0.
  void skip(const CouplingPeriod& period) noexcept;

  /// See Coupling::settle.
  EnergyTank::Settlement settle(const EnergyTank::Period& period) noexcept;

  /// Must be called once per period. `force` is the applied force, N.
  PortGrip message(double force) noexcept;

  double stiffness() const noexcept { return stiffness_.value(); }          ///< current K, N/m
  double account() const noexcept { return tank_ ? tank_->account() : 0; }  ///< J; 0 without an energy tank
  double asked() const noexcept { return asked_; }                          ///< w or z, m

 private:
  bool leads() const noexcept { return end_.role == PortRole::kLeader; }
  double bounded(double force) const noexcept;
  void approach(double target) noexcept;
  void lead(double opening, double velocity, const CouplingPeriod& period) noexcept;
  void go_after(double opening, double there, const CouplingPeriod& period) noexcept;

  Config config_;
  End end_;
  double whole_;  ///< N/m; K at this end if there is no delay
  double peers_;  ///< K of the peer without a delay, N/m
  double damping_;
  QuietStiffness stiffness_;
  std::optional<EnergyTank> tank_;

  PortGrip newest_;
  bool heard_ = false;
  bool came_ = false;    ///< true if a state was received since the last period
  bool begins_ = false;  ///< an act starts in this period
  double asked_ = 0;     ///< m, w or z
  bool joined_ = false;  ///< `asked_` has reached its target
  double told_ = 0;      ///< m
  double speed_ = 0;     ///< m/s, of `told_`
  bool was_driven_ = false;
  std::optional<double> place_;  ///< m, z_h
  double spring_ = 0;            ///< N, last force of the spring
  double left_ = 0;              ///< N
  double last_ = 0;              ///< N, last requested force
};

}  // namespace tendon
