// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toml++/toml.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/motion.h"
#include "core/base/nearest_word.h"
#include "core/base/time.h"
#include "protocol/discovery.h"
#include "protocol/limits.h"
#include "protocol/link.h"

// The representation of keys and values in a scene file. Only the declarations of keys use this.
//
// A rule specifies the valid values of a key, which are described by `expected(unit)`. `take(node, unit, to)` converts
// a value to SI units, or returns an error. `shown(unit, value)` is the inverse.

namespace tendon::scene_file {

/// `part` describes a key or table that can be removed from a scene, for `tendond explain`.
struct Name {
  std::string_view name;
  std::string_view part;

  template <std::convertible_to<std::string_view> Text>
  Name(const Text& text, std::string_view what = {}) : name(text), part(what) {}
};

struct NoKeys {
  void operator()(const auto& /*table*/) const {}
};

struct Absent {
  bool required = false;
  std::string_view text = {};
};
inline constexpr Absent kRequired = {.required = true};

/// Specified by the suffix of a key.
struct Unit {
  std::string_view suffix;
  std::string_view symbol;
  /// Integer except for angles and minutes. Dividing by it only rounds once, so that 43 µm is exactly 0.000043.
  double per_si;
};

inline constexpr Unit kNoUnit = {"", "", 1};

const Unit& unit_of(std::string_view key);  ///< kNoUnit if the key has no suffix with a unit

std::string with_symbol(std::string text, const Unit& unit);

/// Returns the shortest text that is converted back to the same value. Large exponents are avoided.
std::string digits(double value);

std::string in_quotes(std::string_view text);

std::string found_in(const toml::node& node);

std::optional<double> number_in(const toml::node& node);  ///< nothing unless an integer or floating-point number

struct Refusal {
  const toml::node* found;
  std::string expected;
  std::string hint{};  ///< for example "; did you mean aol+?"
};
using Verdict = std::optional<Refusal>;

/// Maximum of a time if its rule has none. Longer times are not useful in a haptic loop, and this prevents overflow.
inline constexpr Duration kLongest = limits::kMaxTimeout;

struct Number {
  double least = -limits::kMaxValue;
  double most = limits::kMaxValue;
  bool without_least = false;
  bool or_infinite = false;

  std::string expected(const Unit& unit) const {
    std::string text;
    if (least <= -limits::kMaxValue) {
      text = unit.symbol.empty() ? "a number" : "a number of " + std::string(unit.symbol);
    } else if (most < limits::kMaxValue) {
      text =
          without_least ? "a number above " + digits(least) + " and up to " : "a number from " + digits(least) + " to ";
      text += with_symbol(digits(most), unit);
    } else if (without_least) {
      text = with_symbol("a number above " + digits(least), unit);
    } else {
      text = with_symbol("a number of " + digits(least), unit) + " or more";
    }
    return or_infinite ? text + ", or inf" : text;
  }

  Verdict take(const toml::node& node, const Unit& unit, double& to) const {
    const auto number = number_in(node);
    if (auto refusal = check(node, unit, number, most)) return refusal;
    to = *number / unit.per_si;
    return {};
  }

  Verdict take(const toml::node& node, const Unit& unit, Duration& to) const {
    const auto number = number_in(node);
    const double limit = most < limits::kMaxValue ? most : seconds(kLongest) * unit.per_si;
    if (auto refusal = check(node, unit, number, limit)) return refusal;
    const Duration rounded(std::llround(*number * (1e9 / unit.per_si)));
    if (without_least && rounded <= Duration::zero()) return Refusal{&node, expected(unit)};
    to = rounded;
    return {};
  }

  template <class T>
  Verdict take(const toml::node& node, const Unit& unit, std::optional<T>& to) const {
    T value{};
    if (auto refusal = take(node, unit, value)) return refusal;
    to = value;
    return {};
  }

  static std::string shown(const Unit& unit, double value) { return digits(value * unit.per_si); }
  static std::string shown(const Unit& unit, Duration value) {
    return digits(static_cast<double>(value.count()) / (1e9 / unit.per_si));
  }
  template <class T>
  static std::string shown(const Unit& unit, const std::optional<T>& value) {
    return value ? shown(unit, *value) : "none";
  }

