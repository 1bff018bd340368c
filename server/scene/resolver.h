// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toml++/toml.h>

#include <filesystem>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <string_view>

#include "server/scene/keys.h"

namespace tendon::scene_file {

/// Throws errors about values that contradict other keys of the file.
class SceneErrors {
 public:
  /// Errors begin with `name`. Both arguments must outlive this object.
  SceneErrors(const toml::table& file, const std::string& name) : file_(file), name_(name) {}

 protected:
  /// Throws a SceneError with the line of the first of `places` that is in the file. If there is none, the error has the
  /// line of the innermost table around the key.
  [[noreturn]] void blame(std::string_view key, std::initializer_list<std::string_view> places,
                          const std::string& sentence) const;

  template <class Build>
  void build(std::string_view table, const Build& attempt) const {
    try {
      attempt();
    } catch (const std::invalid_argument& refused) {
      blame(table, {}, refused.what());
    }
  }

  const toml::table& file_;
  const std::string& name_;
};

/// Computes the friction bounds and the parts of the limiter, and the limits for rotation and gripper.
void resolve_limiter(Draft& draft, const SceneErrors& errors);

/// Turns a draft without mistakes of its own into a scene: checks and computes what depends on several keys, and reads
/// the files that it names, relative to `directory`. `file` and `name` say in errors where a key stands.
/// Throws SceneError.
Scene resolve(Draft draft, const toml::table& file, const std::string& name, const std::filesystem::path& directory);

}  // namespace tendon::scene_file
