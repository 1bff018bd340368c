// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/replay/copy.h"

#include <fstream>
#include <memory>
#include <stdexcept>

#include "server/machine/regular_file.h"
#include "server/recording/recording_codec.h"

namespace tendon::replay {

McapReader open_mcap(const std::filesystem::path& path) {
  return {std::make_unique<std::ifstream>(open_regular_file(path, "recording")), path.string()};
}

std::uint16_t CopiedChannels::in(McapWriter& writer, const McapReader::Channel& from, const std::string& prefix) {
  const auto [id, anew] = ids_.try_emplace(from.topic, std::uint16_t{0});
  if (anew) {
    const auto schema = writer.add_schema(from.schema_name, recording::kEncoding, recording::schema_data());
    id->second = writer.add_channel(schema, prefix + from.topic, from.message_encoding);
  }
  return id->second;
}

void check_written(bool written, const FileSink& sink) {
  if (!written) throw std::runtime_error(sink.error());
}

}  // namespace tendon::replay
