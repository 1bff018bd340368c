// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <ostream>
#include <stdexcept>
#include <string>
#include <vector>

namespace tendon::lab {

/// `tendon-report`: what some recorded runs come down to, side by side.
struct ReportOptions {
  std::vector<std::filesystem::path> recordings = {};  ///< one or more
  /// One for each recording. Left out: "limiter on" or "limiter off", as the recorded steps show.
  std::vector<std::string> labels = {};
  std::optional<std::filesystem::path> picture = {};  ///< .svg or .png
  /// The devices that are shown. If this is empty, all devices are shown if there is enough room.
  std::vector<std::string> devices = {};
  bool json = false;  ///< one object for each device of each recording instead of the table
  /// Throws std::runtime_error after the report if a device breaks the limiter's promise, even if it has no column. The
  /// message contains the name and the energy of the first such device.
  bool check = false;
};

/// Throws std::invalid_argument unless there are recordings, and labels for all of them or none.
void check(const ReportOptions& options);

/// The maximum number of columns in a table.
inline constexpr std::size_t kMostColumns = 6;

/// Reads the recordings, writes the table (or JSON) to `out`, and draws the picture. Each device of each recording has a
/// column. If there are more than kMostColumns (kMostDrawings in the picture), the devices that broke the promise are
/// shown first, and the number of the other devices is printed.
///
/// If a recording is truncated or damaged, the valid part is used, and the report contains a note. Throws
/// std::invalid_argument if the options are not valid, before anything is read. Throws std::runtime_error if a
/// recording cannot be read, has no steps or has no such device (in this case nothing has been written), if the picture
/// cannot be drawn, or if `check` fails.
void report(const ReportOptions& options, std::ostream& out);

/// What `check` throws: `account` of that recording was `least` J at its lowest.
std::runtime_error broken_promise(const std::string& recording, const std::string& account, double least);

}  // namespace tendon::lab
