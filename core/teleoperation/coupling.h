// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "core/base/motion.h"
#include "core/control/stability_controller.h"
#include "core/handle/handle_sample.h"
#include "core/teleoperation/coupling_config.h"
#include "core/teleoperation/mapped_end.h"
#include "core/teleoperation/methods/any_coupling_law.h"
#include "core/teleoperation/phases/alignment.h"
#include "core/teleoperation/phases/force_ramp.h"
#include "core/teleoperation/phases/loss_stages.h"
#include "core/teleoperation/phases/phase_machine.h"

namespace tendon {

/// Implements one end of a coupling between two devices. This includes engaging, the clutch, loss of the peer, position
/// mapping, the law, and the exchange of energy. The haptic loop of each device owns one object, and the network only
/// transfers PortStates.
///
/// **In each period**, in this order:
///     coupling.receive(state of the peer)            any number of states, possibly late or duplicated
///     limiter.observe(interval)                      the account: L − given + taken
///     coupling.observe(interval, limiter.payable())
///     demand = coupling.command(hand, …)             phases, map, law: the requested force
///     settlement = coupling.settle(…)                limiter.credit, limiter.withdraw
///     limiter.limit(sum of all requested forces)     the bound
///     coupling.conclude(applied, contact)            the end of the period
///     send(coupling.message())
///
/// **Displacements.** Each end has an offset p₀ and sends u = p − p₀ in its own axes. If an end is not *live*, u is
/// constant and p₀ is updated with the position of the handle. The leader is live if it is engaged and the follower has
/// answered this engagement. The follower is live if it is engaged. It then starts with the mapped u of the leader, so
/// that the initial force of the law is 0. The u of the leader is 0 at the start of each engagement. When the clutch is
/// released, it continues from its last value, so that the other end does not move.
///
/// **Phases** (the table is in phase_machine.h). The device is ready if it is connected, armed, and has no fault. The
/// leader engages if its operator calls engage() or presses the button, the leader is ready, and the peer is fresh and
/// in the phase coupled, engaged, or clutched. This starts a new *act*, an engagement with a number. The follower
/// engages if it receives an act that is newer than all previous acts and belongs to the current epoch of the follower.
/// An act ends if the peer has restarted or is no longer engaged in it. The leader also ends the act if the peer knows
/// the act and is not engaged, if the peer is not ready, or if there is no answer within kAnswerWithin. If the leader
/// is clutched, the follower is still engaged and holds its position.
///
/// The force increases within `ramp` and decreases within ForceRamp::kFade, so there are no steps. A fault sets the
/// force to 0 immediately. If there is no position in a period, the gain decreases at the same rate.
///
/// **A new peer** (renew). If another client takes over a channel, its epoch may not be larger than that of the
/// previous client. renew() resets the peer, so that any epoch is accepted, and increments this port's own epoch, so
/// that previous totals and acts are not used. The act ends and the force decreases to 0.
///
/// **Scales that change** (set_scale, MappedEnd). The displacement of the leader is multiplied by the old s_x over the
/// new s_x, so that its mapped position does not change. The force changes within ForceRamp::kFade. The methods waves
/// and passivity (`keeps_scales`) and a coupling of grippers cannot change their scales.
///
/// **Loss of the peer** (LossStages). If the peer is silent, the force decreases. If the peer is gone, the phase is
/// `lost` and the force is 0. A link whose delay exceeds max_delay is treated as lost. A robot (`holds_place`) that is
/// ready and not live holds its last position with a spring of K and B along all axes, and the ramp blends this spring
/// with the law. After a loss, the round trip is measured again, so that the spring of the next act does not depend on
/// the silence. Energy that the network has not delivered is lost to the pair, and some energy is dissipated while the
/// force decreases. A resting hand cannot replace it, so the force is smaller until the next press.
///
/// **Laws.** The folder methods/ contains one law per method. K, D, and B are the values of the leader, and the values
/// of the follower are smaller by s_f s_x. The norm of all forces is at most max_force.
///
/// **Energy tank.** If Config::tank is set, the port exchanges energy with its peer (EnergyTank). Energy is only given
/// if this end is live and the peer is engaged and not silent. A pair with an energy tank is only passive if the method
/// is position-position, set-position, or passivity. If there is no energy tank, each end is passive because of its own
/// limiter, but the follower cannot move. This is also true for the other methods except for waves.
///
/// **The rest of a handle.** Config::turn couples the orientations (TurnCoupling), and Config::grip the grippers
/// (GripCoupling), with the same phases and ramp. The force and the torque share one account, which `settle` changes.
/// `settle_grip` changes that of the gripper. The coupling disengages if the orientations differ by more than 150°.
///
/// **Bad input.** A state is ignored and counted in `refused` if one of its values is not finite or out of bounds, if
/// it answers a state that was never sent, if `energy_in` has decreased within the epoch, or if the tank refuses it.
/// Older states and duplicates are ignored. If the position or the velocity of the hand is not finite or larger than
/// 10¹², the demand is not finite and the limiter sets the force to 0. The same is true for the orientation and the
/// opening if they are coupled. If a measured force is not finite, 0 is used instead. Such a contact force is treated
/// as not measured.
///
/// **Share.** If a follower has several leaders (Couplings), K, D, B, max_force, and the contact force of each pair are
/// multiplied by its share α at both ends. If the follower does not send α (PortState::share), it is 1. The rate of α
/// at the leader is limited as in Shares::kHandOver, so that a late state does not cause a step.
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
class Coupling {
 public:
  static constexpr Duration kAnswerWithin = std::chrono::seconds(12);

