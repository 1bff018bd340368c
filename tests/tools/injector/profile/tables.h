// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"
#include "server/tables/table_reader.h"
#include "tests/tools/injector/profile/profile.h"

namespace tendon::injector {

// Readers for the files that a profile can name. All throw std::invalid_argument with the file, the line and the
// expected format, and reject anything but a regular file.

/// Calls `take(line, where)` for each line that is not blank or a comment (#). `where` is "FILE:LINE: ".
void for_each_line(const std::filesystem::path& file, const std::string& expected,
                   const std::function<void(std::string_view, const std::string&)>& take);

/// Reads a table with two columns, LOWER_EDGE_MS and COUNT. The edges must increase. A header is allowed.
std::vector<Weighted> histogram_from_csv(const std::filesystem::path& file);

/// Reads open_delays(), without lost datagrams. The column `weight` is optional.
std::vector<Weighted> samples_from_csv(const std::filesystem::path& file);

/// For samples(FILE) and `tendon-inject import csv`: one row for each datagram, with an empty delay if it was lost. The
/// header names the columns t_ms, delay_ms, dir and weight; others are ignored, times in other units are converted.
/// Without a header there is one column with the delays in ms, and a blank line is an empty delay.
struct DelayList {
  TableReader table;
  TableReader::Column delay;                  ///< ms
  std::optional<TableReader::Column> t;       ///< ms
  std::optional<TableReader::Column> weight;  ///< number of occurrences
  std::optional<std::size_t> dir;             ///< up or down
};

/// Reads the first line. Throws std::runtime_error that begins with `name` if the input is malformed. Rejects two
/// columns without a header, which could be a time and a delay, or one delay with a decimal comma.
DelayList open_delays(std::istream& from, const std::string& name);

/// iproute2's *.dist: integers in units of a standard deviation/8192.
std::vector<Weighted> netem_table(const std::filesystem::path& file, Duration mean, Duration deviation);

std::vector<Weighted> merged(std::vector<Weighted> values);

}  // namespace tendon::injector
