// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "protocol/limits.h"

namespace tendon::dash {

/// A token bucket for `rate` events per second with a burst of a tenth of that, at least one:
///
///     left ← min(left + rate · Δt, max(rate / 10, 1)),      each event takes 1
///
/// Thread-safe: no. Realtime-safe: yes.
class RateLimit {
 public:
  RateLimit(double rate_hz, LocalTime now) noexcept : rate_hz_(rate_hz), left_(most()), then_(now) {}

  /// Returns whether an event may pass, and counts it.
  bool take(LocalTime now) noexcept {
    left_ = std::min(left_ + rate_hz_ * seconds(now - then_), most());
    then_ = now;
    if (left_ < 1) return false;
    left_ -= 1;
    return true;
  }

 private:
  double most() const noexcept { return std::max(rate_hz_ / 10, 1.0); }

  double rate_hz_;
  double left_;
  LocalTime then_;
};

}  // namespace tendon::dash
