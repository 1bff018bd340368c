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

/// Reads a recording. All times are converted to the local clock of the run. The first record is the scene. Records of
/// the same type are returned in the order in which they were recorded.
///
/// If the recording is truncated, all records in complete chunks are returned. If it is damaged, all records in valid
/// chunks are returned, and error messages are added to `damage()`. A LossRecord with Cause::kDisk is returned for each
/// gap. It contains the number of missing steps and datagrams. If the scene is missing, the time of a record is the
/// wall clock.
///
/// Throws std::runtime_error with the name of the file if it is not an MCAP file or not a Tendon recording. Unknown
/// channels are ignored. By default, the scenes, steps and ports of all devices except for the first one are also
/// ignored.
///
/// Thread-safe: no. Realtime-safe: no.
class RecordingReader {
 public:
  using Record = std::variant<SceneRecord, StepRecord, DatagramRecord, LossRecord, PortRecord>;
  enum class Devices : std::uint8_t { kFirst, kAll };

  /// Throws std::runtime_error if the file cannot be read.
  explicit RecordingReader(const std::filesystem::path& path, Devices devices = Devices::kFirst);
  /// The stream must support seeking. `name` is used in error messages.
  RecordingReader(std::unique_ptr<std::istream> input, std::string name, Devices devices = Devices::kFirst);

  /// Returns the next record, or nothing if there are no more records.
  std::optional<Record> next();

  /// Returns the names of the devices, in the order of their scenes. The first name is empty because it may be
  /// specified in the scene.
  const std::vector<std::string>& devices() const noexcept { return devices_; }
  /// Returns the index of the device in the last scene, step or port.
  std::size_t device() const noexcept { return device_; }

  /// Returns true if the recording is incomplete because the server was killed or the disk was full. This must only be
  /// called after `next` has returned nothing.
  bool truncated() const noexcept { return mcap_.truncated(); }

  /// Returns an error message for a recording that has no steps, for example "NAME: is empty".
  std::string without_steps() const;

  /// See McapReader::damage().
  std::vector<std::string> damage() const { return mcap_.damage(); }

  /// Returns the names of Step::force_way in the recording.
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
