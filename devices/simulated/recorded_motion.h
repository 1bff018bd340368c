// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <istream>
#include <string>
#include <variant>

#include "devices/simulated/scripted_motion.h"

namespace tendon {

/// A motion recorded in a CSV file, and how to read it: commas between the cells, `.` as decimal point, no quotes, one
/// line per sample.
struct RecordedMotionFile {
  /// A column by its name in the header line, or by its number, from 0. When both columns are given by number, the file
  /// has no header line.
  using Column = std::variant<std::string, std::size_t>;

  std::filesystem::path path;        ///< where it is; errors begin with it
  Column time = std::string("t_s");  ///< s, strictly increasing
  Column position;                   ///< in the file's own unit
  double scale = 1;                  ///< m per unit of `position`; not 0. Negative turns the motion round
  Vec3 origin = Vec3::Zero();        ///< m, where position 0 lies
  Vec3 direction = Vec3::UnitX();
  ScriptedMotion::Recorded::AtEnd at_end = ScriptedMotion::Recorded::AtEnd::kHold;
};

/// The most samples that a recording may have: 33 minutes at 2 kHz, 64 MB. The limit protects against a path to a file
/// of another kind.
inline constexpr std::size_t kMaxRecordedSamples = 4'000'000;

/// The longest line that a recorded motion may have, in bytes.
inline constexpr std::size_t kMaxRecordedLine = 65'536;

/// Reads a whole recorded motion from `csv`, the content of `file.path`, before the loop runs. Memory: the samples and
/// one line. Throws std::runtime_error "PATH:LINE: expected …, found …" for a missing column, a cell that is not a
/// finite number, time that does not increase, a line or a recording that is too long, or fewer than 2 samples.
ScriptedMotion::Recorded load_recorded_motion(std::istream& csv, const RecordedMotionFile& file);

}  // namespace tendon
