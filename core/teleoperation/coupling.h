// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "core/base/motion.h"
#include "core/control/stability_controller.h"
#include "core/handle/handle_sample.h"
#include "core/teleoperation/grip_coupling.h"
#include "core/teleoperation/model_mediated.h"
#include "core/teleoperation/port_state.h"
#include "core/teleoperation/pose_map.h"
#include "core/teleoperation/position_position.h"
#include "core/teleoperation/purse.h"
#include "core/teleoperation/turn_coupling.h"
#include "core/teleoperation/two_channel_passivity.h"
#include "core/teleoperation/wave_variables.h"

namespace tendon {

/// One end of a coupling between two devices: engage, clutch and loss of the peer, the map, the law and the purse. Both
/// ends are this class, each in the haptic loop of its device; the network only carries PortStates.
///
/// **In each period**, in this order:
///
///     coupling.receive(state of the peer)            any number, late or twice
///     limiter.observe(interval)                      the account: L − given + taken
///     coupling.observe(interval, limiter.payable())
///     demand = coupling.command(hand, …)             phases, map, law: the force to want
///     settlement = coupling.settle(…)                limiter.credit, limiter.withdraw
///     limiter.limit(everything that is wanted)       the bound
///     send(coupling.message(applied, contact))
///
/// **Displacements.** Each end has an offset p₀ and tells u = p − p₀, in its own axes. While an end is not *live* its u
/// stands still, and p₀ moves with the handle. The leader is live while it is engaged and the follower has answered the
/// act; the follower while it is engaged. When it becomes live the follower sets its u to the leader's as mapped, so
/// that the law has no force at that moment; the leader's u begins each act at 0 and goes on from where it stood, after
/// a clutch too. So nothing moves at the other end, however often the clutch is pressed.
///
/// **Phases** (PortPhase), `ready` = the device is seen, armed and without fault:
///
///     alone    → coupled   the peer is fresh;  coupled → alone   it is silent for as long as the last rung says
///     coupled  → aligning  leader, of an absolute map: the act, while ready and so on, as below
///     aligning → engaged   leader: the handle was within `within` of the follower's place for kAligned
///     aligning → coupled   disengage(), the peer is not ready or starts anew, or after kAlignWithin
///     coupled  → engaged   leader: the act (engage(), or its button pressed), while ready and the peer is coupled,
///                          engaged or clutched, and fresh. follower: ready, the peer fresh, and engaged or clutched by
///                          an act that is newer than any that the follower has heard of, in any phase, and that was
///                          made for the follower's present epoch
///     engaged  → clutched  leader: its clutch is held (or toggled); the follower stays engaged and holds its place
///     clutched → engaged   leader: released
///     engaged, clutched → coupled    disengage(); or the peer starts anew, or is not engaged or clutched by this act
///                          any more; or (leader) the peer has heard the act and is not engaged by it, is not ready, or
///                          has not answered for kAnswerWithin
///     engaged, clutched → lost       the ladder
///     lost     → coupled   the peer is fresh again, and its state answers one of ours that said so: both ways work,
///                          and no act that was made before it knew can engage us any more
///     any      → fault     not ready;  fault → coupled when ready again (alone, without a peer or before it knows of a
///                          loss)
///
/// The force of a port that becomes live is multiplied by a ramp 0 → 1 within `ramp`. Whenever what makes the force
/// changes, what the force was before is faded out within kFade: no act, clutch, loss or takeover makes a step. A fault
/// ends the force at once. (So does the limiter, when it has to.) Periods without a position lower the ramp as fast.
///
/// **Absolute maps** (Config::absolute): u = p at both ends, p_f = s_x R p_l, and no clutch. The act is aligning first:
/// the leader is drawn to where the follower is, by its spring whose far end moves at kAlignSpeed, with at most
/// kAlignForce, while the follower stands still. A limiter lets it draw with what the hand has put in; `energy` (J) is
/// paid into the account at each act beside that, so that the port's promise is L ≥ −energy · acts. 0: the hand brings
/// the handle there. What is left of the distance when it engages is drawn together as the ramp rises.
///
/// **Another peer** (renew): who takes a channel over has an epoch that is not above that of the one before. renew()
/// forgets the peer, so that any epoch is heard, and raises our own by one, so that no total and no act of before
/// counts. Whatever was engaged is not any more, and its force fades.
///
/// **Scales that change** (set_scale): the leader's u is stretched by the old s_x over the new, so that its mapped
/// place stays where it is, and its states tell the new scales. The follower takes them from the first state that tells
/// them. The force that this changes fades from the old to the new within kFade. Purse says what becomes of energy: in
/// the leader's joules of each moment, the pair gives out nothing. Waves and passivity keep their scales
/// (keeps_scales), and so does a coupling of grippers.
///
/// **Ladder.** Age: how long ago the newest state came. v = max(3 periods of the peer, 20 ms, twice the longest gap
/// of at most kMostGap between two newer states lately):
///
///     age > v            the peer's velocity counts as zero (PositionPosition does so at 20 ms already)
///     age > v + 20 ms    the force fades within kFade; with `holds_place` (a robot) it stays: the last place is held
///     age > v + 250 ms   phase lost. Force zero; with `holds_place` the place where the TOOL is now is held
///
/// While half of the measured round trip is above max_delay the last rung is reached at once: no state is fresh.
///
/// A robot (`holds_place`) holds the place where it stopped being live, with its own spring of whole K and B along all
/// axes, whenever it is ready and not live; the ramp blends it with the law.
///
/// When a lost peer is back the round trip is measured anew, so that the silence does not soften the springs of the
/// next act. A state that comes before the last rung ramps the force in again. Energy that was under way is lost, which
/// is safe.
///
/// **Laws.** position-position: F = K(y − u) + D(ẏ − u̇) − B u̇ at both ends (PositionPosition), y the peer's u mapped.
/// K, D, B are those of the leader; the follower's are smaller by s_f s_x. position-force: the follower has the same
/// law, with a K that does not adapt to the delay, because the leader has no spring; the leader's force is
/// s_f Rᵀ f_contact − B v, and −B v alone when the peer measures no contact (`contact_measured`). surface: the follower
/// does the same and finds the surface that its tool touches (SurfaceEstimator, from the contact force); the leader
/// renders that one at its own rate (SurfaceRenderer, what a change costs is paid from the account), and −B v. The
/// surface is forgotten with each act. waves: a WavePort of impedance B at both ends, B_f = B/(s_f s_x); K and D are
/// not used, but for the place of a robot. All forces of the coupling are bounded by max_force.
///
/// set-position: F = K(ȳ − u) − B u̇ at both ends, ȳ the nearest to the peer's mapped u with ½ K ‖ȳ − u‖² ≤ payable
/// (paid_stretch). K adapts to the delay as that of position-position; no velocity of the peer is used, nor D, so
/// that states may be seldom and irregular. With a follower that only follows, as in position-force, the leader felt a
/// tenth of what was at the wall (0.17 of 4.1 N at 50 ms): the follower's stiffer spring drew the account that the
/// leader's stretch needs.
///
/// passivity: the leader's force is s_f Rᵀ(−F_follower) − (α + B) u̇_l (PassivityLeader), F_follower what the
/// follower's device exerts on its tool. The follower's spring of K_f pulls the tool to a reference that begins at u
/// and moves as PassivityFollower says, with λ = drift_rate. α is at most B: the damping that the scene lets each
/// handle bear, for a device's own friction is too little to take anything up. B besides, because E_in is 0 without it
/// and nothing could begin to move. E_in is what the port took in by this coupling's acts; of a peer's epoch only what
/// came after this port first heard of that epoch counts, because the rest may have been used. By itself it gives out
/// some mJ, because tools have mass and the ends look one period ahead: the pair needs limiters and a purse, too.
///
/// rate: u_l begins at 0 whenever the leader becomes live, and that place is the centre. In the leader's scale
///
///     F_l = −K_c u_l − B u̇_l + f,     f = s_f Rᵀ f_contact, no longer than K_c · dead_zone
///     v = gain (‖u_l‖ − dead_zone)₊ û_l,  ‖v‖ ≤ max_speed;     the follower's reference moves by s_x R v T in a period
///
/// The follower's spring of K_f pulls its tool to the reference, which runs at most max_force/K_f ahead of the tool. f
/// alone cannot push the handle out of its dead zone, so a contact never moves the follower. The reference stands in
/// each period in which the newest state has the handle in its dead zone, is not of a live leader, or is older than v
/// of the ladder. A hand that holds its handle out does no work: a follower behind a limiter of its own goes on only as
/// far as its account pays for what friction takes beyond the limiter's lower bounds.
///
/// **Waves and phases.** What the line sends is paid from the limiter's account, and what comes is paid into it, so
/// that the pair is passive whatever was cut. What limiter and motors leave of the force is what the line books; what
/// they cut is sent later (WavePort::SharedAccount), and what the ramp takes is not cut, so that nothing shifts the two
/// places against each other for good. A clutched leader holds its end of the line where it is: the follower stays
/// there on the line's own spring. An end that is not engaged takes up what comes and sends nothing.
///
/// **Purse.** With Config::purse the port pays and is paid (Purse); it gives only while it is live and its
/// peer is engaged (not clutched) and not silent. Its `joule` is the map's. The pair of position-position, set-position
/// or passivity needs it to be passive; without it a limiter at each end keeps each by itself passive, and the follower
/// cannot move. Nor can a follower of another method without a purse, if it has a limiter, but by waves, which carry
/// their own energy.
///
/// **The rest of a handle.** With Config::turn the orientations are coupled (TurnCoupling), with Config::grip the
/// grippers (GripCoupling), in the same phases, with the same ramp and fade. Force and torque share the account that
/// `observe` and `settle` are about; the gripper's is settled by `settle_grip`. Ends whose orientations are more than
/// 150° apart disengage.
///
/// **Bad input.** A state with a value that is not finite or out of its bounds, that answers what we have not sent,
/// whose energy_in has fallen within its epoch, or that the purse refuses, changes nothing and is counted in `refused`.
/// One that is not newer is passed over. A hand that is not finite, or beyond 10¹² m or m/s, gives a demand that is not
/// finite, which the limiter turns to zero; it moves nothing else; so does one whose orientation or opening is coupled
/// and missing or not finite. A force or contact that is not finite is told as 0 or
/// as not measured.
///
/// **Share.** Of several leaders of one follower (Couplings) the law is multiplied by its share α at both ends: K, D, B
/// and max_force of this pair are α times what the scene says, and so is the contact force that a leader feels. The
/// follower tells it (PortState::share); the leader goes there no faster than Shares::kHandOver allows, so that a state
/// that comes late makes no step. Where the follower tells none, there is one leader, and α = 1.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
class Coupling {
 public:
  static constexpr Duration kFade = std::chrono::milliseconds(50);
  static constexpr Duration kAnswerWithin = std::chrono::seconds(12);
  static constexpr Duration kStale = std::chrono::milliseconds(20);  ///< least v, and from v to the second rung
  static constexpr Duration kLostAfter = std::chrono::milliseconds(250);
  static constexpr Duration kMostGap = std::chrono::milliseconds(100);  ///< a longer one counts as this
  /// Of a line of waves, besides way and playout: W/2 and the periods.
  static constexpr Duration kLineWaits = std::chrono::milliseconds(11);
  static constexpr Duration kGapsKept = std::chrono::seconds(5);  ///< lately: the last one to two of these

