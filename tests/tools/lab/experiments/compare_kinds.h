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
  std::uint64_t seed = 1;                      ///< of the first; the next has the next
  bool held_out = false;                       ///< kHeldOutSeeds is added to the seed
  std::vector<std::string> laws{};             ///< names of contenders(); empty: those that promise to be passive
  std::optional<std::filesystem::path> out{};  ///< folder for compare_kinds.csv
  bool json = false;                           ///< one object for each kind and contender
  bool progress = false;                       ///< on standard error
};

/// `tendon-lab compare --kinds`: laws in situations that are drawn from seeds. A table for each kind: how many are
/// passive and quiet, the median error, and where a contender is furthest above the best other one that promises to be
/// passive and was, with the seed that draws that situation again. The number of threads changes no result.
///
/// Throws std::invalid_argument for a kind or law that is none.
void compare_kinds(const CompareKindsOptions& options, std::ostream& out);

}  // namespace tendon::lab
