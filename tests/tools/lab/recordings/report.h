// SPDX-License-Identifier: Apache-2.0
#pragma once

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
  bool json = false;                                  ///< one object for each recording instead of the table
  /// For scripts: throws std::runtime_error at the end when a recording breaks the limiter's promise. It names the first
  /// that does, with its energy.
  bool check = false;
};

/// Throws std::invalid_argument unless there are recordings, and labels for all of them or none.
void check(const ReportOptions& options);

/// Reads the recordings, writes the table (or JSON) to `out`, and draws the picture.
///
/// A recording that was cut off is read as far as it goes, and the report says so. Throws std::invalid_argument when
/// the options make no sense, before anything is read; std::runtime_error when a recording cannot be read, is corrupt
/// or holds no step (then nothing has been written), when the picture cannot be drawn, or by `check`.
void report(const ReportOptions& options, std::ostream& out);

/// What `check` throws: `account` of that recording was `least` J at its lowest.
std::runtime_error broken_promise(const std::string& recording, const std::string& account, double least);

}  // namespace tendon::lab
