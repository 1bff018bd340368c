// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace tendon {

enum class DatagramType : std::uint8_t {
  kHello = 1,   ///< client → server
  kRetry = 2,   ///< server → client, with a cookie
  kData = 3,    ///< both directions, in a session
  kAnswer = 4,  ///< server → client: Welcome or Refused
};

enum class Suite : std::uint8_t {
  kPlain = 0,   ///< unencrypted; loopback only
  kNoise = 1,   ///< Noise_NNpsk0_25519_ChaChaPoly_SHA256
  kAesGcm = 2,  ///< for Data, after a handshake of suite 1
};

/// The header of all datagrams (WIRE.md, "Header"). It is authenticated in suites 1 and 2.
///
///     [0] 0x54 'T' · [1] version << 4 | type · [2] key epoch · [3] cipher suite
///     [4..8) connection id, LE · [8..16) packet number, LE
struct Header {
  DatagramType type = DatagramType::kData;
  Suite suite = Suite::kPlain;
  std::uint8_t epoch = 0;           ///< key renewals modulo 256, for Data of suites 1 and 2
  std::uint32_t connection_id = 0;  ///< 0 until assigned by the server
  std::uint64_t packet_number = 0;  ///< per direction, for Data only
  bool operator==(const Header&) const = default;
};
inline constexpr std::size_t kHeaderSize = 16;

// For kernel filters:
inline constexpr std::uint32_t kTypeByte = 1;          ///< type in the lower four bits
inline constexpr std::uint32_t kConnectionIdByte = 4;  ///< lowest byte of the connection id

std::array<std::byte, kHeaderSize> encode_header(const Header& header) noexcept;

/// Returns nullopt if size, protocol, version, type or suite (2 in a handshake) is invalid, or a reserved byte not 0.
std::optional<Header> decode_header(std::span<const std::byte> datagram) noexcept;

}  // namespace tendon
