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

/// Forces are only rendered in `kArmed`.
enum class SafetyState : std::uint8_t {
  kAbsent,  ///< to kHomed: Device::State of the wrapped device
  kOpening,
  kFirmware,
  kUnhomed,
  kHomed,
  kArmed,
  kFault,  ///< must be armed again
};
std::string_view to_string(SafetyState state) noexcept;

enum class SafetyFault : std::uint8_t {
  kNone,
  kForceNotFinite,     ///< requested NaN or infinity
  kPositionNotFinite,  ///< measured NaN or infinity
  kPositionJumped,     ///< StepBound
  kTooFast,            ///< SpeedTrip
  kCommandSilent,      ///< `apply` was late (Watchdog)
  kDeviceSilent,       ///< positions were late (Watchdog)
  kDeviceLost,         ///< no longer homed, or unplugged
  kNoRotation,         ///< measured an invalid orientation
  kTurnsTooFast,       ///< TurnTrip
  kGuardianLost,       ///< see Guardian::stands
};
/// A sentence for people: "the handle was faster than a hand".
std::string_view to_string(SafetyFault fault) noexcept;

/// The safety layer, which can be used with any device, between the control law and the motors.
///
///     F ← 0                              unless armed; F with a NaN or infinity is a fault
///     F ← s F, 0 ≤ s ≤ 1                 for each listed part: size, heat, workspace, ramp-in, the ramp to zero of a
///                                        watchdog that has tripped, and growth
///
/// So |F_i applied| ≤ |F_i requested| for each component i, if the wrapped device does not write more than requested.
/// `apply` returns the force that was actually written, which is counted by the energy ledger. Unused parts only cost a
/// branch. The state machine is always used:
///
///     Absent → Opening → Firmware → Unhomed → Homed ⇄ Armed → Fault → Armed
///
/// **Torque and grip** (`apply_all`) are limited in the same way. Force and torque are reduced by the smaller of their
/// factors, to keep the direction of the wrench. Workspace and heat are computed from the force only. The grip has a
/// separate limit and growth limit, but the same ramps and conditions. `apply` does not render torque or grip.
///
/// **Arming** must be requested (Arming::By). It is granted in the first `apply` for which the device is homed, the
/// handle has not moved faster than `rest_speed` for 50 ms, using positions at most 10 ms apart, the requested force
/// and grip are at most `rest_force`, the requested torque is at most `rest_torque`, and the dead man's button, if
/// listed, is held. Rotation is allowed. Requests expire after `patience`, and are ignored before the first `read`.
///
/// **Faults** are only latched while armed; otherwise, they just prevent arming. The force is zero in the next `apply`.
/// For watchdogs with a ramp, the device stays armed until the force has decreased to zero. Releasing the dead man's
/// button is not a fault: the device returns to Homed, without a force.
///
/// **Disarming** by the operator is not a fault either: the device returns to Homed, without a force, and a pending
/// request is cancelled. It cannot be armed by `kStart` or the dead man's button until `arm` is called; the button must
/// be pressed again after that. A fault is not cleared. If a watchdog is ramping the force down, this becomes a fault.
///
/// If the process hangs or dies, the guardian (guardian.h) or the device's watchdog ends the force. A guardian adds two
/// faults, both set by the next `read`: kCommandSilent, if `apply` is not called for Heartbeat::kStill, and
/// kGuardianLost, if the guardian is killed or stopped. If the guardian is not running, the device cannot be armed.
///
/// `read` returns nullopt if position or opening are not finite, the orientation is no rotation, or a StepBound trips.
/// Thread-safe: no, except `status`. Realtime-safe: all except the constructor.
class SafeDevice final : public Device {
 public:
  struct Arming {
    enum class By : std::uint8_t {
      kRequest,
      kStart,    ///< initially at the start, then by `arm`
      kDeadMan,  ///< by pressing the dead man's button; `arm` only cancels `disarm`
    };
    By by = By::kRequest;
    double rest_speed = 0.02;   ///< m/s, > 0
    double rest_force = 0.1;    ///< N, > 0
    double rest_torque = 0.01;  ///< N·m, > 0
    Duration patience = std::chrono::seconds(1);
  };

  struct Config {
    Arming arming{};
    std::optional<GrowthLimit::Config> growth_limit{};
    std::optional<ForceLimit::Config> force_limit{};
    std::optional<HeatLimit::Config> heat_limit{};
    std::optional<Workspace::Config> workspace{};
    std::optional<RampIn::Config> ramp_in{};
    std::optional<SpeedTrip::Config> speed_trip{};
    std::optional<StepBound::Config> step_bound{};
    std::optional<Watchdog::Config> command_watchdog{};  ///< for calls of `apply`
    std::optional<Watchdog::Config> link_watchdog{};     ///< for positions
    std::optional<DeadManSwitch::Config> dead_man{};
    const std::atomic<bool>* guardian = nullptr;               ///< Guardian::stands, or null
    std::optional<ForceLimit::Config> torque_limit{};          ///< N·m
    std::optional<GrowthLimit::Config> torque_growth_limit{};  ///< N·m/s
    std::optional<TurnTrip::Config> turn_trip{};
    std::optional<ForceLimit::Config> grip_limit{};          ///< N
    std::optional<GrowthLimit::Config> grip_growth_limit{};  ///< N/s
  };

  struct Status {
    SafetyState state = SafetyState::kAbsent;
    SafetyFault last_fault = SafetyFault::kNone;  ///< not cleared by arming
    std::uint32_t faults = 0;
  };

  /// `device` must outlive this object. Throws std::invalid_argument naming the field if a value is invalid.
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

  /// Must be called before suspending the haptic thread. Sets kCommandSilent if the device is armed.
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
  std::optional<RampOut> stopping_;             ///< during a fault with a ramp
  LocalTime request_until_ = LocalTime::min();  ///< end of the pending request to arm
  bool button_held_ = true;                     ///< a stuck button must not arm the device
  bool disarmed_ = false;                       ///< by the operator, until `arm`

  std::optional<LocalTime> now_;
  Duration passed_{};
  std::optional<PositionSample> last_;
  /// The time and the position when the handle was stopped. Empty if it is not known to be at rest.
  std::optional<PositionSample> rest_;
  LocalTime heard_at_{};
  LocalTime applied_at_{};
  LocalTime armed_at_{};
  Effort applied_;  ///< what the device actually renders

  std::uint32_t times_armed_ = 0;
  SafetyFault last_fault_ = SafetyFault::kNone;
  std::uint32_t faults_ = 0;
  std::atomic<std::uint64_t> status_{0};
};

}  // namespace tendon