  using Config = CouplingConfig;
  using Absolute = CouplingAbsolute;
  using Button = CouplingButton;

  /// Throws std::invalid_argument with the name of the field, its value and the expected value.
  explicit Coupling(const Config& config);

  /// Returns all errors in the combination of fields. The constructor throws the first one.
  static std::vector<CouplingReason> check(const Config& config) { return tendon::check(config); }

  void receive(const PortState& peer, LocalTime now) noexcept;

  /// Starts an act; must be called at the leader. Returns true if the coupling is engaging or was engaged before.
  /// Returns false and does nothing if the phase is alone, lost or fault, or if the peer is not ready.
  bool engage() noexcept;
  void disengage() noexcept;  ///< ends the act; both ends can call this

  void renew() noexcept;  ///< must be called if the peer has been replaced or has restarted

  /// Sets the scales of the leader, 0.01 … 100. Returns false and does nothing if this end is the follower, if the
  /// coupling is engaged or aligning, if the method or a gripper needs constant scales, or if one is out of range.
  bool set_scale(double position_scale, double force_scale) noexcept;
  /// Sets the share α of a follower with Config::share for the next `command`. `others` is the gain of the ramp of
  /// another leader. A robot only holds its position with the remaining part.
  void set_share(double share, double others) noexcept;

  /// `payable` is the account after the previous interval in J (SharesAccount::payable), or +∞ for a port without a
  /// limiter. Must not be called if the interval was not measured.
  void observe(const Interval<3>& interval, double payable) noexcept;

  /// Returns the requested force for this period and −∂F/∂x. `hand` is in the axes of the base frame. `handle` must
  /// contain at least the coupled values.
  Demand<3> command(const Motion& hand, std::uint32_t buttons, bool ready,
                    const HandleSample* handle = nullptr) noexcept;
  const Vec3& torque() const noexcept { return torque_; }     ///< N·m, on the hand, in the axes of the base frame
  double grip_force() const noexcept { return grip_force_; }  ///< N, on the fingers; > 0 opens them
  /// Must be called instead of `command` if there is no position. This only updates the phase. The force is 0.
  void command_unseen(LocalTime now, bool ready) noexcept;

  /// Returns the changes of the account, or 0 without a tank or waves. Must be called between `command` and the
  /// limiter.
  EnergyTank::Settlement settle(double payable, double loss, Duration elapsed) noexcept;

  /// Returns the same for the account of the gripper. Both values are 0 if the grippers are not coupled.
  EnergyTank::Settlement settle_grip(double payable, double loss, Duration elapsed) noexcept;

  /// Ends the period. `applied` (N), `torque` (N·m), and `grip` (N) are from the device, `contact` (N) is on the tool.
  void conclude(const Vec3& applied, const std::optional<Vec3>& contact, const Vec3& torque = Vec3::Zero(),
                double grip = 0) noexcept;
  /// Returns the state to send in this period. Must be called after `conclude`.
  PortState message() const noexcept;

