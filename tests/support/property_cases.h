// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <string>

namespace tendon {

/// Returns the number of random cases for each property. ctest sets TENDON_PROPERTY_CASES to 10 000 for tests that are
/// listed as LONG in tendon_test(). The default is 2000.
inline int property_cases() {
  const char* const cases = std::getenv("TENDON_PROPERTY_CASES");
  return cases == nullptr ? 2000 : std::stoi(cases);
}

}  // namespace tendon
