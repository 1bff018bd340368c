// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/answered.h"

#include <gtest/gtest.h>

namespace tendon::softbody::answered_test {
namespace {

constexpr NearModel::Size kNear{.made = 5, .late = 1, .linear = 3};

TEST(Answered, SaysTheSameCountsInWordsAndInJson) {
  const Answered both{{{.size = {.name = "tabulated"}, .answers = 812}, {.size = {.name = "learned"}, .answers = 97}},
                      kNear};
  EXPECT_EQ(in_json(both), R"({"answers":{"tabulated":812,"learned":97,"linear":3,"fields":5,"fields_late":1}})"
                           "\n");
  EXPECT_EQ(in_words(both),
            "812 answers were tabulated, 97 answers were learned, 3 answers were from the linear body, 5 near fields "
            "were computed by the other thread, 1 of them were too late\n");
}

TEST(Answered, WithoutAnotherThreadThereAreLevelsAlone) {
  const Answered levels{{{.size = {.name = "learned"}, .answers = 0}}, {}};
  EXPECT_EQ(in_json(levels), "{\"answers\":{\"learned\":0}}\n");
  EXPECT_EQ(in_words(levels), "0 answers were learned\n");
}

TEST(Answered, ABodyWithoutEitherHasNothingToSay) {
  EXPECT_EQ(in_json({}), "");
  EXPECT_EQ(in_words({}), "");
}

}  // namespace
}  // namespace tendon::softbody::answered_test
