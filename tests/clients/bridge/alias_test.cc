// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/alias.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/refusal.h"

namespace tendon::bridge::alias_test {
namespace {

struct Read {
  std::vector<std::string> names;
  std::vector<std::string> devices;
};

std::string in_words(Read read) {
  std::string words;
  for (const Alias& alias : read_aliases(read.names, read.devices, 12, "Phantom0")) {
    words += alias.name + "=" + std::to_string(alias.index) + "(" + read.devices.at(alias.index) + ") ";
  }
  return words;
}

TEST(Alias, NamesAddTheirDevicesAndWithoutNamesEachDeviceHasItsOwn) {
  EXPECT_EQ(in_words({}), "Phantom0=0() ");
  EXPECT_EQ(in_words({.names = {}, .devices = {"left", "right"}}), "left=0(left) right=1(right) ");
  EXPECT_EQ(in_words({.names = {"tool"}, .devices = {}}), "tool=0() ");
  EXPECT_EQ(in_words({.names = {"a=right", "b=left", "c=right"}, .devices = {"left"}}),
            "a=1(right) b=0(left) c=1(right) ");
}

TEST(Alias, ANameThatCannotBeUsedIsRefusedWithTheReason) {
  const auto refused = [](const Read& read) { return thrown_by<std::runtime_error>([&] { in_words(read); }); };
  for (const char* name : {"", "=right", "a b=right", "a@b", "a:b", "a/b", "thirteenbytes"}) {
    EXPECT_PRED2(says, refused({.names = {name}, .devices = {}}), "with a name of at most 12 characters") << name;
  }
  EXPECT_PRED2(says, refused({.names = {"a=left", "a=right"}, .devices = {}}), "--name a: expected unique names");
  EXPECT_PRED2(says, refused({.names = {}, .devices = {"stylus-leader-left"}}),
               "--device stylus-leader-left needs --name: expected NAME=DEVICE");
}

}  // namespace
}  // namespace tendon::bridge::alias_test
