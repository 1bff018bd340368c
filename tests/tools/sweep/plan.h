// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/units.h"
#include "tests/tools/sweep/arithmetic.h"

namespace tendon::sweep {

struct Plan {
  std::filesystem::path program;         ///< absolute path, which must be the same on every node
  std::string sha256;                    ///< hash of the program file, 64 hexadecimal digits
  std::vector<std::string> arguments{};  ///< inserted before --units
  Units units{};
  std::uint64_t per_shard = 0;  ///< units per shard
  Arithmetic arithmetic = Arithmetic::kPortable;
  Fingerprint fingerprint{};  ///< of a process with this arithmetic on the planning node

  std::uint64_t shards() const noexcept { return (units.count + per_shard - 1) / per_shard; }
  /// Throws std::invalid_argument if there is no such shard.
  Units shard(std::uint64_t number) const;
};

/// Accepts a folder that already has the same plan, so two users may plan concurrently. Throws std::runtime_error if it
/// has a different one.
void write_plan(const std::filesystem::path& folder, const Plan& plan);

/// Throws std::runtime_error naming the file and the error.
Plan read_plan(const std::filesystem::path& folder);

/// Returns 64 hexadecimal digits. Throws std::runtime_error if the file cannot be read.
std::string sha256_of(const std::filesystem::path& file);

}  // namespace tendon::sweep
