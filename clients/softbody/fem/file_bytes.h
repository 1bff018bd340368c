// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

namespace tendon::softbody {

static_assert(std::endian::native == std::endian::little, "the bytes of files are those of memory");

template <class Value>
void put(std::string& bytes, const Value& value) {
  const auto raw = std::bit_cast<std::array<char, sizeof(Value)>>(value);
  bytes.append(raw.data(), raw.size());
}

class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : left_(bytes) {}

  /// Throws std::invalid_argument if there are too few bytes.
  template <class Value>
  Value take() {
    if (left_.size() < sizeof(Value)) throw std::invalid_argument("it is truncated");
    Value value;
    std::memcpy(&value, left_.data(), sizeof value);
    left_.remove_prefix(sizeof value);
    return value;
  }
  std::size_t left() const noexcept { return left_.size(); }

 private:
  std::string_view left_;
};

std::uint64_t checksum(std::string_view bytes);  ///< XXH3 hash (64 bits)

/// Returns the bytes before the checksum, the last 8. Throws std::invalid_argument if it does not match.
std::string_view without_checksum(std::string_view bytes);

/// Writes a file for the caller to rename. If it cannot be written, removes it and throws std::runtime_error.
void write_draft(const std::filesystem::path& draft, std::string_view bytes);

}  // namespace tendon::softbody
