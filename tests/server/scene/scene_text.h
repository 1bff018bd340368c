// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "devices/simulated/scripted_motion.h"
#include "server/scene/scene.h"

namespace tendon {

/// This has three lines, so the rest begins at line 4.
extern const std::string_view kMinimal;
/// This has four lines, so the rest begins at line 5.
extern const std::string_view kWithoutProfile;
/// This has nine lines. The last line is the beginning of the table for the motion of the hand.
extern const std::string_view kHand;

/// Reads `text` as the file s.toml.
Scene parse(const std::string& text, const std::filesystem::path& directory = {});
Scene minimal_and(const std::string& more);
/// Reads deploy/scenes/`file`.
Scene shipped(const std::string& file, const std::vector<std::string>& settings = {});

/// A setting "TABLE.KEY=VALUE" of a scene, and the value that the scene must then have in SI units (1 for true).
using S = const Scene&;
struct Setting {
  const char* text;
  double expected;
  double (*made)(S scene);
};
void expect_made(const std::string& text, const std::vector<Setting>& settings);

/// Returns the error message, or "no error" if there is none.
std::string error_of(const std::string& text, const std::filesystem::path& directory = {});
std::string error_of_minimal_and(const std::string& more);

struct Broken {
  std::string more;  ///< appended to kMinimal
  std::string error;
};
void expect_errors(const std::vector<Broken>& scenes);

void write(const std::filesystem::path& file, std::string_view text);

ScriptedMotion::Point target(const Scene& scene, double t);

}  // namespace tendon
