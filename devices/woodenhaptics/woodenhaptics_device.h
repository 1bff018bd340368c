// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "core/exchange/counter.h"
#include "devices/device.h"
#include "devices/driver.h"
#include "devices/simulated/simulated_device.h"
#include "devices/usb/pipe.h"
#include "devices/woodenhaptics/kinematics.h"
#include "devices/woodenhaptics/report.h"

namespace tendon {

/// A WoodenHaptics, or a relative with the same board and firmware, from the plug to the force as one state machine
/// that `read` turns, over a `usb::Pipe` with interrupt endpoints:
///
///     kAbsent ──plugged in──▶ kOpening ──answers──▶ kUnhomed ──calibrated──▶ kHomed
///                                                      ▲                       │
///                     the calibrate button, or lost count over 100 ms ─────────┘
///     any ──unplugged, a transfer failed, or silent for 100 ms──▶ kAbsent, and all the way again
///
/// Calibrating: the operator holds the arm in its calibration pose (page) and presses the board's button, which the
/// firmware remembers. Ten reports in a row have to say so; then command 1 sets the counters, and ten in a row have to
/// show them. A board that has been calibrated before is not believed to be: nobody knows whether it was reset since.
///
/// The firmware answers each report with one, and takes the newest. At most two are under way without an answer, which
/// is what 1 kHz takes on a full-speed bus; zero is sent at once, whatever is under way. Currents other than zero only
/// in kHomed, and only while a report came in the last 10 ms. Counters that moved further than a hand can are not
/// believed.
///
/// **Watchdog.** The firmware disables the amplifiers 0.5 s after the last report of the right length, whatever becomes
/// of the host; it is armed by the first one. So DeviceInfo has 0.5 s, and `apply` counts on it: currents that were
/// sent so long ago are over.
///
/// Positions are relative to the middle of the workspace, in the frame of kinematics.h. A sample is some 1 ms older
/// than its `at`, that of `read`. Button 0: the switch at the tip, where there is one.
///
/// Thread-safe: `stats` and `state` from any thread, the rest from one. Realtime-safe: `read` and `apply`.
class WoodenHapticsDevice final : public Device {
 public:
  /// mbed's own example number, which USBHID has without another: other gadgets may have it too.
  static constexpr usb::Id kId{0x1234, 0x0006};
  static constexpr std::uint8_t kIn = 0x81;  ///< EP1 of the LPC1768, 64 bytes, each ms
  static constexpr std::uint8_t kOut = 0x01;
  static constexpr Duration kWatchdog = std::chrono::milliseconds(500);

  struct Config {
    const woodenhaptics::Model* model = nullptr;  ///< of `models()`
    /// A, of each motor; above 0, at most the model's full scale. The published host clamps here too, because the
    /// smaller of the amplifiers it knows (ESCON 24/4) give no more for long.
    double max_current = 2.0;
  };

  /// Of all connections so far.
  struct Stats {
    std::uint64_t reports = 0;              ///< believed
    std::uint64_t unknown = 0;              ///< packets that are no report
    std::uint64_t implausible = 0;          ///< reports with counters where no hand can have moved them
    std::uint64_t unanswered = 0;           ///< times when an answer did not come in time, and was asked for again
    std::uint64_t silences = 0;             ///< times when the device was given up as silent
    std::uint64_t lost_counts = 0;          ///< times when the counters were given up as having lost count
    std::uint64_t failed_calibrations = 0;  ///< times when the counters were not set as they were told
  };

  /// Takes the pipe to a device. Throws std::invalid_argument naming the field, its value and what was expected.
  WoodenHapticsDevice(const Config& config, std::unique_ptr<usb::Pipe> pipe);

  /// What a device of this model says of itself.
  static DeviceInfo info_of(const woodenhaptics::Model& model);

  const DeviceInfo& info() const noexcept override { return info_; }
  State state() const noexcept override { return state_.load(std::memory_order_relaxed); }
  std::optional<PositionSample> read(LocalTime now) noexcept override;
  Vec3 apply(const Vec3& force) noexcept override;

  Stats stats() const noexcept;

 private:
  void enter(State state) noexcept;
  void follow_connection() noexcept;
  void receive() noexcept;
  void believe(const woodenhaptics::Report& report) noexcept;
  void home(const woodenhaptics::Report& report) noexcept;
  bool near_calibration(const woodenhaptics::Report& report) const noexcept;
  woodenhaptics::Counts steps_to(const woodenhaptics::Report& report) const noexcept;
  bool plausible(const woodenhaptics::Counts& steps) const noexcept;
  void advance() noexcept;
  void give_up() noexcept;
  bool may_write() const noexcept;
  void write(const woodenhaptics::Currents& wanted) noexcept;

  woodenhaptics::Model model_;
  double most_ma_;
  Vec3 counts_per_radian_;  ///< of the bodies, above 0
  DeviceInfo info_;
  std::unique_ptr<usb::Pipe> pipe_;
  std::atomic<State> state_{State::kAbsent};
  std::uint32_t connection_ = 0;
  LocalTime now_{};  ///< of the last `read`

  // Requests and answers
  int under_way_ = 0;                              ///< sent since the last answer
  LocalTime asked_{};                              ///< when the first of these was sent,
  LocalTime told_{};                               ///< and the last report of all
  LocalTime heard_{};                              ///< when the last report came,
  LocalTime believed_{};                           ///< and the last one that was believed,
  std::optional<woodenhaptics::Report> newest_{};  ///< which is this one
  bool fresh_ = false;                             ///< it came in this `read`

  // Calibrating
  int asking_replies_ = 0;                 ///< in a row that say that the button was pressed
  int set_replies_ = 0;                    ///< in a row that have the counters as they were set
  std::optional<LocalTime> calibrated_{};  ///< when command 1 was sent

  woodenhaptics::Counts counts_{};  ///< without wrap
  woodenhaptics::Pose pose_{};      ///< of these
  woodenhaptics::Currents held_{};  ///< what the device has, as far as we know,
  Vec3 held_force_ = Vec3::Zero();  ///< and the force of that when it was last known

  Counter reports_;
  Counter unknown_;
  Counter implausible_;
  Counter unanswered_;
  Counter silences_;
  Counter lost_counts_;
  Counter failed_calibrations_;
};

namespace woodenhaptics {

/// A WoodenHaptics, or a relative, in a scene.
struct Config {
  std::string port{};  ///< as `tendond devices` names it; empty: the first free one
  WoodenHapticsDevice::Config drive{};
};

// The row of this driver: see driver.h. `stand_in` and `make` want a model.
const Driver& driver(const Config& config);
SimulatedDevice::Config stand_in(const Config& config);
std::unique_ptr<Device> make(const Config& config, FromOutside outside);

}  // namespace woodenhaptics

}  // namespace tendon
