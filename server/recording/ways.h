// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "protocol/limits.h"

namespace tendon {

/// The names of the solver paths that were used by the engines of a device (Hello::ways). They are numbered from 1 in
/// the order of their first use, so that a step only needs to store a number instead of a string. The same name always
/// has the same number during the lifetime of this object, even if it is used by different engines.
///
/// Thread-safe: only one thread may call `number_of`. Other threads may call `name_of` for a number that was passed to
/// them with synchronization, for example through a mailbox, because names are never modified.
/// Realtime-safe: yes.
class Ways {
 public:
  /// Typical engines have about five names, and they are the same after a restart. This requires 1.6 kB.
  static constexpr std::size_t kMost = 63;

  /// Returns 0 if `name` is empty or longer than limits::kMaxLabel, or if it is new and there are already kMost names.
  std::uint8_t number_of(std::string_view name) noexcept;

  /// Returns an empty string if the number is 0 or not in use.
  std::string_view name_of(std::uint8_t number) const noexcept;

 private:
  struct Name {
    std::array<char, limits::kMaxLabel> text{};
    std::uint8_t size = 0;
  };
  std::array<Name, kMost> names_{};
};

}  // namespace tendon
