// SPDX-License-Identifier: Apache-2.0
#include "core/estimation/velocity_estimator.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/base/expect.h"

namespace tendon {
namespace {

/// Compares bits, because −0 − 0 and 0 − 0 differ.
bool is_same(double a, double b) noexcept { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }

}  // namespace

template <int N>
VelocityEstimatorOf<N>::VelocityEstimatorOf(double resolution) : resolution_(resolution) {
  expect_not_negative(resolution, "resolution");
}

template <int N>
Vec<N> VelocityEstimatorOf<N>::observe(LocalTime at, const Vec<N>& position) noexcept {
  if (!position.allFinite()) return velocity_;
  if (count_ > 0 && at <= samples_[newest_].at) return velocity_;
  if (newest_ == 0) {
    std::copy_backward(samples_.begin(), samples_.begin() + kWindow, samples_.end());
    newest_ = kSlots - kWindow;
  }
  const Sample* const now = &samples_[--newest_];
  samples_[newest_] = {at, position};
  for (Eigen::Index axis = 0; axis < N; ++axis) {
    std::size_t& same = same_[static_cast<std::size_t>(axis)];
    const bool stands = count_ > 0 && is_same(position[axis], now[1].position[axis]);
    same = stands ? same + 1 : 0;
  }
  count_ = std::min(count_ + 1, kWindow + 1);

  // All axes share one division per sample, because divisions are slow.
  std::array<double, kWindow + 1> rate;  // 1/s
  std::size_t known = 1;                 // number of valid entries of `rate`
  const auto rate_to = [&](const Sample& past) { return 1e9 / static_cast<double>((at - past.at).count()); };

  for (Eigen::Index axis = 0; axis < N; ++axis) {
    // Samples at the same position have the slope 0. Only the oldest one is checked, because its r(i) is the smallest.
    const std::size_t first = std::max<std::size_t>(same_[static_cast<std::size_t>(axis)], 1);
    if (first < count_) {
      for (; known < first; ++known) rate[known] = rate_to(now[known]);
    }
    // The line of slope v through the newest sample passes within `resolution` of sample i if and only if v is within
    // resolution · r(i) of the slope to it. Keep the intersection of these ranges.
    const double x = position[axis];
    const double resolution = resolution_;
    double lowest = -std::numeric_limits<double>::infinity();
    double highest = std::numeric_limits<double>::infinity();
    double velocity = 0;
    for (std::size_t i = first; i < count_; ++i) {
      if (i == known) rate[known++] = rate_to(now[i]);
      const double slope = (x - now[i].position[axis]) * rate[i];
      if (slope < lowest || slope > highest) break;
      velocity = slope;
      const double margin = resolution * rate[i];
      lowest = std::max(lowest, slope - margin);
      highest = std::min(highest, slope + margin);
    }
    velocity_[axis] = velocity;
  }
  return velocity_;
}

template class VelocityEstimatorOf<1>;
template class VelocityEstimatorOf<3>;

}  // namespace tendon
