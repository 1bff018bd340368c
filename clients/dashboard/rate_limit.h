// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "protocol/limits.h"

namespace tendon::dash {

/// So many things a second, and as many at once as a tenth of that, at least one:
///
///     left ← min(left + rate · Δt, max(rate / 10, 1)),      a thing takes 1 of it
///
/// Thread-safe: no. Realtime-safe: yes.
class RateLimit {
 public:
  RateLimit(double rate_hz, LocalTime now) noexcept : rate_hz_(rate_hz), left_(most()), then_(now) {}

  /// Whether one more may pass.
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
