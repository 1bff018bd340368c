// SPDX-License-Identifier: Apache-2.0
#include "server/recording/recorder.h"

#include <utility>

namespace tendon {
namespace {

std::uint16_t add_channel(McapWriter& writer, const recording::Channel& channel) {
  const auto schema = writer.add_schema(channel.schema, recording::kEncoding, recording::schema_data());
  return writer.add_channel(schema, channel.topic, recording::kEncoding);
}

}  // namespace

Recorder::Recorder(const Config& config, ByteSink& sink)
    : config_(config),
      sink_(sink),
      writer_("tendon " + config.scene.version, sink),
      scene_channel_(add_channel(writer_, recording::kScene)),
      step_channels_{add_channel(writer_, recording::kStep)},
      datagram_channel_(add_channel(writer_, recording::kDatagram)),
      loss_channel_(add_channel(writer_, recording::kLoss)) {
  port_channels_.push_back(config_.ports ? add_channel(writer_, recording::kPort) : 0);
  FieldChannels& first = field_channels_.emplace_back();
  if (config_.fields)
    first = {add_channel(writer_, recording::kFieldInput), add_channel(writer_, recording::kFieldData)};
  write(scene_channel_, config_.started, recording::encode(config_.scene));
  for (const Device& device : config_.more_devices) {
    const auto of_device = [&](const recording::Channel& channel) {
      const std::string topic = "/" + device.name + std::string(channel.topic);
      return add_channel(writer_, {topic, channel.schema});
    };
    write(of_device(recording::kScene), config_.started, recording::encode(device.scene));
    step_channels_.push_back(of_device(recording::kStep));
    port_channels_.push_back(device.ports ? of_device(recording::kPort) : 0);
    FieldChannels& channels = field_channels_.emplace_back();
    if (device.fields) channels = {of_device(recording::kFieldInput), of_device(recording::kFieldData)};
  }
  settle(writer_.flush_chunk());
}

void Recorder::record(const StepRecord& step, std::size_t device, std::string_view force_way) {
  if (!recording()) {
    ++lost_.steps;
    return;
  }
  ++pending_.steps;
  write(step_channels_[device], step.hand.at, recording::encode(step, force_way));
}

void Recorder::record(const PortRecord& port, std::size_t device) {
  if (recording()) write(port_channels_[device], port.at, recording::encode(port));
}

void Recorder::record(const FieldInput& input, std::size_t device) {
  if (recording()) write(field_channels_[device].input, input.at, recording::encode(input));
}

void Recorder::record(const FieldData& data, std::size_t device) {
  if (recording()) write(field_channels_[device].data, data.at, recording::encode(data));
}

void Recorder::record(const DatagramRecord& datagram) {
  if (!recording()) {
    ++lost_.datagrams;
    return;
  }
  ++pending_.datagrams;
  write(datagram_channel_, datagram.at, recording::encode(datagram));
}

void Recorder::lost(const LossRecord& loss) {
  lost_.steps += loss.steps;
  lost_.datagrams += loss.datagrams;
  if (recording()) write(loss_channel_, loss.at, recording::encode(loss));
}

void Recorder::tick(LocalTime now) {
  if (chunk_opened_ && now - *chunk_opened_ >= config_.flush_after) settle(writer_.flush_chunk());
}

void Recorder::close() {
  if (!recording()) return;
  settle(writer_.flush_chunk());
  failed_ = failed_ || !writer_.close();
  closed_ = true;
}

Recorder::Status Recorder::status() const {
  return {.bytes = writer_.bytes_written(),
          .steps = kept_.steps + pending_.steps,
          .datagrams = kept_.datagrams + pending_.datagrams,
          .lost_steps = lost_.steps,
          .lost_datagrams = lost_.datagrams,
          .error = failed_ ? sink_.error() : std::string()};
}

void Recorder::write(std::uint16_t channel, LocalTime at, const std::string& message) {
  if (!chunk_opened_) chunk_opened_ = at;
  writer_.write(channel, recording::log_time(at, config_.scene.unix_offset), message);
  if (writer_.chunk_size() >= config_.flush_size) settle(writer_.flush_chunk());
  tick(at);
}

void Recorder::settle(bool kept) {
  Counts& account = kept ? kept_ : lost_;
  account.steps += pending_.steps;
  account.datagrams += pending_.datagrams;
  pending_ = {};
  chunk_opened_.reset();
  failed_ = !kept;
}

}  // namespace tendon
