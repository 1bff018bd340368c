// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/time.h"

namespace tendon::injector {

/// How late the proxy itself was: the distribution of (left − due) in fixed memory. Quantiles are
/// exact below 64 ns and at most 1/32 too high above (32 buckets for each power of two, the upper
/// edge is returned); the maximum is exact. Negative errors count as zero.
class ReleaseError {
 public:
  void observe(Duration error) noexcept;

  /// The error that a share `q` (0…1) of the datagrams did not exceed; zero when there were none.
  Duration quantile(double q) const noexcept;
  Duration max() const noexcept { return max_; }

 private:
  static constexpr std::size_t kBucketsPerOctave = 32;
  static constexpr std::size_t kBuckets = kBucketsPerOctave * 59;  // up to 2⁶³ ns

  std::array<std::uint64_t, kBuckets> buckets_{};
  std::uint64_t count_ = 0;
  Duration max_{};
};

}  // namespace tendon::injector