 private:
  Verdict check(const toml::node& node, const Unit& unit, std::optional<double> number, double limit) const {
    if (number && or_infinite && *number == std::numeric_limits<double>::infinity()) return {};
    const bool too_small = number && !(without_least ? *number > least : *number >= least);  // also true for NaN
    if (!number || too_small) return Refusal{&node, expected(unit)};
    if (*number <= limit) return {};
    return Refusal{&node, limit < most || most >= limits::kMaxValue
                              ? with_symbol("a number of at most " + digits(limit), unit)
                              : expected(unit)};
  }
};

inline constexpr Number kAnyNumber{};
inline constexpr Number kZeroOrMore{.least = 0};
inline constexpr Number kAboveZero{.least = 0, .without_least = true};
inline constexpr Number kAboveZeroOrInf{.least = 0, .without_least = true, .or_infinite = true};

/// The value can be `false` if there is no such effect.
struct OrFalse {
  Number number;

  std::string expected(const Unit& unit) const { return number.expected(unit) + ", or false for none"; }

  template <class T>
  Verdict take(const toml::node& node, const Unit& unit, std::optional<T>& to) const {
    if (const auto* none = node.as_boolean(); none != nullptr && !**none) {
      to.reset();
      return {};
    }
    if (auto refusal = number.take(node, unit, to)) return Refusal{&node, expected(unit)};
    return {};
  }

  template <class T>
  static std::string shown(const Unit& unit, const std::optional<T>& value) {
    return Number::shown(unit, value);
  }
};

struct Count {
  std::int64_t most;
  std::int64_t least = 0;

  std::string expected(const Unit&) const {
    return "a whole number from " + std::to_string(least) + " to " + std::to_string(most);
  }

  template <class Whole>
  Verdict take(const toml::node& node, const Unit& unit, Whole& to) const {
    const auto* count = node.as_integer();
    if (count == nullptr || **count < least || **count > most) return Refusal{&node, expected(unit)};
    to = static_cast<Whole>(**count);
    return {};
  }

  template <class Whole>
  Verdict take(const toml::node& node, const Unit& unit, std::optional<Whole>& to) const {
    return take(node, unit, to.emplace());
  }

  template <class Whole>
  static std::string shown(const Unit&, Whole value) {
    return std::to_string(value);
  }
  template <class Whole>
  static std::string shown(const Unit&, const std::optional<Whole>& value) {
    return value ? std::to_string(*value) : "none";
  }
};

struct Vector {
  Number each = kAnyNumber;

  static std::string expected(const Unit& unit) {
    return unit.symbol.empty() ? "[x, y, z]" : "[x, y, z] in " + std::string(unit.symbol);
  }

  Verdict take(const toml::node& node, const Unit& unit, Vec3& to) const {
    const auto* array = node.as_array();
    if (array == nullptr || array->size() != 3) return Refusal{&node, expected(unit)};
    Vec3 vector;
    for (Eigen::Index i = 0; i < 3; ++i) {
      if (auto refusal = each.take(*array->get(static_cast<std::size_t>(i)), unit, vector[i])) return refusal;
    }
    to = vector;
    return {};
  }

  Verdict take(const toml::node& node, const Unit& unit, std::optional<Vec3>& to) const {
    return take(node, unit, to.emplace());
  }

  static std::string shown(const Unit& unit, const Vec3& value) {
    return "[" + Number::shown(unit, value.x()) + ", " + Number::shown(unit, value.y()) + ", " +
           Number::shown(unit, value.z()) + "]";
  }
  static std::string shown(const Unit& unit, const std::optional<Vec3>& value) {
    return value ? shown(unit, *value) : "none";
  }
};

template <class Rule>
struct ListOf {
  Rule rule;
  std::string_view form = "[…]";

  std::string expected(const Unit& unit) const { return std::string(form) + ", each " + rule.expected(unit); }

  template <class T>
  Verdict take(const toml::node& node, const Unit& unit, std::vector<T>& to) const {
    const auto* array = node.as_array();
    if (array == nullptr) return Refusal{&node, expected(unit)};
    to.clear();
    for (const toml::node& element : *array) {
      if (auto refusal = rule.take(element, unit, to.emplace_back())) return refusal;
    }
    return {};
  }

  template <class T, std::size_t kCount>
  Verdict take(const toml::node& node, const Unit& unit, std::array<T, kCount>& to) const {
    std::vector<T> all;
    if (auto refusal = take(node, unit, all)) return refusal;
    if (all.size() != kCount) return Refusal{&node, expected(unit)};
    std::copy(all.begin(), all.end(), to.begin());
    return {};
  }

