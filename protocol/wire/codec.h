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

// Encodes and decodes Data datagrams. WIRE.md describes the bytes, limits.h the bounds.
//
// The encoder does not check its input, but truncates texts and lists to their bounds. The decoder accepts any input:
// it never throws or prints, and it returns null or nullopt for bad input.

namespace tendon {

/// Returns true if columns can represent this state, which requires that it has no wanted force and no orientation,
/// torque, gripper, force sensor or joints.
inline bool fits_columns(const DeviceState& state) noexcept {
  return !state.force_wanted && !state.stiffness_wanted && !state.turning && !state.torque_applied && !state.grip &&
         !state.grip_applied && !state.hand_force && !state.joints;
}

/// Rounds everything except the position to single precision, as transmission in columns does.
void round_to_columns(DeviceState& state) noexcept;

/// Writes Data datagrams without encryption. It never allocates memory.
///
/// Call `begin`, then `add` until it returns false or nothing is left, then send `size()` bytes.
///
/// Thread-safe: no.
class DataWriter {
 public:
  /// `buffer` must remain valid until the last `add`.
  void begin(std::span<std::byte> buffer, const Header& header, LocalTime sent,
             const std::optional<OutgoingEcho>& echo);

  /// Appends one frame. Returns false, and leaves the datagram unchanged, if the frame does not fit or would be the
  /// 65th. Any frame fits into an otherwise empty buffer of at least kMaxDatagram − 16 bytes.
  bool add(const DeviceState& state);
  bool add(const ForceCommand& command);
  bool add(const Control& control);
  bool add(const ControlAck& ack);
  bool add(const Bye& bye);
  bool add(const LinkReport& report);
  bool add(const DeviceReport& report);
  bool add(const PeerReport& report);
  bool add(const PortFrame& port);

  /// Appends as many of the first states as fit, as one frame in columns, and returns their number. If it returns 0,
  /// the datagram is unchanged. The states must belong to the same tick and time, be sorted by device, satisfy
  /// fits_columns(), and number kMaxDevices at most.
  std::size_t add(std::span<const DeviceState* const> states);

  std::size_t size() const noexcept { return size_; }

 private:
  template <unsigned kBody, std::size_t kUsualFront, class Value, class List>
  bool add_frame(const Value& value, std::size_t most, List list) noexcept;

  std::span<std::byte> buffer_;
  std::size_t size_ = 0;
  int frames_ = 0;
};

/// Encodes only the message, without frame and datagram.
std::string message_of(const DeviceReport& report);
std::string message_of(const PeerReport& report);

/// The decoded content of a Data datagram.
struct DataContent {
  PeerTime sent{};
  std::optional<IncomingEcho> echo;
  /// in the order of the datagram, all values within bounds; columns yield one frame per state
  std::vector<Frame> frames;
  /// The number of frames and echoes that were dropped because a value is out of bounds. Requests (see
  /// Control::invalid) and answers (see Code::kInvalid) with a valid id are counted but not dropped.
  std::uint32_t invalid = 0;
  // Those of them that are forces:
  std::uint32_t forces_not_finite = 0;
  std::uint32_t forces_out_of_bounds = 0;
};

/// Reads Data datagrams. The object keeps its memory between calls.
///
/// Thread-safe: no.
class DataReader {
 public:
  /// Decodes `body`, the bytes after the header. Returns null if it is malformed: if it is not protobuf, has too many
  /// frames, or has no usable tx_time. The content is valid until the next call.
  const DataContent* read(std::span<const std::byte> body);
  /// Does the same, but always through AnyOrder, so that tests can compare the two.
  const DataContent* read_in_any_order(std::span<const std::byte> body);

 private:
  wire::AnyOrder any_order_;
  DataContent content_;
};

}  // namespace tendon
