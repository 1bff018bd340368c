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

/// Plays a recorded motion with its original positions and time stamps, so that engines and the whole loop can be run
/// repeatedly with the same motion. There is no force: `apply` always returns zero.
///
/// The first `read` returns the first sample. Sample i is returned tᵢ − t₀ later, using this time. There is no
/// interpolation: `read` returns a sample, or nullopt if no new sample is due. A sample that is due can be returned by
/// this `read` or the next one. A loop as fast as the recording therefore returns all samples, even with jitter. A
/// slower loop returns the newest sample that was already due in the previous `read`. The times always increase.
/// Thread-safe: no. Realtime-safe: `read` and `apply`.
class ReplayDevice final : public Device {
 public:
  struct Sample {
    Duration at{};  ///< only differences matter
    Vec3 position = Vec3::Zero();
  };
  /// kHold: keeps the last position. kRepeat: starts again after the mean interval, and jumps if the ends differ.
  using AtEnd = ScriptedMotion::Recorded::AtEnd;

  struct Config {
    std::vector<Sample> samples{};  ///< at least 2, strictly increasing, up to 10⁹ s
    AtEnd at_end = AtEnd::kHold;
    double position_resolution = 0;  ///< m; 0 = exact
  };

  /// Throws std::invalid_argument if a value is out of range, naming the field.
  explicit ReplayDevice(Config config);

  /// For motions along a line (`load_recorded_motion`): origin + x · direction / ‖direction‖. Throws
  /// std::invalid_argument if the direction is zero or the motion is longer than 10⁹ s.
  static std::vector<Sample> samples_of(const ScriptedMotion::Recorded& motion);

  const DeviceInfo& info() const noexcept override { return info_; }
  std::optional<PositionSample> read(LocalTime now) noexcept override;
  Vec3 apply(const Vec3& force) noexcept override;

 private:
  std::uint64_t due_at(Duration since_start) const noexcept;
  PositionSample sample(std::uint64_t number) const noexcept;

  Config config_;
  DeviceInfo info_;
  Duration round_;
  std::optional<LocalTime> start_{};
  // Numbers continue to increase when the samples are repeated.
  std::uint64_t next_ = 0;        ///< not yet returned or skipped
  std::uint64_t due_before_ = 0;  ///< due at the last `read`
};

const Driver& driver(const ReplayDevice::Config& config);
SimulatedDevice::Config stand_in(const ReplayDevice::Config& config);
std::unique_ptr<Device> make(const ReplayDevice::Config& config, FromOutside outside);

}  // namespace tendon
