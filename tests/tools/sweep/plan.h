// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/units.h"
#include "tests/tools/sweep/arithmetic.h"

namespace tendon::sweep {

/// What a sweep is: FOLDER/plan.json. It never changes.
struct Plan {
  std::filesystem::path program;         ///< absolute; every node finds it there
  std::string sha256;                    ///< of the program's file, 64 hexadecimal digits
  std::vector<std::string> arguments{};  ///< before --units
  Units units{};
  std::uint64_t per_shard = 0;  ///< units
  Arithmetic arithmetic = Arithmetic::kPortable;
  Fingerprint fingerprint{};  ///< of a process with that arithmetic, on the node that planned

  std::uint64_t shards() const noexcept { return (units.count + per_shard - 1) / per_shard; }
  /// Throws std::invalid_argument when there is no such shard.
  Units shard(std::uint64_t number) const;
};

/// Writes the plan into a new folder. The same plan again is let through, so that two users may plan at once; throws
/// std::runtime_error when the folder has another one.
void write_plan(const std::filesystem::path& folder, const Plan& plan);

/// Throws std::runtime_error, naming the file and what is wrong with it.
Plan read_plan(const std::filesystem::path& folder);

/// 64 hexadecimal digits. Throws std::runtime_error when the file cannot be read.
std::string sha256_of(const std::filesystem::path& file);

}  // namespace tendon::sweep
