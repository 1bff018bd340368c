// SPDX-License-Identifier: Apache-2.0
#include "server/scene/reader.h"

#include "core/base/nearest_word.h"
#include "server/scene/scene.h"

namespace tendon::scene_file {

std::string joined(std::string_view path, std::string_view name) {
  return path.empty() ? std::string(name) : std::string(path) + '.' + std::string(name);
}

std::string advice(std::string_view unknown, const std::vector<std::string_view>& known) {
  for (const std::string_view key : known) {
    const Unit& unit = unit_of(key);
    const std::string_view stem = key.substr(0, key.size() - unit.suffix.size());
    const bool only_the_unit_differs = unknown == stem || unknown.starts_with(std::string(stem) + '_');
    if (!unit.suffix.empty() && only_the_unit_differs) {
      return "; " + std::string(stem) + " is given in " + std::string(unit.symbol) + ": " + std::string(key);
    }
  }
  std::string text = did_you_mean(unknown, known);
  if (!text.empty()) return text;
  for (const std::string_view key : known) text.append(text.empty() ? "; expected one of " : ", ").append(key);
  return text;
}

Place place_of(const toml::node& node) { return {node.source().begin.line, node.source().begin.column}; }

[[noreturn]] void fail(const std::string& file, Place at, const std::string& key, const std::string& sentence) {
  std::string text = file;
  if (at.line > 0) text += ':' + std::to_string(at.line);
  throw SceneError(text + ": " + key + ": " + sentence);
}

}  // namespace tendon::scene_file
