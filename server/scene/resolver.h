// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toml++/toml.h>

#include <filesystem>
#include <string>

#include "server/scene/keys.h"

namespace tendon::scene_file {

/// Turns a draft without mistakes of its own into a scene: checks and computes what depends on several keys, and reads
/// the files that it names, relative to `directory`. `file` and `name` say in errors where a key stands.
/// Throws SceneError.
Scene resolve(Draft draft, const toml::table& file, const std::string& name, const std::filesystem::path& directory);

}  // namespace tendon::scene_file