  struct Button {
    std::uint32_t bit = 0;  ///< ≤ 31
    bool toggles = false;   ///< else: as long as it is held
  };

  static constexpr Duration kAligned = std::chrono::milliseconds(200);
  static constexpr Duration kAlignWithin = std::chrono::seconds(5);
  static constexpr double kAlignSpeed = 0.05;  ///< m/s
  static constexpr double kAlignForce = 1;     ///< N

  /// A place of the leader is a place of the follower.
  struct Absolute {
    double within = 0.02;  ///< m, at the leader: near enough to engage; > 0
    double energy = 0;     ///< J, of the leader: paid into the account at each act; ≥ 0
  };

  struct Config {
    PortRole role = PortRole::kLeader;
    CouplingMethod method = CouplingMethod::kPositionPosition;
    PoseMap::Config map{};
    /// stiffness, damping, own_damping: the LEADER's; max_force this end's. period, epoch: this end's.
    PositionPosition<3>::Config spring{};
    /// start: the LEADER's J, the follower's is worth as much; max_power, max_account: this end's. peers, joule and
    /// epoch are set from map and spring.
    std::optional<Purse::Config> purse{};
    /// Of method surface; in the follower's scale, and used there only.
    SurfaceEstimator<3>::Config surface{
        .contact_force = 0.1, .first_stiffness = 200, .max_stiffness = 5000, .least_travel = 2e-4, .memory = 300};
    /// Of methods that have places (has_places); not with a clutch. Empty: places count from where each end was.
    std::optional<Absolute> absolute{};
    std::optional<Button> clutch{};            ///< leader only
    std::optional<std::uint32_t> engage_by{};  ///< leader: bit of the button whose press is the act; empty: engage()
    Duration ramp = std::chrono::milliseconds(300);       ///< > 0
    Duration peer_period = std::chrono::milliseconds(1);  ///< > 0: how often states of the peer are sent
    bool holds_place = false;                             ///< follower only: a robot, which no hand holds
    /// Follower only, of one of several leaders: α at first, 0 … 1. Methods position-position and position-force.
    std::optional<double> share{};
    double drift_rate = 100;                     ///< λ, 1/s, ≥ 0; of method passivity
    std::optional<RateControl> rate{};           ///< of method rate, which needs it
    double centring = 0;                         ///< K_c, N/m, ≥ 0; leader only, of method rate
    Duration max_delay = Duration::max();        ///< > 0; a link with a longer way counts as lost
    std::optional<TurnCoupling::Config> turn{};  ///< empty: the orientations are not coupled
    std::optional<GripCoupling::Config> grip{};  ///< empty: the grippers are not
  };

