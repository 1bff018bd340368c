// SPDX-License-Identifier: Apache-2.0
#include "protocol/secrets/suites.h"

#include <algorithm>
#include <stdexcept>

#include "protocol/secrets/crypto.h"

namespace tendon {

Suites all_suites() {
  Suites suites;
  for (const NamedSuite& one : kSealedSuites) suites.push_back(one.suite);
  return suites;
}

bool contains(const Suites& suites, Suite suite) noexcept {
  return std::find(suites.begin(), suites.end(), suite) != suites.end();
}

Suites suites_of_this_machine() {
  crypto::start();
  Suites suites = all_suites();
  if (!crypto::has_aes()) std::erase(suites, Suite::kAesGcm);
  return suites;
}

std::string names_of(const Suites& suites) {
  std::string names;
  for (const NamedSuite& one : kSealedSuites) {
    if (contains(suites, one.suite)) names += (names.empty() ? "" : ", ") + std::string(one.name);
  }
  return names;
}

void expect_speakable(const Suites& suites) {
  const Suites here = suites_of_this_machine();
  if (suites.empty()) throw std::invalid_argument("no cipher suite: expected at least one of " + names_of(here));
  for (const Suite suite : suites) {
    if (contains(here, suite)) continue;
    throw std::invalid_argument(suite == Suite::kAesGcm
                                    ? "this processor has no AES instructions: expected " + names_of(here)
                                    : "expected suites with encryption: " + names_of(here));
  }
}

}  // namespace tendon
