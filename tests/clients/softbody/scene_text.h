// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace tendon::softbody::testing {

inline const std::string kGood = R"(effects = ["contact"]
[body]
shape = "block"
size_mm = [100, 100, 50]
cells = [4, 4, 2]
element = "hex8-sri"
material = { young_pa = 10000, poisson = 0.45 }
[model]
kind = "condensed"
[touch]
patch_radius_mm = 20
[place]
at_mm = [10, 0, 0]
towards_hand = [-1, 0, 0]
)";

inline std::string with(std::string_view old, std::string_view replacement) {
  std::string text = kGood;
  text.replace(text.find(old), old.size(), replacement);
  return text;
}

inline constexpr std::string_view kCut =
    "[[cutting]]\ncorner_mm = [0, -60, 25]\nalong_mm = [0, 120, 0]\ndeep_mm = [0, 0, 30]\n";

/// kGood with another model and effects, followed by `tables`.
inline std::string listing(const std::string& model, const std::string& effects, const std::string& tables) {
  std::string text = with("condensed", model);
  text.replace(text.find("[\"contact\"]"), 11, effects);
  return text + tables;
}

}  // namespace tendon::softbody::testing
