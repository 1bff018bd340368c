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

// Data datagrams as values, to bytes and back. The bytes are in WIRE.md, the bounds in limits.h.
//
// Encoding trusts its input, except that texts and lists are cut to their bounds. Decoding trusts nothing: it never
// throws, never prints, and returns "nothing" for what it refuses.

namespace tendon {

/// Whether a DeviceState has nothing that columns cannot say: a wanted force, a handle that turns, grips or has joints.
inline bool fits_columns(const DeviceState& state) noexcept {
  return !state.force_wanted && !state.stiffness_wanted && !state.turning && !state.torque_applied && !state.grip &&
         !state.grip_applied && !state.hand_force && !state.joints;
}

/// As it is when it has come in columns: all but its position rounded to single precision.
void round_to_columns(DeviceState& state) noexcept;

/// Writes one Data datagram after the other, in the clear. It never allocates memory.
///
/// Use: `begin`, `add` until it is false or nothing is left, then send `size()` bytes.
///
/// Thread-safe: no.
class DataWriter {
 public:
  /// `buffer` must live until the last `add`; what is written stays within it.
  void begin(std::span<std::byte> buffer, const Header& header, LocalTime sent,
             const std::optional<OutgoingEcho>& echo);

  /// Appends one frame; false when it does not fit any more, or is the 65th (then the datagram is as before). A buffer
  /// of kMaxDatagram − 16 bytes or more, without other frames, holds any frame.
  bool add(const DeviceState& state);
  bool add(const ForceCommand& command);
  bool add(const Control& control);
  bool add(const ControlAck& ack);
  bool add(const Bye& bye);
  bool add(const LinkReport& report);
  bool add(const DeviceReport& report);
  bool add(const PeerReport& report);
  bool add(const PortFrame& port);

  /// Appends states as one frame in columns: as many of the first ones as fit, and how many they were; 0: none, and the
  /// datagram is as before. They are of one tick and one instant, in the order of their devices, each has
  /// fits_columns(), and there are at most kMaxDevices of them.
  std::size_t add(std::span<const DeviceState* const> states);

  std::size_t size() const noexcept { return size_; }

 private:
  template <unsigned kBody, std::size_t kUsualFront, class Value, class List>
  bool add_frame(const Value& value, std::size_t most, List list) noexcept;

  std::span<std::byte> buffer_;
  std::size_t size_ = 0;
  int frames_ = 0;
};

/// Encodes the message alone, without the frame and the datagram around it.
std::string message_of(const DeviceReport& report);
std::string message_of(const PeerReport& report);

/// What a Data datagram holds.
struct DataContent {
  PeerTime sent{};
  std::optional<IncomingEcho> echo;
  std::vector<Frame> frames;  ///< in the order of the datagram, every value within bounds; of columns each state
  /// The number of frames and echoes with a value out of bounds. They are left out, except for requests
  /// (see Control::invalid) and answers (see Code::kInvalid) with a valid id.
  std::uint32_t invalid = 0;
  // Of these, the forces:
  std::uint32_t forces_not_finite = 0;
  std::uint32_t forces_out_of_bounds = 0;
};

/// Reads one Data datagram after the other. Keeps its memory.
///
/// Thread-safe: no.
class DataReader {
 public:
  /// `body` is what follows the header. Null when it is malformed: not protobuf, too many frames, or
  /// without a usable tx_time. The content lives until the next call.
  const DataContent* read(std::span<const std::byte> body);
  /// Does the same, but always through AnyOrder. Tests compare the two.
  const DataContent* read_in_any_order(std::span<const std::byte> body);

 private:
  wire::AnyOrder any_order_;
  DataContent content_;
};

}  // namespace tendon
