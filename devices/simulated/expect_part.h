// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/expect.h"

namespace tendon {

/// Throws std::invalid_argument with the name of the field if it is set and not positive.
inline void expect_part(const std::optional<double>& value, const char* field) {
  if (value) expect_above_zero(*value, field);
}

}  // namespace tendon