  /// Throws std::invalid_argument naming the field, its value and what was expected.
  explicit Coupling(const Config& config);

  void receive(const PortState& peer, LocalTime now) noexcept;

  /// The operator's act, leader only (a follower passes over it): true when the coupling is engaging, or was already.
  /// It is false, and nothing happens, in the phases alone, lost and fault, and when the peer is not ready.
  bool engage() noexcept;
  /// Either end.
  void disengage() noexcept;

  /// The other end is another one from now on, or one that has been away.
  void renew() noexcept;

  /// The scales from now on, leader only, 0.01 … 100. False, and nothing happens, while it is engaged or aligning, with
  /// a method or grippers that keep their scales, at a follower, and for a scale out of its bounds.
  bool set_scale(double position_scale, double force_scale) noexcept;
  /// Of a follower that has Config::share: α from the next `command` on; and how far the ramp of another of its leaders
  /// has come, because a robot holds its place only as far as none leads it.
  void set_share(double share, double others) noexcept;

  /// The interval that has just ended, and the account after it was booked, J (SharesAccount::payable; +∞ for a port
  /// without a limiter). Not when the interval was not seen.
  void observe(const Interval<3>& interval, double payable) noexcept;

  /// The force to want in the period that begins, and −∂F/∂x of it. `hand` in base frame axes. `handle`: what of it is
  /// coupled, at least.
  Demand<3> command(const Motion& hand, std::uint32_t buttons, bool ready,
                    const HandleSample* handle = nullptr) noexcept;
  /// To want besides, of the newest period; zero when they are not coupled.
  const Vec3& torque() const noexcept { return torque_; }     ///< N·m, on the hand, base axes
  double grip_force() const noexcept { return grip_force_; }  ///< N, on the fingers; > 0 opens them
  /// The device gave no position in this period: phases and ladder only. No force.
  void command_unseen(LocalTime now, bool ready) noexcept;

