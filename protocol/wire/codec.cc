// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/codec.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <type_traits>

#include "protocol/limits.h"
#include "protocol/wire/bounds.h"
#include "protocol/wire/columns.h"
#include "protocol/wire/fields/reader.h"
#include "protocol/wire/fields/writer.h"
#include "protocol/wire/generated/frame_fields.h"
#include "protocol/wire/generated/request_fields.h"
#include "protocol/wire/generated/schema.h"

namespace tendon {
namespace {

using wire::Byte;
using wire::Reader;
using wire::Writer;

/// Bytes: the head, a frame that is sent at every step, and any other frame.
constexpr std::size_t kMostHead = 48;
constexpr std::size_t kMostOfAStep = 640;
constexpr std::size_t kMostFrame = 2048;

/// Writes a frame and returns its size. Moves the fields if tags and lengths do not take `kUsualFront` bytes.
template <unsigned kBody, std::size_t kUsualFront, class Value, class List>
std::size_t write_frame(Byte* to, const Value& value, List list) noexcept {
  Writer body(to + kUsualFront);
  list(body, value);
  const auto size = static_cast<std::size_t>(body.at() - to) - kUsualFront;
  const std::size_t frame = wire::size_of_field(size);
  const std::size_t front = wire::size_of_field(frame) - size;
  if (front != kUsualFront) std::memmove(to + front, to + kUsualFront, size);
  Writer out(to);
  out.tag<3, wire::kLength>();
  out.varint(frame);
  out.tag<kBody, wire::kLength>();
  out.varint(size);
  return front + size;
}

/// Constructs the result of `make` in place, because moving it is expensive.
template <class Make>
auto& append(std::vector<Frame>& frames, Make make) {
  using Value = decltype(make());
  struct Parsed {
    Make make;
    operator Value() const noexcept { return make(); }
  };
  return std::get<Value>(frames.emplace_back(std::in_place_type<Value>, Parsed{make}));
}

/// Counts a value that is out of bounds. Returns false if it must be dropped. Requests and answers with a valid id must
/// be kept, because later ones would otherwise never be delivered.
template <class Value>
bool keep_refused(Value& value, wire::Name field, DataContent& content) {
  ++content.invalid;
  if constexpr (std::is_same_v<Value, ForceCommand>) {
    ++(is_finite(value) ? content.forces_out_of_bounds : content.forces_not_finite);
  } else if constexpr (std::is_same_v<Value, Control>) {
    value = {.id = value.id, .request = {}, .invalid = field};
    return value.id > 0;
  } else if constexpr (std::is_same_v<Value, ControlAck>) {
    value = {.id = value.id, .code = Code::kInvalid, .detail = "a field of the answer is out of bounds"};
    return value.id > 0;
  }
  return false;
}

/// Returns false if the fields are not in order. This function is not inlined, so that each list has enough registers.
template <class List, class Make>
[[gnu::noinline]] bool read_arm(const Reader& arm, DataContent& content, List list, Make make) {
  Reader in = arm;
  auto& value = append(content.frames, make);
  list(in, value);
  if (in.refused() != nullptr && !keep_refused(value, in.refused(), content)) content.frames.pop_back();
  return in.done();
}

template <unsigned kBody, class List, class Make>
bool take(Reader& frame, DataContent& content, bool& good, List list, Make make) {
  Reader in(nullptr, nullptr);
  if (!frame.enter<kBody>(in)) return false;
  good = read_arm(in, content, list, make);
  return true;
}

/// Drops all states if one of them is out of bounds.
bool take_columns(Reader& frame, DataContent& content, bool& good) {
  Reader in(nullptr, nullptr);
  if (!frame.enter<10>(in)) return false;
  const std::size_t before = content.frames.size();
  wire::read_columns(in, [&](std::uint64_t tick) -> DeviceState& {
    return append(content.frames, [tick] { return DeviceState{.tick = tick}; });
  });
  good = in.done();
  if (in.refused() != nullptr) {
    content.frames.erase(content.frames.begin() + static_cast<std::ptrdiff_t>(before), content.frames.end());
    ++content.invalid;
  }
  return true;
}

bool read_frame(const Reader& bytes, DataContent& content) {
  Reader frame = bytes;
  bool good = true;
  // Without designated initializers, these aggregates would be zeroed first.
  const bool known =
      take<1>(frame, content, good, wire::kDeviceStateFields, [] { return DeviceState{.tick = 0}; }) ||
      take<2>(frame, content, good, wire::kForceCommandFields, [] { return ForceCommand{.sequence = 0}; }) ||
      take_columns(frame, content, good) ||
      take<9>(frame, content, good, wire::kPortStateFields, [] { return PortFrame{}; }) ||
      take<3>(frame, content, good, wire::kControlFields, [] { return Control{}; }) ||
      take<4>(frame, content, good, wire::kControlAckFields, [] { return ControlAck{}; }) ||
      take<5>(frame, content, good, wire::kByeFields, [] { return Bye{}; }) ||
      take<6>(frame, content, good, wire::kLinkReportFields, [] { return LinkReport{}; }) ||
      take<7>(frame, content, good, wire::kDeviceReportFields, [] { return DeviceReport{}; }) ||
      take<8>(frame, content, good, wire::kPeerReportFields, [] { return PeerReport{}; }) ||
      take<11>(frame, content, good, wire::kFieldBrickFields, [] { return FieldBrick{}; }) ||
      take<12>(frame, content, good, wire::kFieldStatusFields, [] { return FieldStatus{}; }) ||
      take<13>(frame, content, good, wire::kFieldPoseFields, [] { return FieldPose{}; });
  static_cast<void>(known);  // frames of newer peers are empty after AnyOrder
  return good && frame.done();
}

void empty(DataContent& content) noexcept {
  content.sent = {};
  content.echo.reset();
  content.frames.clear();
  content.invalid = content.forces_not_finite = content.forces_out_of_bounds = 0;
}

/// Returns false and invalid `content` if the order is wrong, there are too many frames, or tx_time is not usable.
bool read_in_order(std::span<const std::byte> body, DataContent& content) {
  empty(content);
  Reader in(body);
  in.time(wire::field<1>, "tx_time_ns", content.sent);
  if (in.refused() != nullptr) return false;
  Reader echo(nullptr, nullptr);
  if (in.enter<2>(echo)) {
    wire::kEchoFields(echo, content.echo.emplace());
    if (!echo.done()) return false;
    if (echo.refused() != nullptr) {
      content.echo.reset();
      ++content.invalid;
    }
  }
  Reader frame(nullptr, nullptr);
  for (int frames = 0; in.next_is<3, wire::kLength>(); ++frames) {
    if (frames == limits::kMaxFrames || !in.enter<3>(frame) || !read_frame(frame, content)) return false;
  }
  return in.done();
}

template <class Value, class List>
std::string text_of(const Value& value, List list) {
  std::array<Byte, kMostFrame> bytes;
  Writer out(bytes.data());
  list(out, value);
  return {bytes.data(), out.at()};
}

Byte* as_bytes(std::byte* p) noexcept { return reinterpret_cast<Byte*>(p); }

}  // namespace

void round_to_columns(DeviceState& state) noexcept {
  // Volatile, because GCC 12 otherwise removes the conversion double → float → double when vectorizing.
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

/// Writes into the datagram if the largest frame of this kind fits, and otherwise into a buffer to check its size.
template <unsigned kBody, std::size_t kUsualFront, class Value, class List>
bool DataWriter::add_frame(const Value& value, std::size_t most, List list) noexcept {
  if (frames_ == limits::kMaxFrames) return false;
  const auto rest = buffer_.subspan(size_);
  std::array<Byte, kMostFrame> apart;
  const bool fits = rest.size() >= most;
  const std::size_t size = write_frame<kBody, kUsualFront>(fits ? as_bytes(rest.data()) : apart.data(), value, list);
  if (!fits) {
    if (size > rest.size()) return false;
    std::copy_n(apart.begin(), size, as_bytes(rest.data()));
  }
  size_ += size;
  ++frames_;
  return true;
}

void DataWriter::begin(std::span<std::byte> buffer, const Header& header, LocalTime sent,
                       const std::optional<OutgoingEcho>& echo) {
  buffer_ = buffer;
  std::ranges::copy(encode_header(header), buffer_.begin());
  size_ = kHeaderSize;
  frames_ = 0;

  std::array<Byte, kMostHead> head;
  Writer out(head.data());
  out.time(wire::field<1>, "tx_time_ns", sent);
  if (echo) out.small<2>([&] { wire::kEchoFields(out, *echo); });
  const auto size = static_cast<std::size_t>(out.at() - head.data());
  if (size > buffer_.size() - size_) return;
  std::copy_n(head.begin(), size, as_bytes(buffer_.data() + size_));
  size_ += size;
}

bool DataWriter::add(const DeviceState& state) {
  return add_frame<1, 6>(state, kMostOfAStep, wire::kDeviceStateFields);
}
bool DataWriter::add(const ForceCommand& command) {
  return add_frame<2, 4>(command, kMostOfAStep, wire::kForceCommandFields);
}
bool DataWriter::add(const PortFrame& port) { return add_frame<9, 6>(port, kMostOfAStep, wire::kPortStateFields); }
bool DataWriter::add(const Control& control) { return add_frame<3, 4>(control, kMostFrame, wire::kControlFields); }
bool DataWriter::add(const ControlAck& ack) { return add_frame<4, 4>(ack, kMostFrame, wire::kControlAckFields); }
bool DataWriter::add(const Bye& bye) { return add_frame<5, 4>(bye, kMostFrame, wire::kByeFields); }
bool DataWriter::add(const LinkReport& report) { return add_frame<6, 6>(report, kMostFrame, wire::kLinkReportFields); }
bool DataWriter::add(const DeviceReport& report) {
  return add_frame<7, 6>(report, kMostFrame, wire::kDeviceReportFields);
}
bool DataWriter::add(const PeerReport& report) { return add_frame<8, 6>(report, kMostFrame, wire::kPeerReportFields); }
bool DataWriter::add(const FieldBrick& brick) { return add_frame<11, 6>(brick, kMostFrame, wire::kFieldBrickFields); }
bool DataWriter::add(const FieldStatus& status) {
  return add_frame<12, 6>(status, kMostFrame, wire::kFieldStatusFields);
}
bool DataWriter::add(const FieldPose& pose) { return add_frame<13, 6>(pose, kMostOfAStep, wire::kFieldPoseFields); }

std::size_t DataWriter::add(std::span<const DeviceState* const> states) {
  if (frames_ == limits::kMaxFrames) return 0;
  Writer out(as_bytes(buffer_.data() + size_));
  const std::size_t taken = wire::write_columns(out, buffer_.size() - size_, states);
  if (taken == 0) return 0;
  size_ = static_cast<std::size_t>(out.at() - as_bytes(buffer_.data()));
  ++frames_;
  return taken;
}

std::string message_of(const DeviceReport& report) { return text_of(report, wire::kDeviceReportFields); }
std::string message_of(const PeerReport& report) { return text_of(report, wire::kPeerReportFields); }

const DataContent* DataReader::read(std::span<const std::byte> body) {
  if (body.size() > kMaxDatagram) return nullptr;
  return read_in_order(body, content_) ? &content_ : read_in_any_order(body);
}

const DataContent* DataReader::read_in_any_order(std::span<const std::byte> body) {
  const auto in_order = any_order_.in_order(wire::schema::kDatagram, body);
  return in_order && read_in_order(*in_order, content_) ? &content_ : nullptr;
}

}  // namespace tendon
