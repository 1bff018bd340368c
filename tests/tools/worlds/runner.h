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
  std::vector<std::uint64_t> seeds;   ///< run before all others
  std::optional<Duration> budget;     ///< of real time, instead of `count`
  std::function<Duration()> elapsed;  ///< real time since the beginning
  bool json = false;
  bool progress = false;
};

/// Runs worlds on `jobs` threads until there is no more to do or one has broken a promise: then those that are under
/// way are finished, and each broken one is named with its oracle and the command that reproduces it. Says at the end
/// how many there were, how fast, and in how many of them something happened at all. True when every promise was kept.
bool explore(const RunOptions& options, std::ostream& out, std::ostream& progress);

/// Runs all these seeds and stops at none: a shard of a sweep (tests/support/units.h). A line for each broken world and
/// one end line, in JSON.
void explore_units(const Units& seeds, unsigned jobs, std::ostream& out);

/// What `explore` says at its end, of the lines of explore_units. True when every promise was kept. Throws
/// std::invalid_argument naming the line that is none of these, std::runtime_error when too little happened.
bool judge(std::istream& lines, std::ostream& out);

/// One world, and its story when `verbose`. True when it has kept every promise.
bool run_one(std::uint64_t seed, bool verbose, std::ostream& out);

/// A number at the beginning of a line is a seed; what follows it says why it is there, and # begins a comment. Throws
/// std::runtime_error naming file and line for any other line.
std::vector<std::uint64_t> read_seeds(const std::filesystem::path& file);

}  // namespace tendon::simulation
