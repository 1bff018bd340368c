// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>

#include "core/estimation/velocity_estimator.h"
#include "core/haptic_controller.h"
#include "devices/device.h"
#include "devices/safety/heartbeat.h"
#include "server/guests/health.h"
#include "server/mailboxes.h"

namespace tendon {

/// One half of the world: reads the device, runs the control law, applies the force.
///
/// One thread calls `step` when it is due, and does nothing else but wait and read the clock.
///
/// Thread-safe: `stats` and `health` from any thread; the rest from the haptic thread only.
/// Realtime-safe: yes. No heap, no lock, no log, no socket (see tests/realtime).
class HapticLoop {
 public:
  struct Config {
    std::uint32_t device = 0;  ///< its number
    Duration period = std::chrono::milliseconds(1);
    HapticController::Config control;
    bool record = true;  ///< false: no step goes to the log thread
  };

  struct Stats {
    std::uint64_t steps = 0;
    std::uint64_t overruns = 0;  ///< intervals longer than the bound assumed
    std::uint64_t unseen = 0;    ///< steps in which the device gave no position
    Duration longest_interval{};
    HapticController::Fault fault = HapticController::Fault::kNone;
    Device::State device = Device::State::kHomed;
    double force = 0;  ///< N, norm of what the device holds
  };

  /// `device`, `mail` and `heart` must outlive the loop. Each step beats `heart`, which is null if no guardian watches the
  /// device. Throws std::invalid_argument if a value is impossible.
  HapticLoop(const Config& config, Device& device, Mailboxes& mail, Heartbeat* heart = nullptr);

  /// One haptic step. Returns when the next one is due: one period after this one was, or, when this one
  /// was late by a period or more, one period from now: steps that were missed are not made up for.
  LocalTime step(LocalTime now) noexcept;

  /// Sets the force to zero. This is called before the haptic thread ends or is suspended.
  void stop() noexcept;

  Stats stats() const noexcept;
  /// What its steps tell of it.
  Health health() const noexcept { return meter_.counted(); }

 private:
  /// What is estimated of a device that tells more than a position.
  struct Rest {
    explicit Rest(const DeviceInfo& info);
    bool turns_or_grips;
    bool has_joints;
    VelocityEstimator turning;
    VelocityEstimatorOf<1> opening;
    Vec3 turned = Vec3::Zero();  ///< rad: the sum of all turns so far
    std::optional<Quat> last{};
  };

  void take_mail(LocalTime now) noexcept;
  void take_ports(Couplings& couplings, LocalTime now) noexcept;
  [[gnu::noinline]] void set_outputs(LocalTime now) noexcept;  // a device without any pays a branch
  HandleSample handle_in(const PositionSample& sample) noexcept;
  void take_rest(const PositionSample& sample, const Motion& hand, StepRecord& record) noexcept;
  void take_step(LocalTime now, StepRecord& record) noexcept;
  void command(StepRecord& record) noexcept;
  void command_all(StepRecord& record) noexcept;
  void beat() noexcept;
  void watch_device() noexcept;
  void rearm() noexcept;
  void publish(const StepRecord& record) noexcept;
  void publish_ports(const StepRecord& record) noexcept;

  Config config_;
  Device& device_;
  Mailboxes& mail_;
  Heartbeat* heart_;
  HapticController controller_;
  VelocityEstimator velocity_;
  double force_rounding_squared_;  ///< N²: what the device rounds away is no clamp
  std::optional<Rest> rest_;       ///< empty: the device tells a position only
  bool has_more_motors_;           ///< than those of its position
  bool has_outputs_;
  std::array<std::uint32_t, kMostOutputs> outputs_set_{};             ///< numbers of the settings that the device has
  std::array<std::uint32_t, Couplings::kMost> peer_numbers_{};        ///< by coupling: of whom states are taken
  std::array<std::optional<ArrivedPort>, Couplings::kMost> peers_{};  ///< by coupling: what came since the step before
  Effort applied_;
  std::uint64_t tick_ = 0;
  LocalTime due_{};
  bool homed_once_ = false;
  std::uint32_t times_armed_ = 0;
  bool rearmed_ = false;       ///< since the last record
  bool disarmed_ = false;      ///< by an order, which only an order ends
  std::uint32_t buttons_ = 0;  ///< as the device last said
  std::uint32_t device_faults_ = 0;

  HealthMeter meter_;
  std::atomic<std::int64_t> longest_interval_ns_{0};
  std::atomic<double> force_{0};
  std::atomic<HapticController::Fault> fault_{HapticController::Fault::kNone};
};

}  // namespace tendon
