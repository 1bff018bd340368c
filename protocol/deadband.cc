// SPDX-License-Identifier: Apache-2.0
#include "protocol/deadband.h"

#include <algorithm>
#include <stdexcept>

namespace tendon {

Deadband::Deadband(const Config& config) : config_(config) {
  if (!(config.share >= 0 && config.share <= 1)) throw std::invalid_argument("deadband: share must be within 0 to 1");
  if (!(config.floor >= 0)) throw std::invalid_argument("deadband: floor must not be negative");
  if (config.longest_silence <= Duration::zero()) {
    throw std::invalid_argument("deadband: longest_silence must be positive");
  }
}

bool Deadband::passes(LocalTime now, const Vec3& value) noexcept {
  const bool imperceptible =
      sent_ && now - sent_->at < config_.longest_silence &&
      (value - sent_->value).norm() <= std::max(config_.share * sent_->value.norm(), config_.floor);
  if (imperceptible) return false;  // a value that is not a number is none of these, and passes
  sent_ = {now, value};
  return true;
}

}  // namespace tendon
