// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/verbs/verb.h"

#include <algorithm>
#include <utility>

namespace tendon::lab {
namespace {

/// A function-local static, because verbs register before main() in unspecified order.
std::vector<Verb>& known() {
  static std::vector<Verb> known;
  return known;
}

}  // namespace

Verb::Verb(std::string its_name, std::string its_what, Add its_add)
    : name(std::move(its_name)), what(std::move(its_what)), add(its_add) {
  known().push_back(*this);
}

std::vector<Verb> verbs() {
  std::vector<Verb> all = known();
  std::ranges::sort(all, {}, &Verb::name);
  return all;
}

}  // namespace tendon::lab
