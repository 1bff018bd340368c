// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

// Constants of the MCAP container format, version 0 (https://mcap.dev/spec).
//
//   file   = magic, Header, data section, DataEnd, summary section, summary offset section, Footer, magic
//   record = opcode (1 byte), length of content (8 bytes), content
//
// Integers are little-endian. Strings, arrays and maps start with their length in bytes (4 bytes).

namespace tendon::mcap {

inline constexpr std::array<std::byte, 8> kMagic = {std::byte{0x89}, std::byte{'M'}, std::byte{'C'},  std::byte{'A'},
                                                    std::byte{'P'},  std::byte{'0'}, std::byte{'\r'}, std::byte{'\n'}};

enum class Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

inline constexpr std::size_t kRecordHead = 1 + 8;

/// Updates a CRC-32 as used by zlib, PNG and Ethernet. `crc` is 0 if there are no previous bytes.
std::uint32_t extend_crc(std::uint32_t crc, std::span<const std::byte> bytes);

/// Returns the CRC of two pieces of data. `next` is the CRC of the second piece, and `size` is its length in bytes.
std::uint32_t join_crcs(std::uint32_t crc, std::uint32_t next, std::size_t size);

}  // namespace tendon::mcap
