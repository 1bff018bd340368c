// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/expect.h"

#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <string>

namespace tendon {
namespace {

std::string shortest(double value) {
  std::array<char, 32> text{};  // the longest shortest form of a double has 24 characters
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

}  // namespace

void expect(bool holds, std::string_view field, double value, std::string_view expected) {
  if (holds) return;
  throw std::invalid_argument(std::string(field) + " = " + shortest(value) + ": expected " + std::string(expected));
}

void expect_finite(const Vec3& value, std::string_view field) {
  static constexpr std::array<char, 3> kAxes = {'x', 'y', 'z'};
  for (Eigen::Index i = 0; i < 3; ++i) {
    expect(std::isfinite(value[i]), std::string(field) + "." + kAxes[static_cast<std::size_t>(i)], value[i],
           "a finite number");
  }
}

}  // namespace tendon
