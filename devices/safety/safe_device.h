// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string_view>

#include "devices/device.h"
#include "devices/safety/force_shares.h"
#include "devices/safety/heartbeat.h"
#include "devices/safety/trips.h"

namespace tendon {

/// Where a device stands between the plug and the force. There is force in `kArmed` only.
enum class SafetyState : std::uint8_t {
  kAbsent,    ///< kAbsent to kHomed: the Device::State of the device inside
  kOpening,   ///< see kAbsent
  kFirmware,  ///< see kAbsent
  kUnhomed,   ///< see kAbsent
  kHomed,     ///< ready, and waiting to be armed
  kArmed,     ///< gives forces
  kFault,     ///< there was a fault (SafetyFault): no force until it is armed again
};
std::string_view to_string(SafetyState state) noexcept;

/// Why an armed device gives no force any more.
enum class SafetyFault : std::uint8_t {
  kNone,
  kForceNotFinite,     ///< NaN or infinity was asked for: of a force, torque or grip
  kPositionNotFinite,  ///< the device measured NaN or infinity: a position or an opening
  kPositionJumped,     ///< StepBound
  kTooFast,            ///< SpeedTrip
  kCommandSilent,      ///< nobody called `apply` in time (Watchdog)
  kDeviceSilent,       ///< the device gave no position in time (Watchdog)
  kDeviceLost,         ///< it is not homed any more: unplugged, or lost its origin
  kNoRotation,         ///< the device measured an orientation that is not a rotation
  kTurnsTooFast,       ///< TurnTrip
  kGuardianLost,       ///< the guardian is dead or stopped (Guardian::stands)
};
/// A sentence for people: "the handle was faster than a hand".
std::string_view to_string(SafetyFault fault) noexcept;

/// The safety layer: a device around any other, between the control law and the motors.
///
///     F ← 0                              unless armed; F with a NaN or infinity is a fault
///     F ← s F, 0 ≤ s ≤ 1                 for each listed part: size, heat, workspace, ramp-in, the ramp to zero of a
///                                        watchdog that has tripped, and growth
///
/// So |F_i applied| ≤ |F_i asked| for each component i, provided that the device inside writes no more than it is told.
/// `apply` returns the force that the device wrote, and the energy ledger counts that one. A part that the scene does
/// not list costs a branch. The state machine is always there:
///
///     Absent → Opening → Firmware → Unhomed → Homed ⇄ Armed → Fault → Armed
///
/// **Torque and grip** (`apply_all`) have all of this too. Force and torque have one share, so a wrench keeps its
/// direction: the least that any part demands of the force or of the torque. The workspace and the heat look at the
/// force alone, and their shares hold for the torque as well. The grip has a limit and a growth limit of its own, the
/// same ramps, and the same ends. `apply` gives no torque and no grip.
///
/// **Arming** needs a request (Arming::By). The first `apply` grants it at which all of this holds: the device is
/// homed; for 50 ms its handle has moved no further than `rest_speed` allows, and no two positions were more than 10 ms
/// apart; the force and the grip asked for are at most `rest_force`, the torque at most `rest_torque`; the dead man's
/// button, if the scene lists one, is held. A handle that only turns is at rest. A request that is not granted within
/// `patience` is forgotten. So is a request before the first `read`.
///
/// **Faults** are latched in Armed only. Outside Armed there is no force to take away, and a trouble there keeps the
/// device from being armed. The force is zero from the next `apply` on. A watchdog with a ramp takes the force to zero
/// over that time; the state stays Armed until the force is zero. Releasing the dead man's button is no fault: Armed →
/// Homed, and the force is zero at once.
///
/// **Disarming** is the operator's order and no fault: Armed → Homed, and the force is zero at once. It withdraws a
/// request to arm that is not granted yet. Only `arm` ends it: neither the start (`kStart`) arms the device then, nor
/// the dead man's button, which has to be pressed anew after `arm`. A fault stays a fault; a ramp of a watchdog becomes
/// one at once.
///
/// If the process hangs or dies, the guardian (guardian.h) or the watchdog of the device ends the force. If the device has
/// a guardian, there are two more faults. If `apply` is not called for Heartbeat::kStill, the guardian ends the force, and
/// the next `read` sets kCommandSilent. If the guardian is killed or stopped, `read` sets kGuardianLost, and the device
/// cannot be armed.
///
/// A sample whose position or opening is not a number, whose orientation is no rotation, or that jumped (StepBound), is
/// passed on as no sample.
///
/// Thread-safe: no; but `status` may be read from any thread. Realtime-safe: all but the constructor.
class SafeDevice final : public Device {
 public:
  struct Arming {
    enum class By : std::uint8_t {
      kRequest,  ///< only `arm`
      kStart,    ///< the first time by itself, then `arm`
      kDeadMan,  ///< only by pressing the dead man's button; `arm` only takes a `disarm` back
    };
    By by = By::kRequest;
    double rest_speed = 0.02;   ///< m/s, > 0
    double rest_force = 0.1;    ///< N, > 0
    double rest_torque = 0.01;  ///< N·m, > 0
    Duration patience = std::chrono::seconds(1);
  };

