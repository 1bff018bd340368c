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

/// What is learned of a body at set-up, as plain values; without either, nothing is known of it.
struct Learned {
  std::optional<LearnedShapes> shapes{};
  std::optional<TabulatedAnswers> answers{};
  std::vector<std::string> warnings{};  ///< of files that were not as they should be
};

/// What is wanted of it.
struct LearnConfig {
  bool shapes = false;
  bool answers = false;
  Vec2 middle = Vec2::Zero();  ///< m, across
  double reach = 0;            ///< m, how far from there a hand goes along each axis
  /// Where files are read that were kept before, and kept. Each file is named by what it was made of: the body, its law, the
  /// side that is touched, the patch, where it is pressed, and a version. Empty: nothing is kept.
  std::filesystem::path folder{};
};

/// Learns, or reads what was learned before. No file that is there is ever written over: one that is damaged is named in
/// a warning, and what it should have had is learned anew.
///
/// A file, little-endian, lengths in bytes:
///
///     8   "TENDONSH" or "TENDONAN"                  4   version, 3; then 4 zeros
///     8   digest of all that it was made of         n   the fields of LearnedShapes or TabulatedAnswers but the grid, in
///                                                       their order: numbers of 8, each list and matrix behind its size
///     8   XXH3 (64 bits) of everything before
///
/// Throws what solve_presses() throws, and std::runtime_error when a file cannot be written.
Learned learn(const Solid& solid, const TouchSurface& surface, const LearnConfig& config, const Tell& tell);

}  // namespace tendon::softbody
