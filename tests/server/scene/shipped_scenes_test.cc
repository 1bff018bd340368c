// SPDX-License-Identifier: Apache-2.0
#include "server/scene/scene.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "devices/simulated/profiles.h"
#include "tests/server/scene/scene_text.h"
#include "tests/server/scratch_folder.h"

namespace tendon::shipped_scenes_test {
namespace {

using namespace std::chrono_literals;
using testing::ScratchFolder;

TEST(ShippedScenes, DemoIsAHandAtAWallWithTheLimiterOn) {
  const Scene scene = shipped("demo.toml");
  EXPECT_EQ(scene.simulated().name, "falcon");
  ASSERT_TRUE(scene.simulated().hand);
  EXPECT_EQ(scene.simulated().hand->stiffness, 300);
  EXPECT_EQ(scene.simulated().hand->damping, 3);
  EXPECT_EQ(scene.simulated().hand->mass, 0.05);
  EXPECT_EQ(target(scene, 0.5).position, Vec3(0.015, 0, 0));
  EXPECT_EQ(scene.loop.control.limiter.law, Law::kAolPlus);
  ASSERT_TRUE(scene.recording);
  EXPECT_EQ(scene.recording->path, "demo.mcap");
  EXPECT_EQ(scene.recording->budget_bytes, 4e9) << "it is the scene of the systemd unit";
}

TEST(ShippedScenes, AdmittanceIsAHeavyDeviceThatMovesAsATool) {
  const Scene scene = shipped("admittance.toml");
  EXPECT_TRUE(scene.simulated().force_sensor);
  EXPECT_TRUE(scene.loop.control.admittance);
}

TEST(ShippedScenes, TwoEnginesShareADevice) {
  const Scene scene = shipped("two-engines.toml");
  EXPECT_EQ(scene.loop.control.channels,
            (std::vector{ChannelRule::kSum, ChannelRule::kPriority, ChannelRule::kPriority}));
}

TEST(ShippedScenes, SafeListsEveryPartOfTheSafetyLayer) {
  const auto safety = shipped("safe.toml").safety;
  ASSERT_TRUE(safety);
  EXPECT_TRUE(safety->force_limit && safety->growth_limit && safety->ramp_in && safety->heat_limit &&
              safety->workspace && safety->speed_trip && safety->step_bound && safety->command_watchdog &&
              safety->link_watchdog && safety->dead_man);
}

TEST(ShippedScenes, MechanismHasWhatARealOneAdds) {
  const Scene scene = shipped("mechanism.toml");
  EXPECT_TRUE(scene.simulated().joint_friction && scene.simulated().structural_mode);
  EXPECT_EQ(scene.simulated().sample_delay, 1ms);
  EXPECT_EQ(scene.simulated().force_delay, 500us);
  EXPECT_EQ(scene.simulated().hand->mass, find_operator_profile("stylus")->mass.middle());
}

TEST(ShippedScenes, MinimalIsAcceptedAsItIs) { EXPECT_EQ(shipped("minimal.toml").simulated().name, "falcon"); }

TEST(ShippedScenes, AFleetIsFourBanksOfDevices) {
  const std::vector<Scene> devices = each_device({shipped("fleet.toml")});
  ASSERT_EQ(devices.size(), 64U);
  EXPECT_EQ(devices.back().name, "finger-63");
}

TEST(ShippedScenes, RecordedHandFollowsTheRecordingBesideIt) {
  const ScratchFolder folder;
  std::filesystem::copy(std::filesystem::path(TENDON_SCENES) / "recorded-hand.toml", folder.path() / "scene.toml");
  write(folder.path() / "hand.csv", "t_s,master_pos_rad\n15,0\n16,0.5\n17,1\n");
  EXPECT_EQ(target(read_scene(folder.path() / "scene.toml"), 1).position, Vec3(0.0375, 0, 0));
}

TEST(ShippedScenes, ATrainerAndATraineeLeadOneDevice) {
  const Scene follower = shipped("shared_follower.toml");
  double sum = 0;
  for (const CoupledLeader& leader : follower.loop.control.leaders) {
    sum += leader.share;
    const Scene scene = shipped(follower.channels[leader.channel].name + ".toml");
    EXPECT_EQ(scene.teleoperation->channel, follower.channels[leader.channel].name);
    EXPECT_EQ(to_string(*scene.teleoperation->dial), to_string(follower.network.listen));
  }
  EXPECT_EQ(follower.loop.control.leaders.size(), 2U);
  EXPECT_EQ(sum, 1);
}

TEST(SceneReference, TheKindsOfATableStandUnderItsOwnHeading) {
  const std::string text = scene_reference();
  const std::size_t device = text.find("[device]\n");
  const std::size_t next = text.find("\n[", device);
  for (const Driver* driver : drivers()) {
    const std::size_t kind = text.find("  kind = \"" + std::string(driver->kind) + "\"\n", device);
    EXPECT_LT(kind, next) << driver->kind;
  }
  EXPECT_NE(text.find("\n[device.hand]  of kind = \"simulated\"\n"), std::string::npos);
  EXPECT_NE(text.find("\n[device.csv]  of kind = \"replay\"\n"), std::string::npos);
}

TEST(SceneReference, ListsEveryKeyWithUnitMeaningAndDefault) {
  const std::string text = scene_reference();
  const auto has = [&text](std::string_view part) { return text.find(part) != std::string::npos; };
  EXPECT_TRUE(
      has("[loop]\n"
          "  period_us\n"
          "      Time from one haptic step to the next.\n"
          "      A number from 100 to 4000 µs. Default: 1000.\n"))
      << text;
  // The tables and the effects are checked in Explain.NamesEveryPartThatASceneMayLeaveOut.
  const std::string_view keys[] = {"profile",
                                   "start_position_mm",
                                   "upper_arm_mm",
                                   "coulomb_n_m",
                                   "One of \"fingertip\", \"stylus\", \"arm\"",
                                   "[device.hand.motion]",
                                   "kind = \"sine\"",
                                   "kind = \"ramp-hold\"",
                                   "kind = \"minimum-jerk\"",
                                   "kind = \"recorded\"",
                                   "position_column",
                                   "max_valid_for_ms",
                                   "[network]",
                                   "observer_timeout_ms",
                                   "[recording]",
                                   "[loop]"};
  for (const std::string_view key : keys) {
    EXPECT_TRUE(has(key)) << key;
  }
}

}  // namespace
}  // namespace tendon::shipped_scenes_test
