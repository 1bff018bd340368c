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

/// One place where a rule is broken, and the rule as a sentence.
struct Finding {
  std::string path;
  int line = 1;
  std::string rule;

  friend bool operator==(const Finding&, const Finding&) = default;
};

/// The rules of the building, read from the text of its files:
///
///     clients ──▶ protocol ──▶ core ◀── devices        tests may see all;
///                     ▲          ▲          ▲          nobody sees server or tests but tests
///                     └───────  server  ────┘
///
/// who may include whom; one front door per library; what core and protocol must not know; who may read a clock; what
/// nobody may use; the licence line; a README.md in every room; nothing at the root that has no place there; no citation
/// of a file, or of a section of core/PROOFS.md, that does not exist.
/// The last rule reads pages (but CHANGELOG.md) and comments. The other rules ignore comments and the contents of string
/// literals. Findings come in the order of `tree`, by line in each file; those about the tree as a whole come last. Empty
/// when all rules are kept.
std::vector<Finding> check(const std::vector<File>& tree);

/// All files under `root` in the order of their paths, without what is made there and ignored by git (build folders,
/// caches, packages). Throws std::filesystem::filesystem_error when `root` cannot be read.
std::vector<File> read_tree(const std::filesystem::path& root);

/// `path:line: rule`, which editors and terminals take for a link.
std::string to_string(const Finding& finding);

/// `text` with every comment, and the inside of every string and character literal, turned into spaces. Lines and
/// columns stay. The file name of an #include "…" stays too.
std::string without_comments_and_strings(std::string_view text);

}  // namespace tendon::rooms
