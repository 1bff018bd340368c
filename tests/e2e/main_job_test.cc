// SPDX-License-Identifier: Apache-2.0
// All parts run in separate processes, and one of these processes is killed. Times are not measured, because virtual
// machines pause. Instead, the recordings are checked.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::main_job_test {
namespace {

using testing::ScratchFolder;

bool felt(double force) { return force < -0.5; }  // N along x, away from the wall

struct Stretch {
  Mode mode;
  std::size_t begin;
};

std::vector<Stretch> stretches_of(const std::vector<StepRecord>& steps) {
  std::vector<Stretch> stretches;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (stretches.empty() || stretches.back().mode != steps[i].mode) stretches.push_back({steps[i].mode, i});
  }
  return stretches;
}

TEST(MainJob, AHandFeelsALateLossyRemoteWallAndTheDeviceNeverGivesOutEnergy) {
  const ScratchFolder folder;
  const auto file = folder.path() / "run.mcap";
  const Scene scene = read_scene(demo_scene());
  Server server(folder.path(), demo_scene(), {"--record", file.string()});
  Service network("tendon-inject",
                  {"--to", server.address(), "--profile", "delay=uniform(15ms,25ms) loss=2%", "--seed", "7",
                   "--max-release-error-us", "1e9"},  // the test does not depend on the release times
                  folder.path(), "start", "listen");
  Process wall(program("virtual_wall"), {"--server", network.address(), "--duration-s", "3", "--json"}, folder.path());
  EXPECT_EQ(wall.wait(), 0) << wall.err();
  const std::string network_end = network.stop();
  const std::string server_end = server.stop();

  EXPECT_EQ(count_in(server_end, "welcomed"), 1U);
  EXPECT_EQ(count_in(network_end, "seed"), 7U);
  const auto down = network_end.find(R"("down")");
  ASSERT_NE(down, std::string::npos);
  EXPECT_GT(count_in(std::string_view(network_end).substr(down), "lost"), 0U);  // 2 % of 3000
  const std::string said = wall.out();
  const auto summary = said.find(R"({"summary")");
  ASSERT_NE(summary, std::string::npos) << said;
  EXPECT_GE(number_in(std::string_view(said).substr(summary), "round_trip_ms"), 2 * 15.0);

  const Recording recording = read_recording(file);
  expect_passive(recording, scene);
  std::size_t in_time = 0;
  double peak = 0;
  for (const StepRecord& step : recording.steps) {
    peak = std::max(peak, step.applied.norm());
    in_time += step.reasons.has(Reason::kOverrun) ? 0 : 1;
    if (step.force_sequence == 0) continue;
    ASSERT_GE(step.loop_age, 2 * std::chrono::milliseconds(15)) << "tick " << step.tick;
  }
  EXPECT_GT(peak, 1);
  // This must be true for all of these steps. On a busy machine, only some of the 3000 steps qualify.
  EXPECT_GT(in_time, 100U);

  EXPECT_FALSE(recording.truncated);
  EXPECT_EQ(recording.losses, 0U);
  EXPECT_EQ(recording.steps.size(), count_in(server_end, "steps"));
  EXPECT_EQ(recording.steps.size(), count_in(server_end, "recorded_steps"));
  EXPECT_EQ(count_in(server_end, "lost_steps"), 0U);
  EXPECT_NE(server_end.find(R"("recording_ended_early":false)"), std::string::npos) << server_end;
}

