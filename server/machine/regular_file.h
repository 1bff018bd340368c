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

/// A file cannot be read. The message is "cannot read WHAT: REASON".
class UnreadableFile : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Opens `file` for reading, in binary, when it is a regular file or a link to one. Anything else is refused before it
/// is opened: opening a named pipe waits for a writer, for ever; a device may never end; a directory has no bytes.
///
/// Throws UnreadableFile, where WHAT is `file`, with `kind` and a space before it when
/// `kind` is not empty: "cannot read recording run.mcap: it is a named pipe, expected a regular file".
///
/// Thread-safe: yes. Realtime-safe: no.
std::ifstream open_regular_file(const std::filesystem::path& file, std::string_view kind = {});

/// The reason for which a file of this `st_mode` is refused; empty for a regular file.
std::optional<std::string> why_not_regular(mode_t mode);

}  // namespace tendon
