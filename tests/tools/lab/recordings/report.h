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

struct ReportOptions {
  std::vector<std::filesystem::path> recordings = {};  ///< one or more
  /// One per recording. Empty: "limiter on" or "limiter off", according to the recorded steps.
  std::vector<std::string> labels = {};
  std::optional<std::filesystem::path> picture = {};  ///< .svg or .png
  /// Devices to show. If this is empty, all devices are shown if there is enough room.
  std::vector<std::string> devices = {};
  bool json = false;  ///< one object per device and recording instead of the table
  /// Throws std::runtime_error after the report if any device violates the limiter's guarantee, even one without a
  /// column. The message contains name and energy of the first one.
  bool check = false;
};

/// Throws std::invalid_argument without recordings, or unless there are no labels or one per recording.
void check(const ReportOptions& options);

inline constexpr std::size_t kMostColumns = 6;

/// Each device of each recording has a column. Beyond kMostColumns (kMostDrawings in the picture), devices that
/// violated the guarantee come first, and the number of omitted devices is printed.
///
/// Uses the valid part of a damaged recording, with a note. Throws std::invalid_argument for invalid options before
/// reading anything. Throws std::runtime_error if a recording cannot be read, has no steps or lacks a requested device
/// (nothing has been written then), if the picture cannot be drawn, or if `check` fails.
void report(const ReportOptions& options, std::ostream& out);

std::runtime_error broken_promise(const std::string& recording, const std::string& account, double least);

}  // namespace tendon::lab
