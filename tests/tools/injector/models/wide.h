// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace tendon::injector {

// NOLINTBEGIN(modernize-use-using): `using` cannot carry __extension__
__extension__ typedef unsigned __int128 Uint128;
__extension__ typedef __int128 Int128;
// NOLINTEND(modernize-use-using)

/// ⌊a · b / 2⁶⁴⌋
constexpr std::uint64_t high_half(std::uint64_t a, std::uint64_t b) noexcept {
  return static_cast<std::uint64_t>((Uint128{a} * b) >> 64);
}

}  // namespace tendon::injector
