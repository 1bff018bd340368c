// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>
#include <functional>

#include "devices/simulated/scripted_motion.h"
#include "server/tables/recorded_motion.h"

namespace tendon {

/// Handle path in m from one column of a recording of the TU/e rig.
inline std::function<double(double)> recorded(const std::filesystem::path& file, const char* column) {
  std::ifstream csv(file);
  const ScriptedMotion motion(load_recorded_motion(csv, {.path = file, .position = column, .scale = 0.075}));
  return [motion](double t) { return motion.at(t).position.x(); };
}

}  // namespace tendon
