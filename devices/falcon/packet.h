// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

/// The packets between the Falcon's firmware and the host have 16 bytes, `<` p1 … p14 `>`, where each p is 0x41 + a
/// nibble. Source: libnifalcon, FalconFirmwareNovintSDK.cpp. A packet has neither a checksum nor a sequence number: 16
/// bytes are a reply if their frame and all nibbles are valid. `FalconDevice` also checks how far the encoders moved.
namespace tendon::falcon {

inline constexpr std::size_t kPacketBytes = 16;
inline constexpr std::uint8_t kPacketBegin = '<';
inline constexpr std::uint8_t kPacketEnd = '>';

/// One number per leg.
using Counts = std::array<std::int16_t, 3>;

/// Host to device.
struct Command {
  Counts torque{};  ///< −10⁴ · N·m at the joint; bytes 1-4, 5-8, 9-12: two's complement, least significant nibble first
  /// Byte 13, bit 0. Must be set in every packet for the device to home and to stay homed.
  bool homing = true;
  /// Byte 13, bits 1-3: green 2, blue 4, red 8, as in libnifalcon's code; its comments give other bits.
  std::uint8_t lamps = 0;
};
inline constexpr std::uint8_t kGreen = 2;
inline constexpr std::uint8_t kBlue = 4;
inline constexpr std::uint8_t kRed = 8;

/// No torque and red lamps. The guardian sends this if the driver's process dies.
inline constexpr Command kLastCommand{.torque = {}, .homing = true, .lamps = kRed};

/// Byte 14, whose meaning is unknown, is sent as nibble 0.
std::array<std::uint8_t, kPacketBytes> encode(const Command& command) noexcept;

/// Device to host.
struct Reply {
  Counts encoders{};         ///< bytes 1-12, encoded like the torques
  std::uint8_t buttons = 0;  ///< byte 13, bits 0-3: right 1, forward 2, centre 4, left 8
  std::uint8_t homed = 0;    ///< byte 13, bits 4-6: top 1, right 2, left 4
  static constexpr std::uint8_t kAllHomed = 7;
};

/// Returns nullopt if the frame is missing or a byte is not a nibble. Byte 14 is ignored.
std::optional<Reply> decode(std::span<const std::uint8_t, kPacketBytes> bytes) noexcept;

/// Finds replies in a stream in which bytes may be lost, corrupted or added. Bytes that cannot begin a reply are
/// skipped one at a time, so a complete reply is found whatever precedes it. The beginning of a reply is kept until the
/// rest arrives.
///
/// Thread-safe: no. Realtime-safe: yes.
class ReplyParser {
 public:
  /// Adds as many of `bytes` as there is room for, and returns their number. There is room for 64 after `next` has
  /// returned nullopt.
  std::size_t feed(std::span<const std::uint8_t> bytes) noexcept;

  /// Removes and returns the oldest reply, or nullopt if there is none.
  std::optional<Reply> next() noexcept;

  /// Number of bytes so far that belong to no reply.
  std::uint64_t left_out() const noexcept { return left_out_; }

  /// Discards an incomplete reply.
  void clear() noexcept { size_ = 0; }

 private:
  void drop(std::size_t count) noexcept;

  std::array<std::uint8_t, 64 + kPacketBytes> bytes_{};
  std::size_t size_ = 0;
  std::uint64_t left_out_ = 0;
};

}  // namespace tendon::falcon
