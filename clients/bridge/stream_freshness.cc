// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/stream_freshness.h"

#include <algorithm>
#include <chrono>

namespace tendon::bridge {
namespace {

constexpr Duration kOneBurst = std::chrono::milliseconds(10);
constexpr Duration kLeastStale = std::chrono::milliseconds(100);
constexpr Duration kMostStale = std::chrono::seconds(2);
constexpr std::size_t kLeastGaps = 2;  // between three
constexpr int kStaleGaps = 10;

}  // namespace

void StreamFreshness::heard(LocalTime now) {
  newest_ = now;
  if (any_ && now - counted_ < kOneBurst) return;
  if (any_) gaps_[count_++ % kGaps] = now - counted_;
  counted_ = now;
  any_ = true;
}

LocalTime StreamFreshness::until() const {
  if (count_ < kLeastGaps) return LocalTime::max();
  std::array<Duration, kGaps> sorted = gaps_;
  const std::size_t known = std::min(count_, kGaps);
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(known / 2);
  std::nth_element(sorted.begin(), middle, sorted.begin() + static_cast<std::ptrdiff_t>(known));
  if (*middle > kMostStale) return LocalTime::max();
  return newest_ + std::clamp(kStaleGaps * *middle, kLeastStale, kMostStale);
}

}  // namespace tendon::bridge
