// SPDX-License-Identifier: Apache-2.0
#include "devices/spacemouse/report.h"

#include <algorithm>
#include <cstddef>

namespace tendon::spacemouse {
namespace {

constexpr std::size_t kOneTriple = 7;
constexpr std::size_t kTwoTriples = 13;

Axes triple_at(std::span<const std::uint8_t> bytes, std::size_t at) {
  Axes axes;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    axes[i] = static_cast<std::int16_t>(bytes[at + 2 * i] | bytes[at + 2 * i + 1] << 8);
  }
  return axes;
}

}  // namespace

std::optional<Report> parse(std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() < 2) return std::nullopt;
  switch (bytes[0]) {
    case 1:
      if (bytes.size() == kOneTriple) return Motion{.translation = triple_at(bytes, 1)};
      if (bytes.size() == kTwoTriples) {
        return Motion{.translation = triple_at(bytes, 1), .rotation = triple_at(bytes, kOneTriple)};
      }
      return std::nullopt;
    case 2:
      if (bytes.size() != kOneTriple) return std::nullopt;
      return Motion{.rotation = triple_at(bytes, 1)};
    case 3: {
      Buttons buttons;
      for (std::size_t i = 1; i < std::min<std::size_t>(bytes.size(), 5); ++i) {
        buttons.held |= std::uint32_t{bytes[i]} << (8 * (i - 1));
      }
      return buttons;
    }
    case 0x17:
      if (bytes[1] > 100) return std::nullopt;
      return Battery{bytes[1]};
    default:
      return std::nullopt;
  }
}

}  // namespace tendon::spacemouse
