// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "core/base/motion.h"

namespace tendon {

/// Refuses an impossible value of a configuration: throws std::invalid_argument
/// "`field` = `value`: expected `expected`" unless `holds`. Write `holds` so that it is false for NaN
/// (`x > 0`, not `!(x <= 0)`).
void expect(bool holds, std::string_view field, double value, std::string_view expected);

/// The same for a vector whose three components must be finite.
void expect_finite(const Vec3& value, std::string_view field);

/// The same for a value that must be finite and above zero, or finite and not below zero.
void expect_above_zero(double value, std::string_view field);
void expect_not_negative(double value, std::string_view field);

/// A number for people: the shortest text that reads back as the same value, or `significant` digits of it.
std::string shortest(double value);
std::string rounded(double value, int significant);

}  // namespace tendon
