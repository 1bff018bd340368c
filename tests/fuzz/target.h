// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

// What the fuzz targets have in common. A property that fails ends the process: that is how libFuzzer is told.

namespace tendon::fuzz {

inline void require(bool property) {
  if (!property) std::abort();
}

/// The input as a sequence of small decisions and of pieces; when it is used up, zeros and empty pieces.
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
