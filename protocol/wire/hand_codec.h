// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "protocol/wire/codec.h"

// What every step sends, states and forces, to bytes and back without protobuf's objects: the same bytes, and the same
// values. Protobuf stays for all other frames, for the rare parts of these two, and as what this is compared with
// (tests/protocol/wire/hand_codec_test.cc). For codec.cc only.
//
// Realtime-safe, but for the memory of DataContent::frames.

namespace tendon::wire {

/// The most bytes that write_head() and one write_frame() write.
inline constexpr std::size_t kMostHead = 48;
inline constexpr std::size_t kMostFrame = 384;

/// Writes `Datagram.tx_time_ns` and `echo` to `to`, which has room for kMostHead bytes. How many it took.
std::size_t write_head(std::uint8_t* to, LocalTime sent, const std::optional<OutgoingEcho>& echo) noexcept;

/// Writes one of `Datagram.frames` to `to`, which has room for kMostFrame bytes. How many it took; 0, whatever `to`
/// then holds: it has a part that is left to protobuf (joints, a wanted stiffness; a model's contact).
std::size_t write_frame(std::uint8_t* to, const DeviceState& state) noexcept;
std::size_t write_frame(std::uint8_t* to, const ForceCommand& command) noexcept;

/// The states that write_columns() took, the first ones, and the bytes of their frame.
struct WrittenColumns {
  std::size_t states = 0;
  std::size_t bytes = 0;
};
/// Writes as many of `states` as fit `room` bytes as one frame in columns to `to` (DataWriter::add says of which states).
/// Empty: left to protobuf.
std::optional<WrittenColumns> write_columns(std::uint8_t* to, std::size_t room,
                                            std::span<const DeviceState* const> states) noexcept;

/// Nothing is in it, as when it was made; its frames keep their memory.
inline void empty(DataContent& content) noexcept {
  content.sent = {};
  content.echo.reset();
  content.frames.clear();
  content.invalid = content.forces_not_finite = content.forces_out_of_bounds = 0;
}

/// Reads the body of a Data datagram. True: `content` holds all of it, and it is what protobuf makes of these bytes.
/// False, whatever `content` then holds: let protobuf say what they are. It is false unless every field is known here,
/// stands where our own writer puts it, once and in its shortest form, and has a value that a receiver accepts. So
/// there is nothing here about duplicated or unknown fields, or about counting refusals: protobuf's codec does that.
bool read_by_hand(std::span<const std::byte> body, DataContent& content);

}  // namespace tendon::wire
