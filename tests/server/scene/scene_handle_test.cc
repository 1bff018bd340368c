// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include "core/base/rotation.h"
#include "server/scene/scene.h"
#include "tests/server/scene/scene_text.h"
#include "tests/server/scratch_folder.h"

namespace tendon::scene_handle_test {
namespace {

using namespace std::chrono_literals;
using testing::ScratchFolder;

constexpr double kDegree = std::numbers::pi / 180;

const std::string kRotation =
    "[device.rotation]\n"
    "inertia_kg_m2 = 2e-5\n";
const std::string kGripper =
    "[device.gripper]\n"
    "open_deg = 30\n"
    "arm_mm_per_rad = 60\n"
    "mass_kg = 0.02\n";

TEST(SceneHandle, WithoutItsTablesAHandleIsAPoint) {
  const SimulatedDevice::Config device = minimal_and("").simulated();
  EXPECT_FALSE(device.rotation || device.gripper);
  EXPECT_TRUE(device.presses.empty());
}

SimulatedRotation::Config rotation(S scene) { return *scene.simulated().rotation; }
Vec3 turned(S scene) { return rotation(scene).hand->motion.at(0.125).position; }

TEST(SceneHandle, ARotationHasWhatItListsInItsUnits) {
  const auto bare = *minimal_and(kRotation).simulated().rotation;
  EXPECT_EQ(bare.inertia, 2e-5);
  EXPECT_FALSE(bare.viscous_friction || bare.coulomb_friction || bare.max_torque || bare.encoder_step || bare.start ||
               bare.hand);
  const std::string bounds = "[limiter.rotation]\ncoulomb_friction_nm = 0\nviscous_friction_nm_s_per_rad = 1e-4\n";
  const std::vector<Setting> settings = {
      {"device.rotation.viscous_friction_nm_s_per_rad=2e-4", 2e-4, [](S s) { return *rotation(s).viscous_friction; }},
      {"device.rotation.coulomb_friction_nm=1e-3", 1e-3, [](S s) { return *rotation(s).coulomb_friction; }},
      {"device.rotation.max_torque_nm=0.2", 0.2, [](S s) { return *rotation(s).max_torque; }},
      {"device.rotation.encoder_step_rad=0.0005", 0.0005, [](S s) { return *rotation(s).encoder_step; }},
      {"device.rotation.start_deg=[0, 90, 0]", 90 * kDegree, [](S s) { return rotation(s).start->y(); }},
      {"device.rotation.hand.stiffness_nm_per_rad=0.3", 0.3, [](S s) { return rotation(s).hand->stiffness; }},
      {"device.rotation.hand.damping_nm_s_per_rad=0.002", 0.002, [](S s) { return rotation(s).hand->damping; }},
      {"device.rotation.hand.motion.kind=sine", 10 * kDegree, [](S s) { return turned(s).x(); }},
      {"device.rotation.hand.motion.amplitude_deg=45", 75 * kDegree, [](S s) { return turned(s).z(); }},
      {"device.rotation.hand.motion.frequency_hz=2", 75 * kDegree, [](S s) { return turned(s).z(); }},
      {"device.rotation.hand.motion.centre_deg=[10, 20, 30]", 20 * kDegree, [](S s) { return turned(s).y(); }},
      {"device.rotation.hand.motion.direction=[0, 0, 5]", 75 * kDegree, [](S s) { return turned(s).z(); }}};
  expect_made(std::string(kMinimal) + kRotation + bounds, settings);
}

SimulatedGripper::Config gripper(S scene) { return *scene.simulated().gripper; }
double gripped(S scene, double t) { return gripper(scene).hand->motion.at(t).position.x(); }

TEST(SceneHandle, AGripperHasWhatItListsInItsUnits) {
  const std::string bounds = "[limiter.gripper]\ncoulomb_friction_n = 0.05\nviscous_friction_n_s_per_m = 0.25\n";
  const std::vector<Setting> settings = {
      {"device.gripper.open_deg=30", 30 * kDegree, [](S s) { return gripper(s).open; }},
      {"device.gripper.arm_mm_per_rad=60", 0.06, [](S s) { return gripper(s).arm; }},
      {"device.gripper.mass_kg=0.02", 0.02, [](S s) { return gripper(s).mass; }},
      {"device.gripper.viscous_friction_n_s_per_m=0.5", 0.5, [](S s) { return *gripper(s).viscous_friction; }},
      {"device.gripper.coulomb_friction_n=0.1", 0.1, [](S s) { return *gripper(s).coulomb_friction; }},
      {"device.gripper.max_force_n=3", 3, [](S s) { return *gripper(s).max_force; }},
      {"device.gripper.encoder_step_rad=0.001", 0.001, [](S s) { return *gripper(s).encoder_step; }},
      {"device.gripper.start_deg=12", 12 * kDegree, [](S s) { return *gripper(s).start; }},
      {"device.gripper.hand.stiffness_n_per_m=300", 300, [](S s) { return gripper(s).hand->stiffness; }},
      {"device.gripper.hand.damping_n_s_per_m=3", 3, [](S s) { return gripper(s).hand->damping; }},
      {"device.gripper.hand.motion.kind=ramp-hold", 15 * kDegree, [](S s) { return gripped(s, 0.25); }},
      {"device.gripper.hand.motion.from_deg=25", 25 * kDegree, [](S s) { return gripped(s, 0); }},
      {"device.gripper.hand.motion.to_deg=5", 5 * kDegree, [](S s) { return gripped(s, 0.5); }},
      {"device.gripper.hand.motion.ramp_ms=500", 15 * kDegree, [](S s) { return gripped(s, 0.25); }}};
  expect_made(std::string(kMinimal) + kGripper + bounds, settings);
  EXPECT_FALSE(minimal_and(kGripper).simulated().gripper->max_force);
}

TEST(SceneHandle, ARecordedTurnIsAboutAnAxisAndARecordedOpeningHasNone) {
  const ScratchFolder folder;
  write(folder.path() / "turn.csv", "t_s,turn\n0,0\n1,2\n2,4\n");
  const std::string hand = "[device.rotation.hand]\nstiffness_nm_per_rad = 1\n[device.rotation.hand.motion]\n";
  const std::string recorded = "kind = \"recorded\"\nfile = \"turn.csv\"\nposition_column = \"turn\"\n";
  const auto turned = [&](const std::string& more) {
    return parse(std::string(kMinimal) + kRotation + hand + recorded + more, folder.path())
        .simulated()
        .rotation->hand->motion.at(1)
        .position;
  };
  EXPECT_EQ(turned("direction = [0, 0, 1]\n"), Vec3(0, 0, 2)) << "rad, when nothing else is said";
  EXPECT_NEAR(
      (turned("direction = [0, 2, 0]\nscale_deg = 30\norigin_deg = [0, 0, 10]\n") - Vec3(0, 60 * kDegree, 10 * kDegree))
          .norm(),
      0, 1e-14);
  const std::string fingers = "[device.gripper.hand]\nstiffness_n_per_m = 1\n[device.gripper.hand.motion]\n";
  const auto scene =
      parse(std::string(kMinimal) + kGripper + fingers + recorded + "scale_deg = 5\norigin_deg = 3\n", folder.path());
  EXPECT_NEAR(scene.simulated().gripper->hand->motion.at(1).position.x(), 13 * kDegree, 1e-15);
  EXPECT_EQ(error_of(std::string(kMinimal) + kGripper + fingers + recorded + "direction = [0, 0, 1]\n", folder.path())
                .rfind("s.toml:14: device.gripper.hand.motion.direction: unknown key", 0),
            0U);
  EXPECT_EQ(error_of(std::string(kMinimal) + kRotation + hand +
                         "kind = \"recorded\"\nfile = \"no.csv\"\nposition_column = 1\n",
                     folder.path())
                .rfind("s.toml:10: device.rotation.hand.motion.file: ", 0),
            0U);
}

TEST(SceneHandle, AListOfPressesIsWhatTheHandDoesAndTheDeadManMayBeOneOfThem) {
  const std::string hand =
      "[device.hand]\nprofile = \"stylus\"\n[[device.hand.press]]\nfrom_ms = 20\nfor_ms = 30\n"
      "[[device.hand.press]]\nbutton = 3\nfrom_ms = 0\nfor_ms = 1.5\n"
      "[device.hand.motion]\nkind = \"sine\"\namplitude_mm = 0\nfrequency_hz = 0\n";
  const auto presses = minimal_and(hand).simulated().presses;
  ASSERT_EQ(presses.size(), 2U);
  EXPECT_EQ(presses[0].button, 0U);
  EXPECT_EQ(presses[0].from, 20ms);
  EXPECT_EQ(presses[0].length, 30ms);
  EXPECT_EQ(presses[1].button, 3U);
  EXPECT_EQ(presses[1].length, 1500us);
  EXPECT_EQ(minimal_and(hand + "[safety.dead_man]\nbutton = 3\n").safety->dead_man->button, 3U);
  EXPECT_NE(error_of_minimal_and(hand + "[safety.dead_man]\nbutton = 1\n").find("safety.dead_man.button: expected"),
            std::string::npos);
}

TEST(SceneHandle, ASimulatedDeviceHasTheOutputsThatItLists) {
  EXPECT_TRUE(minimal_and("").simulated().outputs.empty());
  const auto outputs = minimal_and(
                           "[[device.effects.output]]\nname = \"ring\"\nkind = \"lamp\"\n"
                           "[[device.effects.output]]\nname = \"tip\"\nkind = \"vibration\"\n")
                           .simulated()
                           .outputs;
  ASSERT_EQ(outputs.size(), 2U);
  EXPECT_EQ(outputs[0], (OutputDescription{.name = "ring", .kind = OutputKind::kLamp}));
  EXPECT_EQ(outputs[1], (OutputDescription{.name = "tip", .kind = OutputKind::kVibration}));
  const std::string wrong = "[[device.effects.output]]\nname = \"ring\"\nkind = \"light\"\n";
  const std::string said = error_of_minimal_and(wrong);
  EXPECT_NE(said.find("device.effects.output[0].kind: expected"), std::string::npos) << said;
}

TEST(SceneHandle, ErrorsNameFileLineAndKey) {
  const std::string finger = "[device.gripper.hand]\nstiffness_n_per_m = 1\n[device.gripper.hand.motion]\n";
  expect_errors({
      {"[device.rotation]\n", "s.toml:4: device.rotation.inertia_kg_m2: missing, expected a number above 0 kg·m²"},
      {kRotation + "max_torque_nm = 0\n",
       "s.toml:6: device.rotation.max_torque_nm: expected a number above 0 N·m, found 0"},
      {kRotation + "start_deg = 3\n", "s.toml:6: device.rotation.start_deg: expected [x, y, z] in °, found 3"},
      {kRotation + "[device.rotation.hand]\n",
       "s.toml:6: device.rotation.hand.stiffness_nm_per_rad: missing, expected a number above 0 N·m/rad"},
      {kRotation + "[device.rotation.hand]\nstiffness_nm_per_rad = 1\n[device.rotation.hand.motion]\nkind = \"sine\"\n"
                   "amplitude_deg = 1\nfrequency_hz = 1\ndirection = [0, 0, 0]\n",
       "s.toml:8: device.rotation.hand.motion: sine.direction (its length) = 0: expected a vector that is not zero"},
      {"[device.gripper]\nopen_deg = 200\n",
       "s.toml:5: device.gripper.open_deg: expected a number above 0 and up to 180 °, found 200"},
      {kGripper + "start_deg = 31\n",
       "s.toml:8: device.gripper.start_deg: expected at most open_deg, which is 30 °, found 31"},
      {kGripper + finger + "kind = \"sine\"\namplitude_mm = 3\n",
       "s.toml:12: device.gripper.hand.motion.amplitude_mm: unknown key; amplitude is given in °: amplitude_deg"},
      {kGripper + finger + "kind = \"minimum-jerk\"\npoints_deg = [[1, 2, 3]]\n",
       "s.toml:12: device.gripper.hand.motion.points_deg: expected a number of °, found an array of 3"},
      {"[device.hand]\nprofile = \"stylus\"\n[[device.hand.press]]\nbutton = 32\n",
       "s.toml:7: device.hand.press[0].button: expected a whole number from 0 to 31, found 32"},
      {"[safety.torque_limit]\n", "s.toml:4: safety.torque_limit.max_nm: missing, expected a number above 0 N·m"},
      {"[safety.turn_trip]\nmax_deg_per_s = 0\n",
       "s.toml:5: safety.turn_trip.max_deg_per_s: expected a number above 0 °/s, found 0"},
  });
}

TEST(SceneHandle, TheSafetyLayerHasPartsForTorqueAndGrip) {
  const std::vector<Setting> settings = {
      {"safety.rest_torque_nm=0.02", 0.02, [](S s) { return s.safety->arming.rest_torque; }},
      {"safety.torque_limit.max_nm=0.1", 0.1, [](S s) { return s.safety->torque_limit->max; }},
      {"safety.torque_growth_limit.rate_nm_per_s=5", 5, [](S s) { return s.safety->torque_growth_limit->rate; }},
      {"safety.turn_trip.max_deg_per_s=720", 4 * std::numbers::pi, [](S s) { return s.safety->turn_trip->max; }},
      {"safety.grip_limit.max_n=2", 2, [](S s) { return s.safety->grip_limit->max; }},
      {"safety.grip_growth_limit.rate_n_per_s=100", 100, [](S s) { return s.safety->grip_growth_limit->rate; }}};
  expect_made(std::string(kMinimal) + kRotation, settings);
}

TEST(SceneHandle, TheShippedOneTurnsGripsAndPressesItsButton) {
  SimulatedDevice device(shipped("handle.toml").simulated());
  EXPECT_TRUE(device.info().measures_orientation);
  EXPECT_GT(device.info().max_torque, 0);
  EXPECT_GT(device.info().gripper.value().max_force, 0);
  double turned = 0;
  double closest = 1;
  int presses = 0;
  std::uint32_t before = 0;
  for (int ms = 0; ms < 4000; ++ms) {
    const auto sample = *device.read(LocalTime(ms * 1ms));
    turned = std::max(turned, rotation_vector(*sample.orientation).norm());
    closest = std::min(closest, *sample.opening);
    presses += sample.buttons == 1 && before == 0 ? 1 : 0;
    before = sample.buttons;
  }
  EXPECT_NEAR(turned, 45 * kDegree, 2 * kDegree);
  EXPECT_NEAR(closest, 5 * kDegree, 2 * kDegree);
  EXPECT_EQ(presses, 2);
}

const std::string kMotors = kRotation +
                            "viscous_friction_nm_s_per_rad = 2e-4\ncoulomb_friction_nm = 1e-3\nmax_torque_nm = 0.2\n" +
                            kGripper + "viscous_friction_n_s_per_m = 0.5\nmax_force_n = 3\n";
const std::string kBounds =
    "[limiter.rotation]\ncoulomb_friction_nm = 5e-4\nviscous_friction_nm_s_per_rad = 1e-4\n"
    "[limiter.gripper]\ncoulomb_friction_n = 0\nviscous_friction_n_s_per_m = 0.25\n";

TEST(SceneHandle, MotorsHaveLimitsOfTheirOwn) {
  const auto control = minimal_and(kMotors + kBounds).loop.control;
  ASSERT_TRUE(control.rotation && control.grip);
  EXPECT_EQ(control.rotation->friction.coulomb, 5e-4);
  EXPECT_EQ(control.rotation->friction.viscous, 1e-4);
  EXPECT_EQ(control.rotation->max_torque, 0.2) << "the device's";
  EXPECT_EQ(control.grip->friction.viscous, 0.25);
  EXPECT_EQ(control.grip->arm, 0.06);
  EXPECT_EQ(control.grip->max_force, 3);
  const auto less = minimal_and(kMotors + kBounds + "[force]\nmax_torque_nm = 0.1\nmax_grip_n = 2\n").loop.control;
  EXPECT_EQ(less.rotation->max_torque, 0.1);
  EXPECT_EQ(less.grip->max_force, 2);
  const auto passive = minimal_and(kRotation).loop.control;
  EXPECT_FALSE(passive.rotation || passive.grip) << "a handle that is only turned has no torque to bound";
}

TEST(SceneHandle, AMotorWithoutABoundOfItsFrictionIsRefused) {
  EXPECT_EQ(error_of_minimal_and(kMotors),
            "s.toml: limiter.rotation.coulomb_friction_nm: missing, expected a number of 0 N·m or more, because the "
            "device has motors that turn its handle");
  const std::string higher = "[limiter.rotation]\ncoulomb_friction_nm = 2e-3\nviscous_friction_nm_s_per_rad = 1e-4\n";
  EXPECT_NE(
      error_of_minimal_and(kMotors + higher).find("limiter.rotation.coulomb_friction_nm: expected at most 0.001 N·m"),
      std::string::npos)
      << error_of_minimal_and(kMotors + higher);
  const std::string truth = "[limiter.rotation]\ncoulomb_friction_nm = 1e-3\nviscous_friction_nm_s_per_rad = 2e-4\n";
  EXPECT_NE(error_of_minimal_and(kMotors + truth)
                .find("limiter.rotation.viscous_friction_nm_s_per_rad: expected at most 0.000196 N·m·s/rad, 98 % of "
                      "the true friction of the simulated device"),
            std::string::npos)
      << error_of_minimal_and(kMotors + truth);
  EXPECT_NE(error_of_minimal_and(kRotation + kBounds).find("expected a device with motors that turn its handle"),
            std::string::npos)
      << error_of_minimal_and(kRotation + kBounds);
  const std::string law = error_of_minimal_and(kMotors + kBounds + "[limiter]\nkind = \"force-bounding\"\n");
  EXPECT_NE(law.find("limiter.kind: expected \"aol+\", \"aol\" or \"none\""), std::string::npos) << law;
}

TEST(SceneHandle, AnotherLawKeepsTheBoundsOfTheWholeHandle) {
  const Scene scene = minimal_and(kMotors + kBounds);
  const auto control = parse_scene(scene.text, "s.toml", {}, limiter_settings("aol", scene.loop.control)).loop.control;
  EXPECT_EQ(control.limiter.law, Law::kAol);
  EXPECT_EQ(control.rotation->friction.viscous, 1e-4);
  EXPECT_EQ(control.grip->friction.viscous, 0.25);
}

}  // namespace
}  // namespace tendon::scene_handle_test
