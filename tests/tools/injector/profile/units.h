// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/time.h"

namespace tendon::injector {

/// Numbers with their units, as profiles, scenarios and traces write them. Each parse takes the whole of its text or
/// gives nothing; what the text functions write reads back as exactly the same value.

/// A finite number.
std::optional<double> parse_number(std::string_view text);
std::string number_text(double value);  ///< the shortest that reads back exactly

/// A whole number of zero or more, "64" or "0x40".
std::optional<std::uint64_t> parse_whole(std::string_view text);

/// A number with its unit (ns, us, ms, s), to the nearest nanosecond; at most a day.
std::optional<Duration> parse_duration(std::string_view text);
std::string duration_text(Duration duration);  ///< whole seconds in s, all else in ms with up to six decimals

/// `value` units of `unit_ns` each, to the nearest nanosecond; at most a day.
std::optional<Duration> to_duration(double value, double unit_ns);

/// "2%" or "0.02"; 7% is exactly the double 0.07. Not checked to be in 0…1.
std::optional<double> parse_probability(std::string_view text);
std::string probability_text(double probability);  ///< in percent

}  // namespace tendon::injector
