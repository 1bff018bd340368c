// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/base/expect.h"
#include "core/base/time.h"

namespace tendon {

/// Limits a rate to one per `interval` (the generic cell rate algorithm of ATM, ITU-T I.371).
class Pace {
 public:
  /// Up to `burst`/`interval` can be sent at once after a pause. Throws std::invalid_argument if `burst` is negative.
  Pace(Duration interval, Duration burst) : interval_(interval), burst_(burst) {
    expect_not_negative(seconds(burst), "burst_s");
  }

  LocalTime next() const noexcept { return next_; }
  /// Returns false if the rate is exceeded. If `count` are sent at once, the next ones must wait for longer.
  bool pass(LocalTime now, std::int64_t count = 1) noexcept {
    if (next_ > now) return false;
    next_ = std::max(next_, now - burst_) + count * interval_;
    return true;
  }

 private:
  Duration interval_;
  Duration burst_;
  LocalTime next_{};
};

}  // namespace tendon
