// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tests/tools/lab/recordings/run_summary.h"

namespace tendon::lab {

/// One recorded run: what it comes down to, and how far its recording can be trusted.
struct Run {
  std::string label;      ///< heads its column
  std::string recording;  ///< the file
  std::string device;     ///< its name; empty: the recording has one only
  RunSummary summary;
  bool truncated = false;  ///< the recording ended before its end mark
  std::uint64_t lost_steps = 0;
  std::uint64_t lost_datagrams = 0;
  std::vector<std::string> damage = {};  ///< error messages, see RecordingReader::damage()
};

/// "12.3 mJ": three significant digits and a prefix from n to G; a true minus sign, "0 J", "∞ N".
std::string with_unit(double value, std::string_view unit);

/// `text` with spaces after it, `to` columns wide on a terminal: it has no combining and no wide characters.
std::string padded(const std::string& text, std::size_t to);

/// A figure that each run has, and an explanation below when one needs it. Text for people, UTF-8, aligned.
std::string to_table(std::span<const Run> runs);

/// One line of JSON without its end; keys have the unit at their end, what is not known is null.
std::string to_json(const Run& run);

}  // namespace tendon::lab
