// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/proxy/duration_histogram.h"

#include <algorithm>
#include <bit>

namespace tendon::injector {
namespace {

std::size_t bucket_of(std::uint64_t ns) noexcept {
  if (ns < 64) return ns;
  const auto shift = static_cast<std::size_t>(std::bit_width(ns)) - 6;
  return shift * 32 + (ns >> shift);
}

std::uint64_t upper_edge(std::size_t bucket) noexcept {
  if (bucket < 64) return bucket;
  const std::size_t shift = bucket / 32 - 1;
  return ((bucket - shift * 32 + 1) << shift) - 1;
}

}  // namespace

void DurationHistogram::observe(Duration length) noexcept {
  const Duration positive = std::max(length, Duration::zero());
  ++buckets_[bucket_of(static_cast<std::uint64_t>(positive.count()))];
  ++count_;
  max_ = std::max(max_, positive);
}

DurationHistogram DurationHistogram::since(const DurationHistogram& earlier) const noexcept {
  DurationHistogram result;
  for (std::size_t i = 0; i < kBuckets; ++i) {
    result.buckets_[i] = buckets_[i] - earlier.buckets_[i];
    result.count_ += result.buckets_[i];
    if (result.buckets_[i] > 0) result.max_ = std::min(max_, Duration(static_cast<std::int64_t>(upper_edge(i))));
  }
  return result;
}

Duration DurationHistogram::quantile(double q) const noexcept {
  const double wanted = q * static_cast<double>(count_);
  std::uint64_t seen = 0;
  for (std::size_t i = 0; i < kBuckets; ++i) {
    seen += buckets_[i];
    if (seen > 0 && static_cast<double>(seen) >= wanted) {
      return std::min(max_, Duration(static_cast<std::int64_t>(upper_edge(i))));
    }
  }
  return Duration::zero();
}

}  // namespace tendon::injector
