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

/// Reads a list of delays with open_delays(). It ignores lost datagrams. The column `weight` is optional.
std::vector<Weighted> samples_from_csv(const std::filesystem::path& file);

/// A list of delays for samples(FILE) and `tendon-inject import csv`. It has one row for each datagram. If the delay is
/// empty, the datagram was lost.
///
/// The header names the columns t_ms, delay_ms, dir and weight. Other columns are ignored, and times in other units are
/// converted. If there is no header, the list has one column with the delays in ms, and a blank line is an empty delay.
struct DelayList {
  TableReader table;
  TableReader::Column delay;                  ///< ms
  std::optional<TableReader::Column> t;       ///< ms
  std::optional<TableReader::Column> weight;  ///< number of occurrences
  std::optional<std::size_t> dir;             ///< up or down
};

/// Opens a list of delays and reads its first line. Throws std::runtime_error if the input is malformed. The error
/// message starts with `name`. Rejects two columns without a header, which could be a time and a delay, or one delay
/// with a decimal comma.
DelayList open_delays(std::istream& from, const std::string& name);

/// Reads a table of netem (iproute2's *.dist): integers in units of a standard deviation/8192.
std::vector<Weighted> netem_table(const std::filesystem::path& file, Duration mean, Duration deviation);

/// Sorts the values and merges equal ones.
std::vector<Weighted> merged(std::vector<Weighted> values);

}  // namespace tendon::injector
