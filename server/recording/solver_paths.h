// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "protocol/limits.h"

namespace tendon {

/// The names of the solver paths of a device (Hello::ways), numbered from 1 in the order of their first use, so that a
/// step stores a number instead of a string. The numbers are valid during the lifetime of this object.
/// Thread-safe: only one thread may call `number_of`. Other threads may call `name_of` for a number that they have
/// received with synchronization, for example through a mailbox. Realtime-safe: yes.
class SolverPaths {
 public:
  static constexpr std::size_t kMost = 63;  ///< typical engines have about five names; 1.6 kB

  /// Returns 0 if `name` is empty or longer than limits::kMaxLabel, or if it is new and there are already kMost names.
  std::uint8_t number_of(std::string_view name) noexcept;

  std::string_view name_of(std::uint8_t number) const noexcept;

 private:
  struct Name {
    std::array<char, limits::kMaxLabel> text{};
    std::uint8_t size = 0;
  };
  std::array<Name, kMost> names_{};
};

}  // namespace tendon
