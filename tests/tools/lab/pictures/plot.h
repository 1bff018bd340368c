// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "tests/tools/lab/recordings/run_summary.h"
#include "tests/tools/lab/recordings/trace.h"

namespace tendon::lab {

/// A run as a column of the picture.
struct Drawing {
  std::string label;
  RunSummary summary;
  Trace trace;
};

/// Maximum number of legible columns.
inline constexpr std::size_t kMostDrawings = 4;

/// Throws std::invalid_argument unless `path` ends with .svg or .png without control characters, and there are 1 to
/// kMostDrawings drawings.
void check_picture(const std::filesystem::path& path, std::size_t drawings);

/// One trace column per pixel of a panel.
std::size_t trace_columns(std::size_t drawings);

/// Draws runs side by side as an .svg or .png file of 1000 pixels height and 1600 width (800 per run from the third
/// on). From top to bottom: the position; the wanted, permitted and applied force; the energy ledger. All columns share
/// the scales of position, force and time. They also share that of energy unless one run would be illegible; then each
/// has its own, and the picture says so.
///
/// Runs gnuplot (package gnuplot-nox) and waits. `path` and labels are quoted and cannot inject commands.
///
/// Throws the exceptions of `check_picture`, and std::runtime_error if gnuplot is missing or fails.
void draw(const std::filesystem::path& path, std::span<const Drawing> drawings);

/// Returns the gnuplot script.
std::string plot_script(const std::filesystem::path& path, std::span<const Drawing> drawings);

}  // namespace tendon::lab
