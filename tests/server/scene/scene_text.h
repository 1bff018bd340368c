// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "devices/simulated/scripted_motion.h"
#include "server/scene/scene.h"

namespace tendon {

/// Three lines, so the rest begins at line 4.
extern const std::string_view kMinimal;
/// Four lines, so the rest begins at line 5.
extern const std::string_view kWithoutProfile;
/// Nine lines. The motion of the hand begins in the last one.
extern const std::string_view kHand;

/// Reads `text` as the file s.toml.
Scene parse(const std::string& text, const std::filesystem::path& directory = {});
Scene minimal_and(const std::string& more);

/// Returns the error message, or "no error".
std::string error_of(const std::string& text, const std::filesystem::path& directory = {});
std::string error_of_minimal_and(const std::string& more);

void write(const std::filesystem::path& file, std::string_view text);

ScriptedMotion::Point target(const Scene& scene, double t);

}  // namespace tendon
