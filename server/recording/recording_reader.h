// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <istream>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "server/recording/mcap_reader.h"
#include "server/recording/recording_codec.h"
#include "server/recording/records.h"
#include "server/recording/ways.h"

namespace tendon {

/// Reads a recording back, record by record, with times on the clock of the run. Records of one kind come in the
/// order in which they were recorded; kinds interleave as in the file. The scene is the first record.
///
/// If the recording is truncated, all records in complete chunks are returned. If it is damaged, all records in valid
/// chunks are returned, and `damage()` contains the error messages. A LossRecord with Cause::kDisk is returned for each
/// gap. It contains the number of missing steps and datagrams. If the scene is missing, the time of a record is the
/// wall clock.
///
/// Throws std::runtime_error with the name of the file if it is not an MCAP file or not a Tendon recording. Unknown
/// channels are ignored, as are the scenes, steps and ports of all devices except the first, unless all are asked for.
///
/// Thread-safe: no. Realtime-safe: no.
class RecordingReader {
 public:
  using Record = std::variant<SceneRecord, StepRecord, DatagramRecord, LossRecord, PortRecord>;
  enum class Devices : std::uint8_t { kFirst, kAll };

  /// Throws std::runtime_error with path and reason when the file cannot be read.
  explicit RecordingReader(const std::filesystem::path& path, Devices devices = Devices::kFirst);
  /// From any stream that can seek; `name` is what errors call it.
  RecordingReader(std::unique_ptr<std::istream> input, std::string name, Devices devices = Devices::kFirst);

  /// The next record; empty at the end.
  std::optional<Record> next();

  /// The names of the devices whose records it has given so far, in the order of their scenes. That of the first is
  /// empty: its scene may tell it.
  const std::vector<std::string>& devices() const noexcept { return devices_; }
  /// The number among them to which the scene, step or port belongs that `next` has just given.
  std::size_t device() const noexcept { return device_; }

  /// True when the recording ended before its end mark: the server was killed, or the disk was full. Known once `next`
  /// has returned empty.
  bool truncated() const noexcept { return mcap_.truncated(); }

  /// Returns an error message for a recording that has no steps, for example "NAME: is empty".
  std::string without_steps() const;

  /// See McapReader::damage().
  std::vector<std::string> damage() const { return mcap_.damage(); }

  /// The names of Step::force_way in the steps that it has given.
  const Ways& ways() const noexcept { return ways_; }

 private:
  bool belongs(const McapReader::Channel& channel, const recording::Channel& kind);
  std::optional<Record> decode(const McapReader::Message& message);
  std::optional<Record> end();

  std::string name_;
  McapReader mcap_;
  std::optional<Duration> unix_offset_;  ///< from the scene
  LocalTime newest_{};                   ///< the time of the last record
  std::optional<Record> held_back_;      ///< the record after a LossRecord
  bool ended_ = false;
  Ways ways_;
  Devices wanted_;
  std::vector<std::string> devices_{""};
  std::size_t device_ = 0;
};

}  // namespace tendon
