// SPDX-License-Identifier: Apache-2.0
#include "core/base/expect.h"

#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <string>

namespace tendon {
std::string shortest(double value) {
  std::array<char, 32> text{};  // the shortest form of a double has at most 24 characters
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

std::string rounded(double value, int significant) {
  std::array<char, 32> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, significant).ptr;
  return {text.data(), end};
}

std::string not_expected(std::string_view field, double value, std::string_view expected) {
  return std::string(field) + " = " + shortest(value) + ": expected " + std::string(expected);
}

void expect(bool holds, std::string_view field, double value, std::string_view expected) {
  if (!holds) throw std::invalid_argument(not_expected(field, value, expected));
}

void expect_above_zero(double value, std::string_view field) {
  expect(value > 0 && std::isfinite(value), field, value, "a finite number above 0");
}

void expect_not_negative(double value, std::string_view field) {
  expect(value >= 0 && std::isfinite(value), field, value, "a finite number of 0 or more");
}

void expect_finite(const Vec3& value, std::string_view field) {
  static constexpr std::array<char, 3> kAxes = {'x', 'y', 'z'};
  for (Eigen::Index i = 0; i < 3; ++i) {
    expect(std::isfinite(value[i]), std::string(field) + "." + kAxes[static_cast<std::size_t>(i)], value[i],
           "a finite number");
  }
}

}  // namespace tendon
