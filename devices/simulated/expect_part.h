// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/expect.h"

namespace tendon {

/// Checks an optional part of a simulated device, which must be above zero if it is set. Throws std::invalid_argument,
/// naming the field.
inline void expect_part(const std::optional<double>& value, const char* field) {
  if (value) expect_above_zero(*value, field);
}

}  // namespace tendon
