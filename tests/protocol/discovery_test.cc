// SPDX-License-Identifier: Apache-2.0
#include "protocol/discovery.h"

#include <gtest/gtest.h>

#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/refusal.h"

namespace tendon::dns_sd::discovery_test {
namespace {

std::string refusal(const std::string& text) {
  return thrown_by([&] { parse_instance(text); });
}

TEST(Discovery, ANameEndsAtTheFirstDotThatIsNotEscaped) {
  EXPECT_EQ(parse_instance("falcon at bench 3"), (Instance{"falcon at bench 3", "local"}));
  EXPECT_EQ(parse_instance("falcon.example.org"), (Instance{"falcon", "example.org"}));
  EXPECT_EQ(parse_instance("falcon.Example.ORG."), (Instance{"falcon", "example.org"}));
  EXPECT_EQ(parse_instance("falcon.local"), (Instance{"falcon", "local"}));
  EXPECT_EQ(parse_instance("falcon v1\\.2.example.org"), (Instance{"falcon v1.2", "example.org"}));
  EXPECT_EQ(parse_instance("back\\\\slash"), (Instance{"back\\slash", "local"}));
  EXPECT_EQ(parse_instance("falcon\\032at\\032\\049"), (Instance{"falcon at 1", "local"}));
}

TEST(Discovery, WithoutANameAllOfADomainIsMeant) {
  EXPECT_EQ(parse_instance(""), (Instance{"", "local"}));
  EXPECT_EQ(parse_instance(".example.org"), (Instance{"", "example.org"}));
}

TEST(Discovery, ANameHas63BytesOfUtf8WithoutControlCharacters) {
  const std::string longest = "B\xC3\xA4nk " + std::string(57, 'x');
  ASSERT_EQ(longest.size(), kMaxName);
  EXPECT_EQ(parse_instance(longest).name, longest);
  EXPECT_TRUE(is_instance_name("\xE5\x8A\x9B 3"));
  EXPECT_FALSE(is_instance_name(longest + "x"));
  EXPECT_FALSE(is_instance_name(std::string_view("a\0b", 3)));
  for (const char* const name : {"", "a\nb", "\x7F", "\x1B[2J", "\xC2\x9B[2J", "\xC3", "\xFF", "\xED\xA0\x80"}) {
    EXPECT_FALSE(is_instance_name(name)) << name;
  }
}

TEST(Discovery, WhatIsNoNameIsRefusedWithTheReason) {
  EXPECT_EQ(refusal("a\\"), R"(expected NAME or NAME.DOMAIN like "falcon at bench 3", got "a\": )"
                            "a backslash must not be the last character");
  EXPECT_NE(refusal("a\\25").find("three digits"), std::string::npos);
  EXPECT_NE(refusal("a\\256").find("three digits"), std::string::npos);
  EXPECT_NE(refusal("a\\027").find("without control characters"), std::string::npos);
  EXPECT_NE(refusal(std::string(64, 'a')).find("63 bytes"), std::string::npos);
  const std::string too_long(64, 'a');
  for (const std::string_view domain : {".", "..", "a..b", "exa mple", "a/b", "-.\n", too_long.c_str()}) {
    EXPECT_NE(refusal("a." + std::string(domain)).find("after the first dot must be a domain"), std::string::npos)
        << domain;
  }
  std::string of_254_bytes(62, 'a');
  while (of_254_bytes.size() < 254) of_254_bytes.append(1, '.').append(63, 'b');
  EXPECT_FALSE(is_domain(of_254_bytes));
  EXPECT_TRUE(is_domain(of_254_bytes.substr(1)));
}

TEST(Discovery, WhatIsWrittenIsReadAgain) {
  for (const Instance& instance : {Instance{"a.b\\c d", "local"}, Instance{"\\065", "example.org"},
                                   Instance{"", "local"}, Instance{"", "example.org"}, Instance{"\xC3\xA4.", "x"}}) {
    EXPECT_EQ(parse_instance(to_string(instance)), instance) << to_string(instance);
  }
  EXPECT_EQ(to_string({"falcon at bench 3", "local"}), "falcon at bench 3");
  EXPECT_EQ(full_name({"v1.2", "example.org"}), "v1\\.2._tendon._udp.example.org");
  EXPECT_EQ(full_name({"", "local"}), "_tendon._udp.local");
}

TEST(Discovery, AnotherNameIsOneToo) {
  EXPECT_EQ(another_name("falcon", 2), "falcon #2");
  const std::string of_umlauts = "x\xC3\xA4\xC3\xA4" + std::string(58, 'y');
  ASSERT_EQ(of_umlauts.size(), kMaxName);
  const std::string long_one = another_name(of_umlauts, 100);
  EXPECT_LE(long_one.size(), kMaxName);
  EXPECT_TRUE(long_one.ends_with(" #100"));
  std::string cut_inside;
  while (cut_inside.size() < 62) cut_inside += "\xC3\xA4";
  EXPECT_TRUE(is_instance_name(another_name(cut_inside, 2)));
}

const About kFalcon{.version = 1, .device = "falcon", .hz = 1000, .suite = 1, .channels = {"main", "tissue"}};

TEST(Discovery, ATextRecordSaysWhatItWasMadeOf) {
  const std::vector<std::string> strings = to_txt(kFalcon);
  EXPECT_EQ(strings, (std::vector<std::string>{"v=1", "device=falcon", "hz=1000", "suite=1", "channels=main,tissue"}));
  EXPECT_EQ(read_txt(strings), kFalcon);
}

TEST(Discovery, TheLongestTextsFitIntoTheirStrings) {
  const About longest{.version = 1,
                      .device = std::string(24, 'd'),
                      .hz = 1'000'000,
                      .suite = 1,
                      .channels = std::vector<std::string>(8, std::string(24, 'c'))};
  for (const std::string& text : to_txt(longest)) EXPECT_LE(text.size(), 255U);
  EXPECT_EQ(read_txt(to_txt(longest)), longest);
}

TEST(Discovery, OfAStrangersTextOnlyWhatIsSoundCounts) {
  const auto read = [](std::vector<std::string> strings) { return read_txt(strings); };
  EXPECT_EQ(read({"V=1", "Device=falcon", "HZ=1000", "suite=1", "channels=main,tissue"}), kFalcon);
  EXPECT_EQ(read({"device=first", "device=second"}).device, "first");
  EXPECT_EQ(read({"device=\x1B[2J", "device=second"}).device, "");
  for (const std::string value : {"", "a b", "a.b", "\xC3\xA4", "1234567890123456789012345", "a\n"}) {
    EXPECT_EQ(read({"device=" + value}).device, "") << value;
  }
  for (const std::string value : {"", "-1", "1e3", "1000001", "99999999999999999999", " 1", "1 ", "0x10"}) {
    EXPECT_EQ(read({"hz=" + value}).hz, 0U) << value;
  }
  for (const std::string value : {"", ",", "a,", ",a", "a,,b", "a b", "1,2,3,4,5,6,7,8,9"}) {
    EXPECT_TRUE(read({"channels=" + value}).channels.empty()) << value;
  }
  EXPECT_EQ(read({"", "=", "=x", "v", std::string(255, 'x'), std::string("v=1\0", 4)}), About{});
}

std::span<const std::byte> bytes_of(const std::string& text) { return std::as_bytes(std::span(text)); }

TEST(Discovery, TheDataOfATextRecordAreStringsWithTheirLengths) {
  using Strings = std::vector<std::string>;
  EXPECT_EQ(split_txt(bytes_of("\x03v=1\x05hz=10")), (Strings{"v=1", "hz=10"}));
  EXPECT_EQ(split_txt(bytes_of(std::string("\0", 1))), (Strings{""}));  // a record without strings
  EXPECT_EQ(split_txt({}), Strings{});
  EXPECT_EQ(split_txt(bytes_of("\x03v=1\x06hz=10")), (Strings{"v=1"})) << "the second one is cut";
  EXPECT_EQ(split_txt(bytes_of("\xFF")), Strings{});
}

}  // namespace
}  // namespace tendon::dns_sd::discovery_test
