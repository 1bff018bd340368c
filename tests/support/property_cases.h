// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <string>

namespace tendon {

/// Returns TENDON_PROPERTY_CASES, which ctest sets to 10 000 for tests listed as LONG in tendon_test(), or 2000.
inline int property_cases() {
  const char* const cases = std::getenv("TENDON_PROPERTY_CASES");  // NOLINT(concurrency-mt-unsafe): nobody sets it
  return cases == nullptr ? 2000 : std::stoi(cases);
}

}  // namespace tendon
