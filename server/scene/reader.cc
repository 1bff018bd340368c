// SPDX-License-Identifier: Apache-2.0
#include "server/scene/reader.h"

#include "server/scene/scene.h"

namespace tendon::scene_file {
namespace {

/// How many letters have to be added, left out, replaced or swapped with their neighbour to turn `a` into `b`.
std::size_t edits(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        d[i][j] = i + j;
        continue;
      }
      const std::size_t replaced = d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      d[i][j] = std::min({replaced, d[i - 1][j] + 1, d[i][j - 1] + 1});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  }
  return d[a.size()][b.size()];
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
      return std::string(stem) + " is given in " + std::string(unit.symbol) + ": " + std::string(key);
    }
  }
  // Beyond a third of its letters a key is another word, not a misspelt one. Longer than any key of ours: no word.
  constexpr std::size_t kLongestWord = 64;
  std::string_view closest;
  std::size_t fewest = unknown.size() <= kLongestWord ? unknown.size() / 3 + 1 : 0;
  for (const std::string_view key : known) {
    const auto [shorter, longer] = std::minmax({unknown.size(), key.size()});
    if (longer - shorter >= fewest) continue;  // that many letters are missing at least
    if (const std::size_t count = edits(unknown, key); count < fewest) {
      fewest = count;
      closest = key;
    }
  }
  if (!closest.empty()) return "did you mean " + std::string(closest) + "?";
  std::string all;
  for (const std::string_view key : known) all.append(all.empty() ? "known here: " : ", ").append(key);
  return all;
}

Place place_of(const toml::node& node) { return {node.source().begin.line, node.source().begin.column}; }

[[noreturn]] void fail(const std::string& file, Place at, const std::string& key, const std::string& sentence) {
  std::string text = file;
  if (at.line > 0) text += ':' + std::to_string(at.line);
  throw SceneError(text + ": " + key + ": " + sentence);
}

}  // namespace tendon::scene_file
