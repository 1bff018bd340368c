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
#include "server/clients/health.h"
#include "server/mailboxes.h"

namespace tendon {

/// Reads the device, runs the control law, and applies the force. `step` must be called by a single thread, which
/// should only sleep and read the clock between calls.
/// Thread-safe: `stats` and `health` can be called from any thread, everything else only from the haptic thread.
/// Realtime-safe: yes. No heap allocation, lock, log output or socket (see tests/realtime).
class HapticLoop {
 public:
  struct Config {
    std::uint32_t device = 0;
    Duration period = std::chrono::milliseconds(1);
    HapticController::Config control;
    bool record = true;  ///< if false, steps are not passed to the log thread
  };

  struct Stats {
    std::uint64_t steps = 0;
    std::uint64_t overruns = 0;  ///< intervals above the assumed maximum
    std::uint64_t unseen = 0;
    Duration longest_interval{};
    HapticController::Fault fault = HapticController::Fault::kNone;
    Device::State device = Device::State::kHomed;
    double force = 0;  ///< N, norm of the force that the device applies
  };

  /// The references must outlive the loop. `heart` can be null. Throws std::invalid_argument if `config` is invalid.
  HapticLoop(const Config& config, Device& device, Mailboxes& mail, Heartbeat* heart = nullptr);

  /// Performs one step and returns the time of the next one: the scheduled time of this step plus one period, or `now`
  /// + period if this step was late by a period or more. Does not catch up on missed steps.
  LocalTime step(LocalTime now) noexcept;

  /// Sets the force to zero. Must be called before the haptic thread ends or is suspended.
  void stop() noexcept;

  Stats stats() const noexcept;
  Health health() const noexcept { return meter_.counted(); }

 private:
  struct Rest {
    explicit Rest(const DeviceInfo& info);
    bool turns_or_grips;
    bool has_joints;
    VelocityEstimator turning;
    VelocityEstimatorOf<1> opening;
    Vec3 turned = Vec3::Zero();  ///< rad, since the first sample
    std::optional<Quat> last{};
  };

  void take_mail(LocalTime now) noexcept;
  [[gnu::noinline]] void take_fields(LocalTime now) noexcept;
  void note(FieldInput input, LocalTime now) noexcept;
  void take_ports(Couplings& couplings, LocalTime now) noexcept;
  [[gnu::noinline]] void set_outputs(LocalTime now) noexcept;  // not inlined because it is rare
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
  double force_rounding_squared_;  ///< N²; a smaller deviation is rounding, not clamping
  std::optional<Rest> rest_;       ///< empty if the device only measures its position
  bool has_more_motors_;           ///< the device has torque or gripper motors
  bool has_outputs_;
  std::array<std::uint32_t, kMostOutputs> outputs_set_{};  ///< OutputSettings::One::number of the settings in effect
  std::array<std::uint32_t, Couplings::kMost> peer_numbers_{};        ///< the number of each current peer; see kRenew
  std::array<std::optional<ArrivedPort>, Couplings::kMost> peers_{};  ///< received since the previous step
  std::array<std::uint32_t, limits::kMaxChannels> field_sources_{};  ///< the source of the newest field of each channel
  Effort applied_;
  std::uint64_t tick_ = 0;
  LocalTime due_{};
  bool homed_once_ = false;
  std::uint32_t times_armed_ = 0;
  bool rearmed_ = false;
  bool disarmed_ = false;  ///< until the next kRearm
  std::uint32_t buttons_ = 0;
  std::uint32_t device_faults_ = 0;

  HealthMeter meter_;
  std::atomic<std::int64_t> longest_interval_ns_{0};
  std::atomic<double> force_{0};
  std::atomic<HapticController::Fault> fault_{HapticController::Fault::kNone};
};

}  // namespace tendon
