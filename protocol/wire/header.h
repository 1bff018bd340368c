// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

// The 16 bytes at the front of every datagram: the only place that knows their order (WIRE.md, "Header").

namespace tendon {

/// What a datagram is, from its second byte.
enum class DatagramType : std::uint8_t {
  kHello = 1,   ///< client → server: may I come in?
  kRetry = 2,   ///< server → client: say it again with this cookie
  kData = 3,    ///< either way, once connected
  kAnswer = 4,  ///< server → client: Welcome or Refused
};

/// How a datagram is protected, from the fourth byte.
enum class Suite : std::uint8_t {
  kPlain = 0,   ///< not at all: loopback only
  kNoise = 1,   ///< Noise_NNpsk0_25519_ChaChaPoly_SHA256
  kAesGcm = 2,  ///< the handshake of suite 1, and AES-256-GCM from then on: Data only
};

/// The 16 bytes in the clear at the front of every datagram; suites 1 and 2 authenticate them.
///
///     [0] 0x54 'T' · [1] version << 4 | type · [2] key epoch · [3] cipher suite
///     [4..8) connection id, LE · [8..16) packet number, LE
struct Header {
  DatagramType type = DatagramType::kData;
  Suite suite = Suite::kPlain;
  std::uint8_t epoch = 0;  ///< how often the sender has renewed its key, modulo 256; Data of suites 1 and 2 only
  std::uint32_t connection_id = 0;  ///< 0 before the server has given one
  std::uint64_t packet_number = 0;  ///< 0, 1, 2 … per direction in Data, 0 in all others
  bool operator==(const Header&) const = default;
};
inline constexpr std::size_t kHeaderSize = 16;

// For a filter in the kernel, which reads single bytes:
inline constexpr std::uint32_t kTypeByte = 1;          ///< its lower four bits: the type
inline constexpr std::uint32_t kConnectionIdByte = 4;  ///< the lowest eight bits of the connection id

std::array<std::byte, kHeaderSize> encode_header(const Header& header) noexcept;

/// Empty when the datagram is too short, too long, of another protocol or version, of an unknown type or
/// suite, of the handshake in suite 2, or has a byte set that must be 0.
std::optional<Header> decode_header(std::span<const std::byte> datagram) noexcept;

}  // namespace tendon
