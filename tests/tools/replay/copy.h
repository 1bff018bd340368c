// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

#include "server/recording/byte_sink.h"
#include "server/recording/mcap_reader.h"
#include "server/recording/mcap_writer.h"

namespace tendon::replay {

/// Throws std::runtime_error if the recording cannot be read.
McapReader open_mcap(const std::filesystem::path& path);

/// The messages must be defined in recording.proto.
class CopiedChannels {
 public:
  /// Creates the channel if it does not exist. `prefix` is added to the topic.
  std::uint16_t in(McapWriter& writer, const McapReader::Channel& from, const std::string& prefix = {});

 private:
  std::map<std::string, std::uint16_t> ids_;
};

/// Throws std::runtime_error with the error message of `sink` if `written` is false.
void check_written(bool written, const FileSink& sink);

}  // namespace tendon::replay
