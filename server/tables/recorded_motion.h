// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <istream>
#include <string>
#include <variant>

#include "devices/simulated/scripted_motion.h"

namespace tendon {

struct RecordedMotionFile {
  using Column = std::variant<std::string, std::size_t>;

  std::filesystem::path path;        ///< used in error messages
  Column time = std::string("t_s");  ///< s, unless its name has another unit; must be strictly increasing
  Column position;                   ///< in the unit of the file
  double scale = 1;                  ///< m per unit of `position`; not 0; can be negative
  Vec3 origin = Vec3::Zero();        ///< m, corresponds to position 0
  Vec3 direction = Vec3::UnitX();
  ScriptedMotion::Recorded::AtEnd at_end = ScriptedMotion::Recorded::AtEnd::kHold;
};

/// 33 minutes at 2 kHz, or 64 MB. Protects against files of the wrong type.
inline constexpr std::size_t kMaxRecordedSamples = 4'000'000;

/// Reads a recorded motion from `csv`, which must be the content of `file.path`. This requires memory for all samples.
/// Throws std::runtime_error "PATH:LINE: expected …, found …" if the table is not valid, if a column is missing, if the
/// time does not increase, or if the number of samples is less than 2 or too large.
ScriptedMotion::Recorded load_recorded_motion(std::istream& csv, const RecordedMotionFile& file);

}  // namespace tendon
