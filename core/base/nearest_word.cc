// SPDX-License-Identifier: Apache-2.0
#include "core/base/nearest_word.h"

#include <algorithm>
#include <cstddef>

namespace tendon {
namespace {

constexpr std::size_t kLongestWord = 64;

/// Edit distance between `a` and `b`: insert, delete, replace, or swap two neighbours.
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

std::string_view nearest_word(std::string_view unknown, const std::vector<std::string_view>& known) {
  std::string_view closest;
  std::size_t fewest = unknown.size() <= kLongestWord ? unknown.size() / 3 + 1 : 0;
  for (const std::string_view word : known) {
    const auto [shorter, longer] = std::minmax({unknown.size(), word.size()});
    if (longer - shorter >= fewest) continue;  // the distance cannot be smaller
    if (const std::size_t count = edits(unknown, word); count < fewest) {
      fewest = count;
      closest = word;
    }
  }
  return closest;
}

std::string did_you_mean(std::string_view unknown, const std::vector<std::string_view>& known) {
  const std::string_view meant = nearest_word(unknown, known);
  return meant.empty() ? std::string() : "; did you mean " + std::string(meant) + "?";
}

std::string did_you_mean(std::string_view unknown, std::string_view known) {
  constexpr std::string_view kBetween = ", ";
  std::vector<std::string_view> words;
  for (std::size_t end = 0; end != std::string_view::npos;) {
    end = known.find(kBetween);
    words.push_back(known.substr(0, end));
    if (end != std::string_view::npos) known.remove_prefix(end + kBetween.size());
  }
  return did_you_mean(unknown, words);
}

std::string_view decimal_point_hint(std::string_view text) noexcept {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  for (std::size_t i = 1; i + 1 < text.size(); ++i) {
    if (text[i] == ',' && is_digit(text[i - 1]) && is_digit(text[i + 1])) return " (a decimal point?)";
  }
  return "";
}

}  // namespace tendon
