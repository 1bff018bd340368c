// SPDX-License-Identifier: Apache-2.0
#include "server/scene/reference.h"

#include <algorithm>
#include <iomanip>
#include <sstream>
#include <stdexcept>

#include "core/base/nearest_word.h"
#include "server/scene/keys.h"
#include "server/scene/scene.h"

namespace tendon {
namespace {

/// Each kind of a table has its own chapter.
struct Chapter {
  std::string table;
  std::string text;
  std::size_t keys = 0;
};

std::vector<Chapter> chapters() {
  std::vector<Chapter> all;
  std::istringstream reference(scene_reference());
  for (std::string line; std::getline(reference, line);) {
    if (line.starts_with('[')) {
      const std::size_t begin = line.find_first_not_of('[');
      all.push_back({.table = line.substr(begin, line.find(']') - begin), .text = {}});
    }
    // Each key is on a separate line, followed by its indented description.
    const bool one_word = line.starts_with("  ") && line.find(' ', line.find_first_not_of(' ')) == std::string::npos;
    const bool is_key = one_word && !line.ends_with('.');
    if (is_key) ++all.back().keys;
    all.back().text += line + '\n';
  }
  return all;
}

}  // namespace

std::string scene_reference(std::string_view table) {
  const std::vector<Chapter> all = chapters();
  std::string text;
  std::vector<std::string_view> known;
  for (const Chapter& chapter : all) {
    known.emplace_back(chapter.table);
    const bool inside = chapter.table.starts_with(std::string(table) + '.');
    if (chapter.table == table || inside) text += chapter.text;
  }
  if (text.empty()) {
    throw std::invalid_argument("--scene-help: no table \"" + std::string(table) + '"' + did_you_mean(table, known));
  }
  return text;
}

std::string scene_tables() {
  std::vector<Chapter> tables;
  for (const Chapter& chapter : chapters()) {
    const auto same = [&](const Chapter& one) { return one.table == chapter.table; };
    const auto found = std::ranges::find_if(tables, same);
    found == tables.end() ? tables.push_back(chapter) : void(found->keys += chapter.keys);
  }
  std::ostringstream text;
  for (const Chapter& table : tables) {
    text << std::left << std::setw(40) << table.table << std::right << std::setw(3) << table.keys
         << (table.keys == 1 ? " key\n" : " keys\n");
  }
  text << "\n`tendond --scene-help limiter` prints the keys of a table, `tendond --scene-help all` those of all.\n";
  return text.str();
}

std::string scene_reference() {
  std::string text;
  scene_file::Draft draft;
  scene_file::Reference reference(text);
  scene_file::declare_scene(reference, draft);
  return text;
}

}  // namespace tendon
