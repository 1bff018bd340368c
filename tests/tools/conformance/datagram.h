// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tendon.pb.h"

// An independent implementation of WIRE.md around protobuf, which shares no code with protocol/wire/codec.cc. It can
// also encode invalid datagrams.

namespace tendon::conformance {

namespace pb = tendon::v1;

using Bytes = std::vector<std::byte>;
using Span = std::span<const std::byte>;
using Sixteen = std::array<std::byte, 16>;

inline constexpr std::size_t kHeadSize = 16;
inline constexpr std::size_t kLargest = 1200;

inline constexpr std::uint8_t kHelloType = 1;
inline constexpr std::uint8_t kRetryType = 2;
inline constexpr std::uint8_t kDataType = 3;
inline constexpr std::uint8_t kAnswerType = 4;

struct Head {
  std::uint8_t magic = 0x54;
  std::uint8_t version = 1;
  std::uint8_t type = kDataType;
  std::uint8_t epoch = 0;
  std::uint8_t suite = 0;
  std::uint32_t connection_id = 0;
  std::uint64_t number = 0;
  bool operator==(const Head&) const = default;
};
Bytes write(const Head& head);
/// Returns nullopt if there are fewer than 16 bytes. This does not check the values of the fields.
std::optional<Head> read_head(Span datagram);

/// A Hello of 1200 bytes, a Retry of 48, an Answer.
Bytes hello(std::uint8_t suite, const Sixteen& random, const Sixteen& cookie, Span body);
Bytes retry(std::uint8_t suite, const Sixteen& random, const Sixteen& cookie);
Bytes answer(std::uint8_t suite, std::uint32_t connection_id, const Sixteen& random, Span body);

Sixteen sixteen(Span datagram, std::size_t at);

Bytes operator+(Bytes a, Span b);
Bytes bytes_of(std::string_view text);
Bytes bytes_of(const google::protobuf::MessageLite& message);
bool read(Span bytes, google::protobuf::MessageLite& message);

/// Returns true for |x| > 10¹² and NaN, which are invalid for every quantity.
bool far(double value);
bool far(const pb::Vec3& vector);
/// The bounds of WIRE.md, except sequence, device and channel.
bool within_bounds(const pb::ForceCommand& force);

/// For example "54 11 00 …", truncated after `most` bytes.
std::string hex(Span bytes, std::size_t most = 32);
/// Decodes hexadecimal digits of either case. White space is ignored.
Bytes from_hex(std::string_view digits);

}  // namespace tendon::conformance
