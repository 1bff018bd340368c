// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace tendon::lab {

struct CompareKindsOptions {
  std::vector<std::string> kinds{};            ///< names of situation_kinds(); "all": every one
  std::size_t count = 200;                     ///< situations of each kind
  std::uint64_t seed = 1;                      ///< of the first situation; consecutive
  bool held_out = false;                       ///< adds kHeldOutSeeds to the seed
  std::vector<std::string> laws{};             ///< names of contenders(). If this is empty, all passive laws are used.
  std::optional<std::filesystem::path> out{};  ///< folder for compare_kinds.csv
  std::string command{};                       ///< repeats the run
  bool json = false;                           ///< one object per kind and contender
  bool progress = false;                       ///< prints to standard error
};

/// A table per kind shows how many runs are passive and quiet, the median error, and where a contender is furthest
/// behind the best other law that guarantees passivity and was passive, with that seed. Results do not depend on the
/// number of threads. Throws std::invalid_argument if there is no such kind or law.
void compare_kinds(const CompareKindsOptions& options, std::ostream& out);

}  // namespace tendon::lab
