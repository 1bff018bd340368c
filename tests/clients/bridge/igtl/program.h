// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "clients/bridge/igtl/igtl_message.h"

// These functions are used to test the bridge with the messages of a program.

namespace tendon::bridge::igtl {

inline Buffer transform(std::string_view name, const Vec3& position_mm) {
  Buffer out;
  append_transform(out, {name, {}}, Mat3::Identity(), position_mm);
  return out;
}

inline Buffer sensor(std::string_view name, const Vec3& force) {
  Buffer out;
  append_force(out, {name, {}}, force);
  return out;
}

/// Writes `value` over the bytes at `at`.
template <class Whole>
void put(Buffer& message, std::size_t at, Whole value) {
  for (std::size_t i = 0; i < sizeof(Whole); ++i) {
    message.at(at + i) = static_cast<std::byte>(std::uint64_t{value} >> (8 * (sizeof(Whole) - 1 - i)) & 0xffU);
  }
}
inline constexpr std::size_t kSizeAt = 42;  ///< the position of the size in the header
inline constexpr std::size_t kCrcAt = 50;

/// Corrects the CRC after a change of the body.
inline Buffer sealed(Buffer message) {
  put(message, kCrcAt, crc64(std::span(message).subspan(kHeaderSize)));
  return message;
}

/// Only the header of a message, which announces a body.
inline Buffer announced(std::string_view type, std::string_view name, std::uint64_t size) {
  Buffer out(kHeaderSize);
  put(out, 0, std::uint16_t{1});
  for (std::size_t i = 0; i < type.size(); ++i) out.at(2 + i) = static_cast<std::byte>(type[i]);
  for (std::size_t i = 0; i < name.size(); ++i) out.at(14 + i) = static_cast<std::byte>(name[i]);
  put(out, kSizeAt, size);
  return out;
}

struct Said {
  std::string type;
  std::string name;
  Duration since_1970;
  Buffer body;

  std::uint64_t whole(std::size_t at, std::size_t bytes) const {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) value = value << 8U | std::to_integer<std::uint64_t>(body.at(at + i));
    return value;
  }
  double f32(std::size_t i) const {  ///< number i of a TRANSFORM
    return static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(whole(4 * i, 4))));
  }
  Vec3 position() const { return {f32(9), f32(10), f32(11)}; }
  std::string text(std::size_t at) const {  ///< the text that starts at this byte
    std::string words(reinterpret_cast<const char*>(body.data()) + at, body.size() - at);
    return words.substr(0, words.find('\0'));
  }
};

/// Reads complete messages from the stream of the bridge. Throws std::runtime_error if it is broken.
class Reader {
 public:
  std::vector<Said> take(Bytes bytes) {
    in_.insert(in_.end(), bytes.begin(), bytes.end());
    std::vector<Said> all;
    std::size_t used = 0;
    while (in_.size() - used >= kHeaderSize) {
      const Bytes left = std::span(in_).subspan(used);
      const auto header = read_header(left);
      if (!header || header->version != 1) throw std::runtime_error("a header of the bridge is broken");
      const auto size = static_cast<std::size_t>(header->body_size);
      if (left.size() < kHeaderSize + size) break;
      const Bytes body = left.subspan(kHeaderSize, size);
      if (crc64(body) != header->crc) throw std::runtime_error("a CRC of the bridge is wrong");
      Said one{std::string(header->type), std::string(header->name), {}, Buffer(left.begin() + 34, left.begin() + 42)};
      const std::uint64_t time = one.whole(0, 8);
      one.since_1970 =
          std::chrono::seconds(time >> 32U) + from_seconds(static_cast<double>(time & 0xffffffffU) / 0x1p32);
      one.body.assign(body.begin(), body.end());
      all.push_back(std::move(one));
      used += kHeaderSize + size;
    }
    in_.erase(in_.begin(), in_.begin() + static_cast<std::ptrdiff_t>(used));
    return all;
  }

 private:
  Buffer in_;
};

}  // namespace tendon::bridge::igtl
