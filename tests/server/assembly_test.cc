// SPDX-License-Identifier: Apache-2.0
#include "server/assembly.h"

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "tests/server/scratch_folder.h"
#include "tests/server/servers.h"

namespace tendon::assembly_test {
namespace {

using std::chrono::milliseconds;

const std::string kFast = "[loop]\nperiod_us = 500\n";

using AssemblyTest = Servers;

std::vector<std::size_t> group_sizes(Assembly& assembly) {
  std::vector<std::size_t> sizes;
  for (const auto& group : assembly.haptic_groups()) sizes.push_back(group.devices.size());
  return sizes;
}

TEST_F(AssemblyTest, DevicesOfOnePeriodShareAHapticGroup) {
  serve({device_named("a"), device_named("b", kFast), device_named("c")});
  EXPECT_EQ(group_sizes(*assembly_), (std::vector<std::size_t>{2, 1}));
  EXPECT_EQ(assembly_->haptic_groups().front().turn(now_), now_ + milliseconds(1));
  EXPECT_EQ(device(0).haptic.stats().steps, 1U);
  EXPECT_EQ(device(1).haptic.stats().steps, 0U);
  EXPECT_EQ(device(2).haptic.stats().steps, 1U);
}

TEST_F(AssemblyTest, AHapticGroupAt1KHzHasAtMostThreeBanks) {
  std::vector<Scene> scenes;
  for (int i = 0; i < 50; ++i) scenes.push_back(device_named("d-" + std::to_string(i)));
  serve(scenes, 2);
  EXPECT_EQ(group_sizes(*assembly_), (std::vector<std::size_t>{48, 2}));
  EXPECT_EQ(assembly_->haptic_groups().front().networks, (std::vector<std::size_t>{0, 1}));
  EXPECT_EQ(assembly_->haptic_groups().back().networks, std::vector<std::size_t>{1});
  EXPECT_EQ(assembly_->first_device(1), 32U);
}

TEST_F(AssemblyTest, StepsAndDatagramsAreRecordedUnlessTheCallerWatchesThem) {
  const testing::ScratchFolder folder;
  Scene scene = device_named("left");
  scene.recording = Scene::Recording{.path = folder.path() / "run.mcap"};
  for (const bool watched : {false, true}) {
    const Mailboxes::Capacities capacities{.steps = 16, .flight = 2};
    serve({scene}, 1, {.watched = watched ? std::optional(capacities) : std::nullopt});
    ends_.back().inbox.push_back({parse_address("127.0.0.1:50000"), server_, Bytes(3)});
    assembly_->haptic_groups().front().turn(now_);
    assembly_->turn_network(0, now_);
    assembly_->log().close(now_, 0);
    const auto recording = assembly_->log().recording();
    EXPECT_EQ(recording.has_value(), !watched);
    if (recording) {
      EXPECT_EQ(recording->steps + recording->datagrams, 2U);
    }
    EXPECT_EQ(mail().steps.front() != nullptr, watched);
    EXPECT_EQ(mail().datagrams.front() != nullptr, watched);
  }
}

}  // namespace
}  // namespace tendon::assembly_test
