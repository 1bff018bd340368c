// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

// Encodes and decodes the 16 bytes at the beginning of every datagram (WIRE.md, "Header").

namespace tendon {

/// The type of a datagram, from its second byte.
enum class DatagramType : std::uint8_t {
  kHello = 1,   ///< client → server: asks for a session
  kRetry = 2,   ///< server → client: repeat the Hello with this cookie
  kData = 3,    ///< both directions, in a session
  kAnswer = 4,  ///< server → client: Welcome or Refused
};

/// The protection of a datagram, from its fourth byte.
enum class Suite : std::uint8_t {
  kPlain = 0,   ///< none; loopback only
  kNoise = 1,   ///< Noise_NNpsk0_25519_ChaChaPoly_SHA256
  kAesGcm = 2,  ///< after a handshake of suite 1, AES-256-GCM for Data
};

/// The unencrypted header of every datagram. Suites 1 and 2 authenticate it.
///
///     [0] 0x54 'T' · [1] version << 4 | type · [2] key epoch · [3] cipher suite
///     [4..8) connection id, LE · [8..16) packet number, LE
struct Header {
  DatagramType type = DatagramType::kData;
  Suite suite = Suite::kPlain;
  std::uint8_t epoch = 0;  ///< number of key renewals by the sender, modulo 256; only for Data of suites 1 and 2
  std::uint32_t connection_id = 0;  ///< 0 before the server has assigned one
  std::uint64_t packet_number = 0;  ///< 0, 1, 2 … per direction for Data, otherwise 0
  bool operator==(const Header&) const = default;
};
inline constexpr std::size_t kHeaderSize = 16;

// Byte offsets for a filter in the kernel.
inline constexpr std::uint32_t kTypeByte = 1;          ///< its lower four bits are the type
inline constexpr std::uint32_t kConnectionIdByte = 4;  ///< lowest eight bits of the connection id

std::array<std::byte, kHeaderSize> encode_header(const Header& header) noexcept;

/// Returns nullopt if the datagram is too short or too long, of another protocol or version, of an unknown type or
/// suite, or a handshake datagram of suite 2, or if a byte is set that must be 0.
std::optional<Header> decode_header(std::span<const std::byte> datagram) noexcept;

}  // namespace tendon
