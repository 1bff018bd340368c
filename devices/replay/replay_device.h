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

/// A recorded hand, played as a device: it gives the positions of the recording, bit for bit, with their time stamps.
/// It exerts no force: `apply` always returns zero. So engines and the whole loop run on the same motion again and
/// again, and nobody is pushed.
///
/// The first `read` is the instant of the first sample; sample i is due tᵢ − t₀ later, and its `at` is that time.
/// Nothing is interpolated: a `read` gives one sample, or none when no sample has become due since the last `read`. A
/// sample that is due waits for one `read`, not for a second. So a loop as fast as the recording misses no sample,
/// although neither is punctual, and a slower loop gets the newest sample that was due one `read` ago. The times of the
/// samples always increase.
///
/// Thread-safe: no. Realtime-safe: `read` and `apply`.
class ReplayDevice final : public Device {
 public:
  struct Sample {
    Duration at{};  ///< since any instant; only differences count
    Vec3 position = Vec3::Zero();
  };
  /// kHold: the hand stays at the last sample; each later `read` finds it there, with the time of the `read`. kRepeat:
  /// the first sample follows again, one mean interval after the last; the position jumps when the ends differ.
  using AtEnd = ScriptedMotion::Recorded::AtEnd;

  struct Config {
    std::vector<Sample> samples{};  ///< 2 or more, strictly increasing in time, 10⁹ s at most
    AtEnd at_end = AtEnd::kHold;
    double position_resolution = 0;  ///< m, one count of the recorded device; 0 = exact
  };

  /// Throws std::invalid_argument naming the field, its value and what was expected.
  explicit ReplayDevice(Config config);

  /// The samples of a motion along a line, from a CSV file (`load_recorded_motion`): origin + x · direction /
  /// ‖direction‖. Throws std::invalid_argument when the line has no direction, or the motion is longer than 10⁹ s.
  static std::vector<Sample> samples_of(const ScriptedMotion::Recorded& motion);

  const DeviceInfo& info() const noexcept override { return info_; }
  std::optional<PositionSample> read(LocalTime now) noexcept override;
  Vec3 apply(const Vec3& force) noexcept override;

 private:
  std::uint64_t due_at(Duration since_start) const noexcept;
  PositionSample sample(std::uint64_t number) const noexcept;

  Config config_;
  DeviceInfo info_;
  Duration round_;  ///< from the first sample to its next return, when the samples repeat
  std::optional<LocalTime> start_{};
  // The numbers of samples go on increasing from round to round.
  std::uint64_t next_ = 0;        ///< the first sample that was neither given nor skipped
  std::uint64_t due_before_ = 0;  ///< how many were due at the last read
};

// The row of this driver: see driver.h.
const Driver& driver(const ReplayDevice::Config& config);
SimulatedDevice::Config stand_in(const ReplayDevice::Config& config);
std::unique_ptr<Device> make(const ReplayDevice::Config& config, FromOutside outside);

}  // namespace tendon
