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

constexpr std::array kKinds = {&recording::kScene,      &recording::kStep,      &recording::kPort,
                               &recording::kFieldInput, &recording::kFieldData, &recording::kDatagram,
                               &recording::kLoss};

bool has_form(const McapReader::Channel& channel, const recording::Channel& kind) {
  return channel.schema_name == kind.schema && channel.message_encoding == recording::kEncoding;
}

bool is(const McapReader::Channel& channel, const recording::Channel& kind) {
  return channel.topic == kind.topic && has_form(channel, kind);
}

}  // namespace

RecordingReader::RecordingReader(const std::filesystem::path& path, Devices devices)
    : RecordingReader(std::make_unique<std::ifstream>(open_regular_file(path, "recording")), path.string(), devices) {}

RecordingReader::RecordingReader(std::unique_ptr<std::istream> input, std::string name, Devices devices)
    : name_(name), mcap_(std::move(input), std::move(name)), wanted_(devices) {}

/// Sets `device_` if the channel belongs to one of the requested devices.
bool RecordingReader::belongs(const McapReader::Channel& channel, const recording::Channel& kind) {
  if (is(channel, kind)) {
    device_ = 0;
    return true;
  }
  if (wanted_ == Devices::kFirst || !has_form(channel, kind) || !channel.topic.ends_with(kind.topic)) return false;
  const std::string name = channel.topic.substr(1, channel.topic.size() - kind.topic.size() - 1);
  const auto known = std::ranges::find(devices_, name);
  device_ = static_cast<std::size_t>(known - devices_.begin());
  if (known == devices_.end()) devices_.push_back(name);
  return true;
}

std::optional<RecordingReader::Record> RecordingReader::next() {
  if (auto record = std::exchange(held_back_, std::nullopt)) return record;
  while (const auto message = mcap_.next()) {
    std::optional<Record> record;
    try {
      record = decode(*message);
    } catch (const std::invalid_argument& error) {
      mcap_.note(message->offset, std::string(error.what()) + "; the record is skipped");
    }
    const bool step = belongs(message->channel, recording::kStep);
    const bool datagram = is(message->channel, recording::kDatagram);
    if (message->missing == 0 || (!step && !datagram)) {
      if (record) return record;
      continue;
    }
    held_back_ = std::move(record);
    return LossRecord{.at = newest_,
                      .steps = step ? message->missing : 0,
                      .datagrams = datagram ? message->missing : 0,
                      .cause = LossRecord::Cause::kDisk};
  }
  return end();
}

std::optional<RecordingReader::Record> RecordingReader::decode(const McapReader::Message& message) {
  const McapReader::Channel& channel = message.channel;
  const auto known = [&] {
    return std::ranges::any_of(kKinds, [&](const auto* kind) { return belongs(channel, *kind); });
  };
  // The name of the channel may be damaged.
  if (!known() && !(mcap_.use_summary() && known())) return std::nullopt;
  if (belongs(channel, recording::kScene)) {
    auto scene = recording::decode_scene(message.data);
    if (device_ == 0) unix_offset_ = scene.unix_offset;  // used for all times
    return scene;
  }
  if (!unix_offset_) {
    mcap_.note(message.offset, "a record precedes the scene, which is missing");
    unix_offset_ = Duration::zero();
  }
  newest_ = recording::local_time(message.log_time, *unix_offset_);
  if (belongs(channel, recording::kStep)) return recording::decode_step(message.data, newest_, ways_);
  if (belongs(channel, recording::kPort)) return recording::decode_port(message.data, newest_);
  if (belongs(channel, recording::kFieldInput)) return recording::decode_field_input(message.data, newest_);
  if (belongs(channel, recording::kFieldData)) return recording::decode_field_data(message.data, newest_);
  if (is(channel, recording::kDatagram)) return recording::decode_datagram(message.data, newest_);
  return recording::decode_loss(message.data, newest_);
}

std::string RecordingReader::without_steps() const {
  if (mcap_.size() == 0) return name_ + ": the file is empty";
  return name_ + (mcap_.truncated() ? ": truncated before the first haptic step" : ": contains no haptic step");
}

/// Returns a LossRecord if records are missing at the end. Throws std::runtime_error if this is not a Tendon recording.
std::optional<RecordingReader::Record> RecordingReader::end() {
  if (std::exchange(ended_, true)) return std::nullopt;
  const auto& channels = mcap_.channels();
  const bool ours = std::ranges::any_of(channels, [](const auto& entry) {
    return std::ranges::any_of(kKinds, [&](const auto* kind) { return is(entry.second, *kind); });
  });
  if (!ours && !(channels.empty() && mcap_.truncated()))
    throw std::runtime_error(name_ + ": an MCAP file, but not a Tendon recording: it has no channel /scene");
  const LossRecord lost{.at = newest_,
                        .steps = mcap_.missing_at_end(recording::kStep.topic),
                        .datagrams = mcap_.missing_at_end(recording::kDatagram.topic),
                        .cause = LossRecord::Cause::kDisk};
  if (lost.steps == 0 && lost.datagrams == 0) return std::nullopt;
  return lost;
}

}  // namespace tendon
