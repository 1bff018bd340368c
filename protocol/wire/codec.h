// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/base/time.h"
#include "protocol/link.h"
#include "protocol/messages.h"
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

/// Writes one Data datagram after the other, in the clear. States and forces are written by hand (hand_codec.h), all
/// else by protobuf, which keeps its objects: a state or a force costs no heap call (a request, or a long text, does).
///
/// Use: `begin`, `add` until it is false or nothing is left, then send `size()` bytes.
///
/// Thread-safe: no.
class DataWriter {
 public:
  DataWriter();
  ~DataWriter();
  DataWriter(DataWriter&&) noexcept;
  DataWriter& operator=(DataWriter&&) noexcept;

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

  /// The same by protobuf alone: what `add` does with the rare parts of these two frames, and on a machine that holds
  /// numbers the other way round. It writes the same bytes.
  bool add_by_protobuf(const DeviceState& state);
  std::size_t add_by_protobuf(std::span<const DeviceState* const> states);
  bool add_by_protobuf(const ForceCommand& command);

  std::size_t size() const noexcept { return size_; }

 private:
  struct Pieces;
  template <class Value>
  std::size_t write_by_hand(const Value& value) noexcept;
  template <class Piece>
  bool append(const Piece& piece);
  bool count(std::size_t size) noexcept {
    size_ += size;
    ++frames_;
    return true;
  }

  std::unique_ptr<Pieces> pieces_;
  std::span<std::byte> buffer_;
  std::size_t size_ = 0;
  int frames_ = 0;
};

/// What a Data datagram holds.
struct DataContent {
  PeerTime sent{};
  std::optional<IncomingEcho> echo;
  std::vector<Frame> frames;  ///< in the order of the datagram, every value within bounds; of columns each state
  std::uint32_t invalid = 0;  ///< frames (and echoes) left out because a value was out of bounds
  // Of these, the forces:
  std::uint32_t forces_not_finite = 0;
  std::uint32_t forces_out_of_bounds = 0;
};

/// Reads one Data datagram after the other. Keeps its memory.
///
/// Thread-safe: no.
class DataReader {
 public:
  DataReader();
  ~DataReader();
  DataReader(DataReader&&) noexcept;
  DataReader& operator=(DataReader&&) noexcept;

  /// `body` is what follows the header. Null when it is malformed: not protobuf, too many frames, or
  /// without a usable tx_time. The content lives until the next call.
  const DataContent* read(std::span<const std::byte> body);
  /// The same by protobuf alone: what `read` does with all but usual states and forces. It gives the same content.
  const DataContent* read_by_protobuf(std::span<const std::byte> body);

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace tendon
