// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/codec.h"

#include <google/protobuf/arena.h>
#include <google/protobuf/stubs/common.h>

#include <algorithm>
#include <array>
#include <type_traits>
#include <utility>
#include <variant>

#include "protocol/limits.h"
#include "protocol/wire/bounds.h"
#include "protocol/wire/fields.h"
#include "protocol/wire/frame_codec.h"
#include "protocol/wire/hand_codec.h"

namespace tendon {
namespace {

namespace pb = tendon::v1;

bool read_echo(const pb::Echo& from, IncomingEcho& to) noexcept {
  to.packet_number = from.peer_packet_number();
  to.received_mask = from.received_mask();
  return wire::read(from.peer_tx_time_ns(), to.sent) && wire::read(from.rx_time_ns(), to.received);
}

/// Appends the frame to `content`, or counts it.
template <class Value, class Message>
void take(const Message& from, DataContent& content) {
  Frame& frame = content.frames.emplace_back(std::in_place_type<Value>);
  if (wire::read(from, std::get<Value>(frame))) return;
  if constexpr (std::is_same_v<Value, ForceCommand>) {
    ++(is_finite(std::get<Value>(frame)) ? content.forces_out_of_bounds : content.forces_not_finite);
  }
  content.frames.pop_back();
  ++content.invalid;
}

/// Appends each state, or counts the frame: where one is out of bounds, none is taken.
void take_columns(const pb::DeviceStates& from, DataContent& content) {
  const std::size_t before = content.frames.size();
  const auto next = [&]() -> DeviceState& { return std::get<DeviceState>(content.frames.emplace_back(DeviceState{})); };
  if (wire::read(from, next)) return;
  content.frames.resize(before);
  ++content.invalid;
}

pb::Datagram& new_datagram(google::protobuf::Arena& arena) {
#if GOOGLE_PROTOBUF_VERSION < 5026000
  return *google::protobuf::Arena::CreateMessage<pb::Datagram>(&arena);
#else  // which deprecates CreateMessage, and whose Create gives a message to the arena with all that is in it
  return *google::protobuf::Arena::Create<pb::Datagram>(&arena);
#endif
}

}  // namespace

/// One small Datagram for each kind of frame. Protobuf defines the concatenation of two messages as their merge, so a
/// datagram with several frames is written piece by piece, and each piece keeps its objects for the next datagram.
struct DataWriter::Pieces {
  pb::Datagram state, states, force, control, ack, bye, report, device_report, peer_report, port;
  pb::Frame& state_frame = *state.add_frames();
  pb::Frame& states_frame = *states.add_frames();
  pb::Frame& force_frame = *force.add_frames();
  pb::Frame& control_frame = *control.add_frames();
  pb::Frame& ack_frame = *ack.add_frames();
  pb::Frame& bye_frame = *bye.add_frames();
  pb::Frame& report_frame = *report.add_frames();
  pb::Frame& device_report_frame = *device_report.add_frames();
  pb::Frame& peer_report_frame = *peer_report.add_frames();
  pb::Frame& port_frame = *port.add_frames();
};

void round_to_columns(DeviceState& state) noexcept {
  // GCC 12 vectorizes two neighbours, and then takes double → float → double for no change at all.
  const auto in_single = [](double number) {
    const volatile auto single = static_cast<float>(number);
    return static_cast<double>(single);
  };
  for (int axis = 0; axis < 3; ++axis) {
    state.velocity[axis] = in_single(state.velocity[axis]);
    state.force_applied[axis] = in_single(state.force_applied[axis]);
  }
  state.energy = in_single(state.energy);
  state.permitted_force = in_single(state.permitted_force);
}

DataWriter::DataWriter() : pieces_(std::make_unique<Pieces>()) {}
DataWriter::~DataWriter() = default;
DataWriter::DataWriter(DataWriter&&) noexcept = default;
DataWriter& DataWriter::operator=(DataWriter&&) noexcept = default;

/// Each piece has one frame.
template <class Piece>
bool DataWriter::append(const Piece& piece) {
  const std::size_t size = piece.ByteSizeLong();
  if (size > buffer_.size() - size_ || frames_ == limits::kMaxFrames) return false;
  piece.SerializeWithCachedSizesToArray(wire::as_bytes(buffer_.data() + size_));
  return count(size);
}

void DataWriter::begin(std::span<std::byte> buffer, const Header& header, LocalTime sent,
                       const std::optional<OutgoingEcho>& echo) {
  buffer_ = buffer;
  std::ranges::copy(encode_header(header), buffer_.begin());
  size_ = kHeaderSize;
  frames_ = 0;

  std::array<std::uint8_t, wire::kMostHead> head;
  const std::size_t size = wire::write_head(head.data(), sent, echo);
  if (size > buffer_.size() - size_) return;
  std::copy_n(head.begin(), size, wire::as_bytes(buffer_.data() + size_));
  size_ += size;
}

/// By hand where there is room for any frame; protobuf knows whether this one fits.
template <class Value>
std::size_t DataWriter::write_by_hand(const Value& value) noexcept {
  if (buffer_.size() - size_ < wire::kMostFrame || frames_ == limits::kMaxFrames) return 0;
  return wire::write_frame(wire::as_bytes(buffer_.data() + size_), value);
}

bool DataWriter::add(const DeviceState& state) {
  if (const std::size_t size = write_by_hand(state); size > 0) return count(size);
  return add_by_protobuf(state);
}
bool DataWriter::add(const ForceCommand& command) {
  if (const std::size_t size = write_by_hand(command); size > 0) return count(size);
  return add_by_protobuf(command);
}
bool DataWriter::add_by_protobuf(const DeviceState& state) {
  wire::write(state, *pieces_->state_frame.mutable_state());
  return append(pieces_->state);
}
std::size_t DataWriter::add(std::span<const DeviceState* const> states) {
  if (frames_ == limits::kMaxFrames) return 0;
  const auto room = buffer_.size() - size_;
  const auto written = wire::write_columns(wire::as_bytes(buffer_.data() + size_), room, states);
  if (!written) return add_by_protobuf(states);
  if (written->states > 0) count(written->bytes);
  return written->states;
}
std::size_t DataWriter::add_by_protobuf(std::span<const DeviceState* const> states) {
  for (std::size_t fit = states.size(); fit > 0; --fit) {
    wire::write(states.first(fit), *pieces_->states_frame.mutable_states());
    if (append(pieces_->states)) return fit;
  }
  return 0;
}
bool DataWriter::add_by_protobuf(const ForceCommand& command) {
  wire::write(command, *pieces_->force_frame.mutable_force());
  return append(pieces_->force);
}
bool DataWriter::add(const Control& control) {
  wire::write(control, *pieces_->control_frame.mutable_control());
  return append(pieces_->control);
}
bool DataWriter::add(const ControlAck& ack) {
  wire::write(ack, *pieces_->ack_frame.mutable_control_ack());
  return append(pieces_->ack);
}
bool DataWriter::add(const Bye& bye) {
  wire::write(bye, *pieces_->bye_frame.mutable_bye());
  return append(pieces_->bye);
}
bool DataWriter::add(const LinkReport& report) {
  wire::write(report, *pieces_->report_frame.mutable_report());
  return append(pieces_->report);
}
bool DataWriter::add(const DeviceReport& report) {
  wire::write(report, *pieces_->device_report_frame.mutable_device_report());
  return append(pieces_->device_report);
}
bool DataWriter::add(const PeerReport& report) {
  wire::write(report, *pieces_->peer_report_frame.mutable_peer_report());
  return append(pieces_->peer_report);
}

bool DataWriter::add(const PortFrame& port) {
  wire::write(port, *pieces_->port_frame.mutable_port_state());
  return append(pieces_->port);
}

/// Parsed objects live in an arena whose first block is ours, so a state or a force needs no heap. One `Reset` frees
/// all objects that the 1200 bytes of a hostile datagram can create.
struct DataReader::Memory {
  alignas(16) std::array<char, 8192> block;
  google::protobuf::Arena arena{block.data(), block.size()};
  DataContent content;
};

DataReader::DataReader() : memory_(std::make_unique<Memory>()) {}
DataReader::~DataReader() = default;
DataReader::DataReader(DataReader&&) noexcept = default;
DataReader& DataReader::operator=(DataReader&&) noexcept = default;

const DataContent* DataReader::read(std::span<const std::byte> body) {
  return wire::read_by_hand(body, memory_->content) ? &memory_->content : read_by_protobuf(body);
}

const DataContent* DataReader::read_by_protobuf(std::span<const std::byte> body) {
  memory_->arena.Reset();
  auto& datagram = new_datagram(memory_->arena);
  DataContent& content = memory_->content;
  if (body.size() > kMaxDatagram || !wire::parse(body, datagram) || datagram.frames_size() > limits::kMaxFrames) {
    return nullptr;
  }
  wire::empty(content);
  if (!wire::read(datagram.tx_time_ns(), content.sent)) return nullptr;

  if (datagram.has_echo() && !read_echo(datagram.echo(), content.echo.emplace())) {
    content.echo.reset();
    ++content.invalid;
  }
  for (const pb::Frame& frame : datagram.frames()) {
    switch (frame.body_case()) {
      case pb::Frame::kState:
        take<DeviceState>(frame.state(), content);
        break;
      case pb::Frame::kForce:
        take<ForceCommand>(frame.force(), content);
        break;
      case pb::Frame::kControl:
        take<Control>(frame.control(), content);
        break;
      case pb::Frame::kControlAck:
        take<ControlAck>(frame.control_ack(), content);
        break;
      case pb::Frame::kBye:
        take<Bye>(frame.bye(), content);
        break;
      case pb::Frame::kReport:
        take<LinkReport>(frame.report(), content);
        break;
      case pb::Frame::kDeviceReport:
        take<DeviceReport>(frame.device_report(), content);
        break;
      case pb::Frame::kPeerReport:
        take<PeerReport>(frame.peer_report(), content);
        break;
      case pb::Frame::kPortState:
        take<PortFrame>(frame.port_state(), content);
        break;
      case pb::Frame::kStates:
        take_columns(frame.states(), content);
        break;
      case pb::Frame::BODY_NOT_SET:
        break;  // a frame of a newer peer
    }
  }
  return &content;
}

}  // namespace tendon
