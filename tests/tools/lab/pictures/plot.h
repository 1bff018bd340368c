// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "tests/tools/lab/recordings/run_summary.h"
#include "tests/tools/lab/recordings/trace.h"

namespace tendon::lab {

struct Drawing {
  std::string label;
  RunSummary summary;
  Trace trace;
};

/// More are not legible.
inline constexpr std::size_t kMostDrawings = 4;

/// Throws std::invalid_argument if `path` does not end with .svg or .png or contains control characters, or if the
/// number of drawings is not from 1 to kMostDrawings.
void check_picture(const std::filesystem::path& path, std::size_t drawings);

/// One trace column per pixel of a panel.
std::size_t trace_columns(std::size_t drawings);

/// Draws runs side by side as an .svg or .png file of 1000 pixels height and 1600 width (800 per run from the third
/// on): position, wanted, permitted and applied force, and energy ledger. All columns share their scales; if the scale
/// of energy would not be legible, each has its own and a note.
///
/// Runs gnuplot (package gnuplot-nox) and waits. `path` and labels are quoted and cannot inject commands. Throws the
/// exceptions of `check_picture`, and std::runtime_error if gnuplot is missing or fails.
void draw(const std::filesystem::path& path, std::span<const Drawing> drawings);

std::string plot_script(const std::filesystem::path& path, std::span<const Drawing> drawings);

}  // namespace tendon::lab
