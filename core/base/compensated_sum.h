// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "core/base/arithmetic.h"

namespace tendon {

/// A sum that keeps what each addition rounds off (Neumaier 1974): it is off by one rounding, however many terms it
/// has. 1e8 times 1 µJ, 28 hours at 1 kHz, is 100 J; a plain double is 0.16 µJ off, a float ends at 32 J.
///
/// Terms must be finite. Realtime-safe: yes.
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
