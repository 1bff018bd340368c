// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "tests/support/swept_work.h"
#include "tests/tools/lab/grid/table.h"

namespace tendon::lab {

struct GridOptions {
  std::filesystem::path scene;
  std::string networks;            ///< profiles with ranges and lists (ranges.h), separated by commas
  std::string stiffness = "2000";  ///< N/m
  std::string laws = "scene";
  std::string rates = "100";  ///< Hz, of the engine
  std::uint64_t seeds = 1;    ///< number of seeds
  std::uint64_t first_seed = 1;
  std::optional<double> length_s{};  ///< default: kDefaultLength, or the length of the trace
  Thresholds thresholds{};
  bool zwidth = false;          ///< draw Z-width over delay
  std::filesystem::path out{};  ///< if empty, the table is printed
  unsigned jobs = 1;
  bool dry_run = false;
  bool json = false;  ///< print JSON instead of the table
  Part part{};        ///< the units are the cells
};

inline constexpr Duration kDefaultLength = std::chrono::seconds(4);
inline constexpr std::size_t kMostCells = 1'000'000;

/// Returns the cells in the order law, network, rate, stiffness, seed; the last one varies fastest.
std::vector<GridCell> cells_of(const GridOptions& options);

/// Returns the command that repeats the sweep, without the options that do not change the result.
std::string command_of(const GridOptions& options);

/// Runs each cell and writes `out`/cells.csv, and the figure as `out`/zwidth.svg and .png. The files depend only on the
/// command, the scene and the commit, and not on the number of jobs. `out`/cells.partial contains the finished cells
/// until all of them are finished: the same command continues an interrupted sweep, and a different one is refused.
///
/// Throws std::invalid_argument for invalid options before a cell is run, and std::runtime_error if a file cannot be
/// written. Finished cells are then kept.
void run_grid(const GridOptions& options, std::ostream& out);

}  // namespace tendon::lab
