// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/header.h"

#include "core/base/bytes.h"
#include "protocol/link.h"
#include "protocol/messages.h"

namespace tendon {
namespace {

constexpr std::byte kMagic{0x54};

}  // namespace

std::array<std::byte, kHeaderSize> encode_header(const Header& header) noexcept {
  std::array<std::byte, kHeaderSize> bytes;
  bytes[0] = kMagic;
  bytes[kTypeByte] = static_cast<std::byte>(kProtocolVersion << 4 | static_cast<std::uint32_t>(header.type));
  bytes[2] = static_cast<std::byte>(header.epoch);
  bytes[3] = static_cast<std::byte>(header.suite);
  put_little_endian(header.connection_id, bytes.data() + kConnectionIdByte);
  put_little_endian(header.packet_number, bytes.data() + 8);
  return bytes;
}

std::optional<Header> decode_header(std::span<const std::byte> datagram) noexcept {
  if (datagram.size() < kHeaderSize || datagram.size() > kMaxDatagram) return {};
  const auto version = std::to_integer<std::uint32_t>(datagram[kTypeByte] >> 4);
  const auto type = std::to_integer<std::uint8_t>(datagram[kTypeByte] & std::byte{0x0F});
  if (datagram[0] != kMagic || version != kProtocolVersion) return {};
  if (type < 1 || type > static_cast<std::uint8_t>(DatagramType::kAnswer)) return {};
  const auto epoch = std::to_integer<std::uint8_t>(datagram[2]);
  const auto suite = std::to_integer<std::uint8_t>(datagram[3]);
  const bool is_data = type == static_cast<std::uint8_t>(DatagramType::kData);
  if (suite > static_cast<std::uint8_t>(is_data ? Suite::kAesGcm : Suite::kNoise)) return {};
  const bool renews_keys = is_data && suite != static_cast<std::uint8_t>(Suite::kPlain);
  if (epoch != 0 && !renews_keys) return {};
  return Header{.type = static_cast<DatagramType>(type),
                .suite = static_cast<Suite>(suite),
                .epoch = epoch,
                .connection_id = get_little_endian<std::uint32_t>(datagram.data() + 4),
                .packet_number = get_little_endian<std::uint64_t>(datagram.data() + 8)};
}

}  // namespace tendon
