// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "core/base/motion.h"
#include "core/ledger/port.h"

namespace tendon {

/// Estimates the velocity using positions that were rounded by an encoder. The backward difference cannot be used at
/// low speed, because the resolution is 30 mm/s for counts of 30 µm at 1 kHz. First-order adaptive windowing takes, per
/// axis, the longest window in which the line between its ends passes within one count of every sample:
///     v = (x(k) − x(k−n)) · r(n),        r(n) = 1 / (t(k) − t(k−n)),
///     n = max { n ≤ window : |v − (x(k) − x(k−i)) · r(i)| ≤ resolution · r(i), 0 < i < n }
/// The estimate is smooth at low speed and fast at high speed, without a cut-off frequency. With resolution 0 (exact
/// positions) it is the backward difference, except on a straight line. The cost of a sample is proportional to the
/// length of the window of each axis. Samples at which the axis did not move are not counted.
///
/// Source: Janabi-Sharifi, Hayward, Chen, "Discrete-time adaptive windowing for velocity estimation", IEEE TCST 8(6),
/// 2000 (end-fit form), with measured time stamps in place of a fixed period. Error: core/PROOFS.md, "Velocity
/// estimator".
/// Thread-safe: no. Realtime-safe: yes; at most N · kWindow steps per sample.
template <int N>
class VelocityEstimatorOf {
 public:
  /// If this is increased, the estimate is smoother at low speed, but a reversal is detected later. 2 mm/s for 30 µm at
  /// 1 kHz.
  static constexpr std::size_t kWindow = 16;

  /// `resolution`: encoder count at the handle, m; 0 = exact. Throws std::invalid_argument if negative or not finite.
  explicit VelocityEstimatorOf(double resolution);

  /// Returns the velocity in m/s. The sample is ignored if it is not finite or not newer.
  Vec<N> observe(LocalTime at, const Vec<N>& position) noexcept;

 private:
  struct Sample {
    LocalTime at;
    Vec<N> position;
  };
  static constexpr std::size_t kSlots = 2 * kWindow;

  double resolution_;
  /// The samples from new to old, starting at `newest_`. New samples are inserted at the front. If there is no room,
  /// the samples of one window are moved to the end. (In a ring buffer, each access would have to wrap.)
  std::array<Sample, kSlots> samples_{};
  std::size_t newest_ = kSlots;
  std::size_t count_ = 0;  ///< number of samples starting at `newest_`, up to kWindow + 1
  /// Per axis, the number of samples before the newest with the identical position.
  std::array<std::size_t, static_cast<std::size_t>(N)> same_{};
  Vec<N> velocity_ = Vec<N>::Zero();
};

/// For a point in space, in m and m/s, or a rotation, in rad and rad/s.
using VelocityEstimator = VelocityEstimatorOf<3>;

}  // namespace tendon
