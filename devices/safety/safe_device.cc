// SPDX-License-Identifier: Apache-2.0
#include "devices/safety/safe_device.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "core/base/expect.h"
#include "core/base/rotation.h"
#include "devices/finite.h"

namespace tendon {

namespace {

/// A handle is at rest if it does not move for this time. The pauses of a tremor (8 to 12 Hz) are shorter.
constexpr Duration kRest = std::chrono::milliseconds(50);
constexpr Duration kBlind = std::chrono::milliseconds(10);  ///< shorter gaps are allowed, because USB replies jitter
constexpr Duration kLongestStep = std::chrono::milliseconds(10);  ///< limits the growth of the force after a pause

template <class Part, class Config, class... More>
std::optional<Part> made(const std::optional<Config>& config, More... more) {
  if (!config) return std::nullopt;
  return Part(*config, more...);
}

DeviceInfo limited_info(DeviceInfo info, const std::optional<ForceLimit>& force,
                        const std::optional<ForceLimit>& torque, const std::optional<ForceLimit>& grip) {
  if (force) info.max_force = info.max_force > 0 ? std::min(info.max_force, force->max()) : force->max();
  // 0 means that there is no motor.
  if (torque) info.max_torque = std::min(info.max_torque, torque->max());
  if (grip && info.gripper) info.gripper->max_force = std::min(info.gripper->max_force, grip->max());
  return info;
}

/// For parts that use vectors.
Vec3 along(double grip) noexcept { return {grip, 0, 0}; }

}  // namespace

std::string_view to_string(SafetyState state) noexcept {
  switch (state) {
    case SafetyState::kAbsent:
      return "absent";
    case SafetyState::kOpening:
      return "opening";
    case SafetyState::kFirmware:
      return "firmware";
    case SafetyState::kUnhomed:
      return "unhomed";
    case SafetyState::kHomed:
      return "homed";
    case SafetyState::kArmed:
      return "armed";
    case SafetyState::kFault:
      return "fault";
  }
  return "unknown";
}

std::string_view to_string(SafetyFault fault) noexcept {
  switch (fault) {
    case SafetyFault::kNone:
      return "none";
    case SafetyFault::kForceNotFinite:
      return "a requested force is not a finite number";
    case SafetyFault::kPositionNotFinite:
      return "a measured position is not a finite number";
    case SafetyFault::kPositionJumped:
      return "the position has jumped further than a hand can move";
    case SafetyFault::kTooFast:
      return "the handle was faster than speed_trip allows";
    case SafetyFault::kCommandSilent:
      return "no force was commanded in time";
    case SafetyFault::kDeviceSilent:
      return "the device sent no position in time";
    case SafetyFault::kDeviceLost:
      return "the device was unplugged or has lost its origin";
    case SafetyFault::kNoRotation:
      return "a measured orientation is not a rotation";
    case SafetyFault::kTurnsTooFast:
      return "the handle turned faster than turn_trip allows";
    case SafetyFault::kGuardianLost:
      return "the guardian process was killed or stopped; if it was killed, restart the server";
  }
  return "unknown";
}

SafeDevice::SafeDevice(const Config& config, Device& device)
    : arming_(config.arming),
      guardian_(config.guardian),
      device_(device),
      growth_limit_(made<GrowthLimit>(config.growth_limit)),
      force_limit_(made<ForceLimit>(config.force_limit)),
      heat_limit_(made<HeatLimit>(config.heat_limit)),
      workspace_(made<Workspace>(config.workspace)),
      ramp_in_(made<RampIn>(config.ramp_in)),
      speed_trip_(made<SpeedTrip>(config.speed_trip, device.info().position_resolution)),
      step_bound_(made<StepBound>(config.step_bound, device.info().position_resolution)),
      command_watchdog_(made<Watchdog>(config.command_watchdog, "command_watchdog")),
      link_watchdog_(made<Watchdog>(config.link_watchdog, "link_watchdog")),
      dead_man_(made<DeadManSwitch>(config.dead_man)),
      torque_limit_(made<ForceLimit>(config.torque_limit, "torque_limit")),
      torque_growth_limit_(made<GrowthLimit>(config.torque_growth_limit, "torque_growth_limit")),
      turn_trip_(made<TurnTrip>(config.turn_trip, device.info().angular_resolution)),
      grip_limit_(made<ForceLimit>(config.grip_limit, "grip_limit")),
      grip_growth_limit_(made<GrowthLimit>(config.grip_growth_limit, "grip_growth_limit")) {
  expect_above_zero(arming_.rest_speed, "arming.rest_speed");
  expect_above_zero(arming_.rest_force, "arming.rest_force");
  expect_above_zero(arming_.rest_torque, "arming.rest_torque");
  expect_above_zero(seconds(arming_.patience), "arming.patience");
  if (arming_.by == Arming::By::kDeadMan && !dead_man_) {
    throw std::invalid_argument("dead_man: expected this table, because the device is armed by its button");
  }
  info_ = limited_info(device.info(), force_limit_, torque_limit_, grip_limit_);
  if (arming_.by == Arming::By::kStart) request_until_ = LocalTime::max();
  publish();
}

void SafeDevice::arm() noexcept {
  disarmed_ = false;
  if (arming_.by == Arming::By::kDeadMan || stage_ == Stage::kArmed || !now_) return;
  request_until_ = std::max(request_until_, *now_ + arming_.patience);
}

void SafeDevice::disarm() noexcept {
  disarmed_ = true;
  request_until_ = LocalTime::min();
  leave_armed();
  publish();
}

/// Leaves Armed without a fault. If a fault is still ramping the force down, it remains a fault.
void SafeDevice::leave_armed() noexcept {
  if (stage_ != Stage::kArmed) return;
  stage_ = stopping_ ? Stage::kFault : Stage::kWaiting;
  stopping_.reset();
}

std::optional<PositionSample> SafeDevice::read(LocalTime now) noexcept {
  passed_ = now_ ? std::max(now - *now_, Duration::zero()) : Duration::zero();
  now_ = now;
  if (heat_limit_) heat_limit_->observe(applied_.force.norm(), passed_);
  auto sample = device_.read(now);
  if (sample && !accept(*sample)) sample.reset();
  if (now - heard_at_ > kBlind) rest_.reset();
  watch_silence();
  publish();
  return sample;
}

bool SafeDevice::is_sound(const PositionSample& sample) noexcept {
  if (!sample.position.allFinite() || (sample.opening && !std::isfinite(*sample.opening))) {
    trip(SafetyFault::kPositionNotFinite);
    return false;
  }
  if (sample.orientation && !is_rotation(*sample.orientation)) {
    trip(SafetyFault::kNoRotation);
    return false;
  }
  return true;
}

bool SafeDevice::accept(const PositionSample& sample) noexcept {
  if (device_.state() != State::kHomed) {
    forget_motion();
    return false;
  }
  if (!is_sound(sample)) {
    forget_motion();
    return false;
  }
  if (step_bound_ && last_ && step_bound_->tripped(last_->position, sample.position, sample.at - last_->at)) {
    trip(SafetyFault::kPositionJumped);
    forget_motion();
    last_ = sample;
    return false;
  }
  last_ = sample;
  heard_at_ = sample.at;
  if (speed_trip_ && speed_trip_->tripped(sample.at, sample.position)) trip(SafetyFault::kTooFast);
  if (turn_trip_ && sample.orientation && turn_trip_->tripped(sample.at, *sample.orientation)) {
    trip(SafetyFault::kTurnsTooFast);
  }
  watch_rest(sample);
  watch_button(sample.buttons);
  return true;
}

void SafeDevice::watch_rest(const PositionSample& sample) noexcept {
  const double near = arming_.rest_speed * seconds(kRest) + std::numbers::sqrt3 * info_.position_resolution;
  if (!rest_ || (sample.position - rest_->position).norm() > near) rest_ = sample;
}

void SafeDevice::watch_button(std::uint32_t buttons) noexcept {
  if (!dead_man_) return;
  const bool held = dead_man_->held(buttons);
  if (!held) leave_armed();
  if (arming_.by == Arming::By::kDeadMan) {
    if (held && !button_held_ && !disarmed_) request_until_ = LocalTime::max();
    if (!held) request_until_ = LocalTime::min();
  }
  button_held_ = held;
}

void SafeDevice::watch_silence() noexcept {
  if (stage_ != Stage::kArmed) return;
  if (guardian_ != nullptr) {
    if (applied_ != Effort{} && *now_ - applied_at_ >= Heartbeat::kStill) trip(SafetyFault::kCommandSilent);
    if (!*guardian_) trip(SafetyFault::kGuardianLost);
  }
  if (command_watchdog_ && command_watchdog_->tripped(*now_ - applied_at_)) {
    trip(SafetyFault::kCommandSilent, command_watchdog_->ramp());
  }
  if (link_watchdog_ && link_watchdog_->tripped(*now_ - heard_at_)) {
    trip(SafetyFault::kDeviceSilent, link_watchdog_->ramp());
  }
}

void SafeDevice::trip(SafetyFault fault, Duration ramp) noexcept {
  if (stage_ != Stage::kArmed) return;
  if (!stopping_) {
    last_fault_ = fault;
    ++faults_;
    stopping_ = RampOut{*now_, ramp};
  }
  if (ramp == Duration::zero()) stopping_->time = ramp;
  if (stopped()) stage_ = Stage::kFault;
}

bool SafeDevice::stopped() const noexcept { return stopping_ && stopping_->share(*now_) == 0; }

void SafeDevice::forget_motion() noexcept {
  last_.reset();
  rest_.reset();
  if (speed_trip_) speed_trip_->forget();
  if (turn_trip_) turn_trip_->forget();
}

bool SafeDevice::may_be_armed(const Effort& asked) const noexcept {
  return now_ && *now_ <= request_until_ && device_.state() == State::kHomed && rest_ &&
         last_->at - rest_->at >= kRest && asked.force.norm() <= arming_.rest_force &&
         asked.torque.norm() <= arming_.rest_torque && std::abs(asked.grip) <= arming_.rest_force &&
         (!dead_man_ || button_held_) && (guardian_ == nullptr || *guardian_) &&
         !(link_watchdog_ && link_watchdog_->tripped(*now_ - heard_at_));
}

Effort SafeDevice::limited(const Effort& asked) const noexcept {
  Effort effort = asked;
  const auto give = [&effort](double share) {
    effort.force *= share;
    effort.torque *= share;
  };
  if (force_limit_) give(force_limit_->share(effort.force));
  if (torque_limit_) give(torque_limit_->share(effort.torque));
  if (heat_limit_) give(heat_limit_->share(effort.force));
  if (workspace_ && last_) give(workspace_->share(effort.force, last_->position));
  if (ramp_in_) give(ramp_in_->share(*now_ - armed_at_));
  if (stopping_) give(stopping_->share(*now_));
  const Duration step = std::min(passed_, kLongestStep);
  if (growth_limit_) give(growth_limit_->share(effort.force, applied_.force, step));
  if (torque_growth_limit_) give(torque_growth_limit_->share(effort.torque, applied_.torque, step));
  if (effort.grip != 0) effort.grip = limited_grip(effort.grip);
  return effort;
}

double SafeDevice::limited_grip(double asked) const noexcept {
  double grip = asked;
  if (grip_limit_) grip *= grip_limit_->share(along(grip));
  if (ramp_in_) grip *= ramp_in_->share(*now_ - armed_at_);
  if (stopping_) grip *= stopping_->share(*now_);
  if (grip_growth_limit_) {
    grip *= grip_growth_limit_->share(along(grip), along(applied_.grip), std::min(passed_, kLongestStep));
  }
  return grip;
}

bool SafeDevice::armed_for(const Effort& asked) noexcept {
  const bool finite = is_finite(asked);
  if (!finite) trip(SafetyFault::kForceNotFinite);
  if (device_.state() != State::kHomed) trip(SafetyFault::kDeviceLost);
  if (stage_ == Stage::kArmed && stopped()) stage_ = Stage::kFault;
  if (stage_ != Stage::kArmed && finite && may_be_armed(asked)) {
    stage_ = Stage::kArmed;
    stopping_.reset();
    request_until_ = LocalTime::min();
    armed_at_ = *now_;
    ++times_armed_;
  }
  return stage_ == Stage::kArmed;
}

Vec3 SafeDevice::apply(const Vec3& force) noexcept {
  const Effort asked{.force = force};
  const Vec3 given = armed_for(asked) ? limited(asked).force : Vec3(Vec3::Zero());
  applied_ = {.force = device_.apply(given)};
  if (now_) applied_at_ = *now_;
  publish();
  return applied_.force;
}

Effort SafeDevice::apply_all(const Effort& effort) noexcept {
  applied_ = device_.apply_all(armed_for(effort) ? limited(effort) : Effort());
  if (now_) applied_at_ = *now_;
  publish();
  return applied_;
}

SafetyState SafeDevice::safety_state() const noexcept {
  static_assert(static_cast<int>(SafetyState::kHomed) == static_cast<int>(State::kHomed));
  if (stage_ == Stage::kArmed) return SafetyState::kArmed;
  if (stage_ == Stage::kFault) return SafetyState::kFault;
  return static_cast<SafetyState>(device_.state());
}

void SafeDevice::publish() noexcept {
  status_.store(static_cast<std::uint64_t>(safety_state()) | static_cast<std::uint64_t>(last_fault_) << 8U |
                    static_cast<std::uint64_t>(faults_) << 32U,
                std::memory_order_relaxed);
}

SafeDevice::Status SafeDevice::status() const noexcept {
  const std::uint64_t status = status_.load(std::memory_order_relaxed);
  return {static_cast<SafetyState>(status & 0xFFU), static_cast<SafetyFault>(status >> 8U & 0xFFU),
          static_cast<std::uint32_t>(status >> 32U)};
}

}  // namespace tendon
