// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/text.h"

#include <gtest/gtest.h>

#include <string>

namespace tendon::text_test {
namespace {

TEST(Text, CharactersHaveOneToFourBytes) {
  EXPECT_EQ(utf8_character("a"), 1U);
  EXPECT_EQ(utf8_character("\xC3\xA4 and more"), 2U);   // ä
  EXPECT_EQ(utf8_character("\xE2\x82\xAC"), 3U);        // €
  EXPECT_EQ(utf8_character("\xF0\x9F\x98\x80"), 4U);    // 😀
  EXPECT_EQ(utf8_character("\xF4\x8F\xBF\xBF"), 4U);    // U+10FFFF, the largest
  EXPECT_EQ(utf8_character(std::string(1, '\0')), 1U);  // NUL is a character
}

TEST(Text, BrokenCharactersAreNone) {
  for (const std::string text :
       {"", "\x80", "\xBF", "\xC3", "\xC3(", "\xE2\x82", "\xE2(\xAC", "\xF0\x9F\x98", "\xFF"}) {
    EXPECT_EQ(utf8_character(text), 0U) << text;
  }
}

TEST(Text, OverlongFormsSurrogatesAndBeyondUnicodeAreNone) {
  for (const std::string text : {"\xC0\x80", "\xC1\xBF", "\xE0\x9F\xBF", "\xED\xA0\x80", "\xED\xBF\xBF",
                                 "\xF0\x8F\xBF\xBF", "\xF4\x90\x80\x80", "\xF5\x80\x80\x80"}) {
    EXPECT_EQ(utf8_character(text), 0U) << text;
  }
}

TEST(Text, NothingVisibleMovesACursorOrBeginsALine) {
  EXPECT_EQ(visible("hand \xC3\xA4\xE2\x82\xAC~"), "hand \xC3\xA4\xE2\x82\xAC~");
  EXPECT_EQ(visible("wall\"\n07:00:00.000 info armed\t"), "wall\"\\n07:00:00.000 info armed\\t");
  EXPECT_EQ(visible("\x1B[2J\r\x7F"), "\\x1b[2J\\x0d\\x7f");
  EXPECT_EQ(visible(std::string(1, '\0')), "\\x00");
  EXPECT_EQ(visible("\xC2\x9B"
                    "31m"),
            "\\x9b31m")
      << "CSI of C1";
  EXPECT_EQ(visible("\xC2\xA0"), "\xC2\xA0") << "the first character after C1";
  EXPECT_EQ(visible("ok\xFF\xC3"), "ok\\xff\\xc3") << "what is not UTF-8";
}

TEST(Text, ClipEndsBeforeACharacterThatDoesNotFitOrIsBroken) {
  EXPECT_EQ(clip("hand", 64), "hand");
  EXPECT_EQ(clip("hand", 3), "han");
  EXPECT_EQ(clip("a\xE2\x82\xAC", 3), "a");
  EXPECT_EQ(clip("a\xE2\x82\xAC", 4), "a\xE2\x82\xAC");
  EXPECT_EQ(clip("ok\xFFrest", 64), "ok");
}

}  // namespace
}  // namespace tendon::text_test
