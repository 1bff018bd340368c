// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "core/base/motion.h"

namespace tendon {

/// Returns "`field` = `value`: expected `expected`".
std::string not_expected(std::string_view field, double value, std::string_view expected);

/// If `holds` is false, throws std::invalid_argument with the text of not_expected(). Write `holds` so that it is false
/// for NaN (`x > 0`, not `!(x <= 0)`).
void expect(bool holds, std::string_view field, double value, std::string_view expected);

void expect_finite(const Vec3& value, std::string_view field);

/// These functions also throw if the value is not finite.
void expect_above_zero(double value, std::string_view field);
void expect_not_negative(double value, std::string_view field);

std::string shortest(double value);
std::string rounded(double value, int significant);

}  // namespace tendon
