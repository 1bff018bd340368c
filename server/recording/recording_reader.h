// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <istream>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "server/recording/mcap_reader.h"
#include "server/recording/recording_codec.h"
#include "server/recording/records.h"
#include "server/recording/ways.h"

namespace tendon {

/// Reads a recording back, record by record, with times on the clock of the run. Records of one kind come in the
/// order in which they were recorded; kinds interleave as in the file. The scene is the first record.
///
/// A recording that was cut off anywhere gives every record of its whole chunks. Corruption, a file that is not MCAP,
/// and one that is not a Tendon recording throw std::runtime_error with the file's name and, where it applies, the
/// byte offset; records before a corruption have been given. Channels that Tendon does not know are skipped.
/// So are the scenes and steps of devices besides the first.
///
/// Thread-safe: no. Realtime-safe: no.
class RecordingReader {
 public:
  using Record = std::variant<SceneRecord, StepRecord, DatagramRecord, LossRecord, PortRecord>;

  /// Throws std::runtime_error with path and reason when the file cannot be read.
  explicit RecordingReader(const std::filesystem::path& path);
  /// From any stream that can seek; `name` is what errors call it.
  RecordingReader(std::unique_ptr<std::istream> input, std::string name);

  /// The next record; empty at the end.
  std::optional<Record> next();

  /// True when the recording ended before its end mark: the server was killed, or the disk was full. Known once `next`
  /// has returned empty.
  bool truncated() const noexcept { return mcap_.truncated(); }

  /// The names of Step::force_way in the steps that it has given.
  const Ways& ways() const noexcept { return ways_; }

 private:
  void check_ours() const;

  std::string name_;
  McapReader mcap_;
  std::optional<Duration> unix_offset_;  ///< from the scene
  Ways ways_;
};

}  // namespace tendon
