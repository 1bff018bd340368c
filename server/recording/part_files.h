// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "server/recording/byte_sink.h"

// Functions for recordings with several parts: run.mcap, run-2.mcap, run-3.mcap, and so on. They should only be used by
// the log thread because they may wait for a disk.

namespace tendon {

/// Creates a file for a new part. If there are no parts, or if there is only an empty file `path`, then `path` is used.
/// Otherwise, the number is the first one that is available after the highest existing number. Therefore, several runs
/// can use the same name without overwriting each other. A device such as /dev/null is used directly.
///
/// Throws std::runtime_error if the file cannot be created. If `path` is not empty and is not an MCAP file, this is
/// also an error because the file was not created by Tendon.
std::unique_ptr<FileSink> open_next_part(const std::filesystem::path& path);

/// Deletes the oldest parts of `path` until the total size does not exceed `most_bytes`. Returns the deleted files.
///
/// A file is only deleted if its Scene has a budget and `path` is its first part. All other files are not counted.
/// Files that are still in use by a server are not deleted.
std::vector<std::filesystem::path> delete_oldest_parts(const std::filesystem::path& path, std::uint64_t most_bytes);

/// Returns true if there are at least 16 MiB of free space on the disk with `path`, which is enough for 30 s of a
/// typical run. If there is less space, restarting a recording would result in many short parts. Also returns true if
/// the free space is unknown.
bool has_room(const std::filesystem::path& path);

}  // namespace tendon
