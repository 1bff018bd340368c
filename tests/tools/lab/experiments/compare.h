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

/// One situation: a spring that pulls and pushes, a network, a device and a hand that is free to move.
struct Situation {
  double stiffness = 0;  ///< N/m
  double delay_ms = 0;
  double jitter_ms = 0;  ///< at most so much later; later forces overtake earlier ones
  double rate_hz = 0;
  double loss = 0;    ///< share
  Friction friction;  ///< of the device
  bool firm = false;  ///< hand 800 N/m, 3 N·s/m, 100 g; else 400, 0.3, 50
};

/// The grid: every combination, the same for every law, fixed before anything is run.
std::vector<Situation> comparison_grid();

struct Cell {
  Situation situation;
  Law law;
  Outcome outcome;
  std::optional<Preset> preset{};  ///< of AOL+

  std::string_view name() const noexcept { return preset ? info(*preset).name : info(law).name; }

  /// The device gave out nothing that had not been put in; rounding aside. Exact positions, true friction.
  bool passive() const noexcept { return outcome.least_energy >= -1e-9; }
};

/// `law` in a situation: 2 s of a hand that swings 15 mm at 0.5 Hz, a device with counts of 30 µm and 8.5 N. Laws that
/// have to know the environment are told the truth. AOL+ has its default parts, and bounded acceleration where the
/// device has little damping.
Cell compare_cell(const Situation& situation, Law law, std::uint64_t seed);
/// … or those of `parts`.
Cell compare_cell(const Situation& situation, Law law, std::uint64_t seed, const AolPlus<1, 3>::Parts& parts);

/// … or those of a preset, with its learned model.
Cell compare_cell(const Situation& situation, Preset preset, std::uint64_t seed);

/// What AOL+ without a preset has against every other law that promises to be passive.
struct Verdict {
  std::size_t cells = 0;    ///< of AOL+
  std::size_t passive = 0;  ///< … in which it was
  std::size_t beaten = 0;   ///< … in which another law that promises passivity, and keeps it, has a lower force error
  std::size_t beaten_clearly = 0;  ///< … by more than 5 %
  /// Why, in the beaten cells: the part without which AOL+ would not have been. Run again, part by part.
  std::size_t robust_ledger = 0, knee = 0, energy_cap = 0, bounded_acceleration = 0;
  std::size_t vibrating = 0;  ///< no single part, but it vibrates there: the other is too soft to
  std::size_t no_single_part = 0;
};
/// The cells of one situation stand together, in the order of laws(); situation i had the seed `seed` + i · `every`.
Verdict verdict(const std::vector<Cell>& cells, std::uint64_t seed, std::size_t every);

struct CompareOptions {
  std::size_t every = 1;  ///< take every Nth situation of the grid
  std::uint64_t seed = 1;
  std::optional<std::filesystem::path> out{};  ///< folder for compare.csv and the figures
  bool json = false;
  Part part{};  ///< its units are the situations that are taken, from 0 on, each with all laws
};

/// `tendon-lab compare`: every law in every situation, with the same seeds, and which one to use where.
void compare(const CompareOptions& options, std::ostream& out);

}  // namespace tendon::lab
