// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "core/base/motion.h"

namespace tendon {

/// Checks a value of a configuration. If `holds` is false, throws std::invalid_argument "`field` = `value`: expected
/// `expected`". Write `holds` so that it is false for NaN (`x > 0`, not `!(x <= 0)`).
void expect(bool holds, std::string_view field, double value, std::string_view expected);

/// Checks that all components of a vector are finite.
void expect_finite(const Vec3& value, std::string_view field);

/// Checks that a value is finite and positive, or finite and not negative.
void expect_above_zero(double value, std::string_view field);
void expect_not_negative(double value, std::string_view field);

/// Formats a number: the shortest text that reads back as the same value, or `significant` digits.
std::string shortest(double value);
std::string rounded(double value, int significant);

}  // namespace tendon
