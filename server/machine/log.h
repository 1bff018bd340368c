// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "core/base/time.h"

namespace tendon::log {

/// Writes a line with the time to std::cerr. Control characters are escaped (`visible` in protocol/wire/text.h). The
/// rate is limited separately for each kind of message (Rate). Two messages are of the same kind if they only differ in
/// digits and in the text after the first quote. Do not call this for each packet or from the haptic thread.
/// Thread-safe: yes. Realtime-safe: no.
void info(std::string_view text);
void warn(std::string_view text);
void error(std::string_view text);

/// Allows kBurst similar messages, plus kLinesPerSecond.
class Rate {
 public:
  static constexpr double kBurst = 100;
  static constexpr double kLinesPerSecond = 1;

  /// Returns nothing if the message must be dropped, or else the number dropped since the last one was written.
  std::optional<std::uint64_t> admit(LocalTime now);

 private:
  double available_ = kBurst;
  std::optional<LocalTime> last_;
  std::uint64_t refused_ = 0;
};

}  // namespace tendon::log
