// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "core/base/motion.h"
#include "core/control/stability_controller.h"
#include "core/teleoperation/port_state.h"
#include "core/teleoperation/pose_map.h"
#include "core/teleoperation/position_position.h"
#include "core/teleoperation/purse.h"

namespace tendon {

/// One end of a coupling between two devices: engage, clutch and loss of the peer, the map, the law and the purse. Both
/// ends are this class, each in the haptic loop of its device; the network only carries PortStates.
///
/// **In each period**, in this order:
///
///     limiter.observe(interval)                      the account: L − given + taken
///     coupling.receive(state of the peer)            any number, late or twice
///     demand = coupling.command(hand, …)             phases, map, law: the force to want
///     settlement = coupling.settle(…)                limiter.credit, limiter.withdraw
///     limiter.limit(everything that is wanted)       the bound
///     send(coupling.message(applied, contact))
///
/// **Displacements.** Each end has an offset p₀ and tells u = p − p₀, in its own axes. While an end is not *live* its u
/// stands still, and p₀ moves with the handle. An end is live when it and its peer are engaged by the same act. On
/// becoming live by an act u is set to the peer's u as mapped, so that the law's force is zero at that moment; after a
/// clutch u goes on from where it stood, so that nothing moves at the other end, however often it is pressed.
///
/// **Phases** (PortPhase), `ready` = the device is seen, armed and without fault:
///
///     alone    → coupled   a state of the peer has come;  coupled → alone   none has for as long as the ladder says
///     coupled  → engaged   leader: the act (engage(), or its button pressed), while ready and the peer is coupled,
///                          engaged or clutched, and fresh. follower: ready, and the leader is engaged by an act that
///                          is newer than any the follower has seen before
///     engaged  → clutched  leader: its clutch is held (or toggled); the follower stays engaged and holds its place
///     clutched → engaged   leader: released
///     engaged, clutched → coupled    disengage(); or the peer is not engaged or clutched by this act any more; or
///                          (leader) the peer has not answered the act for kAnswerWithin
///     engaged, clutched → lost       the ladder
///     lost     → coupled   the peer is fresh again; engaged only by another act
///     any      → fault     not ready;  fault → coupled (alone, without a peer) when ready again
///
/// The force of a port that becomes live is multiplied by a ramp 0 → 1 within `ramp`; one that stops being live, or is
/// clutched, fades within kFade. (A cut by the limiter is faster.)
///
/// **Ladder.** Age: how long ago the newest state came. v = max(3 periods of the peer, 20 ms, twice the longest gap
/// of at most 100 ms between two newer states lately):
///
///     age > v            the peer's velocity counts as zero
///     age > v + 20 ms    the force fades within kFade; with `holds_place` (a robot) it stays: the last place is held
///     age > v + 250 ms   phase lost. Force zero; with `holds_place` the place where the TOOL is now is held
///
/// A robot (`holds_place`) holds its place with its own spring whenever it is ready and not live.
///
/// A state that comes before the last rung ramps the force in again. Energy that was under way is lost, which is safe.
///
/// **Laws.** position-position: F = K(y − u) + D(ẏ − u̇) − B u̇ at both ends (PositionPosition), y the peer's u mapped.
/// K, D, B are those of the leader; the follower's are smaller by s_f s_x. position-force: the follower has the same
/// law, with a K that does not adapt to the delay, because the leader has no spring; the leader's force is s_f Rᵀ f_contact − B v, and −B v alone when the peer measures no contact
/// (`contact_measured`).
/// All forces of the coupling are bounded by max_force.
///
/// **Purse.** With Config::purse the port pays and is paid (Purse); it gives only while it is live, not clutched. Its
/// `joule` is the map's. Method position-position needs it for the pair to be passive; without it a limiter at each end
/// keeps each by itself passive, and the follower cannot move.
///
/// **Bad input.** A state with a value that is not finite or out of its bounds changes nothing and is counted in
/// `refused`. A hand that is not finite gives a demand that is not finite, which the limiter turns to zero.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
class Coupling {
 public:
  static constexpr Duration kFade = std::chrono::milliseconds(50);
  static constexpr Duration kAnswerWithin = std::chrono::seconds(5);
  static constexpr Duration kStale = std::chrono::milliseconds(20);  ///< least v, and from v to the second rung
  static constexpr Duration kLostAfter = std::chrono::milliseconds(250);

  struct Button {
    std::uint32_t bit = 0;  ///< ≤ 31
    bool toggles = false;   ///< else: as long as it is held
  };

