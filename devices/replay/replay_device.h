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

/// Plays back a recorded motion as a device. It returns the recorded positions bit for bit, with their time stamps. It
/// renders no force: `apply` always returns zero. Engines and the whole loop can thus run on the same motion
/// repeatedly.
///
/// The first `read` is the time of the first sample; sample i is due tᵢ − t₀ later, and `at` is that time. There is no
/// interpolation: `read` returns one sample, or nullopt if none has become due since the last `read`. A due sample
/// waits for one `read` but not for a second. A loop as fast as the recording therefore misses no sample despite
/// jitter, and a slower loop gets the newest sample that was due one `read` ago. Sample times always increase.
///
/// Thread-safe: no. Realtime-safe: `read` and `apply`.
class ReplayDevice final : public Device {
 public:
  struct Sample {
    Duration at{};  ///< relative to any time; only differences matter
    Vec3 position = Vec3::Zero();
  };
  /// kHold: the hand stays at the last sample; later calls of `read` return it with their own time. kRepeat: the first
  /// sample follows one mean interval after the last; the position jumps if the ends differ.
  using AtEnd = ScriptedMotion::Recorded::AtEnd;

  struct Config {
    std::vector<Sample> samples{};  ///< 2 or more, strictly increasing in time, 10⁹ s at most
    AtEnd at_end = AtEnd::kHold;
    double position_resolution = 0;  ///< m, one encoder count of the recorded device; 0 = exact
  };

  /// Throws std::invalid_argument, naming the field, its value and the expected range.
  explicit ReplayDevice(Config config);

  /// Returns the samples of a motion along a line from a CSV file (`load_recorded_motion`): origin + x · direction /
  /// ‖direction‖. Throws std::invalid_argument if the direction is zero or the motion is longer than 10⁹ s.
  static std::vector<Sample> samples_of(const ScriptedMotion::Recorded& motion);

  const DeviceInfo& info() const noexcept override { return info_; }
  std::optional<PositionSample> read(LocalTime now) noexcept override;
  Vec3 apply(const Vec3& force) noexcept override;

 private:
  std::uint64_t due_at(Duration since_start) const noexcept;
  PositionSample sample(std::uint64_t number) const noexcept;

  Config config_;
  DeviceInfo info_;
  Duration round_;  ///< from the first sample to its next repetition
  std::optional<LocalTime> start_{};
  // Sample numbers continue to increase from one repetition to the next.
  std::uint64_t next_ = 0;        ///< the first sample that was neither returned nor skipped
  std::uint64_t due_before_ = 0;  ///< number of samples that were due at the last read
};

// The overloads of driver.h.
const Driver& driver(const ReplayDevice::Config& config);
SimulatedDevice::Config stand_in(const ReplayDevice::Config& config);
std::unique_ptr<Device> make(const ReplayDevice::Config& config, FromOutside outside);

}  // namespace tendon
