// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "devices/device.h"
#include "devices/driver.h"
#include "devices/simulated/simulated_device.h"
#include "devices/usb/dialogue.h"
#include "devices/woodenhaptics/kinematics.h"
#include "devices/woodenhaptics/report.h"

namespace tendon {

/// The driver of WoodenHaptics, and other devices with the same board and firmware: a state machine over a `usb::Pipe`
/// with interrupt endpoints, which is advanced by `read`.
///
///     kAbsent ──plugged in──▶ kOpening ──answers──▶ kUnhomed ──calibrated──▶ kHomed
///                                                      ▲                       │
///                     the calibrate button, or lost count over 100 ms ─────────┘
///     any ──unplugged, a transfer failed, or silent for 100 ms──▶ kAbsent, and starts again
///
/// **Calibration.** The operator holds the arm in its calibration pose (see the README) and presses the button on the
/// board. After ten consecutive reports of this, the driver sends command 1, which sets the counters. After ten
/// consecutive reports with these counters, the device is homed. Always required: boards do not report resets.
///
/// **Requests.** The firmware uses the newest request and answers all of them. Up to two can be pending, which is
/// required for 1 kHz on a full-speed bus; a zero force is always sent immediately (`usb::Dialogue`). Currents are only
/// nonzero in kHomed, while there are plausible reports (at least every 10 ms), which a hand could cause.
///
/// **Watchdog.** The firmware disables the amplifiers 0.5 s after the last valid report, starting with the first one.
/// It is assumed by `apply` that older currents have ended.
///
/// Positions are relative to the middle of the workspace, in the frame of kinematics.h. Samples use the time of `read`,
/// but are about 1 ms older. Button 0 is the switch at the tip.
/// Thread-safe: `counts` and `state` only. Realtime-safe: `read`, `apply`, `counts`.
class WoodenHapticsDevice final : public Device {
 public:
  static constexpr usb::Id kId{0x1234, 0x0006};  ///< used in mbed's examples, and possibly by other devices
  static constexpr std::uint8_t kIn = 0x81;      ///< EP1 of the LPC1768: 64 bytes per ms
  static constexpr std::uint8_t kOut = 0x01;
  static constexpr Duration kWatchdog = std::chrono::milliseconds(500);

  struct Config {
    const woodenhaptics::Model* model = nullptr;  ///< one of `models()`
    /// A, per motor; > 0, at most full scale. Default as in the published host: the continuous current of ESCON 24/4.
    double max_current = 2.0;
  };

  /// Throws std::invalid_argument if a value is out of range, naming the field.
  WoodenHapticsDevice(const Config& config, std::unique_ptr<usb::Pipe> pipe);

  static DeviceInfo info_of(const woodenhaptics::Model& model);

  const DeviceInfo& info() const noexcept override { return info_; }
  State state() const noexcept override { return state_.load(std::memory_order_relaxed); }
  DeviceCounts counts() const noexcept override { return dialogue_.counts(); }
  std::optional<PositionSample> read(LocalTime now) noexcept override;
  Joints joints(const Motion& hand) const noexcept override;
  Vec3 apply(const Vec3& force) noexcept override;

 private:
  void enter(State state) noexcept;
  void receive() noexcept;
  void believe(const woodenhaptics::Report& report) noexcept;
  void home(const woodenhaptics::Report& report) noexcept;
  bool near_calibration(const woodenhaptics::Report& report) const noexcept;
  woodenhaptics::Counts steps_to(const woodenhaptics::Report& report) const noexcept;
  bool plausible(const woodenhaptics::Counts& steps) const noexcept;
  void advance() noexcept;
  void write(const woodenhaptics::Currents& wanted) noexcept;

  woodenhaptics::Model model_;
  double most_ma_;
  Vec3 counts_per_radian_;
  DeviceInfo info_;
  usb::Dialogue dialogue_;
  std::atomic<State> state_{State::kAbsent};

  std::optional<woodenhaptics::Report> newest_{};
  bool fresh_ = false;

  int asking_replies_ = 0;                 ///< consecutive reports of the button
  int set_replies_ = 0;                    ///< consecutive reports of the counters as set
  std::optional<LocalTime> calibrated_{};  ///< when command 1 was sent

  woodenhaptics::Counts counts_{};  ///< without overflow
  woodenhaptics::Pose pose_{};
  woodenhaptics::Currents held_{};
  Vec3 held_force_ = Vec3::Zero();
};

namespace woodenhaptics {

/// A WoodenHaptics or similar device in a scene (driver.h). `stand_in` and `make` require a model.
struct Config {
  std::string port{};  ///< from `tendond devices`; optional
  WoodenHapticsDevice::Config drive{};
};

const Driver& driver(const Config& config);
SimulatedDevice::Config stand_in(const Config& config);
std::unique_ptr<Device> make(const Config& config, FromOutside outside);

}  // namespace woodenhaptics

}  // namespace tendon
