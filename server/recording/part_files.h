// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "server/recording/byte_sink.h"

// The files of a recording that has several parts: run.mcap, run-2.mcap, run-3.mcap … Log thread only: all of these may
// wait for a disk.

namespace tendon {

/// A new file for the next part: `path` when no part exists, or when that is empty and the only one; else the first free
/// number after the highest.
/// So any number of parts and runs share a name, and none overwrites another. A device such as /dev/null is opened as
/// it is.
///
/// Throws std::runtime_error with path and reason when it cannot be made, and when `path` exists, is not empty and is
/// no MCAP file: then it is somebody else's.
std::unique_ptr<FileSink> open_next_part(const std::filesystem::path& path);

/// Deletes the oldest parts of `path` until all of them have at most `most_bytes`; returns what it has deleted.
///
/// A file is only deleted if its Scene has a budget and `path` is its first part. All other files are not counted. Files
/// that a server is still writing to are not deleted.
std::vector<std::filesystem::path> delete_oldest_parts(const std::filesystem::path& path, std::uint64_t most_bytes);

/// Whether the disk under `path` has 16 MiB to spare, half a minute of a usual run: with less, a recording that has
/// stopped would go on for moments, in a new part each time. True when that cannot be told.
bool has_room(const std::filesystem::path& path);

}  // namespace tendon
