// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toml++/toml.h>

#include <filesystem>
#include <string>

#include "server/scene/keys.h"
#include "server/scene/reader.h"

namespace tendon::scene_file {

void resolve_limiter(Draft& draft, const SceneErrors& errors);

/// Checks and computes all values that depend on several keys. Files in the scene are relative to `directory`. `file`
/// and `name` are used in error messages. Throws SceneError.
Scene resolve(Draft draft, const toml::table& file, const std::string& name, const std::filesystem::path& directory);

}  // namespace tendon::scene_file
