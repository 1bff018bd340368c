// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <utility>

#include "core/base/time.h"

namespace tendon {

/// Logs the first occurrence of a problem immediately, then the number of occurrences once per minute.
class TroubleSum {
 public:
  static constexpr Duration kPeriod = std::chrono::minutes(1);

  struct Due {
    std::uint64_t count;
    bool of_a_minute;  ///< otherwise since the last call
  };

  /// Adds the number of occurrences since the last call. Returns the count to log now, if any.
  std::optional<Due> add(LocalTime now, std::uint64_t more) {
    const bool of_a_minute = sum_ > 0;
    sum_ += more;
    if (sum_ == 0 || (told_ && now - *told_ < kPeriod)) return std::nullopt;
    told_ = now;
    return Due{std::exchange(sum_, 0), of_a_minute};
  }

 private:
  std::uint64_t sum_ = 0;
  std::optional<LocalTime> told_;
};

}  // namespace tendon
