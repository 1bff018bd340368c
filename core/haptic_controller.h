// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/mode.h"
#include "core/base/motion.h"
#include "core/base/reason.h"
#include "core/control/admittance_loop.h"
#include "core/control/limiter.h"
#include "core/handle/handle_port.h"
#include "core/handle/handle_sample.h"
#include "core/ledger/friction_map.h"
#include "core/remote/force_channels.h"
#include "core/remote/remote_force.h"
#include "core/teleoperation/couplings.h"

namespace tendon {

/// What a step has to say of the handle's rotation.
struct TurnStep {
  Turning hand;
  Vec3 was_applied = Vec3::Zero();  ///< N·m, held during the interval that this step ended
  Vec3 wanted = Vec3::Zero();       ///< N·m, what the remote environment asks for
  Vec3 torque = Vec3::Zero();       ///< N·m, to be applied now
  Vec3 applied = Vec3::Zero();      ///< N·m, really given out by the device
};

/// … and of its gripper, which has an account of its own.
struct GripStep {
  Grip hand;
  double was_applied = 0;  ///< N, held during the interval that this step ended
  double wanted = 0;       ///< N, what the remote environment asks for
  double force = 0;        ///< N, to be applied now
  double applied = 0;      ///< N, really given out by the device
  double permitted = 0;    ///< N, the bound on |force|
  double energy = 0;       ///< J, the account of the gripper after the interval
};

/// What a step has to say of a handle that has more than a position.
struct HandleStep {
  std::optional<TurnStep> turn{};  ///< empty: the device does not measure its orientation
  std::optional<GripStep> grip{};  ///< empty: it has no gripper
  std::optional<Joints> joints{};  ///< empty: the device does not tell them; no law looks at them
};

/// What every handle's step has.
struct PositionStep {
  Motion hand;                       ///< the motion it saw; hand.at = when
  Duration held{};                   ///< T_act: length of the interval that this step ended; 0 in the first
  Vec3 was_applied = Vec3::Zero();   ///< N, the force held during it
  std::optional<Vec3> hand_force{};  ///< N, of the hand on the handle, as measured; empty without a force sensor
  Vec3 wanted = Vec3::Zero();        ///< N, what the remote environment asks for, after hold or local model
  Mat3 stiffness = Mat3::Zero();     ///< N/m, −∂wanted/∂x, as the remote environment says; zero when it does not
  double permitted = 0;  ///< N, the limiter's bound on ‖force‖ (per axis: on the largest component); ∞ when off
  Vec3 force = Vec3::Zero();  ///< N, to be applied now
  double energy = 0;          ///< J, the limiter's account after the interval (per axis: the least)
  Duration longest_hold{};    ///< T that `permitted` counts on: `force` may be held for so long and E stays ≥ 0
  Reasons reasons;            ///< why `force` is not `wanted`
  Mode mode = Mode::kIdle;
  std::uint8_t force_way = 0;           ///< the way by which its engine made the remote force in use; 0: not said
  std::uint32_t channel = 0;            ///< `mode`, `force_sequence` and the ages are of this channel's force
  std::uint64_t force_sequence = 0;     ///< the remote force in use; 0 = none
  Duration force_age{};                 ///< since it arrived
  Duration loop_age{};                  ///< since the motion it answers was sampled
  std::optional<double> force_error{};  ///< N, what its engine thinks that it may be wrong by; empty: it does not say
};

/// One haptic step: its input and its result. It holds enough to take the step again (tests/tools/replay).
struct Step : PositionStep {
  std::optional<HandleStep> handle{};  ///< empty: the device has a position only

