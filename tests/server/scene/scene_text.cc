// SPDX-License-Identifier: Apache-2.0
#include "tests/server/scene/scene_text.h"

#include <fstream>

namespace tendon {

const std::string_view kMinimal =
    "[device]\n"
    "kind = \"simulated\"\n"
    "profile = \"falcon\"\n";

const std::string_view kWithoutProfile =
    "[device]\n"
    "kind = \"simulated\"\n"
    "[device.effects]\n"
    "mass_kg = 0.2\n";

const std::string_view kHand =
    "[device]\n"
    "kind = \"simulated\"\n"
    "profile = \"falcon\"\n"
    "\n"
    "[device.hand]\n"
    "stiffness_n_per_m = 300\n"
    "damping_n_s_per_m = 3\n"
    "\n"
    "[device.hand.motion]\n";

Scene parse(const std::string& text, const std::filesystem::path& directory) {
  return parse_scene(text, "s.toml", directory);
}

Scene minimal_and(const std::string& more) { return parse(std::string(kMinimal) + more); }

std::string error_of(const std::string& text, const std::filesystem::path& directory) {
  try {
    parse(text, directory);
  } catch (const SceneError& error) {
    return error.what();
  }
  return "no error";
}

std::string error_of_minimal_and(const std::string& more) { return error_of(std::string(kMinimal) + more); }

void write(const std::filesystem::path& file, std::string_view text) { std::ofstream(file) << text; }

ScriptedMotion::Point target(const Scene& scene, double t) { return scene.simulated().hand->motion.at(t); }

}  // namespace tendon
