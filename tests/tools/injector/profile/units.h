// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/time.h"

namespace tendon::injector {

/// The parsers consume the whole text or return nullopt. The text functions write values that parse back exactly.

std::optional<double> parse_number(std::string_view text);
std::string number_text(double value);  ///< the shortest that parses back exactly

/// A nonnegative integer, "64" or "0x40".
std::optional<std::uint64_t> parse_whole(std::string_view text);

/// With a unit (ns, us, ms, s). The value is rounded to nanoseconds and must not exceed a day.
std::optional<Duration> parse_duration(std::string_view text);
std::string duration_text(Duration duration);  ///< whole seconds in s, all else in ms with up to six decimals

/// Returns `value` · `unit_ns`, rounded to nanoseconds, or nullopt if the result exceeds a day.
std::optional<Duration> to_duration(double value, double unit_ns);

/// "2%" or "0.02"; 7% is exactly the double 0.07. Does not check the range 0…1.
std::optional<double> parse_probability(std::string_view text);
std::string probability_text(double probability);  ///< in percent

}  // namespace tendon::injector