TEST(MainJob, AKilledEnginesForceIsHeldFadesStopsAndTheNextOneRampsIn) {
  const ScratchFolder folder;
  const auto file = folder.path() / "run.mcap";
  const std::string scene_file = write(folder.path() / "scene.toml", kPressingHand);
  const Scene scene = read_scene(scene_file);
  Server server(folder.path(), scene_file, {"--record", file.string()});
  Client echo("echo_motion", server.address(), folder.path(), {"--json", "--rate-hz", "100"});
  {
    Client wall("virtual_wall", server.address(), folder.path());
    watch_force(echo, felt);
    wall.signal(SIGKILL);
    EXPECT_EQ(wall.wait(), -SIGKILL);
  }
  watch_force(echo, [](double force) { return force == 0; });
  Client successor("virtual_wall", server.address(), folder.path());
  watch_force(echo, felt);
  const std::string end = server.stop();
  EXPECT_EQ(count_in(end, "welcomed"), 3U);

  const Recording recording = read_recording(file);
  expect_passive(recording, scene);
  const std::vector<StepRecord>& steps = recording.steps;
  const std::vector<Stretch> stretches = stretches_of(steps);
  const auto stop = std::find_if(stretches.begin(), stretches.end(),
                                 [](const Stretch& stretch) { return stretch.mode == Mode::kSafeStop; });
  ASSERT_GE(stop - stretches.begin(), 3);
  ASSERT_GE(stretches.end() - stop, 2);
  EXPECT_EQ((stop - 3)->mode, Mode::kActive);
  EXPECT_EQ((stop - 2)->mode, Mode::kHolding);
  EXPECT_EQ((stop - 1)->mode, Mode::kDecaying);
  EXPECT_EQ((stop + 1)->mode, Mode::kActive);

  EXPECT_GT(steps[(stop - 2)->begin].hand.position.x(), 0);
  EXPECT_GT(steps[(stop - 2)->begin].applied.norm(), 0);
  EXPECT_EQ(steps[(stop + 1)->begin - 1].applied.norm(), 0);
  EXPECT_TRUE(steps[(stop + 1)->begin].reasons.has(Reason::kRampIn));
  const double max_growth =
      scene.loop.control.max_slew * tendon::seconds(scene.loop.control.limiter.longest_hold) + 1e-9;
  for (std::size_t i = 1; i < steps.size(); ++i) {
    ASSERT_LE(steps[i].applied.norm() - steps[i - 1].applied.norm(), max_growth) << "tick " << steps[i].tick;
  }
}

TEST(MainJob, AKilledServerLeavesARecordingThatReadsUpToItsLastSecond) {
  const ScratchFolder folder;
  const auto file = folder.path() / "run.mcap";
  Server server(folder.path(), demo_scene(), {"--record", file.string()});
  Client wall("virtual_wall", server.address(), folder.path());
  Client echo("echo_motion", server.address(), folder.path(), {"--json", "--rate-hz", "100"});
  while (count_in(echo.wait_for_line(R"("tick")"), "tick") < 2000) {
  }
  server.process().signal(SIGKILL);
  EXPECT_EQ(server.process().wait(), -SIGKILL);

  echo.signal(SIGTERM);
  EXPECT_EQ(echo.wait(), 0) << echo.err();
  const std::uint64_t last_seen = count_in(std::string_view(echo.out()).substr(echo.out().rfind(R"("tick")")), "tick");
  const Recording recording = read_recording(file);
  expect_passive(recording, read_scene(demo_scene()));
  EXPECT_TRUE(recording.truncated);
  ASSERT_FALSE(recording.steps.empty());
  EXPECT_GE(recording.steps.back().tick + 1000, last_seen);
  EXPECT_FALSE(recording.arrived.empty());
}

TEST(MainJob, ASignalEndsTheServerCleanlyAndItsClientsAreTold) {
  for (const int signal : {SIGTERM, SIGINT, SIGHUP}) {
    SCOPED_TRACE(signal);
    const ScratchFolder folder;
    const auto file = folder.path() / "run.mcap";
    Server server(folder.path(), demo_scene(), {"--record", file.string()});
    Client wall("virtual_wall", server.address(), folder.path());
    Client echo("echo_motion", server.address(), folder.path(), {"--json"});
    wall.wait_for_line("connected to falcon");
    echo.wait_for_line(R"("tick")");
    const std::string end = server.stop(signal);
    EXPECT_EQ(text_in(end, "event"), "stopped");
    EXPECT_NE(server.process().err().find("signal " + std::to_string(signal)), std::string::npos);
    for (Process* guest : {static_cast<Process*>(&wall), static_cast<Process*>(&echo)}) {
      guest->wait_for_line("lost " + server.address() + ": the server is shutting down");
      guest->signal(SIGTERM);
      EXPECT_EQ(guest->wait(), 0);
    }
    const Recording recording = read_recording(file);
    EXPECT_FALSE(recording.truncated);
    EXPECT_EQ(recording.losses, 0U);
    EXPECT_EQ(recording.steps.size(), count_in(end, "steps"));
  }
}

TEST(MainJob, ADurationIsThatOfTheHapticStepsToAPeriod) {
  const ScratchFolder folder;
  Process server(program("tendond"), {demo_scene(), "--listen", "127.0.0.1:0", "--duration-s", "0.3", "--json"},
                 folder.path());
  EXPECT_EQ(server.wait(), 0);
  const std::string out = server.out();
  const double steps = number_in(out.substr(out.find("stopped")), "steps");
  EXPECT_LE(steps, 300) << "each of them 1 ms";
  EXPECT_GE(steps, 1);
}

}  // namespace
}  // namespace tendon::e2e::main_job_test
