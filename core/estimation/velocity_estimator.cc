// SPDX-License-Identifier: Apache-2.0
#include "core/estimation/velocity_estimator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace tendon {
namespace {

/// Samples whose divisions are done before the comparisons that may end the window. A fast hand leaves it after one or
/// two, and the others were for nothing.
constexpr int kAhead = 4;
static_assert(VelocityEstimator::kWindow % kAhead == 0);

}  // namespace

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

  // Divisions are nearly all that this costs, and a processor does two at once where numbers lie side by side.
  std::array<double, kWindow> elapsed;
  std::array<std::array<double, kWindow>, 3> difference;
  for (std::size_t i = 0; i < kWindow; ++i) {
    const Sample& before = back(i + 1);  // beyond `count_` there are zeros
    elapsed[i] = seconds(at - before.at);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto nth = static_cast<Eigen::Index>(axis);
      difference[axis][i] = position[nth] - before.position[nth];
    }
  }

  for (std::size_t axis = 0; axis < 3; ++axis) {
    // A line of slope v through the newest sample passes within `resolution` of sample i just when v
    // lies in [difference − resolution, difference + resolution] / elapsed: keep the intersection.
    double lowest = -std::numeric_limits<double>::infinity();
    double highest = std::numeric_limits<double>::infinity();
    double velocity = 0;
    bool within = true;
    for (std::size_t first = 0; within && first + 1 < count_; first += kAhead) {
      using Several = Eigen::Array<double, kAhead, 1>;
      const Several ways = Several::Map(difference[axis].data() + first);
      const Several spans = Several::Map(elapsed.data() + first);
      const Several slopes = ways / spans;
      const Several lows = (ways - resolution_) / spans;
      const Several highs = (ways + resolution_) / spans;
      for (std::size_t i = 0; i < kAhead && first + i + 1 < count_; ++i) {
        const auto nth = static_cast<Eigen::Index>(i);
        within = slopes[nth] >= lowest && slopes[nth] <= highest;
        if (!within) break;
        velocity = slopes[nth];
        lowest = std::max(lowest, lows[nth]);
        highest = std::min(highest, highs[nth]);
      }
    }
    velocity_[static_cast<Eigen::Index>(axis)] = velocity;
  }
  return velocity_;
}

}  // namespace tendon
