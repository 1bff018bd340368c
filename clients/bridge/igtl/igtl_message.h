// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "protocol/messages.h"

// Encoding of OpenIGTLink messages with header version 1. All numbers are big-endian:
//
//     header      u16 version, char[12] type, char[20] name, u64 time, u64 size of the body, u64 CRC of the body
//                 time in s since 1970 times 2³²; texts are padded with zeros
//     TRANSFORM   f32 ×9 rotation by columns, f32 ×3 position, mm
//     SENSOR      u8 count, u8 0, u64 unit, f64 ×count
//     STATUS      u16 code, i64 subcode, char[20] name of the error, text, zero
//     STRING      u16 encoding (MIBenum of IANA), u16 length, text
//
// The CRC is that of ECMA-182: polynomial 0x42F0E1EBA9EA3693, most significant bit first, initially 0. Source: the
// protocol's specification and the headers igtl_*.h of its library 1.11, with which the tests compare.
//
// The input is untrusted: read functions return nothing if the size is wrong or a number is out of bounds.
// Thread-safe, realtime-safe: yes, except functions that append to a vector.

namespace tendon::bridge::igtl {

using Bytes = std::span<const std::byte>;
using Buffer = std::vector<std::byte>;

inline constexpr std::size_t kHeaderSize = 58;
inline constexpr std::size_t kLongestName = 20;
inline constexpr std::string_view kTransform = "TRANSFORM";
inline constexpr std::string_view kSensor = "SENSOR";
inline constexpr std::string_view kStatus = "STATUS";
inline constexpr std::string_view kString = "STRING";
inline constexpr std::string_view kGetStatus = "GET_STATUS";  ///< without a body

std::uint64_t crc64(Bytes bytes);

struct Header {
  std::uint16_t version = 1;  ///< 1 … 3
  std::string_view type{};    ///< these texts point into the bytes
  std::string_view name{};
  std::uint64_t body_size = 0;  ///< may be a lie
  std::uint64_t crc = 0;
};
/// Returns nullopt if the version is not supported, or if the type is empty or not printable ASCII. A name that is not
/// printable ASCII is empty. `bytes` must contain at least kHeaderSize bytes.
std::optional<Header> read_header(Bytes bytes);

/// Returns the position of a TRANSFORM, in mm. If a component is larger than kFarthest, the units are probably wrong.
inline constexpr double kFarthest = 10'000;
std::optional<Vec3> read_position(Bytes body);

/// Returns the three values of a SENSOR, in N. The unit must be newton with any prefix, or it must be 0.
std::optional<Vec3> read_force(Bytes body);

/// The name and the time stamp of a message.
struct Label {
  std::string_view name;  ///< at most kLongestName bytes
  Duration since_1970;
};
void append_transform(Buffer& out, const Label& label, const Mat3& rotation, const Vec3& position_mm);
void append_force(Buffer& out, const Label& label, const Vec3& force);  ///< a SENSOR in N

enum class Status : std::uint16_t {
  kOk = 1,
  kAccessDenied = 5,
  kConnectionLost = 7,
  kDisabled = 15,
  kHardwareFailure = 18,
};
void append_status(Buffer& out, const Label& label, Status status, std::string_view text);  ///< `text` is ASCII
void append_string(Buffer& out, const Label& label, std::string_view text);                 ///< `text` is ASCII

}  // namespace tendon::bridge::igtl
