// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "tests/support/swept_work.h"
#include "tests/tools/lab/experiments/situations.h"

namespace tendon::lab {

struct Situation {
  double stiffness = 0;  ///< N/m
  double delay_ms = 0;
  double jitter_ms = 0;  ///< the maximum additional delay, so forces can overtake each other
  double rate_hz = 0;
  double loss = 0;  ///< fraction
  Friction friction;
  bool firm = false;  ///< hand of 800 N/m, 3 N·s/m, 100 g; otherwise 400, 0.3, 50
};

std::vector<Situation> comparison_grid();

struct Cell {
  Situation situation;
  Law law;
  Outcome outcome;
  std::optional<Preset> preset{};  ///< of AOL+

  std::string_view name() const noexcept { return preset ? info(*preset).name : info(law).name; }

  /// True if the device output no net energy, within rounding. Uses exact positions and the true friction.
  bool passive() const noexcept { return outcome.least_energy >= -1e-9; }
};

/// Runs `law` for 2 s with a hand that moves by 15 mm at 0.5 Hz and a device with 30 µm resolution and 8.5 N. If a law
/// has a model of the environment, the true values are used. AOL+ has its default parts, plus bounded acceleration if
/// the device has little damping.
Cell compare_cell(const Situation& situation, Law law, std::uint64_t seed);
Cell compare_cell(const Situation& situation, Law law, std::uint64_t seed, const AolPlus<1, 3>::Parts& parts);

Cell compare_cell(const Situation& situation, Preset preset, std::uint64_t seed);

/// AOL+ without a preset against the other passive laws.
struct Verdict {
  std::size_t cells = 0;    ///< number of cells
  std::size_t passive = 0;  ///< cells in which AOL+ was passive
  /// Cells in which a law that guarantees passivity, and is passive in this cell, has a lower force error.
  std::size_t beaten = 0;
  std::size_t beaten_clearly = 0;  ///< cells in which the error of the other law is lower by more than 5 %
  /// Beaten cells in which AOL+ without this part is not beaten.
  std::size_t robust_ledger = 0, knee = 0, energy_cap = 0, bounded_acceleration = 0;
  std::size_t vibrating = 0;  ///< no single part; the other law is too soft to vibrate there, AOL+ vibrates
  std::size_t no_single_part = 0;
};
/// In the order of laws(); situation i has the seed `seed` + i · `every`.
Verdict verdict(const std::vector<Cell>& cells, std::uint64_t seed, std::size_t every);

struct CompareOptions {
  std::size_t every = 1;  ///< take every Nth situation of the grid
  std::uint64_t seed = 1;
  std::optional<std::filesystem::path> out{};  ///< folder for compare.csv and the figures
  std::string command{};                       ///< repeats the run
  bool json = false;
  Part part{};  ///< its units are the selected situations from 0, each with all laws
};

void compare(const CompareOptions& options, std::ostream& out);

}  // namespace tendon::lab
