// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "core/base/time.h"

namespace tendon::log {

/// Writes one line with the time to std::cerr, for the operator. Control characters are escaped (`visible`,
/// protocol/wire/text.h). Each kind of line has its own limit (Rate): lines that are the same up
/// to their first quote, apart from digits, are of one kind. Never call it for each packet or from the haptic thread.
///
/// Thread-safe: yes. Realtime-safe: no.
void info(std::string_view text);
void warn(std::string_view text);
void error(std::string_view text);

/// Limits the number of lines of the same kind to kBurst, plus kLinesPerSecond.
class Rate {
 public:
  static constexpr double kBurst = 100;
  static constexpr double kLinesPerSecond = 1;

  /// Returns nothing if the line must not be written. Otherwise returns the number of lines that were refused since the
  /// last admitted line.
  std::optional<std::uint64_t> admit(LocalTime now);

 private:
  double available_ = kBurst;
  std::optional<LocalTime> last_;
  std::uint64_t refused_ = 0;
};

}  // namespace tendon::log