  /// For the limiter, after `command`, before `limit` (share). Nothing is given or credited without purse or waves.
  Purse::Settlement settle(double payable, double loss, Duration elapsed) noexcept;

  /// … for the limiter of the gripper; nothing when the grippers are not coupled.
  Purse::Settlement settle_grip(double payable, double loss, Duration elapsed) noexcept;

  /// What to send in this period, once, at its end. `applied`: N, on the hand; `contact`: N, on the tool; `torque`,
  /// N·m, and `grip`, N, applied as well.
  PortState message(const Vec3& applied, const std::optional<Vec3>& contact, const Vec3& torque = Vec3::Zero(),
                    double grip = 0) noexcept;

  PortPhase phase() const noexcept { return phase_; }
  bool live() const noexcept;
  double gain() const noexcept { return gain_; }  ///< 0 … 1, how far the ramp of the law has come
  double share() const noexcept { return share_; }
  double stiffness() const noexcept;  ///< in use at this end, N/m: K, of waves B/d, of surface that of the model
  Duration round_trip() const noexcept { return spring_.round_trip(); }
  double account() const noexcept;                                          ///< J; 0 without a purse
  double position_scale() const noexcept { return map_.position_scale(); }  ///< in use
  double force_scale() const noexcept { return map_.force_scale(); }
  const TurnCoupling* turn() const noexcept { return turn_ ? &*turn_ : nullptr; }
  const GripCoupling* grip() const noexcept { return grip_ ? &*grip_ : nullptr; }
  bool contact_measured() const noexcept;  ///< the peer's newest state has a contact force
  std::uint64_t refused() const noexcept;  ///< states

