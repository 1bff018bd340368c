// SPDX-License-Identifier: Apache-2.0
#include "server/scene/reader.h"

#include <algorithm>

#include "core/base/nearest_word.h"
#include "server/scene/scene_error.h"

namespace tendon::scene_file {
namespace {

/// Returns the value after the = in this line if it starts like a number. The first line is 1.
std::string_view bare_value(std::string_view text, std::size_t line) {
  for (; line > 1; --line) text.remove_prefix(std::min(text.find('\n'), text.size() - 1) + 1);
  text = text.substr(0, text.find_first_of("\n#"));
  text.remove_prefix(std::min(text.find('='), text.size() - 1) + 1);
  text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
  return text.find_first_of("+-.0123456789") == 0 ? text : std::string_view();
}

}  // namespace

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

std::string_view new_name_of(std::string_view path) noexcept {
  return path == "teleoperation.purse" ? "teleoperation.energy_tank" : "";
}

Place place_of(const toml::node& node) { return {node.source().begin.line, node.source().begin.column}; }

toml::table parse_toml(std::string_view text, const std::string& name) {
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& error) {
    const std::size_t line = error.source().begin.line;
    throw SceneError(name + ':' + std::to_string(line) + ": not TOML: " + std::string(error.description()) +
                     std::string(decimal_point_hint(bare_value(text, line))));
  }
}

[[noreturn]] void fail(const std::string& file, Place at, const std::string& key, const std::string& sentence) {
  std::string text = file;
  if (at.line > 0) text += ':' + std::to_string(at.line);
  throw SceneError(text + ": " + key + ": " + sentence);
}

void SceneErrors::blame(std::string_view key, std::initializer_list<std::string_view> places,
                        const std::string& sentence) const {
  Place place;
  const auto look = [&](std::string_view path) {
    if (const auto node = file_.at_path(path); node && place.line == 0) place = place_of(*node.node());
  };
  for (const std::string_view path : places) look(path);
  for (std::string_view path = key;; path = path.substr(0, path.rfind('.'))) {
    look(path);
    if (path.find('.') == std::string_view::npos) break;
  }
  fail(name_, place, std::string(key), sentence);
}

}  // namespace tendon::scene_file
