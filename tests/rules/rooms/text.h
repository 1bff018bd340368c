// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace tendon::rooms {

using Names = std::vector<std::string_view>;

inline const Names kRoomFolders = {"clients", "core", "deploy", "devices", "protocol", "server", "tests"};

/// Returns true if one of the `patterns` is the path, a folder that contains it ("core/"), or its end ("*.h").
inline bool one_of(std::string_view path, const Names& patterns) {
  return std::ranges::any_of(patterns, [&](std::string_view pattern) {
    if (pattern.starts_with('*')) {
      return path.ends_with(pattern.substr(1));
    }
    return pattern.ends_with('/') ? path.starts_with(pattern) : path == pattern;
  });
}

inline std::string_view first_folder(std::string_view path) { return path.substr(0, path.find('/')); }

inline std::vector<std::string_view> lines_of(std::string_view text) {
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const auto end = text.find('\n');
    lines.push_back(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return lines;
}

inline bool is_cpp(std::string_view path) { return path.ends_with(".h") || path.ends_with(".cc"); }

inline bool contains(std::string_view line, std::string_view word) { return line.find(word) != std::string_view::npos; }

inline std::string join(std::initializer_list<std::string_view> parts) {
  std::string all;
  for (const auto part : parts) {
    all += part;
  }
  return all;
}

/// Calls `comment` with the range of every comment of a C++ source, and `literal` with the range inside every string
/// and character literal. The file name of an #include "…" is not a literal.
template <class OnComment, class OnLiteral>
void for_each_comment_and_literal(std::string_view text, const OnComment& comment, const OnLiteral& literal) {
  const auto end_after = [&](std::string_view mark, std::size_t from) {
    const auto at = text.find(mark, from);
    return at == std::string_view::npos ? text.size() : at + mark.size();
  };
  const auto end_of_literal = [&](std::size_t from, char quote) {
    auto i = from + 1;
    while (i < text.size() && text[i] != quote && text[i] != '\n') {
      i += text[i] == '\\' ? 2 : 1;
    }
    return std::min(i, text.size());
  };
  const auto is_name = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };

  bool in_include = false;
  for (std::size_t i = 0; i < text.size();) {
    const auto rest = text.substr(i);
    if (text[i] == '\n') {
      in_include = false;
      ++i;
    } else if (text[i] == '#') {
      in_include = rest.substr(1).find_first_not_of(" \t") != std::string_view::npos &&
                   rest.substr(1 + rest.substr(1).find_first_not_of(" \t")).starts_with("include");
      ++i;
    } else if (rest.starts_with("//")) {
      const auto end = std::min(text.find('\n', i), text.size());
      comment(i, end);
      i = end;
    } else if (rest.starts_with("/*")) {
      const auto end = end_after("*/", i + 2);
      comment(i, end);
      i = end;
    } else if (rest.starts_with("R\"") && (i == 0 || !is_name(text[i - 1]))) {
      const auto open = text.find('(', i);
      const auto mark = open == std::string_view::npos ? std::string_view() : text.substr(i + 2, open - i - 2);
      const auto end = end_after(join({")", mark, "\""}), i + 2);
      literal(i, end);
      i = end;
    } else if (text[i] == '"' && !in_include) {
      const auto end = end_of_literal(i, '"');
      literal(i + 1, end);
      i = end + 1;
    } else if (text[i] == '\'' && (i == 0 || !is_name(text[i - 1]))) {  // not the digit separator in 1'000
      const auto end = end_of_literal(i, '\'');
      literal(i + 1, end);
      i = end + 1;
    } else {
      ++i;
    }
  }
}

inline std::string spaces_for(std::string_view text) {
  std::string spaces(text);
  std::ranges::replace_if(
      spaces, [](char c) { return c != '\n'; }, ' ');
  return spaces;
}

}  // namespace tendon::rooms
