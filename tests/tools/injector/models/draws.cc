// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/models/draws.h"

#include "tests/tools/injector/models/wide.h"

namespace tendon::injector {

std::array<std::uint32_t, 4> philox4x32(std::array<std::uint32_t, 4> counter,
                                        std::array<std::uint32_t, 2> key) noexcept {
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t even = std::uint64_t{0xD2511F53} * counter[0];
    const std::uint64_t odd = std::uint64_t{0xCD9E8D57} * counter[2];
    counter = {static_cast<std::uint32_t>(odd >> 32) ^ counter[1] ^ key[0], static_cast<std::uint32_t>(odd),
               static_cast<std::uint32_t>(even >> 32) ^ counter[3] ^ key[1], static_cast<std::uint32_t>(even)};
    key[0] += 0x9E3779B9;  // the golden ratio
    key[1] += 0xBB67AE85;  // √3 − 1
  }
  return counter;
}

Draws::Draws(std::uint64_t seed, std::uint32_t link, Direction direction) noexcept
    : key_{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)},
      link_(link),
      direction_(static_cast<std::uint32_t>(direction)) {}

std::uint64_t Draws::operator()(Purpose purpose, std::uint64_t index) const noexcept {
  const auto words = philox4x32({static_cast<std::uint32_t>(index), static_cast<std::uint32_t>(index >> 32),
                                 static_cast<std::uint32_t>(purpose) * 2 + direction_, link_},
                                key_);
  return words[0] + (std::uint64_t{words[1]} << 32);
}

std::uint64_t one_of(std::uint64_t n, std::uint64_t draw) noexcept { return high_half(draw, n); }

}  // namespace tendon::injector
