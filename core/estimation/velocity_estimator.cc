// SPDX-License-Identifier: Apache-2.0
#include "core/estimation/velocity_estimator.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/expect.h"

namespace tendon {
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
  count_ = std::min(count_ + 1, kWindow + 1);

  // Divisions are nearly all that this would cost: one for each sample serves all axes.
  std::array<double, kWindow + 1> rate;  // 1/s
  std::array<double, kWindow + 1> margin;
  for (std::size_t i = 1; i < count_; ++i) {
    rate[i] = 1e9 / static_cast<double>((at - now[i].at).count());
    margin[i] = resolution_ * rate[i];
  }

  for (Eigen::Index axis = 0; axis < N; ++axis) {
    // A line of slope v through the newest sample passes within `resolution` of sample i just when v lies within
    // `margin` of the slope to it: keep the intersection.
    double lowest = -std::numeric_limits<double>::infinity();
    double highest = std::numeric_limits<double>::infinity();
    double velocity = 0;
    for (std::size_t i = 1; i < count_; ++i) {
      const double slope = (position[axis] - now[i].position[axis]) * rate[i];
      if (slope < lowest || slope > highest) break;
      velocity = slope;
      lowest = std::max(lowest, slope - margin[i]);
      highest = std::min(highest, slope + margin[i]);
    }
    velocity_[axis] = velocity;
  }
  return velocity_;
}

template class VelocityEstimatorOf<1>;
template class VelocityEstimatorOf<3>;

}  // namespace tendon
