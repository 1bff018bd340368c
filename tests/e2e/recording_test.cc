// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "protocol/handshake.h"
#include "server/machine/udp_link.h"
#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::recording_test {
namespace {

using testing::ScratchFolder;

std::string content_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void wait_for_tick(Process& echo, std::uint64_t tick) {
  while (count_in(echo.wait_for_line(R"("tick")"), "tick") < tick) {
  }
}

/// These steps must be bitwise identical in tendon-replay, and there must be no others.
std::uint64_t replayed(const std::filesystem::path& file) {
  Process replay(program("tendon-replay"), {file.string(), "--json"}, file.parent_path());
  EXPECT_EQ(replay.wait(), 0) << replay.out() << replay.err();
  EXPECT_EQ(count_in(replay.out(), "same"), count_in(replay.out(), "steps")) << replay.out();
  return count_in(replay.out(), "same");
}

// This is the same as with the systemd unit: the same scene in the same folder, killed and restarted.
TEST(Recordings, ACrashedServersRecordingIsLeftAloneByTheNextStart) {
  const ScratchFolder folder;
  const auto first = folder.path() / "demo.mcap";
  std::string before;
  {
    Server server(folder.path(), demo_scene());
    Client echo("echo_motion", server.address(), folder.path(), {"--json", "--rate-hz", "100"});
    wait_for_tick(echo, 1000);
    server.process().signal(SIGKILL);
    EXPECT_EQ(server.process().wait(), -SIGKILL);
    before = content_of(first);
  }
  Server again(folder.path(), demo_scene());
  Client echo("echo_motion", again.address(), folder.path(), {"--json", "--rate-hz", "100"});
  wait_for_tick(echo, 500);
  const std::string end = again.stop();
  EXPECT_NE(again.process().err().find("recording to demo-2.mcap, because demo.mcap exists"), std::string::npos)
      << again.process().err();
  EXPECT_EQ(text_in(again.process().out(), "recording"), "demo-2.mcap");

  EXPECT_EQ(content_of(first), before);
  EXPECT_GT(replayed(first), 100U);
  EXPECT_EQ(replayed(folder.path() / "demo-2.mcap"), count_in(end, "steps"));
}

TEST(Recordings, WhatIsNoRecordingIsRefusedBeforeAnythingRuns) {
  const ScratchFolder folder;
  const auto scene = folder.path() / "scene.toml";
  std::filesystem::copy_file(demo_scene(), scene);
  const auto pipe = folder.path() / "pipe.mcap";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const auto refused = [&](const std::filesystem::path& file, const std::string& why) {
    Process server(program("tendond"), {scene.string(), "--record", file.string(), "--duration-s", "60", "--json"},
                   folder.path());
    EXPECT_EQ(server.wait(), 1);
    EXPECT_EQ(server.out(), "");
    EXPECT_NE(server.err().find("cannot write recording " + file.string() + ": " + why), std::string::npos)
        << server.err();
  };
  refused(scene, "the file exists and is not a recording");
  refused(pipe, "it is a named pipe");
  refused(folder.path(), "Is a directory");
  EXPECT_EQ(content_of(scene), content_of(demo_scene()));
}

TEST(Recordings, ARunWithoutALimiterReplaysBitForBit) {
  const ScratchFolder folder;
  const auto file = folder.path() / "far-off.mcap";
  Server server(folder.path(), demo_scene(), {"--without-limiter", "--record", file.string()});
  Service network("tendon-inject",
                  {"--to", server.address(), "--profile", "delay=20ms", "--seed", "7", "--max-release-error-us", "1e9"},
                  folder.path(), "start", "listen");
  Process wall(program("virtual_wall"), {"--server", network.address(), "--duration-s", "2"}, folder.path());
  EXPECT_EQ(wall.wait(), 0) << wall.err();
  network.stop();
  const std::string end = server.stop();
  EXPECT_EQ(replayed(file), count_in(end, "steps"));
  const auto steps = read_recording(file).steps;
  EXPECT_TRUE(std::ranges::any_of(steps, [](const StepRecord& step) { return step.applied.norm() > 0.5; }));
}

TEST(Recordings, AFloodOfHellosIsASampleAndACountAndCostsNoStep) {
  const ScratchFolder folder;
  const auto file = folder.path() / "run.mcap";
  Server server(folder.path(), demo_scene(), {"--record", file.string()});
  UdpLink stranger(parse_address("127.0.0.1:0"), Reach::kThisMachine);
  std::array<std::byte, kMaxDatagram> hello{};
  const std::size_t size = ClientHandshake({}, LocalTime{}).next_datagram(LocalTime{}, hello);
  ASSERT_GT(size, 0U);
  const Address to = parse_address(server.address());
  Client echo("echo_motion", server.address(), folder.path(), {"--json", "--rate-hz", "100"});
  for (std::uint64_t tick = 0; tick < 1000;) {
    for (int i = 0; i < 400; ++i) stranger.send(to, std::span(hello).first(size));
    tick = count_in(echo.wait_for_line(R"("tick")"), "tick");
  }
  const std::string end = server.stop();

  const Recording recording = read_recording(file);
  EXPECT_EQ(recording.steps.size(), count_in(end, "steps"));
  EXPECT_EQ(count_in(end, "lost_steps") + count_in(end, "lost_datagrams"), 0U);
  const auto strangers =
      static_cast<double>(std::ranges::count(recording.arrived, stranger.local_address(), &DatagramRecord::peer));
  EXPECT_GT(strangers, 0);
  EXPECT_LE(strangers, 16 * (number_in(end, "uptime_s") + 2));
  EXPECT_GT(count_in(end, "strangers_left_out"), 1000U);
  EXPECT_EQ(recording.unauthenticated_left_out, count_in(end, "strangers_left_out"));
}

}  // namespace
}  // namespace tendon::e2e::recording_test
