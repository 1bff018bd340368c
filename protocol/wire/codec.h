// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "protocol/link.h"
#include "protocol/messages.h"
#include "protocol/wire/any_order.h"
#include "protocol/wire/frame.h"
#include "protocol/wire/header.h"

// Encodes and decodes Data datagrams (WIRE.md, limits.h). The encoder only truncates texts and lists and does not check
// anything else. The decoder accepts any input, never throws or prints, and returns null or nullopt if it is invalid.

namespace tendon {

/// Rounds all values except the position to single precision, as in columns.
void round_to_columns(DeviceState& state) noexcept;

/// Writes unencrypted Data datagrams without allocating memory. Call `begin`, then `add` until it returns false or all
/// data were added, then send `size()` bytes. Thread-safe: no.
class DataWriter {
 public:
  /// `buffer` must remain valid until the last `add`.
  void begin(std::span<std::byte> buffer, const Header& header, LocalTime sent,
             const std::optional<OutgoingEcho>& echo);

  /// Appends a frame. Returns false, without changing the datagram, if there is not enough room or there are already 64
  /// frames. An empty buffer of kMaxDatagram − 16 bytes has enough room for any frame.
  bool add(const DeviceState& state);
  bool add(const ForceCommand& command);
  bool add(const Control& control);
  bool add(const ControlAck& ack);
  bool add(const Bye& bye);
  bool add(const LinkReport& report);
  bool add(const DeviceReport& report);
  bool add(const PeerReport& report);
  bool add(const PortFrame& port);
  bool add(const FieldBrick& brick);
  bool add(const FieldStatus& status);
  bool add(const FieldPose& pose);

  /// Appends as many of the first states as possible, using one frame in columns, and returns their number. The states
  /// must have the same tick and time, be sorted by device, and satisfy fits_columns(). At most kMaxDevices.
  std::size_t add(std::span<const DeviceState* const> states);

  std::size_t size() const noexcept { return size_; }

 private:
  template <unsigned kBody, std::size_t kUsualFront, class Value, class List>
  bool add_frame(const Value& value, std::size_t most, List list) noexcept;

  std::span<std::byte> buffer_;
  std::size_t size_ = 0;
  int frames_ = 0;
};

std::string message_of(const DeviceReport& report);
std::string message_of(const PeerReport& report);

struct DataContent {
  PeerTime sent{};
  std::optional<IncomingEcho> echo;
  /// In order, within bounds. Columns are split into states. The weights of a brick refer to the body or to the reader.
  std::vector<Frame> frames;
  /// The number of frames and echoes with values out of bounds. They are dropped, except for requests (see
  /// Control::invalid) and answers (see Code::kInvalid) with a valid id.
  std::uint32_t invalid = 0;
  // Only the forces:
  std::uint32_t forces_not_finite = 0;
  std::uint32_t forces_out_of_bounds = 0;
};

/// Keeps its memory between calls. Thread-safe: no.
class DataReader {
 public:
  /// Decodes the bytes after the header. Returns null if they are not protobuf, if there are too many frames, or if
  /// tx_time is not usable. The content is valid until the next call.
  const DataContent* read(std::span<const std::byte> body);
  /// For tests: always uses AnyOrder.
  const DataContent* read_in_any_order(std::span<const std::byte> body);

 private:
  wire::AnyOrder any_order_;
  DataContent content_;
};

}  // namespace tendon
