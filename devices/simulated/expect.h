// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "core/motion.h"

namespace tendon {

/// Refuses an impossible value while a scene is being built: throws std::invalid_argument
/// "`field` = `value`: expected `expected`" unless `holds`. Write `holds` so that it is false for NaN
/// (`x > 0`, not `!(x <= 0)`).
void expect(bool holds, std::string_view field, double value, std::string_view expected);

/// The same for a vector whose three components must be finite.
void expect_finite(const Vec3& value, std::string_view field);

}  // namespace tendon
