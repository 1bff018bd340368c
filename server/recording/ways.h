// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "protocol/limits.h"

namespace tendon {

/// The names of the ways in which the engines of a device have answered (Hello::ways), numbered from 1 in the order in
/// which they were first used: so a step, which the haptic thread may not let hold a text, holds a number. A number has
/// the same name for as long as this object lives, whichever engine says it.
///
/// Thread-safe: one thread numbers. Any other may ask for the name of a number that has come to it, as by the mailboxes,
/// since that was given out: what is written once is not written again. Realtime-safe: yes.
class Ways {
 public:
  /// Engines have five or so; those of a hundred restarts have the same ones. 1.6 kB.
  static constexpr std::size_t kMost = 63;

  /// 0, which is none: `name` is empty or longer than limits::kMaxLabel, or is new where there are kMost already.
  std::uint8_t number_of(std::string_view name) noexcept;

  /// Empty: of 0, and of a number that has not been given out.
  std::string_view name_of(std::uint8_t number) const noexcept;

 private:
  struct Name {
    std::array<char, limits::kMaxLabel> text{};
    std::uint8_t size = 0;
  };
  std::array<Name, kMost> names_{};
};

}  // namespace tendon
