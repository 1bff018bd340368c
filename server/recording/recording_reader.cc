// SPDX-License-Identifier: Apache-2.0
#include "server/recording/recording_reader.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <stdexcept>
#include <utility>

#include "server/machine/regular_file.h"

namespace tendon {
namespace {

bool is(const McapReader::Channel& channel, const recording::Channel& kind) {
  return channel.topic == kind.topic && channel.schema_name == kind.schema &&
         channel.message_encoding == recording::kEncoding;
}

}  // namespace

RecordingReader::RecordingReader(const std::filesystem::path& path)
    : RecordingReader(std::make_unique<std::ifstream>(open_regular_file(path, "recording")), path.string()) {}

RecordingReader::RecordingReader(std::unique_ptr<std::istream> input, std::string name)
    : name_(name), mcap_(std::move(input), std::move(name)) {}

std::optional<RecordingReader::Record> RecordingReader::next() {
  while (const auto message = mcap_.next()) {
    const McapReader::Channel& channel = message->channel;
    try {
      if (is(channel, recording::kScene)) {
        auto scene = recording::decode_scene(message->data);
        unix_offset_ = scene.unix_offset;
        return scene;
      }
      const bool step = is(channel, recording::kStep);
      const bool port = is(channel, recording::kPort);
      const bool datagram = is(channel, recording::kDatagram);
      const bool loss = is(channel, recording::kLoss);
      if (!step && !port && !datagram && !loss) continue;
      if (!unix_offset_) throw std::invalid_argument("a record comes before the scene");
      const LocalTime at = recording::local_time(message->log_time, *unix_offset_);
      if (step) return recording::decode_step(message->data, at, ways_);
      if (port) return recording::decode_port(message->data, at);
      if (datagram) return recording::decode_datagram(message->data, at);
      return recording::decode_loss(message->data, at);
    } catch (const std::invalid_argument& error) {
      mcap_.corrupt(message->offset, error.what());
    }
  }
  check_ours();
  return std::nullopt;
}

/// At the end: a file that has channels, or is complete, must be a recording of Tendon.
void RecordingReader::check_ours() const {
  const auto& channels = mcap_.channels();
  if (channels.empty() && mcap_.truncated()) return;
  const bool ours =
      std::ranges::any_of(channels, [](const auto& entry) { return is(entry.second, recording::kScene); });
  if (!ours)
    throw std::runtime_error(name_ + ": is an MCAP file, but not a Tendon recording: it has no channel /scene");
}

}  // namespace tendon
