// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "tests/tools/lab/recordings/run_summary.h"
#include "tests/tools/lab/recordings/trace.h"

namespace tendon::lab {

/// One run as a column of the picture.
struct Drawing {
  std::string label;
  RunSummary summary;
  Trace trace;
};

/// More of them side by side cannot be read.
inline constexpr std::size_t kMostDrawings = 4;

/// Throws std::invalid_argument unless `path` ends with .svg or .png and has no control characters in it, and there
/// are 1 to kMostDrawings drawings.
void check_picture(const std::filesystem::path& path, std::size_t drawings);

/// As many columns as a panel has pixels.
std::size_t trace_columns(std::size_t drawings);

/// Draws runs side by side as `path`, an .svg or a .png, 1000 pixels high and 1600 wide (800 for each run
/// from the third on): from top to bottom where the hand was, the
/// force wanted, permitted and applied, and the energy ledger. Positions, forces and times have one scale in all
/// columns. So have energies, unless that would hide one: then each has its own, and the picture says so.
///
/// Starts gnuplot (package gnuplot-nox) and waits for it. Neither `path` nor a label can make it do anything else.
///
/// Throws what `check_picture` throws, and std::runtime_error when gnuplot is not installed or fails.
void draw(const std::filesystem::path& path, std::span<const Drawing> drawings);

/// What gnuplot is told.
std::string plot_script(const std::filesystem::path& path, std::span<const Drawing> drawings);

}  // namespace tendon::lab
