// SPDX-License-Identifier: Apache-2.0
#include "server/scene/scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "devices/simulated/profiles.h"
#include "tests/server/scene/scene_text.h"
#include "tests/server/scratch_folder.h"
#include "tests/support/refusal.h"

namespace tendon::scene_control_test {
namespace {

TEST(Scene, PerAxisTheProfilesCoulombFrictionIsSharedByTheAxes) {
  const Scene scene = minimal_and("[limiter]\nkind = \"aol-per-axis\"\n");
  const DeviceProfile& falcon = *find_device_profile("falcon");
  EXPECT_DOUBLE_EQ(scene.loop.control.limiter.friction.coulomb * std::sqrt(3), falcon.coulomb_bound.value);
  EXPECT_EQ(scene.loop.control.limiter.friction.viscous, falcon.viscous_bound.value);
}

TEST(Scene, ABoundMayBeTheTrueFrictionItself) {
  EXPECT_EQ(minimal_and("[limiter]\ncoulomb_friction_n = 0.4\nviscous_friction_n_s_per_m = 1\n")
                .loop.control.limiter.friction.coulomb,
            0.4);
}

TEST(Scene, APartOfAolPlusIsThereWhenItsTableIs) {
  const auto parts = minimal_and("[limiter]\n[limiter.knee]\nstart = 0.7\n[limiter.energy_cap]\nenergy_mj = 3\n")
                         .loop.control.limiter.parts;
  ASSERT_TRUE(parts.knee);
  EXPECT_EQ(parts.knee->start, 0.7);
  ASSERT_TRUE(parts.energy_cap);
  EXPECT_EQ(parts.energy_cap->energy, 0.003);
  EXPECT_EQ(parts.energy_cap->most_contact, 0.13);
  EXPECT_FALSE(parts.robust_ledger || parts.latency_reserve || parts.bounded_acceleration || parts.adaptive_friction);
  const auto none = minimal_and("").loop.control.limiter.parts;
  EXPECT_FALSE(none.knee || none.energy_cap || none.robust_ledger || none.latency_reserve ||
               none.bounded_acceleration || none.adaptive_friction);
}

TEST(Scene, EveryLawOfTheCatalogueCanBeChosenByName) {
  for (const LawInfo& law : laws()) {
    std::string text = "[limiter]\nkind = \"" + std::string(law.name) + "\"\n";
    if (law.needs_stiffness) text += "environment_stiffness_n_per_m = 1000\n";
    if (law.law == Law::kClamp) text += "clamp_n = 2\n";
    EXPECT_EQ(minimal_and(text).loop.control.limiter.law, law.law) << law.name;
    EXPECT_EQ(&info(law.law), &law);
    EXPECT_NE(scene_reference().find('"' + std::string(law.name) + '"'), std::string::npos) << law.name;
  }
}

TEST(Scene, AnEstimatorIsThereWhenItsTableIs) {
  const auto learned =
      minimal_and("[force.output_estimator]\nmodel = \"spring-and-bias\"\nscale_mm = 5\n").loop.control.hold;
  ASSERT_TRUE(learned.output_estimator && !learned.adaptive_local_model);
  EXPECT_EQ(learned.output_estimator->model, OutputEstimator::Model::kSpringAndBias);
  EXPECT_EQ(learned.output_estimator->scale, 0.005);
  const auto sent = minimal_and("[force.adaptive_local_model]\nshare = 0.8\n").loop.control.hold;
  ASSERT_TRUE(sent.adaptive_local_model && !sent.output_estimator);
  EXPECT_EQ(sent.adaptive_local_model->share, 0.8);
  EXPECT_EQ(
      error_of_minimal_and("[force.output_estimator]\n[force.adaptive_local_model]\n"),
      "s.toml:4: force: adaptive_local_model, output_estimator, learned_model and field: expected at most one of them");
}

TEST(Scene, AToolNeedsADeviceThatMeasuresTheHand) {
  const std::string tool = "[admittance]\nmass_kg = 3\nproportional_n_s_per_m = 400\n";
  const Scene scene = minimal_and("[device.effects]\nforce_sensor = 0.1\n" + tool);
  ASSERT_TRUE(scene.loop.control.admittance);
  EXPECT_EQ(scene.loop.control.admittance->mass, Vec3(3, 3, 3));
  EXPECT_EQ(scene.simulated().force_sensor->resolution, 0.1);
  EXPECT_EQ(error_of_minimal_and(tool),
            "s.toml:4: admittance: expected a device with force_sensor in [device.effects], because the force of the "
            "hand moves the virtual tool");
  EXPECT_EQ(error_of_minimal_and("[device.effects]\nforce_sensor = true\n"),
            "s.toml:5: device.effects.force_sensor: expected the size of one count in N, 0 for an exact one, or false "
            "for none, found true");
}

TEST(Scene, FrictionCanDifferByPlace) {
  const std::string map =
      "[limiter.adaptive_friction]\nplaces_mm = [[0, 0, 0], [80, 0, 0]]\ncoulomb_friction_n = [0.3, 0.2]\n"
      "viscous_friction_n_s_per_m = [0.5, 0.4]\nreach_mm = 30\n";
  const auto control = minimal_and(map).loop.control;
  ASSERT_TRUE(control.friction_map);
  ASSERT_EQ(control.friction_map->places.size(), 2U);
  EXPECT_EQ(control.friction_map->places[1].position, Vec3(0.08, 0, 0));
  EXPECT_EQ(control.friction_map->places[1].friction.coulomb, 0.2);
  EXPECT_EQ(control.friction_map->reach, 0.03);
  EXPECT_EQ(error_of_minimal_and("[limiter.adaptive_friction]\nplaces_mm = [[0, 0, 0]]\ncoulomb_friction_n = [0.3, 0.2]"
                                 "\nviscous_friction_n_s_per_m = [0.5]\n"),
            "s.toml:5: limiter.adaptive_friction.places_mm: expected one place for each value of coulomb_friction_n "
            "and of viscous_friction_n_s_per_m");
  EXPECT_EQ(error_of_minimal_and("[limiter.adaptive_friction]\nplaces_mm = [[0, 0, 0]]\ncoulomb_friction_n = [0.5]"
                                 "\nviscous_friction_n_s_per_m = [0.5]\n"),
            "s.toml:6: limiter.adaptive_friction.coulomb_friction_n: expected at most 0.4 N, the true friction of the "
            "simulated device, found 0.5");
}

TEST(Scene, TheRobustLedgerTakesTheDevicesEncoderAndTheKeyOverrides) {
  const DeviceProfile& falcon = *find_device_profile("falcon");
  const auto step = [](const std::string& more) {
    return minimal_and("[limiter.robust_ledger]\n" + more).loop.control.limiter.parts.robust_ledger->encoder_step[0];
  };
  EXPECT_EQ(step(""), falcon.encoder_step.value);
  EXPECT_EQ(step("encoder_step_um = 100\n"), 1e-4);
}

TEST(Scene, APresetListsItsPartsAndATableOfTheScenesGoesBeforeThem) {
  const Scene scene = minimal_and("[limiter]\npreset = \"feel\"\n[limiter.knee]\nstart = 0.9\n");
  const HapticController::Config& control = scene.loop.control;
  const auto& parts = control.limiter.parts;
  EXPECT_EQ(parts.knee->start, 0.9);
  EXPECT_TRUE(parts.energy_cap && parts.fading_contact && parts.bounded_acceleration && parts.thrift && parts.damper);
  EXPECT_EQ(parts.robust_ledger->encoder_step[0], find_device_profile("falcon")->encoder_step.value);
  EXPECT_EQ(parts.shaping->stiffness[0], 1500);
  EXPECT_TRUE(control.hold.learned_model);
  EXPECT_FALSE(minimal_and("[limiter]\npreset = \"feel\"\n[force.output_estimator]\n").loop.control.hold.learned_model);
  EXPECT_FALSE(minimal_and("[limiter]\n").loop.control.limiter.parts.damper) << "nothing is listed by itself";
  EXPECT_FALSE(
      minimal_and("[limiter]\npreset = \"feel-unconditional\"\n").loop.control.limiter.parts.bounded_acceleration);
}

TEST(Scene, RefusesAPresetThatItsLimiterCannotKeep) {
  EXPECT_NE(error_of_minimal_and("[limiter]\nkind = \"aol\"\npreset = \"feel\"\n").find("expected kind \"aol+\""),
            std::string::npos);
  EXPECT_NE(
      error_of_minimal_and("[limiter]\npreset = \"feel\"\n[limiter.latency_reserve]\n").find("feel-unconditional"),
      std::string::npos);
  EXPECT_NE(error_of_minimal_and("[limiter]\npreset = \"fell\"\n").find("feel-unconditional"), std::string::npos);
}

TEST(Scene, APartThatNeedsAnotherNamesIt) {
  EXPECT_NE(error_of_minimal_and("[limiter.fading_contact]\n").find("limiter.energy_cap"), std::string::npos);
  EXPECT_NE(error_of_minimal_and("[limiter.bounded_acceleration]\n").find("limiter.shaping"), std::string::npos);
}

TEST(Scene, BoundedAccelerationIsWhatTheSceneSays) {
  const auto parts = minimal_and(
                         "[limiter.bounded_acceleration]\nmost_m_per_s2 = 200\n"
                         "[limiter.shaping]\nstiffness_n_per_m = 700\n")
                         .loop.control.limiter.parts;
  EXPECT_EQ(parts.bounded_acceleration->most[0], 200);
  EXPECT_EQ(parts.shaping->stiffness[0], 700);
}

TEST(Scene, HasOneChannelForAllWhoNameNone) {
  const Scene scene = minimal_and("");
  ASSERT_EQ(scene.channels.size(), 1U);
  EXPECT_EQ(scene.channels[0].name, "main");
  EXPECT_EQ(scene.channels[0].lease, Duration::zero());
  EXPECT_EQ(scene.loop.control.channels, std::vector{ChannelRule::kSum});
  EXPECT_EQ(scene.name, "s") << "that of the file";
}

TEST(Scene, ListsItsChannelsInOrder) {
  const Scene scene = minimal_and(
      "name = \"left-hand\"\n[[channel]]\nname = \"wall\"\n[[channel]]\nname = \"tissue\"\nrule = \"priority\"\n"
      "lease_ms = 500\n[network]\ntakeover = [\"surgeon\"]\n");
  EXPECT_EQ(scene.name, "left-hand");
  ASSERT_EQ(scene.channels.size(), 2U);
  EXPECT_EQ(scene.channels[0].name, "wall");
  EXPECT_EQ(scene.channels[1].name, "tissue");
  EXPECT_EQ(scene.channels[1].lease, std::chrono::milliseconds(500));
  EXPECT_EQ(scene.loop.control.channels, (std::vector{ChannelRule::kSum, ChannelRule::kPriority}));
  EXPECT_EQ(scene.network.takeover, std::vector<std::string>{"surgeon"});
}

TEST(Scene, SeveralMakeOneServerWhoseNetworkIsTheFirstOnes) {
  const std::filesystem::path shipped(TENDON_SCENES);
  const auto scenes = read_scenes({shipped / "left.toml", shipped / "right.toml"});
  ASSERT_EQ(scenes.size(), 2U);
  EXPECT_EQ(scenes[0].name, "left");
  EXPECT_EQ(scenes[1].name, "right");
  EXPECT_EQ(scenes[1].loop.device, 1U);
  const auto error_of_both = [&](const std::filesystem::path& second) {
    return thrown_by<SceneError>([&] { read_scenes({shipped / "left.toml", second}); });
  };
  EXPECT_TRUE(
      error_of_both(shipped / "left.toml")
          .ends_with("expected a unique name, found \"left\" again, which is in " + (shipped / "left.toml").string()));
  EXPECT_NE(error_of_both(shipped / "demo.toml").find("recording: expected only in the first scene"),
            std::string::npos);
}

TEST(Scene, ACountMakesSoManyDevicesWithNamesAndPlacesOfTheirOwn) {
  const testing::ScratchFolder folder;
  const std::string hand = (folder.path() / "hand.toml").string();
  const std::string finger = (folder.path() / "finger.toml").string();
  write(hand, kMinimal);
  write(finger, std::string(kMinimal) + "count = 20\n");
  const auto scenes = read_scenes({hand, finger});
  ASSERT_EQ(scenes.size(), 2U);
  EXPECT_EQ(scenes[1].count, 20U);
  const auto devices = each_device(scenes);
  ASSERT_EQ(devices.size(), 21U);
  for (std::uint32_t place = 0; place < devices.size(); ++place) {
    EXPECT_EQ(devices[place].loop.device, place);
    EXPECT_EQ(devices[place].name, place == 0 ? "hand" : "finger-" + std::to_string(place - 1));
    EXPECT_EQ(devices[place].count, 1U);
  }
}

TEST(Scene, TheDevicesOfAllCountsHaveNamesOfTheirOwnAndAreNotTooMany) {
  const testing::ScratchFolder folder;
  const auto error_of = [&](const std::string& first, const std::string& second) -> std::string {
    const std::string a = (folder.path() / "a.toml").string();
    const std::string b = (folder.path() / "b.toml").string();
    write(a, std::string(kMinimal) + first);
    write(b, std::string(kMinimal) + second);
    const std::string error = thrown_by<SceneError>([&] { read_scenes({a, b}); });
    return error.empty() ? "none" : error.substr(b.size());
  };
  EXPECT_EQ(
      error_of("count = 2\n", "name = \"a-1\"\n"),
      ": device.name: expected a unique name, found \"a-1\" again, which is in " + (folder.path() / "a.toml").string());
  EXPECT_EQ(error_of("count = 2\n", "name = \"a-2\"\n"), "none");
  EXPECT_EQ(error_of("count = 1000\n", "count = 24\n"), "none");
  EXPECT_EQ(error_of("count = 1000\n", "count = 25\n"),
            ": device.count: expected at most 1024 devices of all scenes, found 1025");
}

TEST(Scene, NetworkThreadsAreAPowerOfTwoThatTheBanksAndTheSocketsAllow) {
  const testing::ScratchFolder folder;
  const std::string file = (folder.path() / "a.toml").string();
  const auto error_of = [&](int devices, const std::string& network) -> std::string {
    write(file, std::string(kMinimal) + "count = " + std::to_string(devices) + "\n[network]\n" + network);
    const std::string error = thrown_by<SceneError>([&] { read_scenes({file}); });
    return error.empty() ? "none" : error.substr(file.size());
  };
  const std::string expected =
      ": network.threads: expected a power of two, at most the number of banks of 16 devices, ";
  EXPECT_EQ(error_of(16, "threads = 1\n"), "none");
  EXPECT_EQ(error_of(16, "threads = 2\n"), expected + "1, found 2");
  EXPECT_EQ(error_of(17, "threads = 2\n"), "none");
  EXPECT_EQ(error_of(64, "threads = 4\n"), "none");
  EXPECT_EQ(error_of(64, "threads = 3\n"), expected + "4, found 3");
  EXPECT_EQ(error_of(64, "threads = 8\n"), expected + "4, found 8");
  EXPECT_EQ(error_of(64, "threads = 4\nbusy = true\n"), ": network.threads: expected 1 with network.busy, found 4");
  EXPECT_EQ(error_of(64, "threads = 2\nunix = \"x\"\n"), ": network.threads: expected 1 with network.unix, found 2");
  EXPECT_EQ(error_of(64, "threads = 1\nunix = \"x\"\n"), "none");
}

TEST(Scene, ADeviceWithAPlugIsAmongTheFirst) {
  const testing::ScratchFolder folder;
  const std::filesystem::path falcon = std::filesystem::path(TENDON_SCENES) / "falcon.toml";
  const std::string fingers = (folder.path() / "finger.toml").string();
  write(fingers, std::string(kMinimal) + "count = 16\n");
  EXPECT_EQ(thrown_by<SceneError>([&] {
              read_scenes({fingers, falcon});
            }),
            falcon.string() +
                ": device.kind: expected USB devices among the first 16, found 16 before it: list its scene first");
  write(fingers, std::string(kMinimal) + "count = 15\n");
  EXPECT_EQ(read_scenes({fingers, falcon}).back().loop.device, 15U);
}

}  // namespace
}  // namespace tendon::scene_control_test
