// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>

#include "clients/c/tendon.h"

// Copies the structs of tendon.h, whose sizes depend on the version of the program's header.

namespace tendon {

/// The sizes in the first version of the header. Programs cannot have smaller structs.
inline constexpr std::size_t first_size(const tendon_config*) { return 40 + 5 * sizeof(void*); }
inline constexpr std::size_t first_size(const tendon_state*) { return 232; }
inline constexpr std::size_t first_size(const tendon_force*) { return 264; }
inline constexpr std::size_t first_size(const tendon_order*) { return 24; }
inline constexpr std::size_t first_size(const tendon_description*) { return 264; }
inline constexpr std::size_t first_size(const tendon_counts*) { return 80; }

/// Larger sizes are not plausible: the size was not set.
inline constexpr std::size_t kLargestStruct = 4096;

/// Throws std::invalid_argument "NAME …: expected …" if `given` is NULL or its size is not plausible.
template <class Struct>
void check_sized(const Struct* given, const std::string& name) {
  if (given == nullptr) throw std::invalid_argument(name + " = NULL: expected a struct");
  if (given->size < first_size(given) || given->size > kLargestStruct) {
    throw std::invalid_argument(name + ".size = " + std::to_string(given->size) + ": expected sizeof, " +
                                std::to_string(first_size(given)) + " or more");
  }
}

/// Throws std::invalid_argument if `bits` contains an unknown bit.
inline void check_bits(std::uint32_t bits, std::uint32_t known, const std::string& name) {
  if ((bits & ~known) == 0) return;
  throw std::invalid_argument(name + " = " + std::to_string(bits) + ": bits " + std::to_string(bits & ~known) +
                              " are not known by this library (TENDON_ABI " + std::to_string(TENDON_ABI) + ")");
}

/// Sets the members that the program does not have to 0. Throws the exceptions of check_sized().
template <class Struct>
Struct copy_in(const Struct* given, const std::string& name) {
  check_sized(given, name);
  Struct copy{};
  std::memcpy(&copy, given, std::min<std::size_t>(given->size, sizeof copy));
  return copy;
}

/// Writes the members that the program has. Call check_sized() first.
template <class Struct>
void copy_out(Struct full, Struct* to) noexcept {
  full.size = static_cast<std::uint32_t>(std::min<std::size_t>(to->size, sizeof full));
  std::memcpy(to, &full, full.size);
}

}  // namespace tendon
