// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "core/base/motion.h"
#include "core/ledger/port.h"

namespace tendon {

/// Estimates velocity from positions that an encoder has rounded.
///
/// The backward difference of counts is worthless at low speed: one 30 µm count at 1 kHz reads as
/// 30 mm/s. First-order adaptive windowing takes, per axis, the longest window whose end-to-end line
/// passes within one count of every sample in it:
///
///     v = (x(k) − x(k−n)) · r(n),        r(n) = 1 / (t(k) − t(k−n)),
///     n = max { n ≤ window : |v − (x(k) − x(k−i)) · r(i)| ≤ resolution · r(i), 0 < i < n }
///
/// so it is smooth when slow and prompt when fast, with no cut-off frequency to choose. With
/// resolution 0 (exact sensing) it is the backward difference for every motion but a straight line.
///
/// Source: Janabi-Sharifi, Hayward, Chen, "Discrete-time adaptive windowing for velocity estimation",
/// IEEE TCST 8(6), 2000 (end-fit form), with measured time stamps in place of a fixed period.
///
/// A sample costs what it has to look at: of each axis its window, but for the counts since which it has stood still.
///
/// Thread-safe: no. Realtime-safe: yes; at most N · kWindow steps per sample.
template <int N>
class VelocityEstimatorOf {
 public:
  /// Longer windows smooth slow motion more and notice a reversal later: 16 ms at 1 kHz resolves
  /// 2 mm/s with a 30 µm encoder.
  static constexpr std::size_t kWindow = 16;

  /// `resolution`: one encoder count at the handle, m; 0 = exact. Throws std::invalid_argument when it
  /// is negative or not finite.
  explicit VelocityEstimatorOf(double resolution);

  /// Takes the next sample and returns the velocity (m/s). A sample that is not finite or not newer
  /// than the one before changes nothing.
  Vec<N> observe(LocalTime at, const Vec<N>& position) noexcept;

 private:
  struct Sample {
    LocalTime at;
    Vec<N> position;
  };
  static constexpr std::size_t kSlots = 2 * kWindow;

  double resolution_;
  /// Newest first, from `newest_` on; what is newer still goes before it. When there is no more room, all that a window
  /// needs moves to the end. (A ring would cost each step a wrap for each sample.)
  std::array<Sample, kSlots> samples_{};
  std::size_t newest_ = kSlots;
  std::size_t count_ = 0;  ///< from `newest_` on, at most kWindow + 1
  /// Of each axis: how many samples just before the newest have the same position, to the bit.
  std::array<std::size_t, static_cast<std::size_t>(N)> same_{};
  Vec<N> velocity_ = Vec<N>::Zero();
};

/// Of a point in space, m and m/s; or of a handle that turns, rad and rad/s.
using VelocityEstimator = VelocityEstimatorOf<3>;

}  // namespace tendon
