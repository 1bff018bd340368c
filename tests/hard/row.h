// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

namespace tendon::hard {

/// One row of README.md's table, left by a hard case.
struct Row {
  std::string hard;                   ///< why it is hard: what a naive program does
  std::string oracle;                 ///< what must hold; the same in every run
  std::string result;                 ///< what came out, with units
  std::optional<double> margin = {};  ///< bound / measured: above 1 where a bound is kept; none where it is yes or no
  std::string without;                ///< what happens without the protection, and which one that is
};

/// Fails the running test when README.md has no line for it with the same `hard` and `oracle`. Writes the row as
/// $TENDON_HARD_ROWS/Suite.Test.json where that is set, from which `tests/hard/table` writes README.md.
void report(const Row& row);

}  // namespace tendon::hard
