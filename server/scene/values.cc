// SPDX-License-Identifier: Apache-2.0
#include "server/scene/values.h"

#include <cctype>
#include <charconv>
#include <numbers>
#include <system_error>

namespace tendon::scene_file {
namespace {

/// Longer suffixes must be first.
constexpr std::array kUnits = {
    Unit{"_nm_s_per_rad", "N·m·s/rad", 1},
    Unit{"_nm_per_rad", "N·m/rad", 1},
    Unit{"_mm_per_rad", "mm/rad", 1e3},
    Unit{"_deg_per_s", "°/s", 180 / std::numbers::pi},
    Unit{"_n_s_per_m", "N·s/m", 1},
    Unit{"_kb_per_s", "kB/s", 1e-3},
    Unit{"_rad_per_s2", "rad/s²", 1},
    Unit{"_kg_per_m3", "kg/m³", 1},
    Unit{"_mm_per_s", "mm/s", 1e3},
    Unit{"_m_per_s2", "m/s²", 1},
    Unit{"_nm_per_s", "N·m/s", 1},
    Unit{"_m_per_s", "m/s", 1},
    Unit{"_n_per_m", "N/m", 1},
    Unit{"_n_per_s", "N/s", 1},
    Unit{"_n_m_s", "N·m·s/rad", 1},
    Unit{"_kg_m2", "kg·m²", 1},
    Unit{"_percent", "%", 100},
    Unit{"_per_m", "1/m", 1},
    Unit{"_per_s", "1/s", 1},
    Unit{"_n_m", "N·m", 1},
    Unit{"_deg", "°", 180 / std::numbers::pi},
    Unit{"_min", "min", 1.0 / 60},
    Unit{"_rad", "rad", 1},
    Unit{"_hz", "Hz", 1},
    Unit{"_kg", "kg", 1},
    Unit{"_ma", "mA", 1e3},
    Unit{"_mb", "MB", 1e-6},
    Unit{"_mj", "mJ", 1e3},
    Unit{"_mm", "mm", 1e3},
    Unit{"_ms", "ms", 1e3},
    Unit{"_nm", "N·m", 1},
    Unit{"_ppm", "ppm", 1e6},
    Unit{"_pa", "Pa", 1},
    Unit{"_um", "µm", 1e6},
    Unit{"_us", "µs", 1e6},
    Unit{"_j", "J", 1},
    Unit{"_m", "m", 1},
    Unit{"_n", "N", 1},
    Unit{"_s", "s", 1},
    Unit{"_w", "W", 1},
};

}  // namespace

const Unit& unit_of(std::string_view key) {
  const auto* const found =
      std::find_if(kUnits.begin(), kUnits.end(), [key](const Unit& unit) { return key.ends_with(unit.suffix); });
  return found == kUnits.end() ? kNoUnit : *found;
}

std::string with_symbol(std::string text, const Unit& unit) {
  if (!unit.symbol.empty()) text.append(" ").append(unit.symbol);
  return text;
}

std::string digits(double value) {
  std::array<char, 32> text{};
  const double size = std::abs(value);
  const bool plain = size == 0 || (size >= 1e-4 && size < 1e9);
  const auto end = plain ? std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed).ptr
                         : std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

std::string in_quotes(std::string_view text) { return '"' + std::string(text) + '"'; }

std::string found_in(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::string:
      return in_quotes(**node.as_string());
    case toml::node_type::integer:
      return std::to_string(**node.as_integer());
    case toml::node_type::floating_point:
      return digits(**node.as_floating_point());
    case toml::node_type::boolean:
      return **node.as_boolean() ? "true" : "false";
    case toml::node_type::array:
      return "an array of " + std::to_string(node.as_array()->size());
    case toml::node_type::table:
      return "a table";
    default:
      return "a date or time";
  }
}

std::optional<double> number_in(const toml::node& node) {
  if (const auto* integer = node.as_integer()) return static_cast<double>(**integer);
  if (const auto* number = node.as_floating_point()) return **number;
  return std::nullopt;
}

bool in_a_label(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_'; }

std::string label_of(std::string text) {
  text.resize(std::min(text.size(), limits::kMaxLabel));
  for (char& c : text) c = in_a_label(c) ? c : '-';
  return text.empty() ? "device" : text;
}

}  // namespace tendon::scene_file
