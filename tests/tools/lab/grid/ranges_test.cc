// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/grid/ranges.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/support/refusal.h"

namespace tendon::lab::ranges_test {
namespace {

using Texts = std::vector<std::string>;

TEST(Ranges, ATextWithoutRangesStaysAsItIs) {
  for (const char* const text :
       {"", "lan", "delay=uniform(1ms,2ms) loss=2%", "delay=histogram(0.5ms:72,1ms:28)", "a-b:c"}) {
    EXPECT_EQ(expanded(text), Texts{text}) << text;
  }
}

TEST(Ranges, ARangeIncludesBothEndsWithTheDecimalsItIsWrittenWith) {
  EXPECT_EQ(expanded("delay=0:40:20ms"), (Texts{"delay=0ms", "delay=20ms", "delay=40ms"}));
  EXPECT_EQ(expanded("0:0.3:0.1"), (Texts{"0.0", "0.1", "0.2", "0.3"}));
  EXPECT_EQ(expanded("20:-20:-20"), (Texts{"20", "0", "-20"}));
  EXPECT_EQ(expanded("5:5:1"), Texts{"5"});
}

TEST(Ranges, TheLastOneVariesFastest) {
  EXPECT_EQ(
      expanded("delay={1,20}ms loss={0,burst(1%,3)}"),
      (Texts{"delay=1ms loss=0", "delay=1ms loss=burst(1%,3)", "delay=20ms loss=0", "delay=20ms loss=burst(1%,3)"}));
  EXPECT_EQ(expanded("{0:2:1,9}"), (Texts{"0", "1", "2", "9"}));
}

TEST(Ranges, RefusesWhatItCannotExpand) {
  const auto expected = [](std::string_view text) { return thrown_by([text] { expanded(text); }); };
  EXPECT_EQ(expected("delay=0:50:20ms"), "expected a range A:B:STEP that reaches B in whole steps, found 0:50:20");
  EXPECT_EQ(expected("0:10:0"), "expected a range A:B:STEP that reaches B in whole steps, found 0:10:0");
  EXPECT_EQ(expected("10:0:1"), "expected a range A:B:STEP that reaches B in whole steps, found 10:0:1");
  EXPECT_EQ(expected("loss={0,1"), "expected } at the end of {0,1");
  EXPECT_EQ(expected("loss={}"), "expected a value on both sides of each comma, found \"\"");
  EXPECT_EQ(expected("1:1000:1 1:1000:1"), "expected at most 100000 combinations, found more");
}

TEST(Ranges, NumbersAreInTheirBoundsAndOccurOnce) {
  EXPECT_EQ(numbers("250,500:1500:500", "--stiffness", 1, 1e6), (std::vector<double>{250, 500, 1000, 1500}));

  const auto refused = [](std::string_view text) { return thrown_by([text] { numbers(text, "--k", 1, 1000); }); };
  EXPECT_EQ(refused("0"), "--k: expected numbers from 1 to 1000 or a range A:B:STEP, found \"0\"");
  EXPECT_EQ(refused("5N"), "--k: expected numbers from 1 to 1000 or a range A:B:STEP, found \"5N\"");
  EXPECT_EQ(refused("1,,2"), "--k: expected a value on both sides of each comma, found \"1,,2\"");
  EXPECT_EQ(refused("1:3:1,2"), "--k: expected each number once, found 2 twice");
}

}  // namespace
}  // namespace tendon::lab::ranges_test
