// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <optional>

#include "core/base/motion.h"
#include "core/teleoperation/coupling_period.h"
#include "core/teleoperation/methods/quiet_stiffness.h"
#include "core/teleoperation/port_state.h"
#include "core/teleoperation/pose_map.h"
#include "core/teleoperation/purse.h"

namespace tendon {

/// The grippers of the two handles of a Coupling: that class owns one for each end and calls it; phases, ramp and fade
/// are the coupling's. A gripper is a port of its own (GripPort), with an account and a purse of its own. All methods
/// couple grippers by springs at both ends, because both ends measure them.
///
/// **Places.** g = arm · opening, m at the fingers, > 0 open. An opening means the same at both ends: no scale, no
/// offset. What ties the two is w, the opening that the leader asks for; it tells w in place of its g:
///
///     not engaged                  w = g_l
///     the act                      w = g_f + F_f/K_f: what the follower's gripper is asked for as it is now
///     live                         w → g_l at `speed` at most, and once they were equal w = g_l
///     clutched, not answered yet   w stands still, and so the follower's grip holds
///
/// So neither gripper jumps when they are coupled, wherever they are. The follower makes z of w in the same way: from
/// what its gripper was asked for so far (a hand's: g_f) it goes to w at `speed` at most, until they were equal.
///
/// **Law**, at each end by itself, in N on the fingers, > 0 opens them:
///
///     F_l = K (g_f − w) − B v_l        F_f = K (z − g_f) − B v_f        |F| ≤ max_force
///     K = min(stiffness, 2 B/T_loop)   with `adapts` (QuietStiffness), K_l = s_f K_f, B_l = s_f B_f
///
/// so with both at rest what squeezes the egg is what the leader feels, F_l = −s_f F_f. The peer's place counts on by
/// v e when its newest state is by e late. K follows T_loop in periods in which a state came: a spring to a place that
/// stands still is in no loop, and while the link is dead the grip keeps its force. `stiffness` and `damping` are the
/// leader's.
///
/// **Account.** One joule of the follower's gripper is worth s_f at the leader's, since openings are not scaled. The
/// two grippers share by a purse of their own, in the same messages (PortGrip) and with the same limits as the
/// wrench's; the theorem of Purse holds for the pair of grippers by itself. What a follower's fingers do is paid by
/// what a hand has done at the leader's: while nobody there has moved them, they go nowhere.
///
/// **A robot keeps its grip.** Whenever a follower with `holds_place` is not live it holds the place z_h with its whole
/// K_f, chosen once so that the force stays what it was: z_h = g_f + F/K_f, with F of its spring. What it holds is
/// neither dropped nor squeezed more, also when the leader acts again: then w is this place. A fault ends the force. A
/// hand's grip fades.
///
/// **Bad input.** A state that the purse would refuse is refused as a whole (`accepts`). The caller gives openings that
/// are finite.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
class GripCoupling {
 public:
  struct Config {
    double stiffness = 0;  ///< most K, N/m at the fingers, the leader's; > 0
    double damping = 0;    ///< B, N·s/m, the leader's; ≥ 0, and > 0 with `adapts`
    double speed = 0.05;   ///< m/s, > 0
    double arm = 0;        ///< m/rad, of this end's gripper; > 0
    double max_force = std::numeric_limits<double>::infinity();  ///< N, this end's; > 0
  };
  struct End {
    PortRole role = PortRole::kLeader;
    bool adapts = true;
    Duration period{};  ///< > 0
    /// As Coupling::Config's; joule, peers and start are set from the map.
    std::optional<Purse::Config> purse{};
  };

  /// Throws std::invalid_argument naming the field ("grip.…"), its value and what was expected.
  GripCoupling(const Config& config, const End& end, const PoseMap& map);

  /// Whether the purse would not refuse this state of the peer.
  bool accepts(const PortState& peer) const noexcept;
  void receive(const PortState& peer) noexcept;

  /// The other end is another one (Coupling::renew).
  void renew(std::uint64_t epoch) noexcept;

  void begin_act() noexcept;

  /// N on the fingers, to want in this period.
  double command(const Grip& hand, const CouplingPeriod& period) noexcept;
  /// A period without an opening: no force.
  void skip(const CouplingPeriod& period) noexcept;

  /// As Coupling::settle, for the account of the gripper.
  Purse::Settlement settle(const Purse::Period& period) noexcept;

  /// Once a period. `force`: N, really applied.
  PortGrip message(double force) noexcept;

  double stiffness() const noexcept { return stiffness_.value(); }            ///< K in use, N/m
  double account() const noexcept { return purse_ ? purse_->account() : 0; }  ///< J; 0 without a purse
  double asked() const noexcept { return asked_; }                            ///< w or z, m

 private:
  bool leads() const noexcept { return end_.role == PortRole::kLeader; }
  double bounded(double force) const noexcept;
  void approach(double target) noexcept;
  void lead(double opening, double velocity, const CouplingPeriod& period) noexcept;
  void go_after(double opening, double there, const CouplingPeriod& period) noexcept;

  Config config_;
  End end_;
  double whole_;  ///< K of this end without delay, N/m
  double peers_;  ///< … and of the peer
  double damping_;
  QuietStiffness stiffness_;
  std::optional<Purse> purse_;

  PortGrip newest_;
  bool heard_ = false;
  bool came_ = false;    ///< a state, since the last period
  bool begins_ = false;  ///< the act, in this period
  double asked_ = 0;     ///< m, w or z
  bool joined_ = false;  ///< it goes with what it approached
  double told_ = 0;      ///< m
  double speed_ = 0;     ///< m/s, of it
  bool was_driven_ = false;
  std::optional<double> place_;  ///< m, z_h
  double spring_ = 0;            ///< N, of the last force
  double left_ = 0;              ///< N
  double last_ = 0;              ///< N, wanted last
};

}  // namespace tendon
