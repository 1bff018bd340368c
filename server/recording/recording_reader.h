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
#include "server/recording/solver_paths.h"

namespace tendon {

/// Reads a recording. All times are converted to the local clock of the run. The first record is the scene. Records of
/// the same type are in the order in which they were recorded.
///
/// All records in complete, valid chunks are returned. If chunks are damaged, error messages are added to `damage()`,
/// and a LossRecord with Cause::kDisk is returned for each gap. If the scene is missing, the time of a record is the
/// wall clock. Unknown channels are ignored, and by default also the scenes, steps, ports and fields of all devices except for
/// the first one. Throws std::runtime_error if this is not a Tendon recording. Thread-safe: no. Realtime-safe: no.
class RecordingReader {
 public:
  using Record = std::variant<SceneRecord, StepRecord, DatagramRecord, LossRecord, PortRecord, FieldInput, FieldData>;
  enum class Devices : std::uint8_t { kFirst, kAll };

  explicit RecordingReader(const std::filesystem::path& path, Devices devices = Devices::kFirst);
  /// The stream must support seeking. `name` is used in error messages.
  RecordingReader(std::unique_ptr<std::istream> input, std::string name, Devices devices = Devices::kFirst);

  std::optional<Record> next();

  /// In the order of the scenes. The first name is empty because it may be specified in the scene.
  const std::vector<std::string>& devices() const noexcept { return devices_; }
  std::size_t device() const noexcept { return device_; }  ///< of the last scene, step, port or field

  /// True if the server was killed or the disk was full. Only valid after `next` has returned nothing.
  bool truncated() const noexcept { return mcap_.truncated(); }

  /// Returns an error message for a recording that has no steps, for example "NAME: is empty".
  std::string without_steps() const;

  std::vector<std::string> damage() const { return mcap_.damage(); }

  const SolverPaths& ways() const noexcept { return ways_; }

 private:
  bool belongs(const McapReader::Channel& channel, const recording::Channel& kind);
  std::optional<Record> decode(const McapReader::Message& message);
  std::optional<Record> end();

  std::string name_;
  McapReader mcap_;
  std::optional<Duration> unix_offset_;
  LocalTime newest_{};
  std::optional<Record> held_back_;  ///< the record after a LossRecord
  bool ended_ = false;
  SolverPaths ways_;
  Devices wanted_;
  std::vector<std::string> devices_{""};
  std::size_t device_ = 0;
};

}  // namespace tendon
