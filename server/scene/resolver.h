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

/// Reports inconsistencies between several keys of a file.
class SceneErrors {
 public:
  /// `name` is the start of error messages. Both arguments must outlive this object.
  SceneErrors(const toml::table& file, const std::string& name) : file_(file), name_(name) {}

 protected:
  /// Throws a SceneError with the line of the first of `places` that exists in the file, or of the innermost table that
  /// contains the key.
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

void resolve_limiter(Draft& draft, const SceneErrors& errors);

/// Checks and computes all values that depend on several keys. Files in the scene are read relative to `directory`.
/// `file` and `name` are used in error messages. Throws SceneError.
Scene resolve(Draft draft, const toml::table& file, const std::string& name, const std::filesystem::path& directory);

}  // namespace tendon::scene_file
