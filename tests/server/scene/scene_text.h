// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "devices/simulated/scripted_motion.h"
#include "server/scene/scene.h"

// Scenes in memory for the tests of server/scene: their texts, and what reading them gives.

namespace tendon {

/// Three lines: more begins at line 4.
extern const std::string_view kMinimal;
/// Four lines: more begins at line 5.
extern const std::string_view kWithoutProfile;
/// Nine lines, the last of which begins the hand's motion.
extern const std::string_view kHand;

/// The scene of `text`, whose file is called s.toml.
Scene parse(const std::string& text, const std::filesystem::path& directory = {});
Scene minimal_and(const std::string& more);

/// The sentence that refuses it; "no error" when nothing does.
std::string error_of(const std::string& text, const std::filesystem::path& directory = {});
std::string error_of_minimal_and(const std::string& more);

void write(const std::filesystem::path& file, std::string_view text);

/// Where the scene's hand wants to be after `t` seconds.
ScriptedMotion::Point target(const Scene& scene, double t);

}  // namespace tendon