  struct Config {
    PortRole role = PortRole::kLeader;
    CouplingMethod method = CouplingMethod::kPositionPosition;
    PoseMap::Config map{};
    /// stiffness, damping, own_damping: the LEADER's; max_force this end's. period, epoch: this end's.
    PositionPosition<3>::Config spring{};
    std::optional<Purse::Config> purse{};      ///< peers 1; joule and epoch are set from map and spring
    std::optional<Button> clutch{};            ///< leader only
    std::optional<std::uint32_t> engage_by{};  ///< leader: bit of the button whose press is the act; empty: engage()
    Duration ramp = std::chrono::milliseconds(300);       ///< > 0
    Duration peer_period = std::chrono::milliseconds(1);  ///< > 0: how often states of the peer are sent
    bool holds_place = false;                             ///< follower only: a robot, which no hand holds
  };

  /// Throws std::invalid_argument naming the field, its value and what was expected.
  explicit Coupling(const Config& config);

  void receive(const PortState& peer, LocalTime now) noexcept;

  /// The operator's act, leader only (a follower passes over it): true when the coupling is engaging, or was already.
  /// It is false, and nothing happens, in the phases alone, lost and fault, and when the peer is not ready.
  bool engage() noexcept;
  /// Either end.
  void disengage() noexcept;

  /// The force to want in the period that begins, and −∂F/∂x of it. `hand` in base frame axes.
  Demand<3> command(const Motion& hand, std::uint32_t buttons, bool ready) noexcept;
  /// The device gave no position in this period: phases and ladder only. No force.
  void command_unseen(LocalTime now, bool ready) noexcept;

  /// For the limiter, after `command`, before `limit` (share). Nothing is given or credited without a purse.
  Purse::Settlement settle(double payable, double loss, Duration elapsed) noexcept;

  /// What to send in this period, once, at its end. `applied`: N, on the hand; `contact`: N, on the tool.
  PortState message(const Vec3& applied, const std::optional<Vec3>& contact) noexcept;

  PortPhase phase() const noexcept { return phase_; }
  bool live() const noexcept;
  double stiffness() const noexcept { return spring_.stiffness(); }  ///< K in use at this end, N/m
  Duration round_trip() const noexcept { return spring_.round_trip(); }
  double account() const noexcept;         ///< J; 0 without a purse
  bool contact_measured() const noexcept;  ///< the peer's newest state has a contact force
  std::uint64_t refused() const noexcept;  ///< states

 private:
  bool leads() const noexcept { return config_.role == PortRole::kLeader; }
  bool heard() const noexcept { return peer_.epoch > 0; }
  bool fresh() const noexcept { return heard() && age_ <= stale_after(); }
  bool peer_is_in_act() const noexcept;
  Duration stale_after() const noexcept;
  void begin_epoch(const PortState& peer) noexcept;
  void watch(LocalTime now) noexcept;
  void take_buttons(std::uint32_t buttons) noexcept;
  void change_phase(bool ready) noexcept;
  void leave(PortPhase next) noexcept;
  void stop_living() noexcept;
  void live_on(const Vec3& position) noexcept;
  Vec3 mapped(const Vec3& displacement) const noexcept;
  Vec3 coupled(const Vec3& vector) const noexcept;
  Demand<3> law(const Vec3& displacement, const Vec3& velocity) noexcept;
  Vec3 hold(const Motion& hand) noexcept;

  Config config_;
  PoseMap map_;
  PositionPosition<3> spring_;
  std::optional<Purse> purse_;

  PortPhase phase_ = PortPhase::kAlone;
  std::uint64_t engagement_ = 0;  ///< of the newest act: made (leader), followed (follower)
  std::uint64_t seen_ = 0;        ///< follower: no act up to this one engages it any more
  bool joined_ = false;           ///< leader: the follower has answered the act
  bool wants_clutch_ = false;
  bool after_clutch_ = false;  ///< u goes on from where it stood
  bool live_ = false;
  std::uint32_t buttons_ = 0;

  PortState peer_;         ///< newest; epoch 0: none
  LocalTime peer_at_{};    ///< when it came
  Duration gap_{};         ///< longest between two newer states: of this stretch of kRecovery
  Duration gap_before_{};  ///< … and of the one before
  LocalTime stretch_began_{};
  Duration age_{};
  LocalTime now_{};
  LocalTime acted_at_{};
  Duration elapsed_{};

  Vec3 offset_ = Vec3::Zero();  ///< m, p₀
  Vec3 u_ = Vec3::Zero();       ///< m
  Vec3 u_velocity_ = Vec3::Zero();
  double gain_ = 0;                ///< of the law, 0 … 1
  Vec3 given_ = Vec3::Zero();      ///< N, of the law in this period, with its gain
  Vec3 fading_ = Vec3::Zero();     ///< N, what is left of the law's force when it ended
  Vec3 fade_from_ = Vec3::Zero();  ///< N, of that at its end
  std::optional<Vec3> held_at_{};  ///< m: the place that a robot holds
  std::uint64_t refused_ = 0;
};

}  // namespace tendon
