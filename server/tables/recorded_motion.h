// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <istream>
#include <string>
#include <variant>

#include "devices/simulated/scripted_motion.h"

namespace tendon {

/// A file with a recorded motion, and how to read it. The file is a table for `TableReader` with one sample in each row.
struct RecordedMotionFile {
  /// The name of a column in the header, or the number of a column, counted from 0.
  using Column = std::variant<std::string, std::size_t>;

  std::filesystem::path path;        ///< where it is; errors begin with it
  Column time = std::string("t_s");  ///< s, or the unit in its name; strictly increasing
  Column position;                   ///< in the file's own unit
  double scale = 1;                  ///< m per unit of `position`; not 0. Negative turns the motion round
  Vec3 origin = Vec3::Zero();        ///< m, where position 0 lies
  Vec3 direction = Vec3::UnitX();
  ScriptedMotion::Recorded::AtEnd at_end = ScriptedMotion::Recorded::AtEnd::kHold;
};

/// The most samples that a recording may have: 33 minutes at 2 kHz, 64 MB. The limit protects against a path to a file
/// of another kind.
inline constexpr std::size_t kMaxRecordedSamples = 4'000'000;

/// Reads a whole recorded motion from `csv`, the content of `file.path`, before the loop runs. It needs memory for the
/// samples and one line. It throws std::runtime_error "PATH:LINE: expected …, found …" if `TableReader` refuses the file,
/// if a column is missing, if the time does not increase, or if there are fewer than 2 samples or too many.
ScriptedMotion::Recorded load_recorded_motion(std::istream& csv, const RecordedMotionFile& file);

}  // namespace tendon
