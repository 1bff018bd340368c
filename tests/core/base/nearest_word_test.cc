// SPDX-License-Identifier: Apache-2.0
#include "core/base/nearest_word.h"

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

namespace tendon::nearest_word_test {
namespace {

const std::vector<std::string_view> kWords = {"none", "aol", "aol+", "energy-bounding", "right", "left"};

TEST(NearestWord, FindsAWordWithALetterTooManyTooFewReplacedOrSwapped) {
  EXPECT_EQ(nearest_word("aoll+", kWords), "aol+");
  EXPECT_EQ(nearest_word("energy-boundng", kWords), "energy-bounding");
  EXPECT_EQ(nearest_word("lift", kWords), "left");
  EXPECT_EQ(nearest_word("rihgt", kWords), "right");
}

TEST(NearestWord, CallsNoOtherWordAMisspeltOne) {
  EXPECT_EQ(nearest_word("passivity", kWords), "");
  EXPECT_EQ(nearest_word("", kWords), "");
  EXPECT_EQ(nearest_word("aol", {}), "");
  EXPECT_EQ(nearest_word(std::string(65, 'x'), {std::string_view("x")}), "");
}

TEST(NearestWord, IsOfferedAsAQuestion) {
  EXPECT_EQ(did_you_mean("rihgt", kWords), "; did you mean right?");
  EXPECT_EQ(did_you_mean("passivity", kWords), "");
  EXPECT_EQ(did_you_mean("capsul", "patch, sphere, capsule"), "; did you mean capsule?");
  EXPECT_EQ(did_you_mean("patc", "patch"), "; did you mean patch?");
  EXPECT_EQ(did_you_mean("capsule", ""), "");
}

}  // namespace
}  // namespace tendon::nearest_word_test
