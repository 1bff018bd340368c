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
#include "core/remote/field_use.h"
#include "core/remote/force_channels.h"
#include "core/remote/remote_force.h"
#include "core/teleoperation/couplings.h"

namespace tendon {

struct TurnStep {
  Turning hand;
  Vec3 was_applied = Vec3::Zero();  ///< N·m, applied during the last interval
  Vec3 wanted = Vec3::Zero();       ///< N·m, demand of the remote environment
  Vec3 torque = Vec3::Zero();       ///< N·m, the torque to apply
  Vec3 applied = Vec3::Zero();      ///< N·m, applied by the device
};

/// The gripper has a separate account.
struct GripStep {
  Grip hand;
  double was_applied = 0;  ///< N, applied during the last interval
  double wanted = 0;       ///< N, demand of the remote environment
  double force = 0;        ///< N, to be applied now
  double applied = 0;      ///< N, applied by the device
  double permitted = 0;    ///< N, the bound on |force|
  double energy = 0;       ///< J, the account of the gripper after the interval
};

struct HandleStep {
  std::optional<TurnStep> turn{};  ///< empty if the device does not measure its orientation
  std::optional<GripStep> grip{};  ///< empty if it has no gripper
  std::optional<Joints> joints{};  ///< empty if not measured; not used by the laws
};

/// Every handle has a position.
struct PositionStep {
  Motion hand;                       ///< measured motion; hand.at is the time of the step
  Duration held{};                   ///< T_act, length of the last interval, or 0 if this is the first step
  Vec3 was_applied = Vec3::Zero();   ///< N, applied during the last interval
  std::optional<Vec3> hand_force{};  ///< N, measured force of the hand on the handle; empty if there is no sensor
  Vec3 wanted = Vec3::Zero();        ///< N, demand of the remote environment (HeldForce)
  Mat3 stiffness = Mat3::Zero();     ///< N/m, −∂wanted/∂x from the remote environment; zero if unknown
  double permitted = 0;  ///< N, bound of the limiter on ‖force‖ (per axis: on the largest component); ∞ when off
  Vec3 force = Vec3::Zero();  ///< N, to be applied now
  double energy = 0;          ///< J, account of the limiter after the interval (the minimum if there are several)
  Duration longest_hold{};    ///< T: `force` can be applied for this time
  Reasons reasons;            ///< why `force` is not `wanted`
  Mode mode = Mode::kIdle;
  std::uint8_t force_way = 0;           ///< solver path of the engine for the remote force in use, or 0 if unknown
  std::uint32_t channel = 0;            ///< channel of `mode`, `force_sequence` and the ages
  std::uint64_t force_sequence = 0;     ///< the remote force in use; 0 = none
  Duration force_age{};                 ///< since it arrived
  Duration loop_age{};                  ///< since the sample of the answered motion
  std::optional<double> force_error{};  ///< N, the error that the engine estimates; empty if unknown
};

/// Input and result of one haptic step. This is enough to repeat the step (tests/tools/replay).
struct Step : PositionStep {
  std::optional<HandleStep> handle{};  ///< empty if the device only has a position
  std::optional<FieldStep> field{};    ///< empty if no field is in use

