// SPDX-License-Identifier: Apache-2.0
#include "tests/server/scene/scene_text.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/refusal.h"

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

Scene shipped(const std::string& file, const std::vector<std::string>& settings) {
  const std::filesystem::path path = std::filesystem::path(TENDON_SCENES) / file;
  const Scene scene = read_scene(path);
  return settings.empty() ? scene : parse_scene(scene.text, file, path.parent_path(), settings);
}

void expect_made(const std::string& text, const std::vector<Setting>& settings) {
  std::vector<std::string> texts;
  for (const Setting& setting : settings) texts.emplace_back(setting.text);
  const Scene scene = parse_scene(text, "s.toml", {}, texts);
  for (const Setting& setting : settings) EXPECT_DOUBLE_EQ(setting.made(scene), setting.expected) << setting.text;
}

std::string error_of(const std::string& text, const std::filesystem::path& directory) {
  const std::string error = thrown_by<SceneError>([&] { parse(text, directory); });
  return error.empty() ? "no error" : error;
}

std::string error_of_minimal_and(const std::string& more) { return error_of(std::string(kMinimal) + more); }

void expect_errors(const std::vector<Broken>& scenes) {
  for (const auto& [more, error] : scenes) EXPECT_EQ(error_of_minimal_and(more), error) << more;
}

void write(const std::filesystem::path& file, std::string_view text) { std::ofstream(file) << text; }

ScriptedMotion::Point target(const Scene& scene, double t) { return scene.simulated().hand->motion.at(t); }

}  // namespace tendon