  /// Null when the device does not measure its orientation, or has no gripper.
  TurnStep* turn() noexcept { return handle && handle->turn ? &*handle->turn : nullptr; }
  const TurnStep* turn() const noexcept { return handle && handle->turn ? &*handle->turn : nullptr; }
  GripStep* grip() noexcept { return handle && handle->grip ? &*handle->grip : nullptr; }
  const GripStep* grip() const noexcept { return handle && handle->grip ? &*handle->grip : nullptr; }
  /// Null when the device does not tell its joints.
  const Joints* joints() const noexcept { return handle && handle->joints ? &*handle->joints : nullptr; }
};

/// The heart: from one look at the hand to the force it is to feel.
///
///     account ← the interval just ended, with the force really held         (Limiter::observe)
///     F ← newest remote force, held, faded or stopped by its age            (HeldForce; several: ForceChannels)
///     F ← F + what ties the handle to the one of a peer, or of several      (Couplings, when listed)
///     F ← the force that makes the handle follow a tool which F acts on     (AdmittanceLoop, when listed)
///     F ← ‖F‖ ≤ max_force                                                   (saturate)
///     F ← ‖F − F_before‖ ≤ max_slew · T                                     (limit_slew)
///     account ← what the peer's port has paid, less what this one pays      (Couplings::settle, with a purse)
///     F ← what the account allows, e.g. ‖F‖ ≤ f_c + 2 √(b E / T_max)         (Limiter::limit)
///     F ← ‖F‖ ≤ max_force once more, when the limiter's damper has added to it
///
/// A handle with motors that turn it goes the same way as a wrench: force and torque together are shortened, so that
/// their direction stays, and one account bounds both (WrenchPort). Its gripper is a port of its own (GripPort).
/// What the coupling wants of both is added to what the remote environment asks for; the wrench's account is the one
/// that is shared, also of a coupling that ties positions only.
///
/// The limiter comes last, so nothing after it can lift a force above its bound; it may cut a force
/// faster than the slew limit allows: energy is a matter of safety, smoothness is not.
///
/// The promise: E ≥ −1 nJ at every step, as long as no force is held for longer than the `longest_hold` of the step
/// that chose it. A hold of T_act beyond that T takes at most (T_act − T)(‖F‖ − f_c)₊²/(4b) from below zero; until the
/// ledger has recovered, which it does by itself, forces are at most f_c.
///
/// Overruns: an interval longer than the scene's longest_hold is booked with its measured length, and flagged. The
/// limiter then counts on such holds (HoldBound). When the interval was longer than the device's own watchdog, nobody
/// knows for how long the force was held, and the worst is booked. (Set longest_hold = watchdog and the promise has no
/// condition, at the price of a lower bound: K_op → 2b / T_max.) An interval of which one end was not seen is booked at
/// its worst, too.
///
/// Faults are latched: force zero (through the slew limit while the hand can be seen) until `rearm`.
///
/// `disarm` is for the operator: zero force from the next step on, without a ramp, until `rearm`. It is not a fault,
/// and does not clear one.
///
/// Thread-safe: no. Realtime-safe: yes.
class HapticController {
 public:
  enum class Fault : std::uint8_t {
    kNone,
    kPositionNotFinite,  ///< the device measured NaN or infinity
    kDeviceSilent,       ///< max_missed readings in a row failed
    kPositionJumped,     ///< … or a position that no hand comes to at max_speed
  };

  struct Config {
    LimiterConfig limiter;
    /// Friction by place, for a limiter with adaptive_friction; limiter.friction holds until the first step.
    std::optional<FrictionMap::Config> friction_map{};
    /// For a device with motors that turn the handle; not together with admittance.
    std::optional<RotationLimits> rotation{};
    /// For a device whose gripper has a motor.
    std::optional<GripLimits> grip{};
    /// For a device that measures the hand's force; without it the device is of impedance type.
    std::optional<AdmittanceLoop<3>::Config> admittance{};
    /// Ties the handle to the one of a peer; with a purse the limiter has a shared_account. A coupled orientation has
    /// to be measured in every step; without `rotation` no torque is given. A coupled gripper needs `grip`.
    std::optional<Coupling::Config> coupling{};
    /// Of a follower with several leaders: one `coupling` for each of them (Couplings); empty: it has one.
    std::vector<CoupledLeader> leaders{};
    Duration watchdog{};   ///< the device's own; 0 = it has none
    double max_force = 0;  ///< N; > 0
    /// N/s; > 0, may be infinite. The default is 1 N per step at 1 kHz. The hand cannot distinguish such a ramp from a
    /// step, and a force that changes its sign with each datagram becomes smoother.
    double max_slew = 1000;
    HeldForce::Config hold;
    /// The rules of the channels by which remote forces come in; each channel has a HeldForce of its own.
    std::vector<ChannelRule> channels = {ChannelRule::kSum};
    /// Readings that may fail in a row before it is a fault: 20 ms at 1 kHz, what libfranka allows.
    std::uint32_t max_missed = 20;
    /// m/s; > 0. A faster motion is not a hand but an encoder that has wrapped or lost count. It is a fault, and is not
    /// booked: the account would credit 0.2 m in a millisecond with 32 J of friction at 0.8 N·s/m. Empty: every
    /// position is believed.
    std::optional<double> max_speed{};
  };

  /// Throws std::invalid_argument naming the field when a value is impossible.
  explicit HapticController(const Config& config);

  /// A newer remote force has come for `channel`, an index into `channels`. Returns false when it was refused because
  /// it is not sound (HeldForce).
  bool observe(const RemoteForce& force, std::size_t channel = 0) noexcept { return held_.observe(channel, force); }

  /// The remote environment `source` has left a channel.
  void release(LocalTime now, std::uint32_t source = 0, std::size_t channel = 0) noexcept {
    held_.release(channel, source, now);
  }

