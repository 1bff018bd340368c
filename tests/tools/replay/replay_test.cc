// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/replay/replay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "devices/simulated/simulated_device.h"
#include "server/recording/byte_sink.h"
#include "server/recording/recorder.h"
#include "server/scene/scene.h"
#include "tests/server/scratch_folder.h"
#include "tests/tools/replay/tapping.h"
#include "tests/tools/worlds/world.h"

namespace tendon::replay::replay_test {
namespace {

using tendon::testing::ScratchFolder;

const std::string kScene = std::string(testing::kTapping) + R"([limiter]
kind = "aol+"
[limiter.energy_cap]
)";
constexpr std::uint64_t kSteps = 2000;

/// Two seconds of a remote wall over a bad network, as recorded by a server.
std::vector<StepRecord> tapping() {
  const Scene scene = parse_scene(kScene, "scene", ".");
  SimulatedDevice device(scene.simulated());
  simulation::World::Config config;
  config.loop = scene.loop;
  simulation::World world(config, device);
  world.add_controller({.name = "wall", .rate_hz = 100}, [](const DeviceState& state) -> Touch {
    return Vec3(-2000 * std::max(0.0, state.position.x()), 0, 0);
  });
  std::vector<StepRecord> steps;
  world.watch_steps([&steps](const StepRecord& step) { steps.push_back(step); });
  world.run_for(std::chrono::milliseconds(kSteps));
  steps.resize(kSteps);
  return steps;
}

std::filesystem::path write(const std::filesystem::path& file, const std::vector<StepRecord>& steps,
                            const std::string& scene = kScene) {
  FileSink sink(file);
  Recorder::Config config;
  config.scene.text = scene;
  if (!steps.empty()) config.started = steps.front().hand.at;
  Recorder recorder(config, sink);
  for (const StepRecord& step : steps) {
    recorder.record(step);
    recorder.tick(step.hand.at);
  }
  recorder.close();
  return file;
}

/// Step `wrong` of the last device has a different force.
std::filesystem::path write_fleet(const std::filesystem::path& file, std::size_t devices, std::size_t wrong) {
  const std::vector<StepRecord> steps = tapping();
  FileSink sink(file);
  Recorder::Config config;
  config.scene.text = kScene;
  config.started = steps.front().hand.at;
  for (std::size_t device = 1; device < devices; ++device)
    config.more_devices.push_back({.name = "fleet-" + std::to_string(device), .scene = config.scene});
  Recorder recorder(config, sink);
  for (std::size_t n = 0; n < steps.size(); ++n) {
    for (std::size_t device = 0; device < devices; ++device) {
      StepRecord step = steps[n];
      if (n == wrong && device + 1 == devices) step.force.x() += 1;
      recorder.record(step, device);
    }
  }
  recorder.close();
  return file;
}

struct Outcome {
  bool held;
  std::string said;
};

Outcome run(const Options& options) {
  std::ostringstream out;
  const bool held = replay(options, out);
  return {held, out.str()};
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

std::vector<std::string> lines_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

TEST(Replay, SaysThatEveryStepOfARecordingIsTheSameBitForBit) {
  const ScratchFolder folder;
  const auto file = write(folder.path() / "run.mcap", tapping());
  const Outcome outcome = run({.recording = file});
  EXPECT_TRUE(outcome.held);
  EXPECT_TRUE(contains(outcome.said, "2000 of 2000 steps are identical\n")) << outcome.said;
  const Outcome json = run({.recording = file, .json = true});
  EXPECT_EQ(
      json.said.find(R"({"steps":2000,"same":2000,"gap_before_step":null,"differs_at_step":null,"difference":""})"), 0U)
      << json.said;
  EXPECT_EQ(std::count(json.said.begin(), json.said.end(), '\n'), 3);
}

TEST(Replay, NamesTheFirstStepThatDiffersAndFails) {
  const ScratchFolder folder;
  std::vector<StepRecord> steps = tapping();
  steps[1233].permitted *= 1 + 1e-15;
  ASSERT_NE(steps[1233].permitted, tapping()[1233].permitted);
  const Outcome outcome = run({.recording = write(folder.path() / "run.mcap", steps)});
  EXPECT_FALSE(outcome.held);
  EXPECT_TRUE(contains(
      outcome.said, "1233 of 2000 steps are identical\nthe first difference is in step 1234: permitted_n: recorded "))
      << outcome.said;
}

TEST(Replay, TakesEveryDeviceAgainAndFailsByAnyOfThem) {
  const ScratchFolder folder;
  const Outcome good = run({.recording = write_fleet(folder.path() / "good.mcap", 2, kSteps)});
  EXPECT_TRUE(good.held);
  for (const char* said : {"fleet-1: 2000 of 2000 steps are identical", "first: 2000 of 2000 steps"})
    EXPECT_TRUE(contains(good.said, said)) << good.said;

  const auto file = write_fleet(folder.path() / "bad.mcap", 2, 700);
  const Outcome bad = run({.recording = file});
  EXPECT_FALSE(bad.held);
  EXPECT_TRUE(contains(bad.said, "fleet-1: 700 of 2000 steps are identical")) << bad.said;
  EXPECT_TRUE(contains(bad.said, "first: 2000 of 2000")) << bad.said;

  const Outcome one = run({.recording = file, .device = "first"});
  EXPECT_TRUE(one.held);
  EXPECT_TRUE(contains(one.said, "fleet-1: not selected, not examined")) << one.said;
}

TEST(Replay, OfAFleetThoseThatDifferAreNamedAndTheOthersCounted) {
  const ScratchFolder folder;
  const Outcome fleet = run({.recording = write_fleet(folder.path() / "fleet.mcap", 8, 700)});
  EXPECT_FALSE(fleet.held);
  for (const char* said :
       {"7 devices: 14000 of 14000 steps are identical", "fleet-7: 700 of 2000", "columns for 3 of 8"})
    EXPECT_TRUE(contains(fleet.said, said)) << said << fleet.said;
}

TEST(Replay, ATableOfStepsIsOfOneDevice) {
  const ScratchFolder folder;
  const auto file = write_fleet(folder.path() / "two.mcap", 2, kSteps);
  const auto csv = folder.path() / "steps.csv";
  EXPECT_THROW(run({.recording = file, .csv = csv}), std::invalid_argument);
  EXPECT_THROW(run({.recording = file, .device = "left"}), std::runtime_error);
  EXPECT_TRUE(run({.recording = file, .device = "fleet-1", .csv = csv}).held);
  EXPECT_EQ(lines_of(csv).size(), kSteps + 1);
}

TEST(Replay, AfterAGapItComparesNothingAndSaysSo) {
  const ScratchFolder folder;
  std::vector<StepRecord> steps = tapping();
  steps.erase(steps.begin() + 500);
  const Outcome outcome = run({.recording = write(folder.path() / "run.mcap", steps)});
  EXPECT_TRUE(outcome.held);
  EXPECT_TRUE(contains(outcome.said, "500 of 1999 steps are identical\ngap before step 502")) << outcome.said;
}

TEST(Replay, PartsOfARunAreComparedAsOne) {
  const ScratchFolder folder;
  const std::vector<StepRecord> steps = tapping();
  const auto first = write(folder.path() / "run.mcap", {steps.begin(), steps.begin() + 700});
  const auto second = write(folder.path() / "run-2.mcap", {steps.begin() + 700, steps.begin() + 1200});
  const auto third = write(folder.path() / "run-3.mcap", {steps.begin() + 1200, steps.end()});
  const Outcome outcome = run({.recording = first, .more_parts = {second, third}});
  EXPECT_TRUE(outcome.held);
  EXPECT_TRUE(contains(outcome.said, "2000 of 2000 steps are identical\n")) << outcome.said;
  const Outcome gap = run({.recording = first, .more_parts = {third}});
  EXPECT_TRUE(contains(gap.said, "gap before step 1201")) << gap.said;
}

TEST(Replay, OfARecordingThatBeginsInTheMiddleNothingCanBeCompared) {
  const ScratchFolder folder;
  std::vector<StepRecord> steps = tapping();
  steps.erase(steps.begin(), steps.begin() + 1000);
  const auto file = write(folder.path() / "flight.mcap", steps);
  const Outcome outcome = run({.recording = file});
  EXPECT_FALSE(outcome.held);
  EXPECT_TRUE(contains(outcome.said, "gap before step 1001")) << outcome.said;
  EXPECT_TRUE(run({.recording = file, .law = "aol"}).held) << "another law may begin anywhere";
}

TEST(Replay, ATornRecordingIsReplayedAsFarAsItGoes) {
  const ScratchFolder folder;
  const auto file = write(folder.path() / "run.mcap", tapping());
  std::filesystem::resize_file(file, std::filesystem::file_size(file) * 2 / 3);
  const Outcome outcome = run({.recording = file, .json = true});
  EXPECT_TRUE(outcome.held);
  EXPECT_TRUE(contains(outcome.said, R"("truncated":true)")) << outcome.said;
}

TEST(Replay, WithAnotherLawTheTableHasBothAndSaysThatTheHandIsTheRecordedOne) {
  const ScratchFolder folder;
  const auto file = write(folder.path() / "run.mcap", tapping());
  const Outcome outcome = run({.recording = file, .law = "none"});
  EXPECT_TRUE(outcome.held);
  EXPECT_TRUE(contains(outcome.said, "recorded")) << outcome.said;
  EXPECT_TRUE(contains(outcome.said, "none")) << outcome.said;
  EXPECT_TRUE(contains(outcome.said, "the motion of the hand is as recorded")) << outcome.said;
}

TEST(Replay, ASettingIsTakenAndOneThatCannotBeIsNamed) {
  const ScratchFolder folder;
  const auto file = write(folder.path() / "run.mcap", tapping());
  const std::string said =
      run({.recording = file, .settings = {"limiter.energy_cap=", "force.max_force_n=0.5"}, .json = true}).said;
  const auto peak = [&said](std::size_t from) {
    const std::string key = R"("peak_force_n":)";
    return std::stod(said.substr(said.find(key, from) + key.size()));
  };
  EXPECT_GT(peak(0), 0.6);
  EXPECT_DOUBLE_EQ(peak(said.find('\n')), 0.5);
  for (const char* wrong : {"force.max_force_n=-1", "force.max_farce_n=1", "force", "limiter.kind.x=1"}) {
    try {
      run({.recording = file, .settings = {wrong}});
      FAIL() << wrong << " was taken";
    } catch (const SceneError& error) {
      EXPECT_TRUE(contains(error.what(), "force") || contains(error.what(), "limiter.kind")) << error.what();
    }
  }
  EXPECT_THROW(run({.recording = file, .law = "oal"}), SceneError);
}

TEST(Replay, WritesARowForEachStep) {
  const ScratchFolder folder;
  const auto file = write(folder.path() / "run.mcap", tapping());
  const auto csv = folder.path() / "steps.csv";
  run({.recording = file, .csv = csv});
  const std::vector<std::string> lines = lines_of(csv);
  ASSERT_EQ(lines.size(), kSteps + 1);
  EXPECT_EQ(lines[0].find("t_s,step,x_m,"), 0U);
  EXPECT_EQ(lines[1].find("0,1,"), 0U) << lines[1];
  EXPECT_EQ(lines[kSteps].find("1.999,2000,"), 0U) << lines[kSteps];
  EXPECT_THROW(run({.recording = file, .csv = folder.path() / "no" / "such.csv"}), std::runtime_error);
}

TEST(Replay, ARecordingWithoutAStepIsRefused) {
  const ScratchFolder folder;
  EXPECT_THROW(run({.recording = write(folder.path() / "empty.mcap", {})}), std::runtime_error);
}

TEST(Replay, ASceneThatCannotBeRunIsSaidToBeTheRecordedOne) {
  const ScratchFolder folder;
  try {
    run({.recording = write(folder.path() / "run.mcap", tapping(), "[device]\nkind = 7\n")});
    FAIL();
  } catch (const SceneError&) {
    FAIL() << "nobody has typed it";
  } catch (const std::runtime_error& error) {
    EXPECT_TRUE(contains(error.what(), "run.mcap: the recorded scene:2: device.kind")) << error.what();
  }
}

TEST(Replay, ComparesADamagedRecordingUpToTheDamageAndSaysWhereThatIs) {
  const ScratchFolder folder;
  const auto file = write(folder.path() / "run.mcap", tapping());
  const auto size = std::filesystem::file_size(file);
  std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
  bytes.seekp(static_cast<std::streamoff>(size / 2 + 10'000));
  bytes << std::string(100, '\0');
  bytes.close();
  const Outcome outcome = run({.recording = file});
  EXPECT_TRUE(outcome.held);
  EXPECT_TRUE(contains(outcome.said, "gap before step ")) << outcome.said;
  EXPECT_TRUE(contains(outcome.said, "run.mcap: byte ")) << outcome.said;
  EXPECT_FALSE(contains(outcome.said, "2000 of 2000")) << outcome.said;
}

TEST(Replay, OfARecordingWhoseSceneIsLostIsRefused) {
  const ScratchFolder folder;
  const auto file = write(folder.path() / "run.mcap", tapping());
  std::ifstream in(file, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(in), {}};
  bytes[bytes.find("kind = \"aol+\"")] = 'K';
  std::ofstream(file, std::ios::binary) << bytes;
  try {
    run({.recording = file});
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_TRUE(contains(error.what(), "run.mcap: the scene is missing")) << error.what();
  }
}

}  // namespace
}  // namespace tendon::replay::replay_test
