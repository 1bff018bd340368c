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

/// The state of a device between connection and force output. Forces are rendered only in `kArmed`.
enum class SafetyState : std::uint8_t {
  kAbsent,  ///< kAbsent to kHomed are the Device::State of the wrapped device
  kOpening,
  kFirmware,
  kUnhomed,
  kHomed,  ///< ready and waiting to be armed
  kArmed,
  kFault,  ///< after a SafetyFault: no force until it is armed again
};
std::string_view to_string(SafetyState state) noexcept;

/// Why an armed device no longer renders forces.
enum class SafetyFault : std::uint8_t {
  kNone,
  kForceNotFinite,     ///< a requested force, torque or grip is NaN or infinite
  kPositionNotFinite,  ///< a measured position or opening is NaN or infinite
  kPositionJumped,     ///< StepBound
  kTooFast,            ///< SpeedTrip
  kCommandSilent,      ///< `apply` was not called in time (Watchdog)
  kDeviceSilent,       ///< the device gave no position in time (Watchdog)
  kDeviceLost,         ///< it is no longer homed: disconnected, or lost its origin
  kNoRotation,         ///< a measured orientation is not a rotation
  kTurnsTooFast,       ///< TurnTrip
  kGuardianLost,       ///< the guardian is dead or stopped (Guardian::stands)
};
/// Returns a message for people, such as "the handle was faster than a hand".
std::string_view to_string(SafetyFault fault) noexcept;

/// The safety layer: a decorator for any other device, between the control law and the motors.
///
///     F ← 0                              unless armed; F with a NaN or infinity is a fault
///     F ← s F, 0 ≤ s ≤ 1                 for each listed part: size, heat, workspace, ramp-in, the ramp to zero of a
///                                        watchdog that has tripped, and growth
///
/// Therefore |F_i applied| ≤ |F_i requested| for each component i, provided that the wrapped device writes no more than
/// it is told. `apply` returns the force that the device wrote, which the energy ledger counts. A part that the scene
/// does not list costs one branch. The state machine is always active:
///
///     Absent → Opening → Firmware → Unhomed → Homed ⇄ Armed → Fault → Armed
///
/// **Torque and grip** (`apply_all`) are treated in the same way. Force and torque have a common factor, the smallest
/// that any part requires for either, so that a wrench keeps its direction. Workspace and heat consider only the force,
/// and their factors also apply to the torque. The grip has its own limit and growth limit, the same ramps, and ends
/// under the same conditions. `apply` renders no torque and no grip.
///
/// **Arming** requires a request (Arming::By). It is granted by the first `apply` at which all of these conditions
/// hold: the device is homed; for 50 ms the handle has not moved further than `rest_speed` allows, with no gap of more
/// than 10 ms between two positions; the requested force and grip are at most `rest_force` and the torque at most
/// `rest_torque`; and the dead man's button, if the scene lists one, is held. A handle that only rotates counts as
/// being at rest. A request that is not granted within `patience` expires. A request before the first `read` is
/// ignored.
///
/// **Faults** are latched in Armed only. Otherwise there is no force to end, and the condition prevents arming. The
/// force is zero from the next `apply` on. A watchdog with a ramp takes the force to zero over that time, and the state
/// stays Armed until the force is zero. Releasing the dead man's button is not a fault: Armed → Homed, and the force is
/// zero immediately.
///
/// **Disarming** is a command of the operator and not a fault: Armed → Homed, and the force is zero immediately. It
/// withdraws a request to arm that was not granted yet. Only `arm` ends it: until then, neither startup (`kStart`) nor
/// the dead man's button arms the device, and the button must be pressed again after `arm`. A fault stays a fault. If a
/// watchdog is ramping the force down, it becomes a fault immediately.
///
/// If the process hangs or dies, the guardian (guardian.h) or the watchdog of the device ends the force. A guardian
/// adds two faults. If `apply` is not called for Heartbeat::kStill, the guardian ends the force and the next `read`
/// sets kCommandSilent. If the guardian is killed or stopped, `read` sets kGuardianLost and the device cannot be armed.
///
/// `read` returns nullopt for a sample whose position or opening is not finite, whose orientation is not a rotation, or
/// whose position jumped (StepBound).
///
/// Thread-safe: no, except `status`, which may be called from any thread. Realtime-safe: all except the constructor.
class SafeDevice final : public Device {
 public:
  struct Arming {
    enum class By : std::uint8_t {
      kRequest,  ///< by `arm` only
      kStart,    ///< automatically the first time, then by `arm`
      kDeadMan,  ///< only by pressing the dead man's button; `arm` only revokes a `disarm`
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
    std::optional<Watchdog::Config> command_watchdog;  ///< limits the time between two calls of `apply`
    std::optional<Watchdog::Config> link_watchdog;     ///< limits the age of the newest position
    std::optional<DeadManSwitch::Config> dead_man;
    const std::atomic<bool>* guardian = nullptr;             ///< Guardian::stands; null without a guardian
    std::optional<ForceLimit::Config> torque_limit;          ///< N·m
    std::optional<GrowthLimit::Config> torque_growth_limit;  ///< N·m/s
    std::optional<TurnTrip::Config> turn_trip;
    std::optional<ForceLimit::Config> grip_limit;          ///< N
    std::optional<GrowthLimit::Config> grip_growth_limit;  ///< N/s
  };

  struct Status {
    SafetyState state = SafetyState::kAbsent;
    SafetyFault last_fault = SafetyFault::kNone;  ///< is kept when the device is armed again
    std::uint32_t faults = 0;                     ///< number of faults so far
  };

  /// `device` must outlive this object. Throws std::invalid_argument, naming the field, if a value is out of bounds.
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

  /// Sets the fault kCommandSilent if the device is armed. Call this before the haptic thread is suspended.
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
  /// Arms the device if it may be armed, and returns whether it is armed.
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
  std::optional<RampOut> stopping_;             ///< set while a fault ramps the force down
  LocalTime request_until_ = LocalTime::min();  ///< until then, the request to arm is valid
  bool button_held_ = true;                     ///< initially true, because a stuck button was never pressed
  bool disarmed_ = false;                       ///< by the operator; only `arm` resets it

  std::optional<LocalTime> now_;  ///< time of the last `read`
  Duration passed_{};             ///< time between the last two calls of `read`
  std::optional<PositionSample> last_;
  /// Time and position at which the handle came to rest; empty if it is not known to be at rest.
  std::optional<PositionSample> rest_;
  LocalTime heard_at_{};  ///< sampling time of the newest valid position
  LocalTime applied_at_{};
  LocalTime armed_at_{};
  Effort applied_;  ///< what the device actually holds

  std::uint32_t times_armed_ = 0;
  SafetyFault last_fault_ = SafetyFault::kNone;
  std::uint32_t faults_ = 0;
  std::atomic<std::uint64_t> status_{0};
};

}  // namespace tendon
