// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <ios>
#include <span>
#include <streambuf>
#include <string_view>

// If a property is violated, the process is aborted, and libFuzzer reports this.

namespace tendon::fuzz {

inline void require(bool property) {
  if (!property) std::abort();
}

inline std::string_view text(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

class InputBuffer : public std::streambuf {
 public:
  explicit InputBuffer(std::span<const std::byte> bytes) {
    char* const begin = const_cast<char*>(text(bytes).data());  // NOLINT: streambuf asks for it, and never writes
    setg(begin, begin, begin + bytes.size());
  }

 protected:
  pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode) override {
    const off_type end = egptr() - eback();
    const off_type base = from == std::ios_base::beg ? 0 : from == std::ios_base::end ? end : gptr() - eback();
    const off_type to = base + offset;
    if (to < 0 || to > end) return pos_type(off_type{-1});
    setg(eback(), eback() + to, egptr());
    return pos_type(to);
  }
  pos_type seekpos(pos_type to, std::ios_base::openmode which) override {
    return seekoff(off_type(to), std::ios_base::beg, which);
  }
};

/// Splits the input into small decisions and pieces. After the end of the input, it returns zeros and empty pieces.
class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : left_(std::as_bytes(std::span(data, size))) {}

  bool empty() const { return left_.empty(); }
  std::uint8_t byte() {
    const auto piece = take(1);
    return piece.empty() ? std::uint8_t{0} : std::to_integer<std::uint8_t>(piece[0]);
  }
  std::span<const std::byte> take(std::size_t size) {
    const auto piece = left_.first(std::min(size, left_.size()));
    left_ = left_.subspan(piece.size());
    return piece;
  }
  std::span<const std::byte> rest() { return take(left_.size()); }

 private:
  std::span<const std::byte> left_;
};

}  // namespace tendon::fuzz
