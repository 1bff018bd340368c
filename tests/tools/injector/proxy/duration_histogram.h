// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/time.h"

namespace tendon::injector {

/// Durations in fixed memory, with 32 buckets for each power of two. Quantiles are exact below 64 ns. Otherwise, they
/// are the upper edge of a bucket and at most 1/32 too high. The maximum is exact. Negative durations count as zero.
///
/// Thread-safe: no.
class DurationHistogram {
 public:
  void observe(Duration length) noexcept;

  /// q in 0…1; zero if empty.
  Duration quantile(double q) const noexcept;
  Duration max() const noexcept { return max_; }
  std::uint64_t count() const noexcept { return count_; }

  /// `earlier`: a previous copy of this histogram. The maximum of the result is the upper edge of a bucket.
  DurationHistogram since(const DurationHistogram& earlier) const noexcept;

 private:
  static constexpr std::size_t kBucketsPerOctave = 32;
  static constexpr std::size_t kBuckets = kBucketsPerOctave * 59;  // up to 2⁶³ ns

  std::array<std::uint64_t, kBuckets> buckets_{};
  std::uint64_t count_ = 0;
  Duration max_{};
};

}  // namespace tendon::injector
