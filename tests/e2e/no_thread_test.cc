// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <string>

#include "tests/e2e/stage/process.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::no_thread_test {
namespace {

class NoThread : public ::testing::TestWithParam<const char*> {};

TEST_P(NoThread, AServerWithoutIsStoppedInOrderAndSaysWhich) {
  const tendon::testing::ScratchFolder folder;
  // The first thread is only used to test whether small stacks are sufficient.
  const std::array<std::string, 4> in_order = {"output", "log", "network", "haptic-0"};
  const auto number = 2 + (std::ranges::find(in_order, GetParam()) - in_order.begin());
  const std::string scenes = TENDON_SCENES;
  Process server(std::filesystem::path(TENDON_PROGRAMS) / "tendond",
                 {scenes + "/left.toml", scenes + "/right.toml", "--listen", "127.0.0.1:0", "--record", "/dev/null"},
                 folder.path(), {"LD_PRELOAD=" TENDON_NO_THREAD, "TENDON_REFUSED_THREAD=" + std::to_string(number)});
  EXPECT_EQ(server.wait(), 1);
  const std::string sentence =
      "cannot start the thread " + std::string(GetParam()) + ": Resource temporarily unavailable";
  EXPECT_NE(server.err().find(sentence), std::string::npos) << server.err();
}

INSTANTIATE_TEST_SUITE_P(Of, NoThread, ::testing::Values("output", "log", "network", "haptic-0"),
                         [](const auto& instance) {
                           const std::string name = instance.param;
                           return name.substr(0, name.find('-'));
                         });

}  // namespace
}  // namespace tendon::e2e::no_thread_test
