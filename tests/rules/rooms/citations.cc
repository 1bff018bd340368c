// SPDX-License-Identifier: Apache-2.0
#include "tests/rules/rooms/citations.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "tests/rules/rooms/text.h"

namespace tendon::rooms {
namespace {

/// This is a citation if the first folder is a room. If it is a page (.md), it is always a citation.
const Names kCitedSources = {"*.h",  "*.cc",   "*.py",  "*.ts",    "*.mjs",  "*.proto",
                             "*.sh", "*.toml", "*.csv", "*.cmake", "*.html", "*.css"};

const Names kPagesElsewhere = {"docs/spec.md"};

constexpr std::string_view kProofs = "core/PROOFS.md";

/// Returns the text of a page, or the comments of a source without their marks, with the same lines and columns.
std::string prose_of(const File& file) {
  const std::string_view text = file.text;
  if (file.path.ends_with(".md")) {
    return file.text;
  }
  std::string prose = spaces_for(text);
  const auto keep = [&](std::size_t from, std::size_t to) { prose.replace(from, to - from, text, from, to - from); };
  if (is_cpp(file.path)) {
    for_each_comment_and_literal(text, keep, [](std::size_t, std::size_t) {});
  } else {
    std::size_t begin = 0;
    for (const auto line : lines_of(text)) {
      const auto first = std::min(line.find_first_not_of(" \t"), line.size());
      auto mark = line.find("//");
      while (mark != std::string_view::npos && mark > 0 && line[mark - 1] == ':') {  // an address
        mark = line.find("//", mark + 2);
      }
      mark = line.substr(first).starts_with('*') ? first : std::min(mark, line.find('#'));
      if (mark != std::string_view::npos) {
        keep(begin + mark, begin + line.size());
      }
      begin += line.size() + 1;
    }
  }
  bool front = true;  // the line has only spaces and marks before this character
  for (char& c : prose) {
    if (c == '\n') {
      front = true;
    } else if (front && (c == '/' || c == '*' || c == '#' || c == '<' || c == '!')) {
      c = ' ';
    } else if (c != ' ' && c != '\t') {
      front = false;
    }
  }
  return prose;
}

bool is_of_path(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.' || c == '/' || c == '-';
}

/// The name "x" is a placeholder.
bool names_a_file(std::string_view name) {
  if (name.starts_with('/') || name.substr(name.rfind('/') + 1).starts_with('.') || one_of(name, kPagesElsewhere) ||
      contains(name, "/x.") || contains(name, "/x_") || contains(name, "/x/")) {
    return false;
  }
  const bool in_a_room = std::ranges::find(kRoomFolders, first_folder(name)) != kRoomFolders.end();
  return name.ends_with(".md") || (in_a_room && contains(name, "/") && one_of(name, kCitedSources));
}

void check_cited_files(const File& file, std::string_view prose, const Citable& citable,
                       std::vector<Finding>& findings) {
  const auto folder = std::filesystem::path(file.path).parent_path();
  int number = 0;
  for (const auto line : lines_of(prose)) {
    ++number;
    if (contains(line, "include \"")) {
      continue;
    }
    for (std::size_t from = 0; from < line.size();) {
      if (!is_of_path(line[from])) {
        ++from;
        continue;
      }
      auto to = from;
      while (to < line.size() && is_of_path(line[to])) {
        ++to;
      }
      auto name = line.substr(from, to - from);
      while (name.ends_with('.')) {  // the end of a sentence
        name.remove_suffix(1);
      }
      // This is part of a URL, a variable or a pattern.
      const bool part = (from > 0 && contains(":~@$<>{}*\\", line.substr(from - 1, 1))) ||
                        (to < line.size() && contains("<>{}*$", line.substr(to, 1)));
      from = to;
      if (part || !names_a_file(name)) {
        continue;
      }
      const auto beside = (folder / name).lexically_normal().generic_string();
      if (!citable.endings.contains(name) && !citable.endings.contains(beside)) {
        findings.push_back({file.path, number, join({"cites ", name, ", which does not exist"})});
      }
    }
  }
}

/// Finds `core/PROOFS.md, "Output bound"` and `core/PROOFS.md, "Output bound" and "Late holds"`, also if they continue
/// on the next line.
void check_cited_sections(const File& file, std::string_view prose, const Citable& citable,
                          std::vector<Finding>& findings) {
  constexpr std::string_view kSpace = " \t\n";
  for (auto at = prose.find(kProofs); at != std::string_view::npos; at = prose.find(kProofs, at + 1)) {
    const auto number = 1 + static_cast<int>(std::ranges::count(prose.substr(0, at), '\n'));
    auto rest = prose.substr(at + kProofs.size());
    const auto skip = [&rest](std::string_view characters) {
      rest.remove_prefix(std::min(rest.find_first_not_of(characters), rest.size()));
    };
    skip("`)");
    if (!rest.starts_with(',')) {
      continue;
    }
    while (true) {
      skip(",");
      skip(kSpace);
      if (rest.starts_with("and")) {
        rest.remove_prefix(3);
        skip(kSpace);
      }
      const auto end = rest.starts_with('"') ? rest.find('"', 1) : std::string_view::npos;
      if (end == std::string_view::npos) {
        break;
      }
      std::string name;
      for (const char c : rest.substr(1, end - 1)) {
        const bool space = contains(kSpace, std::string_view(&c, 1));
        if (!space) {
          name += c;
        } else if (!name.ends_with(' ')) {
          name += ' ';
        }
      }
      if (!citable.sections.contains(name)) {
        findings.push_back({file.path, number, join({kProofs, " has no section \"", name, "\""})});
      }
      rest.remove_prefix(end + 1);
    }
  }
}

}  // namespace

Citable citable_in(const std::vector<File>& tree) {
  Citable citable;
  for (const auto& file : tree) {
    const std::string_view path = file.path;
    for (std::size_t at = 0; at != std::string_view::npos;) {
      citable.endings.insert(path.substr(at));
      const auto slash = path.find('/', at);
      at = slash == std::string_view::npos ? slash : slash + 1;
    }
    if (path != kProofs) {
      continue;
    }
    for (auto line : lines_of(file.text)) {
      if (line.starts_with("## ")) {
        line.remove_prefix(std::min(line.find_first_not_of("# 0123456789."), line.size()));
        citable.sections.insert(line);
      }
    }
  }
  return citable;
}

void check_citations(const File& file, const Citable& citable, std::vector<Finding>& findings) {
  const auto prose = prose_of(file);
  check_cited_files(file, prose, citable, findings);
  check_cited_sections(file, prose, citable, findings);
}

}  // namespace tendon::rooms
