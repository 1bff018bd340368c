// SPDX-License-Identifier: Apache-2.0
#include "core/control/adjusting_output_limiter.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace tendon {

void check_longest_hold(Duration longest_hold) {
  if (longest_hold <= Duration::zero()) {
    throw std::invalid_argument("longest hold must be above zero, got " + std::to_string(longest_hold.count()) + " ns");
  }
}

AdjustingOutputLimiter::AdjustingOutputLimiter(const Config& config)
    : coulomb_(config.friction.coulomb), viscous_per_hold_(config.friction.viscous / seconds(config.longest_hold)) {
  check_longest_hold(config.longest_hold);
}

double AdjustingOutputLimiter::permitted(double energy) const noexcept {
  // max(E, 0) written so that a NaN energy permits friction only.
  return coulomb_ + (energy > 0 ? 2 * std::sqrt(viscous_per_hold_ * energy) : 0.0);
}

}  // namespace tendon