  struct Config {
    Arming arming;
    std::optional<GrowthLimit::Config> growth_limit;
    std::optional<ForceLimit::Config> force_limit;
    std::optional<HeatLimit::Config> heat_limit;
    std::optional<Workspace::Config> workspace;
    std::optional<RampIn::Config> ramp_in;
    std::optional<SpeedTrip::Config> speed_trip;
    std::optional<StepBound::Config> step_bound;
    std::optional<Watchdog::Config> command_watchdog;  ///< between two calls of `apply`
    std::optional<Watchdog::Config> link_watchdog;     ///< since the newest position was sampled
    std::optional<DeadManSwitch::Config> dead_man;
    const std::atomic<bool>* guardian = nullptr;             ///< Guardian::stands; null if there is no guardian
    std::optional<ForceLimit::Config> torque_limit;          ///< N·m
    std::optional<GrowthLimit::Config> torque_growth_limit;  ///< N·m/s
    std::optional<TurnTrip::Config> turn_trip;
    std::optional<ForceLimit::Config> grip_limit;          ///< N
    std::optional<GrowthLimit::Config> grip_growth_limit;  ///< N/s
  };

  struct Status {
    SafetyState state = SafetyState::kAbsent;
    SafetyFault last_fault = SafetyFault::kNone;  ///< stays after the device was armed again
    std::uint32_t faults = 0;                     ///< so far
  };

  /// `device` must outlive it. Throws std::invalid_argument naming the field when a value is impossible.
  SafeDevice(const Config& config, Device& device);

  const DeviceInfo& info() const noexcept override { return info_; }
  Joints joints(const Motion& hand) const noexcept override { return device_.joints(hand); }
  State state() const noexcept override { return device_.state(); }
  DeviceCounts counts() const noexcept override { return device_.counts(); }
  void arm() noexcept override;
  void disarm() noexcept override;
  bool armed() const noexcept override { return stage_ == Stage::kArmed && !stopped(); }
  std::uint32_t times_armed() const noexcept override { return times_armed_; }
  std::uint32_t faults() const noexcept override { return faults_; }
  std::optional<PositionSample> read(LocalTime now) noexcept override;
  Vec3 apply(const Vec3& force) noexcept override;
  Effort apply_all(const Effort& effort) noexcept override;
  void set_output(LocalTime now, std::uint32_t output, const OutputSetting& setting) noexcept override {
    device_.set_output(now, output, setting);
  }

  Status status() const noexcept;

  /// Sets the fault to kCommandSilent if the device is armed. This is called before the haptic thread is suspended.
  void stand_still() noexcept {
    if (now_) trip(SafetyFault::kCommandSilent);
    publish();
  }

 private:
  enum class Stage : std::uint8_t { kWaiting, kArmed, kFault };

  bool accept(const PositionSample& sample) noexcept;
  void watch_rest(const PositionSample& sample) noexcept;
  void watch_button(std::uint32_t buttons) noexcept;
  void watch_silence() noexcept;
  void leave_armed() noexcept;
  void trip(SafetyFault fault, Duration ramp = Duration::zero()) noexcept;
  void forget_motion() noexcept;
  bool may_be_armed(const Effort& asked) const noexcept;
  /// Whether the device is armed for what is asked; arms it when it may be.
  bool armed_for(const Effort& asked) noexcept;
  bool stopped() const noexcept;
  Effort limited(const Effort& asked) const noexcept;
  double limited_grip(double asked) const noexcept;
  bool is_sound(const PositionSample& sample) noexcept;
  SafetyState safety_state() const noexcept;
  void publish() noexcept;

  Arming arming_;
  const std::atomic<bool>* guardian_;
  Device& device_;
  DeviceInfo info_;
  std::optional<GrowthLimit> growth_limit_;
  std::optional<ForceLimit> force_limit_;
  std::optional<HeatLimit> heat_limit_;
  std::optional<Workspace> workspace_;
  std::optional<RampIn> ramp_in_;
  std::optional<SpeedTrip> speed_trip_;
  std::optional<StepBound> step_bound_;
  std::optional<Watchdog> command_watchdog_;
  std::optional<Watchdog> link_watchdog_;
  std::optional<DeadManSwitch> dead_man_;
  std::optional<ForceLimit> torque_limit_;
  std::optional<GrowthLimit> torque_growth_limit_;
  std::optional<TurnTrip> turn_trip_;
  std::optional<ForceLimit> grip_limit_;
  std::optional<GrowthLimit> grip_growth_limit_;

  Stage stage_ = Stage::kWaiting;
  std::optional<RampOut> stopping_;             ///< a fault whose force is on its way to zero
  LocalTime request_until_ = LocalTime::min();  ///< the operator's request to arm is open until then
  bool button_held_ = true;                     ///< true at first: a stuck button was never pressed
  bool disarmed_ = false;                       ///< by the operator; only `arm` ends it

  std::optional<LocalTime> now_;  ///< of the last `read`
  Duration passed_{};             ///< between the last two
  std::optional<PositionSample> last_;
  /// When and where the handle came to rest; empty: it is not known to rest.
  std::optional<PositionSample> rest_;
  LocalTime heard_at_{};  ///< when the newest good position was sampled
  LocalTime applied_at_{};
  LocalTime armed_at_{};
  Effort applied_;  ///< what the device really holds

  std::uint32_t times_armed_ = 0;
  SafetyFault last_fault_ = SafetyFault::kNone;
  std::uint32_t faults_ = 0;
  std::atomic<std::uint64_t> status_{0};
};

}  // namespace tendon
