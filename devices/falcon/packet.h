// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

/// Packets of the Falcon's firmware: 16 bytes, `<` p1 … p14 `>`, with p = 0x41 + nibble. Source: libnifalcon,
/// FalconFirmwareNovintSDK.cpp. There is no checksum or sequence number, so only the format can be checked here;
/// `FalconDevice` also checks the encoder counts.
namespace tendon::falcon {

inline constexpr std::size_t kPacketBytes = 16;
inline constexpr std::uint8_t kPacketBegin = '<';
inline constexpr std::uint8_t kPacketEnd = '>';

using Counts = std::array<std::int16_t, 3>;  ///< for each leg

struct Command {
  Counts torque{};  ///< −10⁴ · N·m at the joint; bytes 1-4, 5-8, 9-12; two's complement, lowest nibble first
  /// Byte 13, bit 0. The device is only homed, and stays homed, if this bit is always set.
  bool homing = true;
  /// Byte 13, bits 1-3: green 2, blue 4, red 8, as in libnifalcon's code, but not its comments.
  std::uint8_t lamps = 0;
};
inline constexpr std::uint8_t kGreen = 2;
inline constexpr std::uint8_t kBlue = 4;
inline constexpr std::uint8_t kRed = 8;

inline constexpr Command kLastCommand{.torque = {}, .homing = true, .lamps = kRed};  ///< used by the guardian

std::array<std::uint8_t, kPacketBytes> encode(const Command& command) noexcept;  ///< byte 14 is unknown and always 0

struct Reply {
  Counts encoders{};         ///< bytes 1-12, encoded like the torques
  std::uint8_t buttons = 0;  ///< byte 13: right 1, forward 2, centre 4, left 8
  std::uint8_t homed = 0;    ///< byte 13, bits 4-6: top 1, right 2, left 4
  static constexpr std::uint8_t kAllHomed = 7;
};

/// Returns nullopt if the format is invalid. Ignores byte 14.
std::optional<Reply> decode(std::span<const std::uint8_t, kPacketBytes> bytes) noexcept;

/// Finds replies in a stream with lost, corrupted or additional bytes. Skips invalid bytes one at a time, so that
/// complete replies are always found, and keeps incomplete replies. Thread-safe: no. Realtime-safe: yes.
class ReplyParser {
 public:
  /// Returns the number of bytes that were added. There is room for 64 if `next` has returned nullopt.
  std::size_t feed(std::span<const std::uint8_t> bytes) noexcept;

  std::optional<Reply> next() noexcept;

  std::uint64_t left_out() const noexcept { return left_out_; }  ///< bytes that were skipped

  void clear() noexcept { size_ = 0; }

 private:
  void drop(std::size_t count) noexcept;

  std::array<std::uint8_t, 64 + kPacketBytes> bytes_{};
  std::size_t size_ = 0;
  std::uint64_t left_out_ = 0;
};

}  // namespace tendon::falcon
