// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>
#include <string_view>
#include <vector>

#include "tests/rules/rooms/room_rules.h"

namespace tendon::rooms {

/// The names that can be cited. The views refer to the tree.
struct Citable {
  std::set<std::string_view> endings;   ///< "x.cc" and "core/x.cc" for core/x.cc
  std::set<std::string_view> sections;  ///< headings "## 1. Name" of core/PROOFS.md, without the number
};

Citable citable_in(const std::vector<File>& tree);

/// Adds a finding for each file, and for each section of core/PROOFS.md, that is cited by `file` but does not exist.
void check_citations(const File& file, const Citable& citable, std::vector<Finding>& findings);

}  // namespace tendon::rooms
