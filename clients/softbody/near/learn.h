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

/// Precomputed results for a body.
struct Learned {
  std::optional<LearnedShapes> shapes{};
  std::optional<TabulatedAnswers> answers{};
  std::vector<std::string> warnings{};  ///< about damaged files
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

/// Computes the data, or reads stored results. Never overwrites a file: a damaged one is reported in a warning, and its
/// contents are recomputed.
///
/// File format, little-endian; the first column is the length in bytes:
///
///     8   "TENDONSH" or "TENDONAN"                  4   version, 3; then 4 zeros
///     8   digest of all that it was made of         n   the fields of LearnedShapes or TabulatedAnswers but the grid, in
///                                                       their order: numbers of 8, each list and matrix behind its size
///     8   XXH3 (64 bits) of everything before
///
/// Throws the errors of solve_presses(), and std::runtime_error if a file cannot be written.
Learned learn(const Solid& solid, const TouchSurface& surface, const LearnConfig& config, const Tell& tell);

}  // namespace tendon::softbody
