// SPDX-License-Identifier: Apache-2.0
#include "devices/falcon/packet.h"

#include <algorithm>

namespace tendon::falcon {
namespace {

constexpr std::uint8_t kZero = 0x41;
constexpr std::size_t kNibbles = 4;

}  // namespace

std::array<std::uint8_t, kPacketBytes> encode(const Command& command) noexcept {
  std::array<std::uint8_t, kPacketBytes> bytes;
  bytes.fill(kZero);
  bytes.front() = kPacketBegin;
  bytes.back() = kPacketEnd;
  for (std::size_t leg = 0; leg < command.torque.size(); ++leg) {
    const auto count = static_cast<std::uint16_t>(command.torque[leg]);
    for (std::size_t i = 0; i < kNibbles; ++i) {
      bytes[1 + kNibbles * leg + i] = static_cast<std::uint8_t>(kZero + ((count >> (4 * i)) & 15U));
    }
  }
  bytes[13] =
      static_cast<std::uint8_t>(kZero + ((command.lamps & (kGreen | kBlue | kRed)) | (command.homing ? 1U : 0U)));
  return bytes;
}

std::optional<Reply> decode(std::span<const std::uint8_t, kPacketBytes> bytes) noexcept {
  if (bytes.front() != kPacketBegin || bytes.back() != kPacketEnd) return std::nullopt;
  Reply reply;
  for (std::size_t leg = 0; leg < reply.encoders.size(); ++leg) {
    unsigned count = 0;
    for (std::size_t i = 0; i < kNibbles; ++i) {
      // Bytes below kZero become very large.
      const unsigned nibble = bytes[1 + kNibbles * leg + i] - unsigned{kZero};
      if (nibble > 15) return std::nullopt;
      count |= nibble << (4 * i);
    }
    reply.encoders[leg] = static_cast<std::int16_t>(count);
  }
  const unsigned flags = bytes[13] - unsigned{kZero};
  if (flags > 0x7F) return std::nullopt;
  reply.buttons = static_cast<std::uint8_t>(flags & 15U);
  reply.homed = static_cast<std::uint8_t>(flags >> 4);
  return reply;
}

std::size_t ReplyParser::feed(std::span<const std::uint8_t> bytes) noexcept {
  const std::size_t count = std::min(bytes.size(), bytes_.size() - size_);
  std::copy_n(bytes.begin(), count, bytes_.begin() + static_cast<std::ptrdiff_t>(size_));
  size_ += count;
  return count;
}

void ReplyParser::drop(std::size_t count) noexcept {
  std::copy(bytes_.begin() + static_cast<std::ptrdiff_t>(count), bytes_.begin() + static_cast<std::ptrdiff_t>(size_),
            bytes_.begin());
  size_ -= count;
}

std::optional<Reply> ReplyParser::next() noexcept {
  std::size_t begin = 0;
  std::optional<Reply> reply;
  for (; begin < size_ && !reply; ++begin) {
    if (bytes_[begin] != kPacketBegin) continue;
    if (size_ - begin < kPacketBytes) break;
    reply = decode(std::span(bytes_).subspan(begin).first<kPacketBytes>());
    if (reply) break;
  }
  left_out_ += begin;
  drop(reply ? begin + kPacketBytes : begin);
  return reply;
}

}  // namespace tendon::falcon