  /// One haptic step. `applied` is the force that the device has really held since the step before, `hand_force`
  /// (N, of the hand on the handle) what its force sensor measured; with `admittance` a step without one gives no
  /// force. `handle` is the rest of the handle, of a device that has more than a position; with `rotation` every step
  /// has its orientation, and with `grip` its opening.
  Step step(const Motion& hand, const Vec3& applied, const std::optional<Vec3>& hand_force = {},
            const HandleSample* handle = nullptr) noexcept {
    Step fresh;
    step_into(fresh, hand, applied, hand_force, handle);
    return fresh;
  }
  /// … into a Step that has just been made, which may be part of a record.
  void step_into(Step& fresh, const Motion& hand, const Vec3& applied, const std::optional<Vec3>& hand_force = {},
                 const HandleSample* handle = nullptr) noexcept;

  /// The same, but `wanted` is given instead of derived from the remote forces observed and the coupling, and so is
  /// what the purses had settled in sum. Replays recorded steps, of a scene without `coupling`.
  Step step(const Motion& hand, const Vec3& applied, const std::optional<Vec3>& hand_force,
            const ForceChannels::Wanted& wanted, const HandleSample* handle = nullptr,
            const Purse::Settlement& settled = {}, const Purse::Settlement& grip_settled = {}) noexcept;

  /// A haptic step in which the device gave no position: the force to apply is zero. Of `handle` the last turning and
  /// grip go into the record, and what was held into the accounts.
  Step step_unseen(LocalTime now, const Vec3& applied, const HandleSample* handle = nullptr) noexcept;

  /// The ends of the couplings, which take the peers' states and the operator's acts; null when the scene lists none.
  Couplings* couplings() noexcept { return couplings_ ? &*couplings_ : nullptr; }
  /// For the coupling, before the step: the handle's buttons, and whether the device gives forces.
  void notice(std::uint32_t buttons, bool armed) noexcept {
    buttons_ = buttons;
    armed_ = armed;
  }
  /// What the purse of the grippers settled in the newest step.
  const Purse::Settlement& grip_settled() const noexcept { return grip_settled_; }

  Fault fault() const noexcept { return fault_; }
  /// Clears the fault, and ends `disarm`. Forces start again from idle: the next fresh one is ramped in.
  void rearm() noexcept;
  void disarm() noexcept { disarmed_ = true; }

 private:
  bool is_finite(const Motion& hand, const HandleSample* handle) const noexcept;
  bool believable(const Motion& hand, const HandleSample* handle) const noexcept;
  Step disbelieve(const Motion& hand, const Vec3& applied, const HandleSample* handle) noexcept;
  void take(Step& step, const Motion& hand, const Vec3& applied, const std::optional<Vec3>& hand_force,
            ForceChannels::Wanted& wanted, const HandleSample* handle) noexcept;
  void book(const Motion& hand, const Vec3& applied, const HandleSample* handle, Step& step) noexcept;
  void book_seen(const Motion& hand, const Vec3& applied, const HandleSample* handle, Step& step) noexcept;
  void book_unseen(const Vec3& applied, const HandleSample* handle, Duration held) noexcept;
  void add_accounts(Step& step) const noexcept;
  void limit_force(const ForceChannels::Wanted& wanted, const Vec3& applied, Step& step) noexcept;
  void limit_wrench(Duration age, const Vec3& applied, Step& step) noexcept;
  void limit_grip(Step& step) noexcept;
  void add_coupling(const Motion& hand, const HandleSample* handle, Step& step, ForceChannels::Wanted& wanted) noexcept;
  template <class Port, class Force>
  void settle(Port& port, const Force& wanted, Duration elapsed) noexcept;
  void settle_grip(double wanted, Duration elapsed) noexcept;
  bool ready() const noexcept { return armed_ && !disarmed_ && fault_ == Fault::kNone; }
  static void note(const HandleSample& handle, const ForceChannels::Wanted& wanted, Step& step) noexcept;
  void follow_tool(Step& step) noexcept;

  Config config_;
  Limiter limiter_;
  std::optional<AdmittanceLoop<3>> admittance_;
  std::optional<FrictionMap> friction_map_;
  std::optional<WrenchPort> wrench_;  ///< in place of limiter_
  std::optional<GripPort> grip_;
  ForceChannels held_;
  std::optional<Couplings> couplings_;
  Purse::Settlement settled_{};
  Purse::Settlement grip_settled_{};
  std::uint32_t buttons_ = 0;
  bool armed_ = true;
  Fault fault_ = Fault::kNone;
  bool disarmed_ = false;
  std::uint32_t missed_ = 0;
  std::optional<Motion> last_;  ///< empty when the position before this step is unknown
  std::optional<Quat> last_orientation_;
  std::optional<double> last_opening_;  ///< rad
  LocalTime last_at_{};                 ///< when the force held now was applied
  bool started_ = false;
};

}  // namespace tendon
