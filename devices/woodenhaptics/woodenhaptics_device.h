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

/// The driver of a WoodenHaptics, or of a related device with the same board and firmware: a state machine from
/// connection to force output over a `usb::Pipe` with interrupt endpoints, advanced by `read`.
///
///     kAbsent ──plugged in──▶ kOpening ──answers──▶ kUnhomed ──calibrated──▶ kHomed
///                                                      ▲                       │
///                     the calibrate button, or lost count over 100 ms ─────────┘
///     any ──unplugged, a transfer failed, or silent for 100 ms──▶ kAbsent, and starts again
///
/// **Calibration.** The operator holds the arm in its calibration pose (see the README) and presses the button of the
/// board, which the firmware latches. After ten consecutive reports of it the driver sends command 1, which sets the
/// counters; after ten consecutive reports with these counters the device is homed. A board that was calibrated before
/// is calibrated again, because its reports do not show whether it was reset since.
///
/// **Requests.** The firmware answers each report with one and obeys the newest. At most two are unanswered, which 1
/// kHz requires on a full-speed bus; a zero force is sent immediately (`usb::Dialogue`). Currents are zero in every
/// state other than kHomed, and in kHomed if there was no plausible report for 10 ms. A report is implausible if its
/// counters moved further than a hand can move them.
///
/// **Watchdog.** The firmware disables the amplifiers 0.5 s after the last report of the right length, whatever happens
/// to the host. The first report arms the watchdog. DeviceInfo therefore says 0.5 s, and `apply` relies on it: a
/// current that was sent longer ago has ended.
///
/// Positions are relative to the middle of the workspace, in the frame of kinematics.h. A sample is about 1 ms older
/// than its `at`, the time of `read`. Button 0 is the switch at the tip, if there is one.
///
/// Thread-safe: `counts` and `state` from any thread, the others from one thread. Realtime-safe: `read`, `apply` and
/// `counts`.
class WoodenHapticsDevice final : public Device {
 public:
  /// Default id of mbed's USBHID, from its examples, which other devices may also use.
  static constexpr usb::Id kId{0x1234, 0x0006};
  static constexpr std::uint8_t kIn = 0x81;  ///< EP1 of the LPC1768: 64 bytes, every ms
  static constexpr std::uint8_t kOut = 0x01;
  static constexpr Duration kWatchdog = std::chrono::milliseconds(500);

  struct Config {
    const woodenhaptics::Model* model = nullptr;  ///< one of `models()`
    /// A, for each motor; above 0, at most the model's full scale. The published host uses the same limit, because the
    /// smaller one of its two amplifiers (ESCON 24/4) cannot supply more continuously.
    double max_current = 2.0;
  };

  /// Takes the pipe to a device. Throws std::invalid_argument, naming the field, its value and the expected range.
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
  Vec3 counts_per_radian_;  ///< of the bodies, > 0
  DeviceInfo info_;
  usb::Dialogue dialogue_;
  std::atomic<State> state_{State::kAbsent};

  std::optional<woodenhaptics::Report> newest_{};  ///< last plausible report
  bool fresh_ = false;                             ///< newest_ arrived in this `read`

  // Calibration
  int asking_replies_ = 0;                 ///< number of consecutive reports that the button was pressed
  int set_replies_ = 0;                    ///< number of consecutive reports with the counters as set
  std::optional<LocalTime> calibrated_{};  ///< time at which command 1 was sent

  woodenhaptics::Counts counts_{};  ///< counters without wrap-around
  woodenhaptics::Pose pose_{};      ///< pose for counts_
  woodenhaptics::Currents held_{};  ///< the last currents sent
  Vec3 held_force_ = Vec3::Zero();  ///< last known force of these currents
};

namespace woodenhaptics {

/// Configuration of a WoodenHaptics or a related device in a scene.
struct Config {
  std::string port{};  ///< name in `tendond devices`; empty: the first free one
  WoodenHapticsDevice::Config drive{};
};

// The overloads of driver.h. `stand_in` and `make` require a model.
const Driver& driver(const Config& config);
SimulatedDevice::Config stand_in(const Config& config);
std::unique_ptr<Device> make(const Config& config, FromOutside outside);

}  // namespace woodenhaptics

}  // namespace tendon
