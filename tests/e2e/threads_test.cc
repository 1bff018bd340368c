// SPDX-License-Identifier: Apache-2.0
#include "tests/e2e/stage/threads.h"

#include <gtest/gtest.h>

#include <chrono>
#include <set>
#include <string>
#include <vector>

#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::threads_test {
namespace {

std::set<std::string> threads_when(const std::set<std::string>& expected, Server& server) {
  std::set<std::string> threads;
  for (const auto end = std::chrono::steady_clock::now() + kPatience;
       threads != expected && std::chrono::steady_clock::now() < end;) {
    threads = threads_of(server.process().pid());
  }
  return threads;
}

TEST(Threads, DevicesOfOneRateAndProcessorShareAHapticThread) {
  const testing::ScratchFolder folder;
  const auto scene = [&folder](const std::string& name, const std::string& loop) {
    return write(folder.path() / (name + ".toml"), std::string(kPressingHand) + "[loop]\n" + loop);
  };
  const std::string alone = scene("a", "");
  Server server(
      folder.path(), alone,
      {scene("b", "period_us = 2000"), scene("c", ""), scene("d", "cpu = 0"), scene("e", "period_us = 2000")});
  server.process().wait_for_line("listens on");
  const std::set<std::string> expected = {"haptic-0", "haptic-1", "haptic-3", "log", "network", "output", "tendond"};
  EXPECT_EQ(threads_when(expected, server), expected);
}

TEST(Threads, AreMoreWhereAPeriodHasNoRoomForAllDevices) {
  const testing::ScratchFolder folder;
  std::vector<std::string> scenes;
  for (const char* const name : {"a", "b", "c", "d", "e", "f"}) {
    scenes.push_back(
        write(folder.path() / (std::string(name) + ".toml"), std::string(kPressingHand) + "[loop]\nperiod_us = 100"));
  }
  Server server(folder.path(), scenes.front(), {scenes.begin() + 1, scenes.end()});
  server.process().wait_for_line("listens on");
  const std::set<std::string> expected = {"haptic-0", "haptic-5", "log", "network", "output", "tendond"};
  EXPECT_EQ(threads_when(expected, server), expected);
}

TEST(Threads, EachStepsWholeBanksOfCountedDevices) {
  const testing::ScratchFolder folder;
  const std::string scene =
      write(folder.path() / "finger.toml", "[device]\nkind = \"simulated\"\nprofile = \"falcon\"\ncount = 60\n");
  Server server(folder.path(), scene);
  server.process().wait_for_line("listens on");
  const std::set<std::string> expected = {"haptic-0", "haptic-48", "log", "network", "output", "tendond"};
  EXPECT_EQ(threads_when(expected, server), expected);
}

TEST(Threads, OfTheNetworkShareTheBanks) {
  const testing::ScratchFolder folder;
  const std::string scene = write(folder.path() / "finger.toml",
                                  "[device]\nkind = \"simulated\"\nprofile = \"falcon\"\ncount = 60\n"
                                  "[network]\nthreads = 4\n");
  Server server(folder.path(), scene);
  server.process().wait_for_line("listens on");
  const std::set<std::string> expected = {"haptic-0",   "haptic-48",  "log",    "network-0", "network-16",
                                          "network-32", "network-48", "output", "tendond"};
  EXPECT_EQ(threads_when(expected, server), expected);
}

TEST(Threads, OfAServerAreThoseOfThePage) {
  const testing::ScratchFolder folder;
  Server server(folder.path(), demo_scene().parent_path() / "left.toml",
                {(demo_scene().parent_path() / "right.toml").string()});
  server.process().wait_for_line("listens on");
  const std::set<std::string> page = threads_of_the_page();
  ASSERT_TRUE(page.contains("haptic-N"));
  const std::set<std::string> expected = {"haptic-0", "log", "network", "output", "tendond"};
  const std::set<std::string> threads = threads_when(expected, server);
  EXPECT_EQ(threads, expected);
  for (const std::string& thread : threads) EXPECT_TRUE(page.contains(general_name(thread))) << thread;
}

}  // namespace
}  // namespace tendon::e2e::threads_test
