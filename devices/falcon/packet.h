// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

/// The packets between the Falcon's firmware and the host: 16 bytes, `<` p1 … p14 `>`, with each p = 0x41 + a
/// nibble. Source: libnifalcon, FalconFirmwareNovintSDK.cpp. There is neither a checksum nor a number: a reply counts
/// as one when its frame and each of its nibbles are possible, and the encoders' steps are checked besides
/// (`FalconDevice`).
namespace tendon::falcon {

inline constexpr std::size_t kPacketBytes = 16;
inline constexpr std::uint8_t kPacketBegin = '<';
inline constexpr std::uint8_t kPacketEnd = '>';

/// One number for each of the three legs.
using Counts = std::array<std::int16_t, 3>;

/// Host to device.
struct Command {
  Counts torque{};  ///< −10⁴ · N·m at the joint; bytes 1-4, 5-8, 9-12: two's complement, least nibble first
  /// Byte 13, bit 0. The device homes, and keeps its home, while every packet has it.
  bool homing = true;
  /// Byte 13, bits 1-3: green 2, blue 4, red 8. (The comments of libnifalcon name other bits than its code.)
  std::uint8_t lamps = 0;
};
inline constexpr std::uint8_t kGreen = 2;
inline constexpr std::uint8_t kBlue = 4;
inline constexpr std::uint8_t kRed = 8;

/// No torque, and red lamps. The guardian sends it when the driver's process is dead.
inline constexpr Command kLastCommand{.torque = {}, .homing = true, .lamps = kRed};

/// Byte 14, whose meaning is unknown, is sent as nibble 0.
std::array<std::uint8_t, kPacketBytes> encode(const Command& command) noexcept;

/// Device to host.
struct Reply {
  Counts encoders{};         ///< bytes 1-12, coded like the torques
  std::uint8_t buttons = 0;  ///< byte 13, bits 0-3: right 1, forward 2, centre 4, left 8
  std::uint8_t homed = 0;    ///< byte 13, bits 4-6: top 1, right 2, left 4
  static constexpr std::uint8_t kAllHomed = 7;
};

/// The reply in these 16 bytes; empty when the frame is missing or a byte is no nibble. Byte 14 is ignored.
std::optional<Reply> decode(std::span<const std::uint8_t, kPacketBytes> bytes) noexcept;

/// Finds replies in a stream in which bytes may be lost, garbled or added. Bytes that cannot begin a reply are dropped
/// one at a time, so a whole reply is found whatever stands before it. The beginning of a reply is kept until the rest
/// comes.
///
/// Thread-safe: no. Realtime-safe: yes.
class ReplyParser {
 public:
  /// Takes as many of `bytes` as there is room for and returns how many: all of them, up to 64, once `next` is empty.
  std::size_t feed(std::span<const std::uint8_t> bytes) noexcept;

  /// The oldest reply in what was fed; empty when there is none.
  std::optional<Reply> next() noexcept;

  /// Bytes that were in no reply, so far.
  std::uint64_t left_out() const noexcept { return left_out_; }

  /// Forgets the beginning that it keeps.
  void clear() noexcept { size_ = 0; }

 private:
  void drop(std::size_t count) noexcept;

  std::array<std::uint8_t, 64 + kPacketBytes> bytes_{};
  std::size_t size_ = 0;
  std::uint64_t left_out_ = 0;
};

}  // namespace tendon::falcon