 private:
  bool leads() const noexcept { return config_.role == PortRole::kLeader; }
  bool heard() const noexcept { return newest_.sequence > 0; }
  bool in_act() const noexcept { return phase_ == PortPhase::kEngaged || phase_ == PortPhase::kClutched; }
  bool heard_since(std::uint64_t sequence) const noexcept;
  bool peer_serves() const noexcept;
  bool peer_is_ready() const noexcept;
  bool driven() const noexcept;
  Duration patience() const noexcept;
  void advance(LocalTime now, std::uint32_t buttons, bool ready) noexcept;
  void advance_leader(std::uint32_t buttons) noexcept;
  void advance_follower() noexcept;
  void advance_aligning() noexcept;
  void act() noexcept;
  void rescale(double position_scale, double force_scale) noexcept;
  void take_scales(const PortState& peer) noexcept;
  bool tells_our_scales(const PortState& peer) const noexcept;
  Demand<3> aligning(const Motion& hand) noexcept;
  void leave(PortPhase to) noexcept;
  void place(const Vec3& position, const HandleSample* handle) noexcept;
  bool shows_handle(const HandleSample* handle) const noexcept;
  void command_handle(const HandleSample& handle, bool changed, bool placed) noexcept;
  CouplingPeriod period(bool changed, bool placed) const noexcept;
  bool gives() const noexcept;
  void skip() noexcept;
  Demand<3> law(const Vec3& velocity) noexcept;
  Demand<3> line(const Vec3& speed) noexcept;
  Demand<3> felt(const Vec3& speed) noexcept;
  Demand<3> centred(const Vec3& speed) noexcept;
  Demand<3> following(const Vec3& speed) noexcept;
  Vec3 asked_velocity() const noexcept;
  bool rests_at_zero() const noexcept { return leads() && config_.method == CouplingMethod::kRate; }
  void begin_act() noexcept;
  void receive_wave(const PortState& peer, bool anew) noexcept;
  void receive_energy(const PortState& peer, bool anew) noexcept;
  Demand<3> blended(const Motion& hand) noexcept;
  void follow_share() noexcept;
  Vec3 mapped(const Vec3& displacement) const noexcept;
  Vec3 coupled(const Vec3& vector) const noexcept;
  Vec3 bounded(const Vec3& force) const noexcept;

