// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

namespace tendon {

/// Records packet numbers, so that each packet is accepted only once. The ring of bits is described in RFC 6479: the
/// bit of a number never moves, and advancing clears the words in between.
///
/// Call `contains` before decrypting, but `insert` after authenticating, so that forged packets cannot use up a number.
class ReplayWindow {
 public:
  /// The newest word may be nearly empty, so only 1984 of 2048 numbers are always remembered. At 1 kHz, this is about
  /// two seconds, which is longer than haptic data are useful.
  static constexpr std::uint64_t kBits = 2048;
  static constexpr std::uint64_t kRemembered = kBits - 64;

  /// Returns true if `number` was inserted or is too old.
  bool contains(std::uint64_t number) const noexcept {
    if (empty_ || number > highest_) return false;
    if (highest_ - number >= kRemembered) return true;
    return (words_[word(number)] & bit(number)) != 0;
  }

  /// `number` must not be contained.
  void insert(std::uint64_t number) noexcept {
    if (empty_ || number > highest_) {
      const std::uint64_t from = empty_ ? number / 64 : highest_ / 64;
      const std::uint64_t to = number / 64;
      const std::uint64_t steps = to - from < words_.size() ? to - from : words_.size();
      for (std::uint64_t i = 0; i < steps; ++i) words_[(to - i) % words_.size()] = 0;
      highest_ = number;
      empty_ = false;
    }
    words_[word(number)] |= bit(number);
    ++count_;
  }

  /// Bit i is set if (number − 1 − i) was inserted. `number` must not be above the highest.
  std::uint32_t mask_before(std::uint64_t number) const noexcept {
    // The 64 numbers before `number`, starting at the most significant bit.
    const std::uint64_t into = number % 64;
    const std::uint64_t whole = words_[word(number - 64)];
    const std::uint64_t before = into == 0 ? whole : words_[word(number)] << (64 - into) | whole >> into;
    const std::uint64_t behind = highest_ - number;
    const std::uint64_t known = behind < kRemembered ? kRemembered - 1 - behind : 0;
    const std::uint32_t of_these = known < 32 ? (1U << known) - 1 : ~0U;
    return reversed(static_cast<std::uint32_t>(before >> 32)) & of_these;
  }

  bool empty() const noexcept { return empty_; }
  std::uint64_t highest() const noexcept { return highest_; }
  /// The number of values from 0 to the highest that were not inserted.
  std::uint64_t missing() const noexcept { return empty_ ? 0 : highest_ + 1 - count_; }

 private:
  static std::size_t word(std::uint64_t number) noexcept { return (number / 64) % (kBits / 64); }
  static std::uint64_t bit(std::uint64_t number) noexcept { return std::uint64_t{1} << (number % 64); }

  static std::uint32_t reversed(std::uint32_t bits) noexcept {
    bits = (bits & 0x5555'5555U) << 1 | (bits >> 1 & 0x5555'5555U);
    bits = (bits & 0x3333'3333U) << 2 | (bits >> 2 & 0x3333'3333U);
    bits = (bits & 0x0F0F'0F0FU) << 4 | (bits >> 4 & 0x0F0F'0F0FU);
    bits = (bits & 0x00FF'00FFU) << 8 | (bits >> 8 & 0x00FF'00FFU);
    return bits << 16 | bits >> 16;
  }

  std::array<std::uint64_t, kBits / 64> words_{};
  std::uint64_t highest_ = 0;
  std::uint64_t count_ = 0;
  bool empty_ = true;
};

}  // namespace tendon
