// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

namespace tendon::hard {

struct Row {
  std::string hard;    ///< the reason why this case is difficult
  std::string oracle;  ///< the property that is checked; this must be the same text in every run
  std::string result;
  std::optional<double> margin = {};  ///< bound / measured value, which should be above 1
  std::string without;                ///< the result if the protection is disabled
};

/// Fails the running test if README.md has no line with the same `hard` and `oracle`. $TENDON_HARD_ROWS: writes the row
/// to $TENDON_HARD_ROWS/Suite.Test.json, from which `tests/hard/table` writes README.md.
void report(const Row& row);

}  // namespace tendon::hard
