// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"
#include "tests/tools/injector/profile/profile.h"

namespace tendon::injector {

// The files that a profile can name. All throw std::invalid_argument with the file, the line and what was expected, and
// refuse a file that is not a regular one.

/// Calls `take(line, where)` for each line of a file that holds more than blanks and a comment (#). `where` is
/// "FILE:LINE: ".
void for_each_line(const std::filesystem::path& file, const std::string& expected,
                   const std::function<void(std::string_view, const std::string&)>& take);

/// VALUE_MS and, after a comma, a semicolon, tabs or blanks, WEIGHT; the weight may be left out if `weightless`.
std::vector<Weighted> table_from_csv(const std::filesystem::path& file, bool weightless);

/// A table of netem (iproute2's *.dist): whole numbers in units of a standard deviation/8192.
std::vector<Weighted> netem_table(const std::filesystem::path& file, Duration mean, Duration deviation);

/// In order, each value once.
std::vector<Weighted> merged(std::vector<Weighted> values);

}  // namespace tendon::injector
