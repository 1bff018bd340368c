// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>

#include "tests/e2e/stage/process.h"
#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

// A hand that leads the device of another server, in real processes.

namespace tendon::e2e::teleoperation_test {
namespace {

std::filesystem::path scene(const std::string& name) { return demo_scene().parent_path() / name; }

/// Every force of both ends was within its limiter's bound, and every step is the same when it is taken again.
void expect_sound(const std::filesystem::path& file, const std::filesystem::path& folder) {
  const Recording recording = read_recording(file);
  EXPECT_GT(recording.steps.size(), 500U);
  Process replay(program("tendon-replay"), {file.string(), "--json"}, folder);
  EXPECT_EQ(replay.wait(), 0) << replay.out() << replay.err();
  EXPECT_EQ(count_in(replay.out(), "same"), recording.steps.size()) << replay.out();
}

TEST(Teleoperation, AHandLeadsTheDeviceOfAnotherServerThroughABadNetwork) {
  const testing::ScratchFolder folder;
  const auto followed = folder.path() / "follower.mcap";
  const auto led = folder.path() / "leader.mcap";
  Server follower(folder.path(), scene("follower.toml"), {"--record", followed.string()});
  Service network("tendon-inject",
                  {"--to", follower.address(), "--seed", "7", "--profile", "delay=uniform(15ms,25ms) loss=2%"},
                  folder.path(), "start", "listen");
  Server leader(folder.path(), scene("leader.toml"), {"--record", led.string(), "--dial", network.address()});
  leader.process().wait_for_line("teleoperation: coupled");
  leader.process().wait_for_line("teleoperation: engaged");
  follower.process().wait_for_line("teleoperation: engaged");
  std::this_thread::sleep_for(std::chrono::seconds(3));
  leader.stop();
  follower.process().wait_for_line("teleoperation: lost");
  follower.stop();
  expect_sound(led, folder.path());
  expect_sound(followed, folder.path());

  const Recording hand = read_recording(led);
  const Recording tool = read_recording(followed);
  const auto spread = [](const Recording& recording) {
    double low = 0;
    double high = 0;
    const double start = recording.steps.front().hand.position.x();
    for (const StepRecord& step : recording.steps) {
      low = std::min(low, step.hand.position.x() - start);
      high = std::max(high, step.hand.position.x() - start);
    }
    return high - low;
  };
  EXPECT_GT(spread(hand), 0.01);
  // The wall behind it is 8 mm away. How far it gets to the other side depends on where the hand was at the act, and
  // on how soft a machine that pauses has made the spring.
  EXPECT_GT(spread(tool), 0.004) << "it follows";
}

/// A copy in `folder` of the shipped scene of that role, with that method.
std::filesystem::path scene_by(const std::string& method, const std::string& role,
                               const std::filesystem::path& folder) {
  std::ifstream shipped(scene(role + ".toml"));
  std::string text{std::istreambuf_iterator<char>(shipped), {}};
  const std::string line = "role = \"" + role + "\"\n";
  text.insert(text.find(line) + line.size(), "method = \"" + method + "\"\n");
  std::ofstream(folder / (role + ".toml")) << text;
  return folder / (role + ".toml");
}

/// By waves and by the surface that the follower finds, in one clock afterwards.
TEST(Teleoperation, OtherMethodsLeadToo) {
  for (const std::string method : {"waves", "surface"}) {
    const testing::ScratchFolder folder;
    const auto followed = folder.path() / "follower.mcap";
    const auto led = folder.path() / "leader.mcap";
    Server follower(folder.path(), scene_by(method, "follower", folder.path()), {"--record", followed.string()});
    Server leader(folder.path(), scene_by(method, "leader", folder.path()),
                  {"--record", led.string(), "--dial", follower.address()});
    leader.process().wait_for_line("teleoperation: engaged");
    std::this_thread::sleep_for(std::chrono::seconds(4));
    leader.stop();
    follower.stop();
    expect_sound(led, folder.path());
    expect_sound(followed, folder.path());
    double farthest = 0;
    double pressed = 0;
    for (const StepRecord& step : read_recording(followed).steps) {
      farthest = std::max(farthest, step.hand.position.x());
      if (step.hand_force) pressed = std::max(pressed, -step.hand_force->x());
    }
    EXPECT_GT(farthest, 0.007) << method << ": it follows to the wall";
    EXPECT_GT(pressed, 0.3) << method;

    const auto both = folder.path() / "both.mcap";
    Process merged(program("tendon-replay"),
                   {led.string(), "--merge", followed.string(), "--into", both.string(), "--json"}, folder.path());
    ASSERT_EQ(merged.wait(), 0) << merged.err();
    // On one machine the two clocks are one.
    EXPECT_LT(number_in(merged.out(), "error_p99_s"), 0.5e-3) << merged.out();
    EXPECT_LE(std::abs(number_in(merged.out(), "offset_s")), number_in(merged.out(), "error_p99_s") + 50e-6)
        << merged.out();
  }
}

/// Orientation and gripper go with the position, and each step of the three accounts is the same when it is taken again.
TEST(Teleoperation, AStylusTurnsAndGripsTheOneOfAnotherServer) {
  const testing::ScratchFolder folder;
  const auto followed = folder.path() / "follower.mcap";
  const auto led = folder.path() / "leader.mcap";
  Server follower(folder.path(), scene("stylus_follower.toml"), {"--record", followed.string()});
  Server leader(folder.path(), scene("stylus_leader.toml"), {"--record", led.string(), "--dial", follower.address()});
  leader.process().wait_for_line("teleoperation: engaged");
  std::this_thread::sleep_for(std::chrono::seconds(4));
  leader.stop();
  follower.stop();
  expect_sound(led, folder.path());
  expect_sound(followed, folder.path());
  const Recording tool = read_recording(followed);
  double farthest = 1;  // |w| of the turn since the start: 1 is none
  double opened = 0;
  const StepRecord& first = tool.steps.front();
  ASSERT_TRUE(first.turn() != nullptr && first.grip() != nullptr);
  for (const StepRecord& step : tool.steps) {
    if (step.turn() == nullptr || step.grip() == nullptr) continue;
    const Quat& a = first.turn()->hand.orientation;
    const Quat& b = step.turn()->hand.orientation;
    farthest = std::min(farthest, std::abs(a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z));
    opened = std::max(opened, std::abs(step.grip()->hand.opening - first.grip()->hand.opening));
  }
  EXPECT_GT(2 * std::acos(std::min(farthest, 1.0)), 0.03) << "rad";
  EXPECT_GT(opened, 0.02) << "rad";
}

/// Each by its own act; the recordings of the three replay.
TEST(Teleoperation, TwoHandsLeadOneDevice) {
  const testing::ScratchFolder folder;
  const auto file = [&](const std::string& name) { return folder.path() / (name + ".mcap"); };
  Server follower(folder.path(), scene("shared_follower.toml"), {"--record", file("follower").string()});
  Server trainer(folder.path(), scene("trainer.toml"),
                 {"--record", file("trainer").string(), "--dial", follower.address()});
  Server trainee(folder.path(), scene("trainee.toml"),
                 {"--record", file("trainee").string(), "--dial", follower.address()});
  trainer.process().wait_for_line("teleoperation: engaged");
  trainee.process().wait_for_line("teleoperation: engaged");
  std::this_thread::sleep_for(std::chrono::seconds(2));
  trainee.stop();
  trainer.stop();
  follower.stop();
  for (const char* const name : {"follower", "trainer", "trainee"}) expect_sound(file(name), folder.path());
  double farthest = 0;
  const Recording tool = read_recording(file("follower"));
  for (const StepRecord& step : tool.steps) {
    farthest = std::max(farthest, (step.hand.position - tool.steps.front().hand.position).norm());
  }
  EXPECT_GT(farthest, 2e-3) << "it is led";
}

/// What the two must not do with limiters: it shows that the demonstration demonstrates something.
TEST(Teleoperation, WithoutLimitersTheSamePairGivesOutEnergyThatNobodyPutIn) {
  const testing::ScratchFolder folder;
  const auto led = folder.path() / "leader.mcap";
  Server follower(folder.path(), scene("follower.toml"), {"--without-limiter"});
  Service network("tendon-inject",
                  {"--to", follower.address(), "--seed", "7", "--profile", "delay=uniform(15ms,25ms) loss=2%"},
                  folder.path(), "start", "listen");
  Server leader(folder.path(), scene("leader.toml"),
                {"--record", led.string(), "--dial", network.address(), "--without-limiter"});
  leader.process().wait_for_line("teleoperation: engaged");
  std::this_thread::sleep_for(std::chrono::seconds(3));
  leader.stop();
  follower.stop();
  double least = 0;
  for (const StepRecord& step : read_recording(led).steps) least = std::min(least, step.energy);
  EXPECT_LT(least, -0.1);
}

TEST(Teleoperation, AFollowerThatWasKilledIsCoupledAgainAndEngagedByNobody) {
  const testing::ScratchFolder folder;
  auto follower = std::make_unique<Server>(folder.path(), scene("follower.toml"));
  const std::string address = follower->address();
  Server leader(folder.path(), scene("leader.toml"), {"--dial", address});
  leader.process().wait_for_line("teleoperation: engaged");
  follower->process().signal(SIGKILL);
  follower.reset();
  leader.process().wait_for_line("teleoperation: lost");
  Process again(program("tendond"),
                {scene("follower.toml").string(), "--listen", address, "--duration-s", "60", "--json"}, folder.path());
  leader.process().wait_for_line("teleoperation: coupled");
  std::this_thread::sleep_for(std::chrono::seconds(1));
  leader.stop();
  const std::string& said = leader.process().err();
  const std::size_t first = said.find("teleoperation: engaged");
  EXPECT_EQ(said.find("teleoperation: engaged", first + 1), std::string::npos) << said;
  again.signal(SIGTERM);
  EXPECT_EQ(again.wait(), 0);
  EXPECT_NE(again.err().find("teleoperation: coupled"), std::string::npos) << again.err();
  EXPECT_EQ(again.err().find("engaged"), std::string::npos) << again.err();
}

}  // namespace
}  // namespace tendon::e2e::teleoperation_test
