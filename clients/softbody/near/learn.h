// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "clients/softbody/near/learned.h"
#include "clients/softbody/near/tabulated.h"

namespace tendon::softbody {

struct Learned {  // precomputed results for a body
  std::optional<LearnedShapes> shapes{};
  std::optional<TabulatedAnswers> answers{};
  std::vector<std::string> warnings{};
};

struct LearnConfig {
  bool shapes = false;
  bool answers = false;
  Vec2 middle = Vec2::Zero();  ///< m, tangential
  double reach = 0;            ///< m, for each axis
  /// The folder with the results. If it is empty, results are not stored. File names contain a digest of the body, the
  /// law, the touched side, the patch, the grid and the version.
  std::filesystem::path folder{};
};

/// Reads stored results, or computes them. Never overwrites a file. If a file is damaged, adds a warning and computes
/// the data again. The format is little-endian; the first column is the number of bytes:
///
///     8   "TENDONSH" or "TENDONAN"                  4   version, 3; then 4 zeros
///     8   digest of the input
///     n   the fields of LearnedShapes or TabulatedAnswers without the grid, in order: numbers of 8 bytes, and lists
///         and matrices after their size
///     8   XXH3 (64 bits) of everything before
///
/// Throws the errors of solve_presses(), and std::runtime_error if a file cannot be written.
Learned learn(const Solid& solid, const TouchSurface& surface, const LearnConfig& config, const Tell& tell);

}  // namespace tendon::softbody
