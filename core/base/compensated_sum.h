// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "core/base/arithmetic.h"

namespace tendon {

/// A sum that compensates for rounding errors (Neumaier 1974). The total error is that of a single rounding for any
/// number of finite terms. After 1e8 terms of 1 µJ (28 hours at 1 kHz), the error of a plain double is 0.16 µJ, and the
/// result with float is 32 J instead of 100 J.
/// Realtime-safe: yes.
class CompensatedSum {
 public:
  CompensatedSum& operator+=(double term) noexcept {
    const double sum = sum_ + term;
    rounded_off_ += std::abs(sum_) >= std::abs(term) ? (sum_ - sum) + term : (term - sum) + sum_;
    sum_ = sum;
    return *this;
  }
  CompensatedSum& operator-=(double term) noexcept { return *this += -term; }

  double value() const noexcept { return sum_ + rounded_off_; }

 private:
  double sum_ = 0;
  double rounded_off_ = 0;
};

}  // namespace tendon
