// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::doctor_test {
namespace {

TEST(Doctor, MeasuresThisMachineAndSaysSoForPeopleAndForPrograms) {
  const testing::ScratchFolder folder;
  Process json(program("tendond"), {"doctor", "--json"}, folder.path());
  EXPECT_EQ(json.wait(), 0) << json.err();
  EXPECT_EQ(count_in(json.out(), "n"), 1000U);
  EXPECT_GT(number_in(json.out(), "p50_us"), 0);
  EXPECT_GE(number_in(json.out(), "max_us"), number_in(json.out(), "p99_us"));
  EXPECT_NE(json.out().find(R"("key":"kernel")"), std::string::npos) << json.out();

  Process words(program("tendond"), {"doctor"}, folder.path());
  EXPECT_EQ(words.wait(), 0) << words.err();
  EXPECT_NE(words.out().find("  haptic thread"), std::string::npos) << words.out();

  Process help(program("tendond"), {"doctor", "--help"}, folder.path());
  EXPECT_EQ(help.wait(), 0);
  EXPECT_NE(help.out().find("`tendond doctor`"), std::string::npos) << help.out();
  Process wrong(program("tendond"), {"doctor", "--colour"}, folder.path());
  EXPECT_EQ(wrong.wait(), 2);
}

}  // namespace
}  // namespace tendon::e2e::doctor_test
