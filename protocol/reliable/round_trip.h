// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>

#include "core/base/time.h"

namespace tendon {

/// The smoothed round trip and the retransmission timeout (RFC 6298):
///
///     first sample R:  SRTT = R, RTTVAR = R/2
///     then:            RTTVAR += (|SRTT − R| − RTTVAR)/4,  SRTT += (R − SRTT)/8
///     timeout:         max(minimum, SRTT + 4 RTTVAR)
class RoundTrip {
 public:
  /// RFC 6298 uses 1 s. 100 ms are sufficient after a handshake, because haptics requires a shorter round trip.
  static constexpr Duration kFirstTimeout = std::chrono::milliseconds(100);

  void observe(Duration sample) noexcept {
    newest_ = sample;
    if (!known_) {
      smoothed_ = sample;
      variation_ = sample / 2;
      known_ = true;
      return;
    }
    const Duration error = sample - smoothed_;
    variation_ += (std::chrono::abs(error) - variation_) / 4;
    smoothed_ += error / 8;
  }

  Duration newest() const noexcept { return newest_; }
  Duration smoothed() const noexcept { return smoothed_; }
  Duration variation() const noexcept { return variation_; }
  Duration timeout(Duration minimum) const noexcept {
    return std::max(minimum, known_ ? smoothed_ + 4 * variation_ : kFirstTimeout);
  }

 private:
  bool known_ = false;
  Duration newest_{};
  Duration smoothed_{};
  Duration variation_{};
};

}  // namespace tendon
