// SPDX-License-Identifier: Apache-2.0
//
// The tools that ship, with files and readers that fail them.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/e2e/stage/process.h"
#include "tests/e2e/stage/small_disk.h"
#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::tools_test {
namespace {

using testing::ScratchFolder;

TEST(Tools, ANamedPipeIsNoInputAndIsNotWaitedFor) {
  const ScratchFolder folder;
  const std::string pipe = folder.path() / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const std::string histogram = "delay=histogram(" + pipe + ")";
  for (const auto& [tool, arguments] : std::vector<std::pair<std::string, std::vector<std::string>>>{
           {"tendon-inject", {"--dry-run", "--profile", histogram}},
           {"tendon-inject", {"--dry-run", "--scenario", pipe}},
           {"tendon-inject", {"--dry-run", "--replay", pipe}},
           {"tendon-inject", {"import", "ping", pipe, "--out", "run.csv"}},
           {"tendon-inject", {"export", pipe}},
           {"tendon-identify", {pipe}},
           {"tendon-worlds", {"run", "--seeds", pipe}},
           {"tendon-report", {pipe}}}) {
    Process process(program(tool), arguments, folder.path());
    SCOPED_TRACE(tool + " " + arguments.front());
    EXPECT_NE(process.wait(), 0);
    EXPECT_NE(process.err().find("it is a named pipe, expected a regular file"), std::string::npos) << process.err();
  }
}

/// A recording of half a second without an engine.
std::filesystem::path recording_in(const std::filesystem::path& folder) {
  Process server(
      program("tendond"),
      {demo_scene().string(), "--listen", "127.0.0.1:0", "--record", "run.mcap", "--duration-s", "0.5", "--json"},
      folder);
  EXPECT_EQ(server.wait(), 0) << server.err();
  return folder / "run.mcap";
}

TEST(Tools, APictureThatTheDiskHasNoRoomForIsAFailureWithASentence) {
  const ScratchFolder folder;
  const SmallDisk disk(folder.path() / "disk", "16k");
  if (disk.error() != 0) GTEST_SKIP() << disk.why_not();
  const auto run = recording_in(folder.path());
  for (const std::string name : {"run.png", "run.svg"}) {
    const auto picture = disk.path() / name;
    Process report(program("tendon-report"), {run.string(), "--out", picture.string()}, folder.path());
    EXPECT_EQ(report.wait(), 1) << report.out() << report.err();
    EXPECT_NE(report.err().find(picture.string()), std::string::npos) << report.err();
    EXPECT_EQ(report.out().find("picture: "), std::string::npos) << report.out();
    std::filesystem::remove(picture);
  }
}

TEST(Tools, ATableThatTheDiskHasNoRoomForIsAFailureWithASentence) {
  const ScratchFolder folder;
  const SmallDisk disk(folder.path() / "disk", "16k");
  if (disk.error() != 0) GTEST_SKIP() << disk.why_not();
  const auto run = recording_in(folder.path());
  const auto table = disk.path() / "run.csv";
  Process replay(program("tendon-replay"), {run.string(), "--csv", table.string()}, folder.path());
  EXPECT_EQ(replay.wait(), 1) << replay.out() << replay.err();
  EXPECT_NE(replay.err().find(table.string()), std::string::npos) << replay.err();
}

// Through bash, because `head` goes while the bench writes. 124 would be timeout's.
TEST(Tools, TheBenchEndsWhenItsReaderGoes) {
  const ScratchFolder folder;
  Process bash(
      "/bin/bash",
      {"-c", "timeout -k 1 25 \"$0\" bench --only round-trip --quick --json | head -1; echo \"exit ${PIPESTATUS[0]}\"",
       program("tendon-lab")},
      folder.path());
  EXPECT_EQ(bash.wait(), 0) << bash.err();
  EXPECT_NE(bash.out().find("exit 1\n"), std::string::npos) << bash.out() << bash.err();
}

}  // namespace
}  // namespace tendon::e2e::tools_test