  Config config_;
  PoseMap map_;
  PositionPosition<3> spring_;
  std::optional<Purse> purse_;
  std::optional<WavePort<3>> wave_;
  std::optional<PassivityLeader<3>> passive_leader_;
  std::optional<PassivityFollower<3>> passive_follower_;
  double heard_energy_ = 0;  ///< J, that the peer took in since this port heard of its present epoch, or the former
  std::uint64_t heard_sequence_ = 0;
  double energy_in_ = 0;           ///< J, that this port took in
  Vec3 reference_ = Vec3::Zero();  ///< m, follower of passivity or rate: where its spring pulls the tool, as its u
  Vec3 reference_velocity_ = Vec3::Zero();
  std::optional<SurfaceEstimator<3>> estimator_;  ///< follower
  std::optional<SurfaceRenderer<3>> renderer_;    ///< leader
  std::optional<PortSurface> surface_;            ///< follower: found in this act
  WaveMessage<3> sent_wave_;
  Vec3 wave_force_ = Vec3::Zero();  ///< N, what the law wants of the line in this period
  bool wave_moves_ = false;         ///< … and whether the line moves with the handle
  bool wave_joined_ = false;        ///< to the peer's present epoch
  double taken_ = 0;                ///< J, by waves, since the last `settle`
  double given_ = 0;
  double payable_ = 0;  ///< J, after the newest interval
  double loss_ = 0;     ///< J, what the limiter needs for the force wanted last

  PortPhase phase_ = PortPhase::kAlone;
  std::uint64_t sequence_ = 0;    ///< periods
  std::uint64_t engagement_ = 0;  ///< of the newest act: made (leader), followed (follower)
  std::uint64_t seen_ = 0;        ///< follower: no act up to this one engages it any more
  bool answered_ = false;         ///< leader: the follower is engaged by our act
  bool toggled_ = false;
  bool ready_ = false;
  std::uint64_t act_sequence_ = 0;   ///< the first period that tells of our act
  std::uint64_t lost_sequence_ = 0;  ///< the first period that tells of our loss; 0: none, or the peer knows
  LocalTime acted_at_{};
  LocalTime aligning_since_{};
  LocalTime apart_at_{};                       ///< when the two were last farther apart than Absolute::within
  std::optional<Vec3> guide_{};                ///< m: the far end of the spring that aligns
  bool scaled_ = false;                        ///< set_scale was used: the scales are not those of the scenes
  bool rescaled_ = false;                      ///< in this period
  double kept_ = 1;                            ///< of the account, because the scales changed
  std::uint32_t buttons_ = ~std::uint32_t{0};  ///< at first all: a button that was held all along is not pressed
  LocalTime now_{};                            ///< of the newest period
  Duration elapsed_{};                         ///< since the one before

  PortState newest_;  ///< of the peer; sequence 0: none
  LocalTime arrived_{};
  bool peer_anew_ = false;  ///< it has another epoch than in the last period
  Duration gap_{};          ///< longest between two newer states: of this stretch of kGapsKept
  Duration gap_before_{};   ///< … and of the one before
  LocalTime stretch_began_{};
  bool fresh_ = false;
  bool silent_ = false;  ///< the second rung
  std::uint64_t refused_ = 0;

  Vec3 offset_ = Vec3::Zero();  ///< m, p₀
  Vec3 u_ = Vec3::Zero();       ///< m
  Vec3 u_velocity_ = Vec3::Zero();
  bool was_live_ = false;
  bool new_act_ = false;         ///< follower: this period is the first by its act
  std::optional<Vec3> place_{};  ///< m: where a robot stays
  bool was_driven_ = false;
  bool was_aligning_ = false;
  double gain_ = 0;           ///< of the law
  double share_ = 1;          ///< α
  double others_ = 0;         ///< follower: the gain of another leader
  double fade_ = 0;           ///< of `left_`
  Vec3 left_ = Vec3::Zero();  ///< N, by which the force was above the present one when what drives it changed
  Vec3 last_ = Vec3::Zero();  ///< N, wanted last

  std::optional<TurnCoupling> turn_;
  std::optional<GripCoupling> grip_;
  Vec3 torque_ = Vec3::Zero();
  double grip_force_ = 0;
};

}  // namespace tendon
