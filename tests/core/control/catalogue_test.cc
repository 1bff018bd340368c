// SPDX-License-Identifier: Apache-2.0
// The lists of laws and of AOL+ parts must agree with each other and with core/control/README.md.
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <string_view>

#include "core/control/aol_parts.h"
#include "core/control/limiter.h"

namespace tendon::catalogue_test {
namespace {

std::string readme() {
  std::ifstream file(TENDON_CONTROL_README);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(Catalogue, EveryLawIsARowOfTheReadme) {
  const std::string page = readme();
  for (const LawInfo& law : laws()) {
    EXPECT_NE(page.find("\n| `" + std::string(law.name) + "` |"), std::string::npos) << law.name;
  }
}

TEST(Catalogue, EveryPartOfAolPlusIsARowOfTheReadme) {
  const std::string page = readme();
  for_each_aol_part([&](const auto& part) {
    EXPECT_NE(page.find("\n| `" + std::string(part.name) + "` |"), std::string::npos) << part.name;
    EXPECT_FALSE(part.what.empty()) << part.name;
  });
}

TEST(Catalogue, EachPartOfAolPlusIsListedOnce) {
  // This binding fails to compile if Parts gains a member. In this case, add a row to kAolParts.
  PointAolPlus::Parts parts;
  const auto& [cap, robust, knee, reserve, bounded, shaping, adaptive, thrift, damper, fading] = parts;
  EXPECT_EQ(std::tuple_size_v<decltype(kAolParts)>, 10U);
  std::set<std::string_view> names;
  std::set<const void*> members;
  for_each_aol_part([&](const auto& part) {
    names.insert(part.name);
    members.insert(&(parts.*part.config));
    (parts.*part.config).emplace();
  });
  EXPECT_EQ(names.size(), 10U);
  EXPECT_EQ(members.size(), 10U);
  EXPECT_TRUE(cap && robust && knee && reserve && bounded && shaping && adaptive && thrift && damper && fading);
}

}  // namespace
}  // namespace tendon::catalogue_test
