// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/time.h"

namespace tendon::injector {

/// How a length of time is distributed, in fixed memory: release errors, one-way delays, the timer's own lateness.
/// Quantiles are exact below 64 ns and at most 1/32 too high above (32 buckets for each power of two, the upper edge is
/// returned); the maximum is exact. Negative lengths count as zero.
///
/// Thread-safe: no.
class DurationHistogram {
 public:
  void observe(Duration length) noexcept;

  /// The length that a share `q` (0…1) of them did not exceed; zero when there were none.
  Duration quantile(double q) const noexcept;
  Duration max() const noexcept { return max_; }
  std::uint64_t count() const noexcept { return count_; }

  /// What was observed since `earlier`, an earlier copy of this one. Its maximum is the upper edge of a bucket.
  DurationHistogram since(const DurationHistogram& earlier) const noexcept;

 private:
  static constexpr std::size_t kBucketsPerOctave = 32;
  static constexpr std::size_t kBuckets = kBucketsPerOctave * 59;  // up to 2⁶³ ns

  std::array<std::uint64_t, kBuckets> buckets_{};
  std::uint64_t count_ = 0;
  Duration max_{};
};

}  // namespace tendon::injector
