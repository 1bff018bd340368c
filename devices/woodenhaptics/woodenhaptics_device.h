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

/// A WoodenHaptics, or a relative with the same board and firmware: from the plug to the force as one state machine
/// that `read` turns, over a `usb::Pipe` with interrupt endpoints.
///
///     kAbsent ──plugged in──▶ kOpening ──answers──▶ kUnhomed ──calibrated──▶ kHomed
///                                                      ▲                       │
///                     the calibrate button, or lost count over 100 ms ─────────┘
///     any ──unplugged, a transfer failed, or silent for 100 ms──▶ kAbsent, and all the way again
///
/// **Calibrating.** The operator holds the arm in its calibration pose (see the README) and presses the board's button,
/// which the firmware remembers. When ten reports in a row say so, the driver sends command 1, which sets the counters;
/// when ten in a row show the counters as set, the device is homed. A board that was calibrated before is calibrated
/// again: it may have been reset since, and nothing it says shows that.
///
/// **Requests.** The firmware answers each report with one, and obeys the newest. At most two are under way without an
/// answer, which is what 1 kHz takes on a full-speed bus; zero is sent at once (`usb::Dialogue`). Currents are zero in
/// every state other than kHomed, and in kHomed while no believable report has come for 10 ms. A report whose counters
/// moved further than a hand can move them is not believed.
///
/// **Watchdog.** The firmware disables the amplifiers 0.5 s after the last report of the right length, whatever becomes
/// of the host. The first report arms it. So DeviceInfo says 0.5 s, and `apply` counts on it: a current that was sent
/// longer ago has ended.
///
/// Positions are relative to the middle of the workspace, in the frame of kinematics.h. A sample is some 1 ms older
/// than its `at`, the time of `read`. Button 0: the switch at the tip, where there is one.
///
/// Thread-safe: `counts` and `state` from any thread, the rest from one. Realtime-safe: `read`, `apply` and `counts`.
class WoodenHapticsDevice final : public Device {
 public:
  /// mbed's example number, which its USBHID uses when no other is given: other gadgets may have it too.
  static constexpr usb::Id kId{0x1234, 0x0006};
  static constexpr std::uint8_t kIn = 0x81;  ///< EP1 of the LPC1768, 64 bytes, each ms
  static constexpr std::uint8_t kOut = 0x01;
  static constexpr Duration kWatchdog = std::chrono::milliseconds(500);

  struct Config {
    const woodenhaptics::Model* model = nullptr;  ///< one of `models()`
    /// A, of each motor; above 0, at most the model's full scale. The published host stops at the same current, because
    /// the smaller of the amplifiers it knows (ESCON 24/4) gives no more for long.
    double max_current = 2.0;
  };

  /// Takes the pipe to a device. Throws std::invalid_argument naming the field, its value and what was expected.
  WoodenHapticsDevice(const Config& config, std::unique_ptr<usb::Pipe> pipe);

  /// The data sheet of a device of this model.
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
  Vec3 counts_per_radian_;  ///< of the bodies, above 0
  DeviceInfo info_;
  usb::Dialogue dialogue_;
  std::atomic<State> state_{State::kAbsent};

  std::optional<woodenhaptics::Report> newest_{};  ///< the last report that was believed
  bool fresh_ = false;                             ///< newest_ came in this `read`

  // Calibrating
  int asking_replies_ = 0;                 ///< in a row that say that the button was pressed
  int set_replies_ = 0;                    ///< in a row that have the counters as they were set
  std::optional<LocalTime> calibrated_{};  ///< when command 1 was sent

  woodenhaptics::Counts counts_{};  ///< the counters without wrap
  woodenhaptics::Pose pose_{};      ///< of counts_
  woodenhaptics::Currents held_{};  ///< the currents that were sent last
  Vec3 held_force_ = Vec3::Zero();  ///< their force, when it was last known
};

namespace woodenhaptics {

/// A WoodenHaptics, or a relative, as a scene describes it.
struct Config {
  std::string port{};  ///< as `tendond devices` names it; empty: the first free one
  WoodenHapticsDevice::Config drive{};
};

// The overloads of driver.h. `stand_in` and `make` need a model.
const Driver& driver(const Config& config);
SimulatedDevice::Config stand_in(const Config& config);
std::unique_ptr<Device> make(const Config& config, FromOutside outside);

}  // namespace woodenhaptics

}  // namespace tendon
