// SPDX-License-Identifier: Apache-2.0
// If the disk is full, only the recording is paused, until there is space again. The exit code reports the gap.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/e2e/stage/small_disk.h"
#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::full_disk_test {
namespace {

using testing::ScratchFolder;

void expect_the_device_to_run_on(Server& server, Process& echo, std::uint64_t after_tick) {
  while (count_in(echo.wait_for_line(R"("tick")"), "tick") < after_tick + 500) {
  }
  const std::string end = server.stop(SIGTERM, 1);
  EXPECT_NE(server.process().err().find("the recording is incomplete: "), std::string::npos) << server.process().err();
  EXPECT_NE(end.find(R"("recording_ended_early":true)"), std::string::npos) << end;
  EXPECT_EQ(count_in(end, "recorded_steps") + count_in(end, "lost_steps"), count_in(end, "steps"));
  EXPECT_EQ(count_in(end, "fault"), 0U);
}

TEST(FullDisk, StopsTheRecordingAndNotTheRunAndTheFileStillReads) {
  const ScratchFolder folder;
  const SmallDisk disk(folder.path() / "disk", "512k");
  if (disk.error() != 0) GTEST_SKIP() << disk.why_not();
  const auto file = disk.path() / "run.mcap";
  Server server(folder.path(), demo_scene(), {"--record", file.string()});
  Client wall("virtual_wall", server.address(), folder.path());
  Client echo("echo_motion", server.address(), folder.path(), {"--json"});
  const std::string told = server.process().wait_for_line("recording has stopped, but the device continues");
  EXPECT_NE(told.find("cannot write recording " + file.string() + ": No space left on device"), std::string::npos)
      << told;

  const Recording recording = read_recording(file);
  expect_passive(recording, read_scene(demo_scene()));
  EXPECT_TRUE(recording.truncated);
  ASSERT_FALSE(recording.steps.empty());
  expect_the_device_to_run_on(server, echo, recording.steps.back().tick);
  EXPECT_EQ(read_recording(file).steps.size(), recording.steps.size());
}

TEST(FullDisk, ThatHasRoomAgainIsRecordedToAgainAndSaysWhatIsMissing) {
  const ScratchFolder folder;
  const SmallDisk disk(folder.path() / "disk", "24m");
  if (disk.error() != 0) GTEST_SKIP() << disk.why_not();
  const auto ballast = disk.path() / "ballast";
  std::ofstream(ballast) << std::string(std::size_t{47} << 19, 'x');
  Server server(folder.path(), demo_scene(), {"--record", (disk.path() / "run.mcap").string()});
  Client wall("virtual_wall", server.address(), folder.path());
  server.process().wait_for_line("recording has stopped, but the device continues");
  std::filesystem::remove(ballast);
  server.process().wait_for_line("recording continues in " + (disk.path() / "run-2.mcap").string() + "; ");
  Client echo("echo_motion", server.address(), folder.path(), {"--json"});
  const std::uint64_t tick = count_in(echo.wait_for_line(R"("tick")"), "tick");
  while (count_in(echo.wait_for_line(R"("tick")"), "tick") < tick + 500) {
  }
  const std::string end = server.stop(SIGTERM, 1);
  EXPECT_NE(end.find(R"("recording_ended_early":false)"), std::string::npos) << end;
  EXPECT_EQ(count_in(end, "recorded_parts"), 2U);
  const Recording first = read_recording(disk.path() / "run.mcap");
  const Recording second = read_recording(disk.path() / "run-2.mcap");
  EXPECT_EQ(first.steps.size() + second.steps.size() + count_in(end, "lost_steps"), count_in(end, "steps"));
  EXPECT_GT(count_in(end, "lost_steps"), 0U);
  EXPECT_FALSE(second.truncated);
  EXPECT_EQ(second.losses, 1U);
}

TEST(FullDisk, FromTheFirstByteIsToldAtOnce) {
  const ScratchFolder folder;
  Server server(folder.path(), demo_scene(), {"--record", "/dev/full"});
  server.process().wait_for_line(
      "recording has stopped, but the device continues: cannot write recording /dev/full: No space");
  Client echo("echo_motion", server.address(), folder.path(), {"--json"});
  expect_the_device_to_run_on(server, echo, count_in(echo.wait_for_line(R"("tick")"), "tick"));
}

}  // namespace
}  // namespace tendon::e2e::full_disk_test