  PortPhase phase() const noexcept { return phase_; }
  bool live() const noexcept;
  double gain() const noexcept { return ramp_.gain(); }  ///< 0 … 1, of the ramp
  double share() const noexcept { return share_; }
  double stiffness() const noexcept;  ///< N/m, at this end: K, for waves B/d, for surface that of the model
  Duration round_trip() const noexcept { return spring_.round_trip(); }
  double account() const noexcept;  ///< J; 0 without an energy tank
  double position_scale() const noexcept { return frame_.map().position_scale(); }
  double force_scale() const noexcept { return frame_.map().force_scale(); }
  const TurnCoupling* turn() const noexcept { return turn_ ? &*turn_ : nullptr; }
  const GripCoupling* grip() const noexcept { return grip_ ? &*grip_ : nullptr; }
  bool contact_measured() const noexcept;  ///< the newest state of the peer contains a contact force
  std::uint64_t refused() const noexcept;  ///< number of refused states

 private:
  bool leads() const noexcept { return frame_.leads(); }
  bool heard() const noexcept { return newest_.sequence > 0; }
  bool in_act() const noexcept { return is_in_act(phase_); }
  bool heard_since(std::uint64_t sequence) const noexcept;
  bool peer_serves() const noexcept;
  bool peer_is_ready() const noexcept;
  bool driven() const noexcept;
  bool rests_at_zero() const noexcept;
  bool gives() const noexcept;

  void take(PhaseInput input) noexcept;
  void advance(LocalTime now, std::uint32_t buttons, bool ready) noexcept;
  void advance_leader(std::uint32_t buttons) noexcept;
  void advance_follower() noexcept;
  void advance_aligning() noexcept;
  void act() noexcept;
  void begin_act() noexcept;
  void take_scales(const PortState& peer) noexcept;
  void follow_scales() noexcept;
  void place(const Vec3& position, const HandleSample* handle) noexcept;
  bool shows_handle(const HandleSample* handle) const noexcept;
  void command_handle(const HandleSample& handle, bool changed, bool placed) noexcept;
  CouplingPeriod period(bool changed, bool placed) const noexcept;
  LawPeriod law_period() const noexcept;
  Demand<3> law(const Vec3& velocity) noexcept;
  Demand<3> blended(const Motion& hand) noexcept;
  bool hold_place(const Vec3& position, const ForceRamp::Change& change) noexcept;
  void follow_share() noexcept;
  void skip() noexcept;

  Config config_;
  MappedEnd frame_;
  PositionPosition<3> spring_;  ///< All methods use this spring to count the periods.
  std::optional<EnergyTank> tank_;
  AnyCouplingLaw law_;

  PortPhase phase_ = PortPhase::kAlone;
  std::uint64_t sequence_ = 0;    ///< number of periods
  std::uint64_t engagement_ = 0;  ///< of the newest act that was started (leader) or followed (follower)
  std::uint64_t seen_ = 0;        ///< the newest act that must be ignored by the follower
  bool answered_ = false;         ///< leader: the follower is engaged in this act
  bool ready_ = false;
  std::uint64_t act_sequence_ = 0;   ///< the first state that contains the act
  std::uint64_t lost_sequence_ = 0;  ///< first state that contains the loss; 0 if the peer knows it or there is none
  LocalTime acted_at_{};
  Clutch clutch_;
  Alignment alignment_;
  std::uint32_t buttons_ = ~std::uint32_t{0};  ///< initially all set: a button must first be released
  LocalTime now_{};
  Duration elapsed_{};

  PortState newest_;  ///< newest state of the peer, if its sequence is not 0
  LossStages loss_stages_;
  LossStages::Stage loss_stage_;
  bool peer_anew_ = false;  ///< the epoch has changed in this period
  std::uint64_t refused_ = 0;

  Vec3 offset_ = Vec3::Zero();  ///< m, p₀
  Vec3 u_ = Vec3::Zero();       ///< m
  Vec3 u_velocity_ = Vec3::Zero();
  bool was_live_ = false;
  bool new_act_ = false;         ///< follower: the first period of an act
  std::optional<Vec3> place_{};  ///< m, the held position
  bool was_aligning_ = false;
  bool rescaled_ = false;  ///< The scales have changed in this period.
  ForceRamp ramp_;
  double share_ = 1;    ///< α
  double others_ = 0;   ///< the gain of another leader, only at the follower
  double taken_ = 0;    ///< J; received from waves or acts since the last `settle`
  double given_ = 0;    ///< J, energy that was sent by waves since the last `settle`
  double payable_ = 0;  ///< J, after the newest interval
  double loss_ = 0;     ///< J; the reserve of the limiter for the last force

  std::optional<TurnCoupling> turn_;
  std::optional<GripCoupling> grip_;
  Vec3 torque_ = Vec3::Zero();
  double grip_force_ = 0;
  PortState told_;  ///< The values from `conclude`.
};

}  // namespace tendon
