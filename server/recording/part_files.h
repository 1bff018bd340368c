// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "server/recording/byte_sink.h"

// Functions for recordings with several parts: run.mcap, run-2.mcap, run-3.mcap, and so on. Log thread only.

namespace tendon {

/// Creates a file for a new part. If there is no nonempty part, `path` is used. Otherwise, the number follows the
/// highest existing one, so that several runs can use the same name. A device such as /dev/null is used directly.
/// Throws std::runtime_error if the file cannot be created, or if `path` is not empty and is not an MCAP file.
std::unique_ptr<FileSink> open_next_part(const std::filesystem::path& path);

/// Deletes the oldest parts of `path` until the total size does not exceed `most_bytes`. Returns the deleted files.
/// Only counts and deletes files whose Scene has a budget, whose first part is `path`, and which are not in use.
std::vector<std::filesystem::path> delete_oldest_parts(const std::filesystem::path& path, std::uint64_t most_bytes);

/// Returns true if the disk has at least 16 MiB of free space, which is enough for 30 s of a typical run, or if this is
/// unknown. With less space, restarting a recording would result in many short parts.
bool has_room(const std::filesystem::path& path);

}  // namespace tendon
