// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/e2e/stage/process.h"
#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::replay_test {
namespace {

// The recording includes late wake-ups, pauses of the machine and real datagrams.
TEST(TendonReplay, TakesEveryStepOfARealServerAgainBitForBit) {
  const testing::ScratchFolder folder;
  const auto file = folder.path() / "run.mcap";
  Server server(folder.path(), demo_scene(), {"--record", file.string()});
  Process wall(program("virtual_wall"), {"--server", server.address(), "--duration-s", "2"}, folder.path());
  EXPECT_EQ(wall.wait(), 0) << wall.err();
  const std::string server_end = server.stop();

  Process replay(program("tendon-replay"), {file.string(), "--json"}, folder.path());
  EXPECT_EQ(replay.wait(), 0) << replay.out() << replay.err();
  EXPECT_EQ(count_in(replay.out(), "same"), count_in(server_end, "steps")) << replay.out();

  Process other(program("tendon-replay"), {file.string(), "--law", "hard-clamp"}, folder.path());
  EXPECT_EQ(other.wait(), 2) << "no such law";
  EXPECT_NE(other.err().find("limiter.kind"), std::string::npos) << other.err();
}

}  // namespace
}  // namespace tendon::e2e::replay_test
