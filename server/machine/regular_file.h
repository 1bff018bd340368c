// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace tendon {

/// The message is "cannot read WHAT: REASON".
class UnreadableFile : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Opens a regular file, or a symbolic link to one, for reading. All other files are refused before they are opened,
/// because opening a named pipe would block, and a device may be infinite.
///
/// Throws UnreadableFile. `kind` is prepended to the name of the file, for example "cannot read recording run.mcap: it
/// is a named pipe, expected a regular file". Thread-safe: yes. Realtime-safe: no.
std::ifstream open_regular_file(const std::filesystem::path& file, std::string_view kind = {});

std::optional<std::string> why_not_regular(mode_t mode);

}  // namespace tendon
