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

struct Run {
  std::string label;  ///< heading of the column
  std::string recording;
  std::string device;  ///< name; empty if the recording has one device
  RunSummary summary;
  bool truncated = false;  ///< the recording has no end mark
  std::uint64_t lost_steps = 0;
  std::uint64_t lost_datagrams = 0;
  std::vector<std::string> damage = {};  ///< error messages, see RecordingReader::damage()
};

/// Formats as "12.3 mJ": three significant digits and a prefix from n to G, with a true minus sign; "0 J", "∞ N".
std::string with_unit(double value, std::string_view unit);

/// Pads `text` with spaces to `to` terminal columns. Assumes no combining or wide characters.
std::string padded(const std::string& text, std::size_t to);

/// UTF-8, with a row per quantity, followed by notes.
std::string to_table(std::span<const Run> runs);

/// One line without line end. Each key ends with the unit. Values that are not known are null. The key `fields` is
/// only written if the recording contains fields.
std::string to_json(const Run& run);

}  // namespace tendon::lab