  /// Null if the device does not measure its orientation, its joints, or has no gripper.
  TurnStep* turn() noexcept { return handle && handle->turn ? &*handle->turn : nullptr; }
  const TurnStep* turn() const noexcept { return handle && handle->turn ? &*handle->turn : nullptr; }
  GripStep* grip() noexcept { return handle && handle->grip ? &*handle->grip : nullptr; }
  const GripStep* grip() const noexcept { return handle && handle->grip ? &*handle->grip : nullptr; }
  const Joints* joints() const noexcept { return handle && handle->joints ? &*handle->joints : nullptr; }
};

/// One haptic step: from the measured motion of the hand to the force to apply.
///     account ← the last interval, with the force that was applied          (Limiter::observe)
///     F ← newest remote force, held, faded or stopped by its age            (HeldForce; several: ForceChannels)
///     F ← F + forces of the uploaded fields, as far as the account pays     (field::Renderer, when listed)
///     F ← F + force of the coupling to one or several peers                 (Couplings, when listed)
///     F ← the force that makes the handle follow a tool on which F acts     (AdmittanceLoop, when listed)
///     F ← ‖F‖ ≤ max_force                                                   (saturate)
///     F ← ‖F − F_before‖ ≤ max_slew · T                                     (limit_slew)
///     account ← energy from the tank of the field                           (field::EnergyGate, with a tank)
///     account ← energy received from the peers, less energy given           (Couplings::settle, with an energy tank)
///     F ← the bound of the account, e.g. ‖F‖ ≤ f_c + 2 √(b E / T_max)        (Limiter::limit)
///     F ← ‖F‖ ≤ max_force again, if the damper of the limiter has added to it
/// If the device has motors for rotation, F is a wrench. In this case, force and torque share the same account and are
/// reduced by the same factor (WrenchPort). The gripper is a separate port (GripPort). The torque and the grip force of
/// the coupling are added to those of the remote environment.
///
/// The limiter is the last step, so the force cannot exceed its bound, but it can fall faster than the slew limit
/// allows. If each force is applied for at most the `longest_hold` of its step, it is guaranteed that E ≥ −1 nJ in all
/// steps. Otherwise E can fall below zero by at most (T_act − T)(‖F‖ − f_c)₊²/(4b), and forces are limited to f_c until
/// E has recovered. See core/PROOFS.md, "Output bound" and "Late holds".
///
/// Overruns: if an interval is longer than the longest_hold of the scene, its measured length is used, the step is
/// flagged, and the limiter adapts (HoldBound). If it is longer than the watchdog of the device, or if a position is
/// missing, the worst motion is booked. (If longest_hold is the watchdog time, there is no condition, but K_op → 2b /
/// T_max.)
///
/// A fault is latched: the force is zero (through the slew limit while positions are measured) until `rearm`. `disarm`
/// is for the operator. This sets the force to zero without a ramp until `rearm` is called. It does not clear a fault.
/// Thread-safe: no. Realtime-safe: yes.
class HapticController {
 public:
  enum class Fault : std::uint8_t {
    kNone,
    kPositionNotFinite,  ///< the device measured NaN or infinity
    kDeviceSilent,       ///< max_missed consecutive readings have failed
    kPositionJumped,     ///< the distance to the last position was too large for max_speed
  };

  struct Config {
    LimiterConfig limiter;
    /// Friction at each position, for a limiter with adaptive_friction. Until the first step, limiter.friction is used.
    std::optional<FrictionMap::Config> friction_map{};
    /// For a device with motors that rotate the handle. Cannot be combined with admittance.
    std::optional<RotationLimits> rotation{};
    std::optional<GripLimits> grip{};  ///< for a device with a motorized gripper
    /// For a device with a force sensor. Without it the device is of impedance type.
    std::optional<AdmittanceLoop<3>::Config> admittance{};
    /// Couples the handle to that of a peer. The limiter has a shared_account if the coupling has an energy tank. A
    /// coupled orientation must be measured in every step. Torques require `rotation`, and a coupled gripper `grip`.
    std::optional<Coupling::Config> coupling{};
    /// For a follower with several leaders: one `coupling` per leader (Couplings). Empty: one leader.
    std::vector<CoupledLeader> leaders{};
    Duration watchdog{};   ///< of the device; 0 = none
    double max_force = 0;  ///< N; > 0
    /// N/s; > 0, can be infinite. The default of 1 N per step at 1 kHz feels like a step to the hand, but smooths a
    /// force that changes its sign with each datagram.
    double max_slew = 1000;
    HeldForce::Config hold;
    /// The rule for each channel of remote forces. There is a separate HeldForce for each channel.
    std::vector<ChannelRule> channels = {ChannelRule::kSum};
    std::uint32_t max_missed = 20;  ///< number of failed readings that cause a fault; 20 ms at 1 kHz, as in libfranka
    /// m/s; > 0. If the motion is faster, an encoder has wrapped or lost counts. This is a fault and is not booked,
    /// because 0.2 m in a millisecond would earn 32 J at 0.8 N·s/m. Empty: no check.
    std::optional<double> max_speed{};
  };

  /// Throws std::invalid_argument with the name of the field if a value is out of range.
  explicit HapticController(const Config& config);

