// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace tendon {

/// Hand-written protobuf for messages that our writer cannot produce.
class RawProtobuf {
 public:
  RawProtobuf& varint(unsigned field, std::uint64_t value) {
    put_varint(field << 3U);
    put_varint(value);
    return *this;
  }
  RawProtobuf& fixed64(unsigned field, std::uint64_t value) {
    put_varint(field << 3U | 1U);
    for (unsigned i = 0; i < 8; ++i) bytes_.push_back(static_cast<std::byte>(value >> (8 * i)));
    return *this;
  }
  RawProtobuf& text(unsigned field, std::string_view value) {
    put_varint(field << 3U | 2U);
    put_varint(value.size());
    for (const char c : value) bytes_.push_back(static_cast<std::byte>(c));
    return *this;
  }
  RawProtobuf& message(unsigned field, const RawProtobuf& value) {
    put_varint(field << 3U | 2U);
    put_varint(value.bytes_.size());
    bytes_.insert(bytes_.end(), value.bytes_.begin(), value.bytes_.end());
    return *this;
  }
  RawProtobuf& packed(unsigned field, const std::vector<double>& values) {
    put_varint(field << 3U | 2U);
    put_varint(8 * values.size());
    for (const double value : values) {
      const auto bits = std::bit_cast<std::uint64_t>(value);
      for (unsigned i = 0; i < 8; ++i) bytes_.push_back(static_cast<std::byte>(bits >> (8 * i)));
    }
    return *this;
  }
  const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  void put_varint(std::uint64_t value) {
    for (; value >= 0x80; value >>= 7) bytes_.push_back(static_cast<std::byte>(value | 0x80));
    bytes_.push_back(static_cast<std::byte>(value));
  }

  std::vector<std::byte> bytes_;
};

}  // namespace tendon
