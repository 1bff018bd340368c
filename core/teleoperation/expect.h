// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace tendon {

/// Refuse an impossible value of a configuration: throw std::invalid_argument with the field, its value and what was
/// expected.
void expect_above_zero(double value, const char* field);
void expect_not_negative(double value, const char* field);

}  // namespace tendon
