// SPDX-License-Identifier: Apache-2.0
#include "core/estimation/velocity_estimator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace tendon {

VelocityEstimator::VelocityEstimator(double resolution) : resolution_(resolution) {
  if (!(std::isfinite(resolution) && resolution >= 0)) {
    throw std::invalid_argument("resolution must be finite and not negative, got " + std::to_string(resolution));
  }
}

Vec3 VelocityEstimator::observe(LocalTime at, const Vec3& position) noexcept {
  if (!position.allFinite()) return velocity_;
  if (count_ > 0 && at <= back(0).at) return velocity_;
  ++newest_;
  samples_[newest_ % kSlots] = {at, position};
  count_ = std::min(count_ + 1, kWindow + 1);

  for (int axis = 0; axis < 3; ++axis) {
    // A line of slope v through the newest sample passes within `resolution` of sample i just when v
    // lies in [difference − resolution, difference + resolution] / elapsed: keep the intersection.
    double lowest = -std::numeric_limits<double>::infinity();
    double highest = std::numeric_limits<double>::infinity();
    double velocity = 0;
    for (std::size_t i = 1; i < count_; ++i) {
      const double elapsed = seconds(at - back(i).at);
      const double difference = position[axis] - back(i).position[axis];
      const double slope = difference / elapsed;
      if (slope < lowest || slope > highest) break;
      velocity = slope;
      lowest = std::max(lowest, (difference - resolution_) / elapsed);
      highest = std::min(highest, (difference + resolution_) / elapsed);
    }
    velocity_[axis] = velocity;
  }
  return velocity_;
}

}  // namespace tendon
