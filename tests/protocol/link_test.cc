// SPDX-License-Identifier: Apache-2.0
#include "protocol/link.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/support/refusal.h"

namespace tendon::link_test {
namespace {

TEST(Address, ReadsBackWhatItWrites) {
  for (const char* const text : {"127.0.0.1:47100", "192.168.1.20:0", "255.255.255.255:65535", "[::1]:47100",
                                 "[2001:db8::7]:1", "[::]:0", "0.0.0.0:9"}) {
    EXPECT_EQ(to_string(parse_address(text)), text);
  }
}

TEST(Address, AnIpv4AddressIsMappedIntoIpv6) {
  const std::array<std::uint8_t, 16> mapped = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 10, 1, 2, 3};
  EXPECT_EQ(parse_address("10.1.2.3:5").ip, mapped);
  EXPECT_EQ(parse_address("10.1.2.3:5").port, 5);
  EXPECT_EQ(parse_address("[::ffff:10.1.2.3]:5"), parse_address("10.1.2.3:5"));
}

TEST(Address, LocalhostIsTheIpv4Loopback) { EXPECT_EQ(parse_address("localhost:80"), parse_address("127.0.0.1:80")); }

TEST(Address, RefusesEverythingElseWithOneSentence) {
  const auto refuses = [](const std::string& text) {
    EXPECT_EQ(thrown_by([&] { parse_address(text); }),
              ("expected HOST:PORT like 127.0.0.1:47100 or [::1]:47100, got \"" + text + "\"").c_str());
  };
  for (const std::string host :
       {"", " 127.0.0.1", "127.1", "256.0.0.1", "::1", "[]", "[127.0.0.1]", "[::1", "[fe80::1%lo]", "example.org"}) {
    refuses(host + ":80");
  }
  for (const std::string port : {"", ":", ":65536", ":-1", ":+1", ":80 ", ":0x50"}) refuses("127.0.0.1" + port);
  for (const std::string text : {"", ":", "[::1]"}) refuses(text);
  refuses(std::string("127.0.0.1\0x:80", 14));
}

TEST(Address, KnowsWhatStaysOnThisMachine) {
  for (const char* const text : {"127.0.0.1:1", "127.255.3.4:1", "[::1]:1", "[::ffff:127.0.0.1]:1"}) {
    EXPECT_TRUE(is_loopback(parse_address(text))) << text;
  }
  for (const char* const text : {"0.0.0.0:1", "[::]:1", "128.0.0.1:1", "126.0.0.1:1", "[::2]:1", "[7f00::1]:1"}) {
    EXPECT_FALSE(is_loopback(parse_address(text))) << text;
  }
}

}  // namespace
}  // namespace tendon::link_test
