// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <istream>
#include <optional>
#include <ostream>
#include <vector>

#include "core/base/time.h"
#include "tests/support/units.h"

namespace tendon::simulation {

struct RunOptions {
  std::uint64_t count = 1000;
  std::uint64_t first_seed = 1;
  unsigned jobs = 1;
  std::vector<std::uint64_t> seeds;   ///< run first
  std::optional<Duration> budget;     ///< real time; replaces `count`
  std::function<Duration()> elapsed;  ///< real time since the beginning
  bool json = false;
  bool progress = false;
};

/// Until all are done or one violates an invariant; worlds in progress are finished. Prints each violation with its
/// oracle and the command that reproduces it, the number of worlds, the rate, and coverage counts. Returns true if
/// every invariant held.
bool explore(const RunOptions& options, std::ostream& out, std::ostream& progress);

/// Runs all these seeds, also after a violation: one shard of a sweep (tests/support/units.h). Prints a JSON line per
/// violation and one end line.
void explore_units(const Units& seeds, unsigned jobs, std::ostream& out);

/// Summarizes the lines of explore_units as `explore` does. Returns true if every invariant held. Throws
/// std::invalid_argument, naming the line, for malformed input, and std::runtime_error when coverage is too low.
bool judge(std::istream& lines, std::ostream& out);

/// Runs one world and prints its events if `verbose`. Returns true if every invariant held.
bool run_one(std::uint64_t seed, bool verbose, std::ostream& out);

/// One per line. A note can follow, and a comment starts with #. Throws std::runtime_error, naming file and line, for
/// anything else.
std::vector<std::uint64_t> read_seeds(const std::filesystem::path& file);

}  // namespace tendon::simulation
