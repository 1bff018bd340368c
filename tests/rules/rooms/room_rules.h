// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace tendon::rooms {

/// One file of the project. `path` is relative to the root and uses slashes.
struct File {
  std::string path;
  std::string text;
};

struct Finding {
  std::string path;
  int line = 1;
  std::string rule;

  friend bool operator==(const Finding&, const Finding&) = default;
};

/// Checks the rules about includes and files:
///
///     clients ──▶ protocol ──▶ core ◀── devices        tests may include everything;
///                     ▲          ▲          ▲          only tests may include server and tests
///                     └───────  server  ────┘
///
/// Includes between rooms, the files that may use each library, what core and protocol must not use, who may read a
/// clock, functions that are forbidden everywhere, the license line, a README.md in each room, files at the root, and
/// citations (in pages except CHANGELOG.md, and in comments) of files and of sections of core/PROOFS.md. The findings
/// are in the order of `tree` and by line; those about the whole tree are last.
std::vector<Finding> check(const std::vector<File>& tree);

/// Returns all files, ordered by path, without those that git ignores (build folders, caches, packages). Throws
/// std::filesystem::filesystem_error if `root` cannot be read.
std::vector<File> read_tree(const std::filesystem::path& root);

/// Returns `path:line: rule`, which editors and terminals turn into a link.
std::string to_string(const Finding& finding);

/// Replaces comments and strings by spaces, so that lines and columns do not change, except in #include "…".
std::string without_comments_and_strings(std::string_view text);

}  // namespace tendon::rooms
