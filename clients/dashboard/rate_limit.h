// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "protocol/limits.h"

namespace tendon::dash {

/// Lets `rate` things a second pass, and at most a tenth of that, but at least one, at once:
///
///     left ← min(left + rate · Δt, max(rate / 10, 1)),      a thing takes 1 of it
///
/// Thread-safe: no. Realtime-safe: yes.
class RateLimit {
 public:
  RateLimit(double rate_hz, LocalTime now) noexcept : rate_hz_(rate_hz), left_(most()), then_(now) {}

  /// True when one more may pass; it is then counted.
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
