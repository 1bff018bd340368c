// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "devices/device.h"
#include "devices/driver.h"
#include "devices/simulated/scripted_motion.h"
#include "devices/simulated/simulated_device.h"

namespace tendon {

/// A hand that was recorded, as a device: the positions are those of the recording, to the last bit, with its time
/// stamps. It exerts no force: `apply` returns zero, whatever is asked for, so engines and the whole loop run on the
/// same motion again and again, and nobody is pushed.
///
/// The first `read` is the instant of the first sample; sample i is due tᵢ − t₀ later, and its `at` says so. Nothing is
/// interpolated: a `read` gives one sample or, when none has become due since the last one, none. One that is due waits
/// for the next `read`, but for no second one: so a loop as fast as the recording misses none although neither is
/// punctual, and a slower loop gets the newest that was due one read ago. The times of what it gives always increase.
///
/// Thread-safe: no. Realtime-safe: `read` and `apply`.
class ReplayDevice final : public Device {
 public:
  struct Sample {
    Duration at{};  ///< since whenever; only differences count
    Vec3 position = Vec3::Zero();
  };
  /// kHold: the hand stays at the last sample, and each later `read` finds it there, now. kRepeat: from the first
  /// sample again, one mean interval after the last; the position jumps when the ends differ.
  using AtEnd = ScriptedMotion::Recorded::AtEnd;

  struct Config {
    std::vector<Sample> samples{};  ///< 2 or more, strictly increasing in time, 10⁹ s at most
    AtEnd at_end = AtEnd::kHold;
    double position_resolution = 0;  ///< m, one count of the device that was recorded; 0 = exact
  };

  /// Throws std::invalid_argument naming the field, its value and what was expected.
  explicit ReplayDevice(Config config);

  /// The samples of a motion along a line, from a CSV file (`load_recorded_motion`): origin + x · direction /
  /// ‖direction‖. Throws the same when the line has no direction, or the motion is longer than 10⁹ s.
  static std::vector<Sample> samples_of(const ScriptedMotion::Recorded& motion);

  const DeviceInfo& info() const noexcept override { return info_; }
  std::optional<PositionSample> read(LocalTime now) noexcept override;
  Vec3 apply(const Vec3& force) noexcept override;

 private:
  std::uint64_t due_at(Duration since_start) const noexcept;
  PositionSample sample(std::uint64_t number) const noexcept;

  Config config_;
  DeviceInfo info_;
  Duration round_;  ///< from the first sample to itself, when they repeat
  std::optional<LocalTime> start_{};
  // Samples are counted on from round to round.
  std::uint64_t next_ = 0;        ///< the first that has not been given, or left out
  std::uint64_t due_before_ = 0;  ///< how many were due at the last read
};

// The row of this driver: see driver.h.
const Driver& driver(const ReplayDevice::Config& config);
SimulatedDevice::Config stand_in(const ReplayDevice::Config& config);
std::unique_ptr<Device> make(const ReplayDevice::Config& config, FromOutside outside);

}  // namespace tendon