  /// Takes a newer remote force for `channel`, an index into `channels`. Returns false if it is not sound (HeldForce).
  bool observe(const RemoteForce& force, std::size_t channel = 0) noexcept { return held_.observe(channel, force); }

  /// Updates the pose of the object of a channel (HeldForce::observe). The pose must use the same clock as `Motion::at`.
  bool observe(const field::TimedPose& pose, std::size_t channel = 0) noexcept { return held_.observe(channel, pose); }

  /// Starts to use a field in a channel, replaces it, or stops using it. See HeldForce::use.
  bool use(const FieldUse& use, LocalTime now, std::size_t channel = 0) noexcept {
    return held_.use(channel, use, now);
  }
  /// Returns the generation of the current field, or 0. Previous fields are no longer used and can be deleted.
  std::uint32_t field(std::size_t channel = 0) const noexcept { return held_.field(channel); }

  /// Must be called when the remote environment `source` of a channel has disconnected.
  void release(LocalTime now, std::uint32_t source = 0, std::size_t channel = 0) noexcept {
    held_.release(channel, source, now);
  }

  /// Performs one haptic step. `applied` is the force that the device has really held since the previous step.
  /// `hand_force` (N, of the hand on the handle) is the reading of its force sensor. If this is empty and `admittance`
  /// is set, the force is zero. `handle` must contain the orientation for `rotation`, and the opening for `grip`.
  Step step(const Motion& hand, const Vec3& applied, const std::optional<Vec3>& hand_force = {},
            const HandleSample* handle = nullptr) noexcept {
    Step fresh;
    step_into(fresh, hand, applied, hand_force, handle);
    return fresh;
  }
  /// `fresh` must be newly constructed. It may be part of a record.
  void step_into(Step& fresh, const Motion& hand, const Vec3& applied, const std::optional<Vec3>& hand_force = {},
                 const HandleSample* handle = nullptr) noexcept;

  /// Performs a step with a given `wanted` instead of the observed remote forces, the fields and the coupling, and with
  /// given settlements of the tanks. This can replay a recorded scene without `coupling`.
  Step step(const Motion& hand, const Vec3& applied, const std::optional<Vec3>& hand_force,
            const ForceChannels::Wanted& wanted, const HandleSample* handle = nullptr,
            const EnergyTank::Settlement& settled = {}, const EnergyTank::Settlement& grip_settled = {},
            const std::optional<FieldStep>& field = {}) noexcept;

  /// Performs a step if the position was not measured. The force to apply is zero. The last orientation and grip are
  /// recorded from `handle`, and the held torque and grip force are booked.
  Step step_unseen(LocalTime now, const Vec3& applied, const HandleSample* handle = nullptr) noexcept;

  /// Null if there is no coupling. The couplings receive the states of the peers and the commands of the operator.
  Couplings* couplings() noexcept { return couplings_ ? &*couplings_ : nullptr; }
  /// Must be called before the step if there is a coupling. `armed` is true if the device applies forces.
  void notice(std::uint32_t buttons, bool armed) noexcept {
    buttons_ = buttons;
    armed_ = armed;
  }
  const EnergyTank::Settlement& grip_settled() const noexcept { return grip_settled_; }  ///< of the grippers' tank

  Fault fault() const noexcept { return fault_; }
  void rearm() noexcept;  ///< clears the fault and ends `disarm`. The next fresh force is ramped in.
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
  void render_fields(const Motion& hand, Step& step, ForceChannels::Wanted& wanted) noexcept;
  template <class Port, class Force>
  void settle(Port& port, const Force& wanted, const Step& step) noexcept;
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
  EnergyTank::Settlement settled_{};
  EnergyTank::Settlement grip_settled_{};
  std::uint32_t buttons_ = 0;
  bool armed_ = true;
  Fault fault_ = Fault::kNone;
  bool disarmed_ = false;
  std::uint32_t missed_ = 0;
  std::optional<Motion> last_;  ///< empty if the previous position is unknown
  std::optional<Quat> last_orientation_;
  std::optional<double> last_opening_;  ///< rad
  LocalTime last_at_{};                 ///< start of the current hold
  std::uint64_t tick_ = 0;              ///< number of the step; only counted if fields are listed
  bool started_ = false;
};

}  // namespace tendon
