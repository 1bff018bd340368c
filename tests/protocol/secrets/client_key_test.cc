// SPDX-License-Identifier: Apache-2.0
#include "protocol/secrets/client_key.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/support/refusal.h"

namespace tendon::client_key_test {
namespace {

ClientKey some_key(std::uint64_t seed) {
  return {.name = "wall", .role = Role::kController, .key = Ratchet(seed).next()};
}

std::string refusal(const std::string& text, unsigned mode = 0600) {
  return thrown_by([&] { read_key_file(text, mode, "wall"); });
}

TEST(ClientKey, ComesOutOfItsFileAsItWentIn) {
  for (const Role role : {Role::kController, Role::kObserver}) {
    ClientKey key = some_key(1);
    key.role = role;
    const ClientKey read = read_key_file(key_file_text(key), 0100600, "wall");
    EXPECT_EQ(read.key.bytes(), key.key.bytes());
    EXPECT_EQ(read.role, role);
    EXPECT_EQ(read.name, "wall");
  }
}

TEST(ClientKey, IsRefusedWhenAnybodyButItsOwnerMayReadOrWriteIt) {
  const std::string text = key_file_text(some_key(1));
  for (const unsigned mode : {0640U, 0604U, 0620U, 0602U, 0644U, 0610U}) {
    EXPECT_NE(refusal(text, 0100000U | mode).find("other users can read or write"), std::string::npos)
        << std::oct << mode;
  }
  for (const unsigned mode : {0600U, 0400U, 0700U}) EXPECT_EQ(refusal(text, 0100000U | mode), "") << std::oct << mode;
}

TEST(ClientKey, AByteOrderMarkIsNoPartOfIt) {
  const std::string text = key_file_text(some_key(1));
  EXPECT_EQ(refusal("\xef\xbb\xbf" + text), "");
}

TEST(ClientKey, ARefusalSaysWhatIsWrongAndNeverTheKey) {
  const std::string good = key_file_text(some_key(1));
  const std::string digits = good.substr(good.size() - 65, 64);
  struct Case {
    std::string text, says;
  };
  for (const Case& c :
       {Case{"", "expected one line"}, Case{digits, "got 1 words"}, Case{"admin " + digits, "begins with neither"},
        Case{"controller " + digits.substr(2), "too short: expected 64 hexadecimal digits, got 62"},
        Case{"controller " + digits + "ab", "too long"},
        Case{"controller x" + digits.substr(1), "not hexadecimal digits"}, Case{good + good, "several lines"}}) {
    const std::string said = refusal(c.text);
    EXPECT_NE(said.find(c.says), std::string::npos) << said;
    EXPECT_EQ(said.find(digits.substr(8, 16)), std::string::npos) << said;
  }
}

TEST(ClientKey, OneThatSomebodyMadeUpIsWeakAndARandomOneIsNot) {
  const auto weak = [](auto make) {
    Key key;
    for (std::size_t i = 0; i < key.bytes().size(); ++i) key.bytes()[i] = static_cast<std::byte>(make(i));
    return weakness(key).has_value();
  };
  EXPECT_TRUE(weak([](std::size_t) { return 0; }));
  EXPECT_TRUE(weak([](std::size_t) { return 0xA5; }));
  EXPECT_TRUE(weak([](std::size_t i) { return i; }));
  EXPECT_TRUE(weak([](std::size_t i) { return 255 - 7 * i; }));
  EXPECT_TRUE(weak([](std::size_t i) { return i % 16 * 17; }));
  EXPECT_TRUE(weak([](std::size_t i) { return "correct horse battery staple yes"[i]; }));
  Ratchet random(7);
  for (int i = 0; i < 10'000; ++i) ASSERT_FALSE(weakness(random.next()).has_value()) << i;
}

TEST(ClientKey, ItsIdIsNotTheKeyAndDiffersFromKeyToKey) {
  const Key one = some_key(1).key;
  EXPECT_NE(key_id(one), key_id(some_key(2).key));
  EXPECT_FALSE(std::equal(one.bytes().begin(), one.bytes().begin() + 8, key_id(one).begin()));
}

}  // namespace
}  // namespace tendon::client_key_test