  template <class Values>
  std::string shown(const Unit& unit, const Values& values) const {
    std::string text;
    for (const auto& value : values) text += (text.empty() ? "" : ", ") + rule.shown(unit, value);
    return "[" + text + "]";
  }
};

bool in_a_label(char c);

std::string label_of(std::string text);

struct Label {
  static std::string expected(const Unit&) {
    return "a name of 1 to " + std::to_string(limits::kMaxLabel) + " letters, digits, - or _";
  }

  static Verdict take(const toml::node& node, const Unit& unit, std::string& to) {
    const auto* text = node.as_string();
    const bool good = text != nullptr && !(*text)->empty() && (*text)->size() <= limits::kMaxLabel &&
                      std::all_of((*text)->begin(), (*text)->end(), in_a_label);
    if (!good) return Refusal{&node, expected(unit)};
    to = **text;
    return {};
  }

  static std::string shown(const Unit&, const std::string& value) { return in_quotes(value); }
};

struct InstanceName {
  static std::string expected(const Unit&) {
    return "a name of 1 to " + std::to_string(dns_sd::kMaxName) + " bytes like \"falcon at bench 3\"";
  }

  static Verdict take(const toml::node& node, const Unit& unit, std::string& to) {
    const auto* text = node.as_string();
    if (text == nullptr || !dns_sd::is_instance_name(**text)) return Refusal{&node, expected(unit)};
    to = **text;
    return {};
  }

  static std::string shown(const Unit&, const std::string& value) { return in_quotes(value); }
};

struct YesNo {
  static std::string expected(const Unit&) { return "true or false"; }

  static Verdict take(const toml::node& node, const Unit& unit, bool& to) {
    const auto* truth = node.as_boolean();
    if (truth == nullptr) return Refusal{&node, expected(unit)};
    to = **truth;
    return {};
  }

  static std::string shown(const Unit&, bool value) { return value ? "true" : "false"; }
};

struct Path {
  static std::string expected(const Unit&) { return "a path in quotes"; }

  static Verdict take(const toml::node& node, const Unit& unit, std::filesystem::path& to) {
    const auto* text = node.as_string();
    if (text == nullptr || (*text)->empty()) return Refusal{&node, expected(unit)};
    to = **text;
    return {};
  }

  static Verdict take(const toml::node& node, const Unit& unit, std::optional<std::filesystem::path>& to) {
    return take(node, unit, to.emplace());
  }

  static std::string shown(const Unit&, const std::filesystem::path& value) { return in_quotes(value.string()); }
  static std::string shown(const Unit&, const std::optional<std::filesystem::path>&) { return "none"; }
};

struct NetworkAddress {
  static std::string expected(const Unit&) { return "an address like \"127.0.0.1:47100\" or \"[::1]:47100\""; }

  static Verdict take(const toml::node& node, const Unit& unit, Address& to) {
    const auto* text = node.as_string();
    if (text == nullptr) return Refusal{&node, expected(unit)};
    try {
      to = parse_address(**text);
      return {};
    } catch (const std::invalid_argument&) {
      return Refusal{&node, expected(unit)};
    }
  }

  static Verdict take(const toml::node& node, const Unit& unit, std::optional<Address>& to) {
    return take(node, unit, to.emplace());
  }

  static std::string shown(const Unit&, const Address& value) { return in_quotes(to_string(value)); }
  static std::string shown(const Unit&, const std::optional<Address>&) { return "none"; }
};

template <class T>
struct Names {
  std::vector<std::pair<std::string_view, T>> all;

  std::string expected(const Unit&) const {
    std::string text = all.size() == 1 ? "" : "one of ";
    for (const auto& [name, value] : all) text += (name == all.front().first ? "" : ", ") + in_quotes(name);
    return text;
  }

  Verdict take(const toml::node& node, const Unit& unit, T& to) const {
    const auto* text = node.as_string();
    if (text == nullptr) return Refusal{&node, expected(unit)};
    for (const auto& [name, value] : all) {
      if (name != **text) continue;
      to = value;
      return {};
    }
    std::vector<std::string_view> names;
    for (const auto& [name, value] : all) names.push_back(name);
    return Refusal{&node, expected(unit), did_you_mean(**text, names)};
  }

  std::string shown(const Unit&, const T& wanted) const {
    for (const auto& [name, value] : all) {
      if (value == wanted) return in_quotes(name);
    }
    return "none";
  }
};

}  // namespace tendon::scene_file
