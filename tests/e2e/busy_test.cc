// SPDX-License-Identifier: Apache-2.0
// With `busy`, the network thread must never sleep. The test counts sleeps instead of measuring times.
#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "tests/e2e/stage/stage.h"
#include "tests/e2e/stage/threads.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::busy_test {
namespace {

using testing::ScratchFolder;

constexpr const char* kBusy = "[network]\nbusy = true\n";

TEST(Busy, AServerThatNeverSleepsServesAndStops) {
  const ScratchFolder folder;
  const auto scene = folder.path() / "device.toml";
  write(scene, std::string(kPressingHand) + kBusy);
  Server server(folder.path(), scene);
  Client wall("virtual_wall", server.address(), folder.path(), {"--busy"});
  wall.wait_for_line("connected");
  Client echo("echo_motion", server.address(), folder.path(), {"--json"});
  watch_force(echo, [](double force) { return force < -0.3; });
  const std::uint64_t before = sleeps_of(server.process().pid(), "network");
  const std::uint64_t rests = sleeps_of(server.process().pid(), "haptic-0");
  watch_force(echo, [&](double) { return sleeps_of(server.process().pid(), "haptic-0") > rests + 300; });
  EXPECT_LE(sleeps_of(server.process().pid(), "network") - before, 10U) << "in 300 haptic steps, and as many forces";
  const std::string end = server.stop();
  EXPECT_EQ(count_in(end, "denied"), 0U);
  EXPECT_EQ(end.find(R"("forces":0)"), std::string::npos) << end;
}

TEST(Busy, IsRefusedWhereThereIsOneProcessor) {
  const ScratchFolder folder;
  const auto scene = folder.path() / "device.toml";
  write(scene, std::string(kPressingHand) + kBusy);
  Process server("/usr/bin/taskset", {"-c", "0", program("tendond").string(), scene.string(), "--duration-s", "1"},
                 folder.path());
  EXPECT_EQ(server.wait(), 1);
  EXPECT_NE(server.err().find("requires a whole processor"), std::string::npos) << server.err();
}

}  // namespace
}  // namespace tendon::e2e::busy_test
