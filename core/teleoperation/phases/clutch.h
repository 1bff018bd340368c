// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace tendon {

/// Returns true if the button is held. For this function and is_pressed, `bit` must not exceed 31.
constexpr bool is_held(std::uint32_t buttons, std::uint32_t bit) noexcept { return (buttons >> bit & 1U) != 0; }

/// Returns true if the button is held and was not held in the previous period.
constexpr bool is_pressed(std::uint32_t buttons, std::uint32_t before, std::uint32_t bit) noexcept {
  return is_held(buttons, bit) && !is_held(before, bit);
}

struct CouplingButton {
  std::uint32_t bit = 0;  ///< at most 31
  bool toggles = false;   ///< false if the button must be held
};

/// The clutch of the leader. Thread-safe: no. Realtime-safe: yes.
class Clutch {
 public:
  void reset() noexcept { toggled_ = false; }

  /// Returns true if the clutch is on in this period. Must be called once per period.
  bool asks(const CouplingButton& button, std::uint32_t buttons, std::uint32_t before) noexcept {
    if (is_pressed(buttons, before, button.bit)) toggled_ = !toggled_;
    return button.toggles ? toggled_ : is_held(buttons, button.bit);
  }

 private:
  bool toggled_ = false;
};

}  // namespace tendon
