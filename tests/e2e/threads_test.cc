// SPDX-License-Identifier: Apache-2.0
//
// server/THREADS.md against the server.
#include "tests/e2e/stage/threads.h"

#include <gtest/gtest.h>

#include <chrono>

#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e {
namespace {

TEST(Threads, OfAServerAreThoseOfThePage) {
  const testing::ScratchFolder folder;
  Server server(folder.path(), demo_scene().parent_path() / "left.toml",
                {(demo_scene().parent_path() / "right.toml").string()});
  server.process().wait_for_line("listens on");
  const std::set<std::string> page = threads_of_the_page();
  ASSERT_TRUE(page.contains("haptic-N"));
  // It listens before its threads have begun.
  const std::set<std::string> expected = {"haptic-0", "haptic-1", "log", "network", "tendond"};
  std::set<std::string> threads;
  for (const auto end = std::chrono::steady_clock::now() + kPatience;
       threads != expected && std::chrono::steady_clock::now() < end;) {
    threads = threads_of(server.process().pid());
  }
  EXPECT_EQ(threads, expected);
  for (const std::string& thread : threads) EXPECT_TRUE(page.contains(general_name(thread))) << thread;
}

}  // namespace
}  // namespace tendon::e2e
