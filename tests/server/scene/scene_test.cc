// SPDX-License-Identifier: Apache-2.0
#include "server/scene/scene.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "devices/replay/replay_device.h"
#include "devices/simulated/profiles.h"
#include "server/mailboxes.h"
#include "server/recording/byte_sink.h"
#include "server/recording/recorder.h"
#include "tests/server/scratch_folder.h"

namespace tendon {
namespace {

using namespace std::chrono_literals;
using testing::ScratchFolder;

constexpr std::string_view kMinimal =
    "[device]\n"
    "kind = \"simulated\"\n"
    "profile = \"falcon\"\n";

/// Four lines, so what is added begins at line 5.
constexpr std::string_view kWithoutProfile =
    "[device]\n"
    "kind = \"simulated\"\n"
    "[device.effects]\n"
    "mass_kg = 0.2\n";

/// Nine lines, of which the last begins the hand's motion.
constexpr std::string_view kHand =
    "[device]\n"
    "kind = \"simulated\"\n"
    "profile = \"falcon\"\n"
    "\n"
    "[device.hand]\n"
    "stiffness_n_per_m = 300\n"
    "damping_n_s_per_m = 3\n"
    "\n"
    "[device.hand.motion]\n";

Scene parse(const std::string& text, const std::filesystem::path& directory = {}) {
  return parse_scene(text, "s.toml", directory);
}

Scene minimal_and(const std::string& more) { return parse(std::string(kMinimal) + more); }

std::string error_of(const std::string& text, const std::filesystem::path& directory = {}) {
  try {
    parse(text, directory);
  } catch (const SceneError& error) {
    return error.what();
  }
  return "no error";
}

std::string error_of_minimal_and(const std::string& more) { return error_of(std::string(kMinimal) + more); }

void write(const std::filesystem::path& file, std::string_view text) { std::ofstream(file) << text; }

ScriptedMotion::Point target(const Scene& scene, double t) { return scene.simulated().hand->motion.at(t); }

// What a recording holds: the scene as it ran, command line and all.
TEST(Scene, WithSettingsItsTextIsTheSceneThatTheyMake) {
  const Scene as_written = read_scene(std::string(TENDON_SCENES) + "/demo.toml");
  const Friction friction = as_written.loop.control.limiter.friction;
  const auto settings = limiter_settings("none", friction);
  const Scene changed = parse_scene(as_written.text, "demo.toml", TENDON_SCENES, settings);
  EXPECT_EQ(changed.loop.control.limiter.law, Law::kNone);
  EXPECT_EQ(changed.loop.control.limiter.friction.coulomb, friction.coulomb);
  EXPECT_EQ(changed.loop.control.limiter.friction.viscous, friction.viscous);
  const Scene again = parse_scene(changed.text, "demo.toml", TENDON_SCENES);
  EXPECT_EQ(again.text, changed.text);
  EXPECT_EQ(again.loop.control.limiter.law, Law::kNone);
  EXPECT_EQ(again.loop.control.limiter.friction.coulomb, friction.coulomb);
  EXPECT_EQ(again.loop.control.max_force, as_written.loop.control.max_force);
  EXPECT_EQ(again.simulated().mass, as_written.simulated().mass);
}

TEST(Scene, TheTextThatSettingsMakeHasAllDigits) {
  const double odd = 0.1 + 0.2;
  const Scene changed =
      parse_scene(kMinimal, "s.toml", {}, limiter_settings("aol", {.coulomb = odd / 100, .viscous = odd / 70}));
  const Scene again = parse_scene(changed.text, "s.toml", {});
  EXPECT_EQ(again.loop.control.limiter.friction.coulomb, odd / 100);
  EXPECT_EQ(again.loop.control.limiter.friction.viscous, odd / 70);
}

// --- Good scenes --------------------------------------------------------------------------------------

TEST(Scene, TakesWhatItDoesNotSayFromTheProfileAndTheStructs) {
  const Scene scene = parse(std::string(kMinimal));
  const DeviceProfile& falcon = *find_device_profile("falcon");

  EXPECT_EQ(scene.simulated().name, "falcon");
  EXPECT_EQ(scene.simulated().mass, falcon.mass.value);
  EXPECT_EQ(scene.simulated().viscous_friction, falcon.viscous_friction.value);
  EXPECT_EQ(scene.simulated().coulomb_friction, falcon.coulomb_friction.value);
  EXPECT_EQ(scene.simulated().encoder_step, falcon.encoder_step.value);
  EXPECT_EQ(scene.simulated().max_force, falcon.max_force.value);
  EXPECT_EQ(scene.simulated().amplifier_bandwidth, falcon.amplifier_bandwidth.value);
  EXPECT_FALSE(scene.simulated().watchdog);
  EXPECT_FALSE(scene.simulated().start_position);
  EXPECT_FALSE(scene.simulated().hand);

  const HapticController::Config& control = scene.loop.control;
  EXPECT_EQ(scene.loop.period, HapticLoop::Config{}.period);
  EXPECT_EQ(control.limiter.longest_hold, 2 * scene.loop.period);
  ASSERT_TRUE(control.limiter.follow_holds);
  EXPECT_EQ(control.limiter.follow_holds->memory, HoldBound::Follow{}.memory);
  EXPECT_EQ(control.watchdog, 0ns);
  EXPECT_EQ(control.limiter.law, Law::kAolPlus);
  EXPECT_EQ(control.limiter.friction.coulomb, falcon.coulomb_bound.value);
  EXPECT_EQ(control.limiter.friction.viscous, falcon.viscous_bound.value);
  EXPECT_EQ(control.max_force, falcon.max_force.value);
  EXPECT_EQ(control.max_slew, 1000);
  EXPECT_EQ(control.max_missed, HapticController::Config{}.max_missed);
  EXPECT_EQ(control.hold.hold, HeldForce::Config{}.hold);
  EXPECT_EQ(control.hold.decay, HeldForce::Config{}.decay);
  EXPECT_EQ(control.hold.safe_stop, HeldForce::Config{}.safe_stop);
  EXPECT_EQ(control.hold.ramp_in, HeldForce::Config{}.ramp_in);
  EXPECT_EQ(control.hold.max_valid_for, HeldForce::Config{}.max_valid_for);

  EXPECT_EQ(to_string(scene.network.listen), "127.0.0.1:47100");
  EXPECT_EQ(scene.network.max_observers, NetworkLoop::Config{}.max_observers);
  EXPECT_EQ(scene.network.controller_timeout, NetworkLoop::Config{}.controller_timeout);
  EXPECT_EQ(scene.network.observer_timeout, NetworkLoop::Config{}.observer_timeout);
  EXPECT_FALSE(scene.recording);
  EXPECT_EQ(scene.text, kMinimal);
}

TEST(Scene, ReadsEveryKey) {
  const Scene scene = parse(R"(
[device]
kind = "simulated"
profile = "phantom-premium"
start_position_mm = [1, -2.5, 3]
[device.effects]
mass_kg = 0.1
viscous_friction_n_s_per_m = 0.2
coulomb_friction_n = 0.3
encoder_step_um = 43
max_force_n = 9
amplifier_bandwidth_hz = 250
watchdog_ms = 5.5
[device.hand]
stiffness_n_per_m = 300
damping_n_s_per_m = 3
mass_kg = 0.05
[device.hand.motion]
kind = "sine"
amplitude_mm = 15
frequency_hz = 0.5
centre_mm = [0, 10, 0]
direction = [0, 0, 2]
[loop]
period_us = 500
longest_hold_us = 1500
hold_memory_ms = 5000
hold_margin = 0.5
hold_most = 3
max_speed_m_per_s = 10
[limiter]
kind = "aol-per-axis"
coulomb_friction_n = 0.1
viscous_friction_n_s_per_m = 0.15
[force]
max_force_n = 5
max_slew_n_per_s = inf
hold_ms = 10
decay_ms = 20
safe_stop_ms = 30
ramp_in_ms = 40
max_valid_for_ms = 50
[network]
listen = "[::1]:5000"
max_observers = 3
controller_timeout_ms = 1500
observer_timeout_ms = 2500
adapt_state_rate = true
[recording]
path = "run.mcap"
rotate_mb = 50
rotate_min = 90
budget_mb = 200.5
datagrams_kb_per_s = 100
)");
  EXPECT_EQ(scene.simulated().start_position, Vec3(0.001, -0.0025, 0.003));
  EXPECT_EQ(scene.simulated().mass, 0.1);
  EXPECT_EQ(scene.simulated().viscous_friction, 0.2);
  EXPECT_EQ(scene.simulated().coulomb_friction, 0.3);
  EXPECT_EQ(scene.simulated().encoder_step, 43e-6);
  EXPECT_EQ(scene.simulated().max_force, 9);
  EXPECT_EQ(scene.simulated().amplifier_bandwidth, 250);
  EXPECT_EQ(scene.simulated().watchdog, 5500us);
  ASSERT_TRUE(scene.simulated().hand);
  EXPECT_EQ(scene.simulated().hand->stiffness, 300);
  EXPECT_EQ(scene.simulated().hand->damping, 3);
  EXPECT_EQ(scene.simulated().hand->mass, 0.05);
  EXPECT_EQ(target(scene, 0).position, Vec3(0, 0.01, 0));
  EXPECT_EQ(target(scene, 0.5).position, Vec3(0, 0.01, 0.015));  // a quarter of the cycle

  const HapticController::Config& control = scene.loop.control;
  EXPECT_EQ(scene.loop.period, 500us);
  EXPECT_EQ(control.limiter.longest_hold, 1500us);
  ASSERT_TRUE(control.limiter.follow_holds);
  EXPECT_EQ(control.limiter.follow_holds->memory, 5s);
  EXPECT_EQ(control.limiter.follow_holds->margin, 0.5);
  EXPECT_EQ(control.limiter.follow_holds->most, 3);
  EXPECT_EQ(control.max_speed, 10);
  EXPECT_EQ(control.watchdog, 5500us);
  EXPECT_EQ(control.limiter.law, Law::kAolPerAxis);
  EXPECT_EQ(control.limiter.friction.coulomb, 0.1);
  EXPECT_EQ(control.limiter.friction.viscous, 0.15);
  EXPECT_EQ(control.max_force, 5);
  EXPECT_EQ(control.max_slew, std::numeric_limits<double>::infinity());
  EXPECT_EQ(control.hold.hold, 10ms);
  EXPECT_EQ(control.hold.decay, 20ms);
  EXPECT_EQ(control.hold.safe_stop, 30ms);
  EXPECT_EQ(control.hold.ramp_in, 40ms);
  EXPECT_EQ(control.hold.max_valid_for, 50ms);
  EXPECT_EQ(to_string(scene.network.listen), "[::1]:5000");
  EXPECT_EQ(scene.network.max_observers, 3U);
  EXPECT_EQ(scene.network.controller_timeout, 1500ms);
  EXPECT_EQ(scene.network.observer_timeout, 2500ms);
  EXPECT_TRUE(scene.network.adapt_state_rate);
  ASSERT_TRUE(scene.recording);
  EXPECT_EQ(scene.recording->path, "run.mcap");
  EXPECT_DOUBLE_EQ(scene.recording->rotate_bytes, 50e6);
  EXPECT_DOUBLE_EQ(scene.recording->rotate_after, 5400);
  EXPECT_DOUBLE_EQ(scene.recording->budget_bytes.value(), 200.5e6);
  EXPECT_DOUBLE_EQ(scene.recording->datagram_bytes_per_s, 100e3);
}

TEST(Scene, ReadsAMotionOfRampAndHold) {
  const Scene scene =
      parse(std::string(kHand) +
            "kind = \"ramp-hold\"\nfrom_mm = [0, 0, 0]\nto_mm = [8, 0, 0]\nramp_ms = 1000\nhold_ms = 500\n");
  EXPECT_EQ(target(scene, 0.5).position, Vec3(0.004, 0, 0));
  EXPECT_EQ(target(scene, 1.25).position, Vec3(0.008, 0, 0));
  EXPECT_EQ(target(scene, 2.0).position, Vec3(0.004, 0, 0));  // on its way back
}

TEST(Scene, ReadsAMotionOfLeastJerk) {
  const std::string text = std::string(kHand) +
                           "kind = \"minimum-jerk\"\npoints_mm = [[0, 0, 0], [8, 0, 0], [8, 4, 0]]\n"
                           "durations_ms = [1000, 500]\n";
  EXPECT_EQ(target(parse(text), 0.5).position, Vec3(0.004, 0, 0));
  EXPECT_EQ(target(parse(text), 1.25).position, Vec3(0.008, 0.002, 0));
  EXPECT_EQ(target(parse(text), 3.0).position, Vec3(0, 0, 0));
  EXPECT_EQ(target(parse(text + "back_and_forth = false\n"), 3.0).position, Vec3(0.008, 0.004, 0));
}

TEST(Scene, LooksForARecordedMotionBesideTheSceneFile) {
  const ScratchFolder folder;
  write(folder.path() / "hand.csv", "t_s,angle,other\n0,0,9\n1,2,9\n2,4,9\n");
  write(folder.path() / "scene.toml", std::string(kHand) +
                                          "kind = \"recorded\"\nfile = \"hand.csv\"\nposition_column = \"angle\"\n"
                                          "scale_m = 0.5\norigin_mm = [0, 0, 250]\ndirection = [0, 1, 0]\n");
  const Scene scene = read_scene(folder.path() / "scene.toml");
  EXPECT_EQ(target(scene, 1).position, Vec3(0, 1, 0.25));
  EXPECT_EQ(target(scene, 5).position, Vec3(0, 2, 0.25));  // stays at the end
}

TEST(Scene, ReadsARecordedMotionByColumnNumbersAndRepeatsIt) {
  const ScratchFolder folder;
  write(folder.path() / "hand.csv", "0,0\n1,2\n2,4\n");
  const Scene scene = parse(std::string(kHand) +
                                "kind = \"recorded\"\nfile = \"hand.csv\"\ntime_column = 0\nposition_column = 1\n"
                                "at_end = \"repeat\"\n",
                            folder.path());
  EXPECT_EQ(target(scene, 3).position, Vec3(2, 0, 0));
}

TEST(Scene, ConvertsUnitsWithoutAnErrorInTheLastDigit) {
  const Scene scene = minimal_and(
      "start_position_mm = [0.1, 15, 0.7]\n"
      "[device.effects]\nencoder_step_um = 43\nwatchdog_ms = 4.35\n"
      "[loop]\nperiod_us = 100.001\nlongest_hold_us = 1000.001\n"
      "[force]\nhold_ms = 0.1\ndecay_ms = 0.29\n");
  EXPECT_EQ(scene.simulated().start_position, Vec3(0.0001, 0.015, 0.0007));
  EXPECT_EQ(scene.simulated().encoder_step, 0.000043);
  EXPECT_EQ(scene.simulated().watchdog, 4'350'000ns);
  EXPECT_EQ(scene.loop.period, 100'001ns);
  EXPECT_EQ(scene.loop.control.limiter.longest_hold, 1'000'001ns);
  EXPECT_EQ(scene.loop.control.hold.hold, 100'000ns);
  EXPECT_EQ(scene.loop.control.hold.decay, 290'000ns);
}

TEST(Scene, LoopsRunFrom250HzTo10KHzAndBearSilenceForTheSameTime) {
  for (const auto& [period_us, missed] : {std::pair(100, 200U), std::pair(500, 40U), std::pair(4000, 5U)}) {
    const Scene scene = minimal_and("[loop]\nperiod_us = " + std::to_string(period_us) + "\n");
    EXPECT_EQ(scene.loop.period, std::chrono::microseconds(period_us));
    EXPECT_EQ(scene.loop.control.limiter.longest_hold, std::chrono::microseconds(2 * period_us));
    EXPECT_EQ(scene.loop.control.max_missed, missed);
  }
}

TEST(Scene, TheHapticThreadStaysOnAProcessorWhenOneIsNamed) {
  EXPECT_FALSE(minimal_and("").cpu);
  EXPECT_EQ(minimal_and("[loop]\ncpu = 0\n").cpu, 0U);
  EXPECT_EQ(minimal_and("[loop]\ncpu = 3\n").cpu, 3U);
  EXPECT_EQ(error_of_minimal_and("[loop]\ncpu = -1\n"),
            "s.toml:5: loop.cpu: expected a whole number from 0 to 1023, found -1");
  EXPECT_EQ(error_of_minimal_and("[loop]\ncpu = 1.5\n"),
            "s.toml:5: loop.cpu: expected a whole number from 0 to 1023, found 1.5");
}

TEST(Scene, OfTheSafetyLayerThereIsWhatItLists) {
  EXPECT_FALSE(minimal_and("").safety);
  const Scene bare = minimal_and("[safety]\n");
  ASSERT_TRUE(bare.safety);
  EXPECT_EQ(bare.safety->arming.by, SafeDevice::Arming::By::kRequest);
  EXPECT_FALSE(bare.safety->force_limit || bare.safety->growth_limit || bare.safety->ramp_in ||
               bare.safety->heat_limit || bare.safety->workspace || bare.safety->speed_trip ||
               bare.safety->step_bound || bare.safety->command_watchdog || bare.safety->link_watchdog ||
               bare.safety->dead_man);
  const SafeDevice::Config all = *minimal_and(R"([device.hand]
stiffness_n_per_m = 300
button_after_ms = 500
[device.hand.motion]
kind = "sine"
amplitude_mm = 0
frequency_hz = 0
[safety]
arm = "by dead man"
rest_speed_m_per_s = 0.03
rest_force_n = 0.2
patience_ms = 400
force_limit.max_n = 7
growth_limit.rate_n_per_s = 500
ramp_in.time_ms = 200
heat_limit = {peak_n = 8, continuous_n = 2, time_constant_ms = 30000}
workspace = {kind = "box", half_mm = [50, 40, 30], centre_mm = [0, 0, 125], margin_mm = 10}
speed_trip.max_m_per_s = 1.5
step_bound.max_speed_m_per_s = 10
command_watchdog = {timeout_ms = 30, ramp_ms = 10}
link_watchdog.timeout_ms = 20
dead_man.button = 0
)")
                                      .safety;
  EXPECT_EQ(all.arming.by, SafeDevice::Arming::By::kDeadMan);
  EXPECT_EQ(all.arming.rest_speed, 0.03);
  EXPECT_EQ(all.arming.rest_force, 0.2);
  EXPECT_EQ(all.arming.patience, 400ms);
  EXPECT_EQ(all.force_limit->max, 7);
  EXPECT_EQ(all.growth_limit->rate, 500);
  EXPECT_EQ(all.ramp_in->time, 200ms);
  EXPECT_EQ(all.heat_limit->peak, 8);
  EXPECT_EQ(all.heat_limit->continuous, 2);
  EXPECT_EQ(all.heat_limit->time_constant, 30s);
  EXPECT_EQ(std::get<Workspace::Box>(all.workspace->shape).half, Vec3(0.05, 0.04, 0.03));
  EXPECT_EQ(all.workspace->centre, Vec3(0, 0, 0.125));
  EXPECT_EQ(all.workspace->margin, 0.01);
  EXPECT_EQ(all.speed_trip->max, 1.5);
  EXPECT_EQ(all.step_bound->max_speed, 10);
  EXPECT_EQ(all.command_watchdog->timeout, 30ms);
  EXPECT_EQ(all.command_watchdog->ramp, 10ms);
  EXPECT_EQ(all.link_watchdog->timeout, 20ms);
  EXPECT_EQ(all.link_watchdog->ramp, Watchdog::Config{}.ramp);
  EXPECT_EQ(all.dead_man->button, 0U);
}

TEST(Scene, ReadsDelaysAStructuralModeAndFrictionOfTheJoints) {
  const SimulatedDevice::Config device = minimal_and(R"([device.effects]
sample_delay_ms = 1.5
force_delay_ms = 0.25
coulomb_friction_n = false
[device.effects.structural_mode]
handle_mass_kg = 0.05
stiffness_n_per_m = 3500
damping_n_s_per_m = 0.4
[device.effects.joint_friction]
kind = "arm"
upper_arm_mm = 215
forearm_mm = 170
coulomb_n_m = [0.1, 0.2, 0.3]
viscous_n_m_s = [0.001, 0.002, 0.003]
centre_mm = [0, 10, 0]
)")
                                             .simulated();
  EXPECT_EQ(device.sample_delay, 1500us);
  EXPECT_EQ(device.force_delay, 250us);
  EXPECT_EQ(device.structural_mode->handle_mass, 0.05);
  EXPECT_EQ(device.structural_mode->stiffness, 3500);
  EXPECT_EQ(device.structural_mode->damping, 0.4);
  ASSERT_TRUE(device.joint_friction);
  const auto& arm = std::get<Mechanism::Arm>(device.joint_friction->mechanism);
  EXPECT_EQ(arm.upper_arm, 0.215);
  EXPECT_EQ(arm.forearm, 0.17);
  EXPECT_EQ(device.joint_friction->coulomb, Vec3(0.1, 0.2, 0.3));
  EXPECT_EQ(device.joint_friction->viscous, Vec3(0.001, 0.002, 0.003));
  EXPECT_EQ(device.joint_friction->centre, Vec3(0, 0.01, 0));
  EXPECT_FALSE(device.coulomb_friction);
  EXPECT_FALSE(minimal_and("").simulated().structural_mode);
  EXPECT_FALSE(minimal_and("").simulated().joint_friction);
  EXPECT_FALSE(minimal_and("").simulated().sample_delay);
}

TEST(Scene, AProfilesJointFrictionIsNoLessThanTheLimitersBound) {
  const DeviceProfile& falcon = *find_device_profile("falcon");
  const Scene scene = minimal_and("[device.effects.joint_friction]\nkind = \"falcon\"\n");
  EXPECT_FALSE(scene.simulated().coulomb_friction) << "it is in the joints";
  EXPECT_GE(least_friction(scene.simulated()).coulomb, falcon.coulomb_friction.value);
  EXPECT_NEAR(least_friction(scene.simulated()).coulomb, falcon.coulomb_friction.value, 1e-12);
  EXPECT_EQ(least_friction(scene.simulated()).viscous, falcon.viscous_friction.value);
  EXPECT_EQ(scene.loop.control.limiter.friction.coulomb, falcon.coulomb_bound.value);
  // What an operator has identified may be as much as there is, and no more.
  const std::string joints = "[device.effects.joint_friction]\nkind = \"falcon\"\n";
  EXPECT_EQ(minimal_and(joints + "[limiter]\ncoulomb_friction_n = 0.4\n").loop.control.limiter.friction.coulomb, 0.4);
  EXPECT_NE(error_of_minimal_and(joints + "[limiter]\ncoulomb_friction_n = 0.41\n")
                .find("s.toml:7: limiter.coulomb_friction_n: expected at most 0.4"),
            std::string::npos);
}

TEST(Scene, BoundsByPlaceMayBeAsMuchAsTheJointsHaveThere) {
  const std::string scene = R"([device.effects]
viscous_friction_n_s_per_m = 1
[device.effects.joint_friction]
kind = "arm"
upper_arm_mm = 140
forearm_mm = 140
[limiter]
adaptive_friction = {places_mm = [[0, 0, 0]], viscous_friction_n_s_per_m = [0.5], coulomb_friction_n = [)";
  // The torque that is 0.4 N at the turntable's longest lever, 0.14 m and the reach, is more where that is 0.14 m; the
  // least at the centre is that of the other two, whose levers are the same everywhere.
  EXPECT_TRUE(minimal_and(scene + "0.4]}\n").loop.control.friction_map);
  const std::string error = error_of_minimal_and(scene + "0.45]}\n");
  EXPECT_TRUE(error.starts_with("s.toml:11: limiter.adaptive_friction.coulomb_friction_n: expected at most 0.4"))
      << error;
  EXPECT_NE(error.find(" N, the true friction of the simulated device there, found 0.45"), std::string::npos) << error;
}

TEST(Scene, AHandMayBeThatOfAnOperatorsProfile) {
  const std::string motion = "[device.hand.motion]\nkind = \"sine\"\namplitude_mm = 5\nfrequency_hz = 1\n";
  for (const OperatorProfile& profile : operator_profiles()) {
    const std::string hand = "[device.hand]\nprofile = \"" + std::string(profile.name) + "\"\n";
    const Scene scene = minimal_and(hand + motion);
    ASSERT_TRUE(scene.simulated().hand);
    EXPECT_EQ(scene.simulated().hand->stiffness, profile.stiffness.middle());
    EXPECT_EQ(scene.simulated().hand->damping, profile.damping.middle());
    EXPECT_EQ(scene.simulated().hand->mass, profile.mass.middle());
    EXPECT_NEAR(target(scene, 0.25).position.norm(), 0.005, 1e-12);
    const Scene firmer = minimal_and(hand + "stiffness_n_per_m = 900\n" + motion);
    EXPECT_EQ(firmer.simulated().hand->stiffness, 900);
    EXPECT_EQ(firmer.simulated().hand->mass, profile.mass.middle());
  }
}

TEST(Scene, AnEffectThatIsFalseDoesNotExist) {
  const Scene scene = minimal_and("[device.effects]\nencoder_step_um = false\namplifier_bandwidth_hz = false\n");
  EXPECT_FALSE(scene.simulated().encoder_step);
  EXPECT_FALSE(scene.simulated().amplifier_bandwidth);
  EXPECT_TRUE(scene.simulated().coulomb_friction) << "the other effects of the profile stay";
}

TEST(Scene, WithoutAProfileOnlyTheListedEffectsExist) {
  const Scene scene = parse(std::string(kWithoutProfile) + "[limiter]\nkind = \"none\"\n[force]\nmax_force_n = 5\n");
  EXPECT_EQ(scene.simulated().name, "simulated");
  EXPECT_EQ(scene.simulated().mass, 0.2);
  EXPECT_FALSE(scene.simulated().viscous_friction);
  EXPECT_FALSE(scene.simulated().coulomb_friction);
  EXPECT_FALSE(scene.simulated().encoder_step);
  EXPECT_FALSE(scene.simulated().max_force);
  EXPECT_FALSE(scene.simulated().amplifier_bandwidth);
  EXPECT_FALSE(scene.simulated().watchdog);
  EXPECT_EQ(scene.loop.control.limiter.law, Law::kNone);
  EXPECT_EQ(scene.loop.control.limiter.friction.coulomb, 0);
  EXPECT_EQ(scene.loop.control.limiter.friction.viscous, 0);
  EXPECT_EQ(scene.loop.control.max_force, 5);
}

constexpr std::string_view kFalcon =
    "[device]\n"
    "kind = \"falcon\"\n"
    "[limiter]\n"
    "coulomb_friction_n = 0.9\n"
    "viscous_friction_n_s_per_m = 0\n";

TEST(Scene, AFalconIsARealDeviceWhoseFrictionIsToldNotTaken) {
  const Scene scene = parse(std::string(kFalcon), "/scenes");
  ASSERT_TRUE(std::holds_alternative<falcon::Config>(scene.device));
  EXPECT_EQ(std::get<falcon::Config>(scene.device).port, "");
  EXPECT_FALSE(std::get<falcon::Config>(scene.device).firmware ||
               std::get<falcon::Config>(scene.device).accept_unknown_firmware);
  EXPECT_EQ(scene.loop.control.limiter.friction.coulomb, 0.9) << "nobody here knows that it has less";
  EXPECT_EQ(scene.loop.control.max_force, 8);
  EXPECT_EQ(scene.loop.control.watchdog, 0ns);
  EXPECT_FALSE(std::holds_alternative<falcon::Config>(parse(std::string(kMinimal)).device));

  const std::string keys =
      "port = \"1-2.3\"\nfirmware = \"mine.bin\"\naccept_unknown_firmware = true\nname = \"left\"\n";
  const Scene told =
      parse("[device]\nkind = \"falcon\"\n" + keys + std::string(kFalcon.substr(kFalcon.find("[l"))), "/scenes");
  EXPECT_EQ(std::get<falcon::Config>(told.device).port, "1-2.3");
  EXPECT_EQ(std::get<falcon::Config>(told.device).firmware, "/scenes/mine.bin");
  EXPECT_TRUE(std::get<falcon::Config>(told.device).accept_unknown_firmware);
  EXPECT_EQ(told.name, "left");
  EXPECT_TRUE(
      std::holds_alternative<falcon::Config>(read_scene(std::filesystem::path(TENDON_SCENES) / "falcon.toml").device));
}

TEST(Scene, AFalconHasNoKeysOfTheSimulatedDeviceAndIsNotWithoutALimiter) {
  const std::string falcon = "[device]\nkind = \"falcon\"\n";
  EXPECT_EQ(error_of(falcon + "profile = \"falcon\"\n"),
            "s.toml:3: device.profile: unknown key; known here: kind, name, port, firmware, accept_unknown_firmware");
  EXPECT_EQ(error_of(falcon + "port = \"left\"\n"),
            "s.toml:3: device.port: expected a port as `tendond devices` names it, like \"1-2.3\", found \"left\"");
  EXPECT_EQ(error_of(falcon + "[limiter]\nkind = \"none\"\n"),
            "s.toml:4: limiter.kind: expected a limiter, found \"none\", which is for simulated devices only");
  EXPECT_EQ(
      error_of(falcon + "[limiter]\nviscous_friction_n_s_per_m = 0\n"),
      "s.toml:3: limiter.coulomb_friction_n: missing, expected a number of 0 N or more: what tendon-identify finds "
      "of this very device, or 0");
}

TEST(Scene, AFalconAlwaysHasToBeArmed) {
  const Scene scene = parse(std::string(kFalcon));
  ASSERT_TRUE(scene.safety);
  EXPECT_EQ(scene.safety->arming.by, SafeDevice::Arming::By::kRequest);
  EXPECT_EQ(parse(std::string(kFalcon) + "[safety.dead_man]\nbutton = 3\n").safety->dead_man->button, 3U);
  EXPECT_EQ(error_of(std::string(kFalcon) + "[safety.dead_man]\nbutton = 4\n"),
            "s.toml:7: safety.dead_man.button: expected one of a Falcon's, 0 to 3, found 4");
}

// --- Replay

constexpr std::string_view kReplay = "[device]\nkind = \"replay\"\n";

TEST(Scene, AReplayedCsvFileNeedsNothingElseBecauseNobodyFeelsAForce) {
  const ScratchFolder folder;
  write(folder.path() / "hand.csv", "t_s,angle\n10,0\n10.01,2\n10.015,4\n");
  const Scene scene = parse(std::string(kReplay) +
                                "at_end = \"repeat\"\nencoder_step_um = 30\n[device.csv]\nfile = \"hand.csv\"\n"
                                "position_column = \"angle\"\nscale_m = 0.5\ndirection = [0, 3, 0]\n",
                            folder.path());
  ASSERT_TRUE(std::holds_alternative<ReplayDevice::Config>(scene.device));
  EXPECT_FALSE(scene.driver().exerts_force);
  ASSERT_EQ(std::get<ReplayDevice::Config>(scene.device).samples.size(), 3U);
  EXPECT_EQ(std::get<ReplayDevice::Config>(scene.device).samples[2].position, Vec3(0, 2, 0));
  EXPECT_EQ(std::get<ReplayDevice::Config>(scene.device).samples[2].at -
                std::get<ReplayDevice::Config>(scene.device).samples[0].at,
            15ms);
  EXPECT_EQ(std::get<ReplayDevice::Config>(scene.device).at_end, ReplayDevice::AtEnd::kRepeat);
  EXPECT_EQ(std::get<ReplayDevice::Config>(scene.device).position_resolution, 3e-5);
  EXPECT_EQ(scene.loop.control.limiter.friction.coulomb, 0);
  EXPECT_TRUE(parse(std::string(kMinimal)).driver().exerts_force);
}

TEST(Scene, AReplayedRecordingIsTheHandThatWasSeenBitForBit) {
  const ScratchFolder folder;
  const auto path = folder.path() / "run.mcap";
  std::vector<StepRecord> steps(40);
  {
    FileSink sink(path);
    Recorder recorder({.scene = {}, .started = LocalTime(1s)}, sink);
    for (int i = 0; StepRecord & step : steps) {
      const double x = std::sin(0.1 * i);
      step.hand = {.at = LocalTime(1s + i * 1ms + i % 3 * 7us), .position = {x, x / 3, -x}, .velocity = Vec3::Zero()};
      if (i++ % 5 == 4) step.reasons |= Reason::kUnseen;
      recorder.record(step, 0);
    }
    recorder.close();
  }
  const Scene scene = parse(std::string(kReplay) + "recording = \"run.mcap\"\n", folder.path());
  std::erase_if(steps, [](const StepRecord& step) { return step.reasons.has(Reason::kUnseen); });
  ASSERT_EQ(std::get<ReplayDevice::Config>(scene.device).samples.size(), steps.size());
  for (std::size_t i = 0; i < steps.size(); ++i) {
    EXPECT_EQ(std::get<ReplayDevice::Config>(scene.device).samples[i].position, steps[i].hand.position);
    EXPECT_EQ(std::get<ReplayDevice::Config>(scene.device).samples[i].at, steps[i].hand.at.time_since_epoch());
  }
}

TEST(Scene, AReplayNamesItsSourceAndWhatIsWrongWithIt) {
  const ScratchFolder folder;
  const auto error = [&folder](const std::string& more) -> std::string {
    try {
      parse(std::string(kReplay) + more, folder.path());
    } catch (const SceneError& problem) {
      return problem.what();
    }
    return "none";
  };
  const std::string csv = "[device.csv]\nfile = \"hand.csv\"\nposition_column = \"x\"\n";
  EXPECT_EQ(error(""), "s.toml:1: device: expected either recording or a table csv, found neither");
  EXPECT_EQ(error("recording = \"a.mcap\"\n" + csv),
            "s.toml:1: device: expected either recording or a table csv, found both");
  EXPECT_NE(error("recording = \"a.mcap\"\n").find("s.toml:3: device.recording: "), std::string::npos);
  EXPECT_NE(error(csv).find("s.toml:4: device.csv.file: "), std::string::npos) << error(csv);
  write(folder.path() / "hand.csv", "t_s,x\n0,0\n0.01,1\n0.05,2\n");
  EXPECT_EQ(error(csv),
            "s.toml:4: device.csv.file: expected samples no further apart than 19 ms, because a device that is silent "
            "for longer is a fault, found 40 ms at 0.01 s");
  write(folder.path() / "hand.csv", "t_s,x\n0,0\n0.01,1\n");
  EXPECT_EQ(error(csv), "none");
  EXPECT_NE(error(csv + "direction = [0, 0, 0]\n").find("replay.direction (its length)"), std::string::npos);
}

TEST(Scene, AReplayRunsTheLoopAsTheHandDidAndAFieldOfForceChangesNothing) {
  const ScratchFolder folder;
  write(folder.path() / "hand.csv", "t_s,x\n0,0\n0.002,0.001\n0.004,0.002\n0.006,0.003\n");
  const Scene scene =
      parse(std::string(kReplay) + "[device.csv]\nfile = \"hand.csv\"\nposition_column = \"x\"\n", folder.path());
  ReplayDevice device(std::get<ReplayDevice::Config>(scene.device));
  Mailboxes mail({.steps = 64, .flight = 2, .datagrams = 1});
  HapticLoop loop(scene.loop, device, mail);
  LocalTime now{1s};
  double asked = 0;
  for (int i = 0; i < 12; ++i, now += 1ms) {
    RemoteForce force;
    force.sequence = static_cast<std::uint64_t>(i + 1);
    force.received = force.answers = now;
    force.force = {-3, 0, 0};
    force.valid_for = 20ms;
    mail.forces[0].put(force);
    loop.step(now);
    const StepRecord* step = mail.steps.front();
    EXPECT_EQ(step->applied, Vec3::Zero());
    asked = std::max(asked, step->wanted.norm());
    if (i % 2 == 0 && i <= 6) {
      EXPECT_EQ(step->hand.position,
                std::get<ReplayDevice::Config>(scene.device).samples[static_cast<std::size_t>(i / 2)].position);
    }
    mail.steps.pop();
  }
  EXPECT_GT(asked, 0);
  EXPECT_EQ(loop.stats().fault, HapticController::Fault::kNone);
}

TEST(Scene, ASpaceMouseNeedsNothingElseEither) {
  const std::string mouse = "[device]\nkind = \"spacemouse\"\n";
  const Scene plain = parse(mouse);
  ASSERT_TRUE(std::holds_alternative<spacemouse::Config>(plain.device));
  EXPECT_FALSE(plain.driver().exerts_force);
  const Scene told = parse(mouse + "port = \"1-2.3\"\nspeed_m_per_s = 0.3\ndead_band = 0.2\nreach_mm = 70\n");
  EXPECT_EQ(std::get<spacemouse::Config>(told.device).port, "1-2.3");
  EXPECT_EQ(std::get<spacemouse::Config>(told.device).motion.speed, 0.3);
  EXPECT_EQ(std::get<spacemouse::Config>(told.device).motion.dead_band, 0.2);
  EXPECT_EQ(std::get<spacemouse::Config>(told.device).motion.reach, 0.07);
  EXPECT_EQ(error_of(mouse + "dead_band = 1\n"),
            "s.toml:3: device.dead_band: expected a number from 0 to 0.9, found 1");
  EXPECT_TRUE(std::holds_alternative<spacemouse::Config>(
      read_scene(std::filesystem::path(TENDON_SCENES) / "spacemouse.toml").device));
}

constexpr std::string_view kArm =
    "[device]\n"
    "kind = \"woodenhaptics\"\n"
    "model = \"polhem_v1\"\n";
constexpr std::string_view kArmsFriction =
    "[limiter]\n"
    "coulomb_friction_n = 0.9\n"
    "viscous_friction_n_s_per_m = 0\n";

TEST(Scene, AWoodenHapticsIsARealDeviceOfAModelWhoseWatchdogIsCountedOn) {
  const Scene scene = parse(std::string(kArm) + std::string(kArmsFriction));
  ASSERT_TRUE(std::holds_alternative<woodenhaptics::Config>(scene.device));
  EXPECT_TRUE(scene.driver().moves_a_hand);
  EXPECT_TRUE(scene.driver().exerts_force);
  EXPECT_EQ(std::get<woodenhaptics::Config>(scene.device).drive.model, woodenhaptics::find_model("polhem_v1"));
  EXPECT_EQ(std::get<woodenhaptics::Config>(scene.device).drive.max_current, 2);
  EXPECT_EQ(std::get<woodenhaptics::Config>(scene.device).port, "");
  EXPECT_EQ(scene.loop.control.limiter.friction.coulomb, 0.9) << "nobody here knows that it has less";
  EXPECT_EQ(scene.loop.control.max_force, 5);
  EXPECT_EQ(scene.loop.control.watchdog, 500ms);
  EXPECT_EQ(
      scene.simulated().encoder_step,
      WoodenHapticsDevice::info_of(*std::get<woodenhaptics::Config>(scene.device).drive.model).position_resolution);
  ASSERT_TRUE(scene.safety) << "it always has to be armed";
  EXPECT_EQ(scene.safety->arming.by, SafeDevice::Arming::By::kRequest);

  const Scene told = parse(std::string(kArm) + "port = \"1-2.3\"\nmax_current_ma = 700\n" + std::string(kArmsFriction));
  EXPECT_EQ(std::get<woodenhaptics::Config>(told.device).port, "1-2.3");
  EXPECT_EQ(std::get<woodenhaptics::Config>(told.device).drive.max_current, 0.7);
  EXPECT_FALSE(std::holds_alternative<woodenhaptics::Config>(parse(std::string(kFalcon)).device));
  EXPECT_TRUE(std::holds_alternative<woodenhaptics::Config>(
      read_scene(std::filesystem::path(TENDON_SCENES) / "woodenhaptics.toml").device));
}

TEST(Scene, AWoodenHapticsSaysWhichModelsCanBeDrivenAndWhyTwoCannot) {
  const std::string kind = "[device]\nkind = \"woodenhaptics\"\n";
  const std::string models =
      "expected one of \"woodenhaptics_v2019\", \"woodenhaptics_v2015\", \"polhem_v1\", \"aluhaptics_v2\", "
      "\"vintage\"";
  EXPECT_EQ(error_of(kind), "s.toml:1: device.model: missing, " + models);
  EXPECT_EQ(error_of(kind + "model = \"hawk\"\n"), "s.toml:3: device.model: " + models + ", found \"hawk\"");
  for (const std::string name : {"polhem_v2", "polhem_v3"}) {
    EXPECT_EQ(
        error_of(kind + "model = \"" + name + "\"\n"),
        "s.toml:3: device.model: " + models +
            " (Polhem v2 and v3 have a closed linkage, whose kinematics their makers have not published), found \"" +
            name + "\"");
  }
  EXPECT_EQ(error_of(std::string(kArm) + "max_current_ma = 4000\n" + std::string(kArmsFriction)),
            "s.toml:4: device.max_current_ma: expected at most 3000 mA, the full scale of its amplifiers, found 4000");
  EXPECT_EQ(error_of(std::string(kArm) + "max_current_ma = 0\n"),
            "s.toml:4: device.max_current_ma: expected a number from 1 to 6000 mA, found 0");
  EXPECT_EQ(error_of(std::string(kArm) + "[limiter]\nkind = \"none\"\n"),
            "s.toml:5: limiter.kind: expected a limiter, found \"none\", which is for simulated devices only");
  EXPECT_EQ(error_of(std::string(kArm) + std::string(kArmsFriction) + "[safety.dead_man]\nbutton = 1\n"),
            "s.toml:8: safety.dead_man.button: expected 0, the switch at its tip, found 1");
}

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
  EXPECT_EQ(error_of_minimal_and("[force.output_estimator]\n[force.adaptive_local_model]\n"),
            "s.toml:4: force: adaptive_local_model and output_estimator: expected one of them, not both");
}

TEST(Scene, AToolNeedsADeviceThatMeasuresTheHand) {
  const std::string tool = "[admittance]\nmass_kg = 3\nproportional_n_s_per_m = 400\n";
  const Scene scene = minimal_and("[device.effects]\nforce_sensor = 0.1\n" + tool);
  ASSERT_TRUE(scene.loop.control.admittance);
  EXPECT_EQ(scene.loop.control.admittance->mass, Vec3(3, 3, 3));
  EXPECT_EQ(scene.simulated().force_sensor->resolution, 0.1);
  EXPECT_EQ(error_of_minimal_and(tool),
            "s.toml:4: admittance: expected a device with force_sensor among its effects: the tool is driven by the "
            "hand's force");
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
            "s.toml:5: limiter.adaptive_friction.places_mm: expected as many places as friction bounds of each kind");
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

TEST(Scene, BoundedAccelerationNeverShapesBelowTheFrictionItself) {
  const auto parts = minimal_and("[limiter.bounded_acceleration]\nmost_m_per_s2 = 200\n").loop.control.limiter.parts;
  EXPECT_EQ(parts.bounded_acceleration->most[0], 200);
  EXPECT_EQ(parts.bounded_acceleration->shaping_viscous[0],
            std::max(0.3, find_device_profile("falcon")->viscous_bound.value));
}

// --- Broken scenes ------------------------------------------------------------------------------------

TEST(SceneError, NamesTheFileThatCannotBeRead) {
  const ScratchFolder folder;
  const auto error = [](const std::filesystem::path& file) -> std::string {
    try {
      read_scene(file);
    } catch (const SceneError& problem) {
      return problem.what();
    }
    return "no error";
  };
  const std::string missing = (folder.path() / "missing.toml").string();
  EXPECT_EQ(error(missing), "cannot read " + missing + ": No such file or directory");
  EXPECT_EQ(error(folder.path()), "cannot read " + folder.path().string() + ": Is a directory");
  EXPECT_EQ(error("/dev/zero"), "cannot read /dev/zero: it is a device, expected a regular file");
  const std::string long_one = (folder.path() / "long.toml").string();
  write(long_one, std::string(kMaxSceneBytes + 1, '#'));
  EXPECT_EQ(error(long_one), long_one + ": expected a scene of at most 16384 bytes, found more");
}

struct Broken {
  std::string more;  ///< after kMinimal
  std::string error;
};

void expect_errors(const std::vector<Broken>& scenes) {
  for (const auto& [more, error] : scenes) EXPECT_EQ(error_of_minimal_and(more), error) << more;
}

TEST(SceneError, NamesTheLineOfASyntaxError) {
  expect_errors({
      {"[loop\n", "s.toml:4: not TOML: Error while parsing table header: expected ']', saw '\\n'"},
      {"[loop]\nperiod_us = 1 2\n",
       "s.toml:5: not TOML: Error while parsing key-value pair: expected a comment or whitespace, saw '2'"},
      {"\nkind = \"simulated\"\n",
       "s.toml:5: not TOML: Error while parsing key-value pair: cannot redefine existing string 'kind'"},
  });
}

TEST(SceneError, OfTheSafetyLayerNamesTheLine) {
  expect_errors({
      {"[safety]\narm = \"now\"\n",
       "s.toml:5: safety.arm: expected one of \"by request\", \"at start\", \"by dead man\", found \"now\""},
      {"[safety.force_limit]\n", "s.toml:4: safety.force_limit.max_n: missing, expected a number above 0 N"},
      {"[safety.heat_limit]\npeak_n = 1\ncontinuous_n = 2\ntime_constant_ms = 1\n",
       "s.toml:4: safety: heat_limit.peak = 1: expected a finite number, not below continuous"},
      {"[safety.workspace]\nkind = \"ball\"\n",
       "s.toml:5: safety.workspace.kind: expected one of \"sphere\", \"box\", found \"ball\""},
      {"[safety]\narm = \"by dead man\"\n",
       "s.toml:4: safety: dead_man: expected to be listed, because the device is armed by its button"},
      {"[safety.dead_man]\nbutton = 0\n",
       "s.toml:5: safety.dead_man.button: expected button 0 of a hand with button_after_ms: a simulated device has no "
       "others"},
      {"[safety.thermal]\n",
       "s.toml:4: safety.thermal: unknown table; known here: arm, rest_speed_m_per_s, rest_force_n, patience_ms, "
       "force_limit, growth_limit, ramp_in, heat_limit, workspace, speed_trip, step_bound, command_watchdog, "
       "link_watchdog, dead_man"},
  });
}

TEST(SceneError, TellsTheUnitWhenOnlyThatIsWrong) {
  expect_errors({
      {"[loop]\nperiod_ms = 1\n", "s.toml:5: loop.period_ms: unknown key; period is given in µs: period_us"},
      {"[force]\nmax_force = 1\n", "s.toml:5: force.max_force: unknown key; max_force is given in N: max_force_n"},
      {"[device.effects]\nmass_g = 200\n",
       "s.toml:5: device.effects.mass_g: unknown key; mass is given in kg: mass_kg"},
  });
}

TEST(SceneError, NamesTheClosestKeyOrAllOfThem) {
  expect_errors({
      {"profil = \"falcon\"\n", "s.toml:4: device.profil: unknown key; did you mean profile?"},
      {"[limitre]\n", "s.toml:4: limitre: unknown table; did you mean limiter?"},
      {"[recording]\nfilename = \"x\"\n",
       "s.toml:5: recording.filename: unknown key; known here: path, rotate_mb, rotate_min, "
       "budget_mb, datagrams_kb_per_s"},
      {"[device.gravity]\n",
       "s.toml:4: device.gravity: unknown table; known here: kind, name, profile, start_position_mm, effects, hand"},
      {"[loop]\n" + std::string(10'000, 'x') + " = 1\n", "s.toml:5: loop." + std::string(10'000, 'x') +
                                                             ": unknown key; known here: period_us, longest_hold_us, "
                                                             "hold_memory_ms, hold_margin, hold_most, "
                                                             "max_speed_m_per_s, cpu"},
  });
}

TEST(SceneError, FindsAnUnknownKeyInEveryTable) {
  const std::vector<std::string> tables = {"device",  "device.effects", "device.hand", "device.hand.motion", "loop",
                                           "limiter", "force",          "network",     "recording"};
  const std::string good =
      "device.kind = \"simulated\"\ndevice.profile = \"falcon\"\ndevice.hand.stiffness_n_per_m = 1\n"
      "device.hand.motion = {kind = \"sine\", amplitude_mm = 1, frequency_hz = 1 EXTRA}\nrecording.path = \"x\"\n";
  const std::size_t extra = good.find(" EXTRA");
  for (const std::string& table : tables) {
    std::string text = good;
    const bool inlined = table == "device.hand.motion";
    text.replace(extra, 6, inlined ? ", zzzzzz = 1" : "");
    if (!inlined) text += table + ".zzzzzz = 1\n";
    const std::string line = inlined ? "4" : "6";
    EXPECT_TRUE(error_of(text).starts_with("s.toml:" + line + ": " + table + ".zzzzzz: unknown key; known here: "))
        << error_of(text);
  }
  EXPECT_EQ(
      error_of_minimal_and("[other]\nzzzzzz = 1\n"),
      "s.toml:4: other: unknown table; known here: device, loop, safety, limiter, admittance, force, channel, network, "
      "recording");
}

TEST(SceneError, TheKeysOfOneKindOfMotionAreUnknownToAnother) {
  EXPECT_EQ(error_of(std::string(kHand) + "kind = \"sine\"\namplitude_mm = 1\nfrequency_hz = 1\nramp_ms = 3\n"),
            "s.toml:13: device.hand.motion.ramp_ms: unknown key; known here: kind, amplitude_mm, frequency_hz, "
            "centre_mm, direction");
}

TEST(SceneError, ReportsTheFirstMistakeInTheFile) {
  EXPECT_EQ(error_of_minimal_and("[network]\nzzzzzz = 1\n[loop]\naaaaaa = 1\n"),
            "s.toml:5: network.zzzzzz: unknown key; known here: listen, keys, max_observers, controller_timeout_ms, "
            "observer_timeout_ms, adapt_state_rate, takeover");
  EXPECT_EQ(error_of_minimal_and("[loop]\nperiod_us = \"x\"\n[force]\nhold_us = 1\n"),
            "s.toml:5: loop.period_us: expected a number from 100 to 4000 µs, found \"x\"");
}

TEST(SceneError, AMisspeltRequiredKeyIsNotCalledMissing) {
  EXPECT_EQ(error_of("[device]\nkind = \"simulated\"\n[device.effects]\nmas_kg = 0.2\n"),
            "s.toml:4: device.effects.mas_kg: unknown key; did you mean mass_kg?");
}

TEST(SceneError, TellsWhatWasExpectedAndWhatWasFound) {
  const std::string mass = "s.toml:5: device.effects.mass_kg: expected a number above 0 kg, found ";
  const std::string friction =
      "s.toml:5: device.effects.coulomb_friction_n: expected a number above 0 N, or false for none, found ";
  expect_errors({
      {"[device.effects]\nmass_kg = \"0.2\"\n", mass + "\"0.2\""},
      {"[device.effects]\nmass_kg = true\n", mass + "true"},
      {"[device.effects]\nmass_kg = [1, 2]\n", mass + "an array of 2"},
      {"[device.effects]\nmass_kg = {}\n", mass + "a table"},
      {"[device.effects]\nmass_kg = 2026-01-01\n", mass + "a date or time"},
      {"[device.effects]\nmass_kg = -0.2\n", mass + "-0.2"},
      {"[device.effects]\nmass_kg = 0\n", mass + "0"},
      {"[device.effects]\nmass_kg = false\n", mass + "false"},
      {"[device.effects]\nmass_kg = nan\n", mass + "nan"},
      {"[device.effects]\nmass_kg = -inf\n", mass + "-inf"},
      {"[device.effects]\nmass_kg = inf\n",
       "s.toml:5: device.effects.mass_kg: expected a number of at most 1e+12 kg, found inf"},
      {"[device.effects]\ncoulomb_friction_n = 0\n", friction + "0"},
      {"[device.effects]\ncoulomb_friction_n = true\n", friction + "true"},
      {"start_position_mm = [1, 2]\n",
       "s.toml:4: device.start_position_mm: expected [x, y, z] in mm, found an array of 2"},
      {"start_position_mm = [1,\n 2, \"3\"]\n",
       "s.toml:5: device.start_position_mm: expected a number of mm, found \"3\""},
      {"start_position_mm = [1, nan, 2]\n", "s.toml:4: device.start_position_mm: expected a number of mm, found nan"},
      {"[recording]\npath = 3\n", "s.toml:5: recording.path: expected a path in quotes, found 3"},
      {"[recording]\npath = \"\"\n", "s.toml:5: recording.path: expected a path in quotes, found \"\""},
      {"[network]\nmax_observers = 2.5\n",
       "s.toml:5: network.max_observers: expected a whole number from 0 to 1000, found 2.5"},
      {"[network]\nmax_observers = -1\n",
       "s.toml:5: network.max_observers: expected a whole number from 0 to 1000, found -1"},
      {"[[loop]]\n", "s.toml:4: loop: expected a table, found an array of 1"},
      {"hand = 3\n", "s.toml:4: device.hand: expected a table, found 3"},
  });
}

TEST(SceneError, RefusesTimesThatNoLoopCanHave) {
  const std::string period = "s.toml:5: loop.period_us: expected a number from 100 to 4000 µs, found ";
  const std::string timeout = "s.toml:5: network.controller_timeout_ms: expected a number from 1 to 3600000 ms, found ";
  expect_errors({
      {"[loop]\nperiod_us = 0\n", period + "0"},
      {"[loop]\nperiod_us = -1000\n", period + "-1000"},
      {"[loop]\nperiod_us = 4000.001\n", period + "4000.001"},
      {"[loop]\nperiod_us = 99.999\n", period + "99.999"},
      {"[loop]\nperiod_us = inf\n", period + "inf"},
      {"[loop]\nlongest_hold_us = 1e-9\n", "s.toml:5: loop.longest_hold_us: expected a number above 0 µs, found 1e-09"},
      {"[force]\nhold_ms = 1e300\n", "s.toml:5: force.hold_ms: expected a number of at most 3600000 ms, found 1e+300"},
      {"[force]\nhold_ms = -1\n", "s.toml:5: force.hold_ms: expected a number of 0 ms or more, found -1"},
      {"[force]\ndecay_ms = 0\n", "s.toml:5: force.decay_ms: expected a number above 0 ms, found 0"},
      {"[network]\ncontroller_timeout_ms = 0.5\n", timeout + "0.5"},
      {"[network]\ncontroller_timeout_ms = 4e6\n", timeout + "4000000"},
  });
}

TEST(SceneError, RefusesForcesThatAreNone) {
  expect_errors({
      {"[force]\nmax_force_n = inf\n", "s.toml:5: force.max_force_n: expected a number of at most 1e+12 N, found inf"},
      {"[force]\nmax_force_n = 0\n", "s.toml:5: force.max_force_n: expected a number above 0 N, found 0"},
      {"[force]\nmax_slew_n_per_s = 0\n",
       "s.toml:5: force.max_slew_n_per_s: expected a number above 0 N/s, or inf, found 0"},
      {"[force]\nmax_slew_n_per_s = -inf\n",
       "s.toml:5: force.max_slew_n_per_s: expected a number above 0 N/s, or inf, found -inf"},
  });
}

TEST(SceneError, NamesTheKindsAndProfilesThatThereAre) {
  EXPECT_EQ(error_of("[device]\nkind = \"real\"\n"),
            "s.toml:2: device.kind: expected one of \"simulated\", \"falcon\", \"replay\", \"spacemouse\", "
            "\"woodenhaptics\", found \"real\"");
  EXPECT_EQ(error_of("[device]\nkind = \"simulated\"\nprofile = \"hawk\"\n"),
            "s.toml:3: device.profile: expected one of \"phantom-premium\", \"touch\", \"falcon\", found \"hawk\"");
  EXPECT_EQ(error_of(std::string(kHand) + "kind = \"cosine\"\n"),
            "s.toml:10: device.hand.motion.kind: expected one of \"sine\", \"ramp-hold\", \"minimum-jerk\", "
            "\"recorded\", found \"cosine\"");
  std::string names;
  for (const LawInfo& law : laws()) names += (names.empty() ? "\"" : ", \"") + std::string(law.name) + '"';
  EXPECT_EQ(error_of_minimal_and("[limiter]\nkind = \"off\"\n"),
            "s.toml:5: limiter.kind: expected one of " + names + ", found \"off\"");
}

TEST(SceneError, RefusesPartsThatCannotBe) {
  expect_errors({
      {"[limiter]\nkind = \"port-hamiltonian\"\n",
       "s.toml:4: limiter.environment_stiffness_n_per_m: missing, expected a number above 0 N/m"},
      {"[limiter]\nkind = \"aol\"\nclamp_n = 1\n",
       "s.toml:6: limiter.clamp_n: unknown key; known here: kind, coulomb_friction_n, viscous_friction_n_s_per_m"},
      {"[limiter]\nkind = \"aol\"\n[limiter.knee]\n",
       "s.toml:6: limiter.knee: unknown table; known here: kind, coulomb_friction_n, viscous_friction_n_s_per_m"},
      {"[limiter.knee]\nstart = 1\n", "s.toml:5: limiter.knee.start: expected a number from 0.01 to 0.99, found 1"},
      {"[limiter.latency_reserve]\nholds = 17\n",
       "s.toml:5: limiter.latency_reserve.holds: expected a whole number from 1 to 16, found 17"},
      {"[device.effects]\nencoder_step_um = false\n[limiter.robust_ledger]\n",
       "s.toml:6: limiter.robust_ledger.encoder_step_um: missing, expected a number of 0 µm or more, because the "
       "device has no encoder_step_um"},
      {"[limiter.latency_reserve]\n[limiter.bounded_acceleration]\n",
       "s.toml:4: limiter: bounded_acceleration is not proved for forces that are held late: not together with "
       "latency_reserve"},
  });
}

TEST(SceneError, NamesWhatIsMissing) {
  EXPECT_EQ(error_of(""),
            "s.toml: device.kind: missing, expected one of \"simulated\", \"falcon\", \"replay\", \"spacemouse\", "
            "\"woodenhaptics\"");
  EXPECT_EQ(error_of("\n[device]\n"),
            "s.toml:2: device.kind: missing, expected one of \"simulated\", \"falcon\", \"replay\", \"spacemouse\", "
            "\"woodenhaptics\"");
  EXPECT_EQ(error_of("[device]\nkind = \"simulated\"\n"),
            "s.toml:1: device.effects.mass_kg: missing, expected a number above 0 kg");
  expect_errors({
      {"[recording]\n", "s.toml:4: recording.path: missing, expected a path in quotes"},
      {"[device.hand]\n", "s.toml:4: device.hand.stiffness_n_per_m: missing, expected a number above 0 N/m"},
      {"[device.hand]\nstiffness_n_per_m = 1\n",
       "s.toml:4: device.hand.motion.kind: missing, expected one of \"sine\", \"ramp-hold\", \"minimum-jerk\", "
       "\"recorded\""},
  });
  EXPECT_EQ(error_of(std::string(kHand) + "kind = \"sine\"\nfrequency_hz = 1\n"),
            "s.toml:9: device.hand.motion.amplitude_mm: missing, expected a number of 0 mm or more");
}

TEST(SceneError, WithoutAProfileForceAndFrictionMustBeSaid) {
  EXPECT_EQ(error_of(std::string(kWithoutProfile)),
            "s.toml: force.max_force_n: missing, expected a number above 0 N, because the device has no max_force_n");
  EXPECT_EQ(error_of(std::string(kWithoutProfile) + "[force]\nmax_force_n = 5\n[limiter]\n"),
            "s.toml:7: limiter.coulomb_friction_n: missing, expected a number of 0 N or more, because there is no "
            "profile");
  EXPECT_EQ(error_of(std::string(kWithoutProfile) + "max_force_n = 5\n[limiter]\ncoulomb_friction_n = 0\n"),
            "s.toml:6: limiter.viscous_friction_n_s_per_m: missing, expected a number of 0 N·s/m or more, because "
            "there is no profile");
}

TEST(SceneError, OfTheEffectsOfADeviceNamesTheLineAndWhatWasExpected) {
  const std::string joints = "[device.effects.joint_friction]\n";
  expect_errors({
      {"[device.effects]\nsample_delay_ms = 0\n",
       "s.toml:5: device.effects.sample_delay_ms: expected a number above 0 and up to 100 ms, or false for none, found "
       "0"},
      {"[device.effects]\nforce_delay_ms = 101\n",
       "s.toml:5: device.effects.force_delay_ms: expected a number above 0 and up to 100 ms, or false for none, found "
       "101"},
      {"[device.effects]\nsample_delay_us = 5\n",
       "s.toml:5: device.effects.sample_delay_us: unknown key; sample_delay is given in ms: sample_delay_ms"},
      {joints + "coulomb_n_m = [1, 1, 1]\n",
       "s.toml:4: device.effects.joint_friction.kind: missing, expected one of \"falcon\", \"arm\""},
      {joints + "kind = \"delta\"\n",
       "s.toml:5: device.effects.joint_friction.kind: expected one of \"falcon\", \"arm\", found \"delta\""},
      {joints + "kind = \"arm\"\nforearm_mm = 140\n",
       "s.toml:4: device.effects.joint_friction.upper_arm_mm: missing, expected a number from 10 to 10000 mm"},
      {joints + "kind = \"falcon\"\nupper_arm_mm = 140\n",
       "s.toml:6: device.effects.joint_friction.upper_arm_mm: unknown key; known here: kind, coulomb_n_m, "
       "viscous_n_m_s, "
       "centre_mm"},
      {joints + "kind = \"falcon\"\ncoulomb_n_m = 0.1\n",
       "s.toml:6: device.effects.joint_friction.coulomb_n_m: expected [x, y, z] in N·m, found 0.1"},
      {joints + "kind = \"falcon\"\ncoulomb_n_m = [0.1, -0.1, 0.1]\n",
       "s.toml:4: device.effects.joint_friction: joint_friction.coulomb[1] = -0.1: expected a finite number of 0 or "
       "more"},
      {"[device.effects]\ncoulomb_friction_n = 0.3\n" + joints + "kind = \"falcon\"\ncoulomb_n_m = [1, 1, 1]\n",
       "s.toml:5: device.effects.coulomb_friction_n: expected false beside coulomb_n_m of "
       "[device.effects.joint_friction], found 0.3: this friction is in the joints or at the handle"},
      {"[device.effects.structural_mode]\nhandle_mass_kg = 0.1\n",
       "s.toml:4: device.effects.structural_mode.stiffness_n_per_m: missing, expected a number above 0 N/m"},
      {"[device.effects.structural_mode]\nhandle_mass_kg = 0.2\nstiffness_n_per_m = 1000\n",
       "s.toml:5: device.effects.structural_mode.handle_mass_kg: expected less than mass_kg, of which it is a part and "
       "which is 0.2 kg, found 0.2"},
      {"[device.hand]\nprofile = \"foot\"\n",
       "s.toml:5: device.hand.profile: expected one of \"fingertip\", \"stylus\", \"arm\", found \"foot\""},
  });
  EXPECT_EQ(
      error_of(std::string(kWithoutProfile) + joints + "kind = \"falcon\"\n[force]\nmax_force_n = 1\n"),
      "s.toml:5: device.effects.joint_friction: joint_friction.coulomb = 0: expected friction in one of the joints "
      "at least (left out when there is none)");
}

TEST(SceneError, RefusesTimesThatContradictEachOther) {
  expect_errors({
      {"[loop]\nlongest_hold_us = 999\n",
       "s.toml:5: loop.longest_hold_us: expected the period of 1000 µs or more, found 999"},
      {"[force]\nsafe_stop_ms = 10\n", "s.toml:5: force.safe_stop_ms: expected hold_ms of 20 ms or more, found 10"},
      {"[force]\nhold_ms = 300\n", "s.toml:5: force.safe_stop_ms: expected hold_ms of 300 ms or more, found 250"},
  });
}

TEST(SceneError, ABoundAboveTheTrueFrictionVoidsTheProof) {
  const std::string why = ", because a higher bound voids the limiter's proof, found ";
  expect_errors({
      {"[limiter]\ncoulomb_friction_n = 0.41\n",
       "s.toml:5: limiter.coulomb_friction_n: expected at most 0.4 N, the true friction of the simulated device" + why +
           "0.41"},
      {"[limiter]\nviscous_friction_n_s_per_m = 1.01\n",
       "s.toml:5: limiter.viscous_friction_n_s_per_m: expected at most 1 N·s/m, the true friction of the simulated "
       "device" +
           why + "1.01"},
      {"[device.effects]\ncoulomb_friction_n = 0.1\n",
       "s.toml:5: limiter.coulomb_friction_n: expected at most 0.1 N, the true friction of the simulated device" + why +
           "0.3 (the profile's)"},
      {"[device.effects]\nviscous_friction_n_s_per_m = false\n",
       "s.toml:5: limiter.viscous_friction_n_s_per_m: expected at most 0 N·s/m, the true friction of the simulated "
       "device" +
           why + "0.5 (the profile's)"},
  });
  const std::string per_axis = error_of_minimal_and("[limiter]\nkind = \"aol-per-axis\"\ncoulomb_friction_n = 0.3\n");
  EXPECT_TRUE(per_axis.starts_with("s.toml:6: limiter.coulomb_friction_n: expected at most 0.2309")) << per_axis;
  EXPECT_NE(per_axis.find("(an axis by itself has 1/√3 of it)"), std::string::npos) << per_axis;
}

TEST(SceneError, WithoutKeysItListensOnThisMachineOnly) {
  for (const std::string text : {"0.0.0.0:47100", "192.168.1.20:47100", "[::]:47100"}) {
    EXPECT_EQ(error_of_minimal_and("[network]\nlisten = \"" + text + "\"\n"),
              "s.toml:5: network.listen: expected a loopback address like \"127.0.0.1:47100\" or \"[::1]:47100\", or a "
              "folder of keys besides: without keys anyone on the network could command forces");
    const Scene scene = parse(std::string(kMinimal) + "[network]\nlisten = \"" + text + "\"\nkeys = \"keys\"\n", "lab");
    EXPECT_EQ(to_string(scene.network.listen), text);
    EXPECT_EQ(scene.network.keys, std::filesystem::path("lab/keys"));
  }
  for (const std::string text : {"127.0.0.1", "tendon.example:1", "[::1]:99999"}) {
    EXPECT_EQ(error_of_minimal_and("[network]\nlisten = \"" + text + "\"\n"),
              "s.toml:5: network.listen: expected an address like \"127.0.0.1:47100\" or \"[::1]:47100\", found \"" +
                  text + "\"");
  }
}

TEST(SceneError, PassesOnWhatIsWrongWithARecordedMotion) {
  const ScratchFolder folder;
  const std::string csv = (folder.path() / "hand.csv").string();
  const std::string scene = std::string(kHand) + "kind = \"recorded\"\nfile = \"hand.csv\"\nposition_column = \"x\"\n";
  const std::string where = "s.toml:11: device.hand.motion.file: cannot read ";
  EXPECT_EQ(error_of(scene, folder.path()), where + csv + ": No such file or directory");
  ASSERT_EQ(mkfifo(csv.c_str(), 0600), 0);
  EXPECT_EQ(error_of(scene, folder.path()), where + csv + ": it is a named pipe, expected a regular file");
  std::filesystem::remove(csv);
  write(csv, "t_s,y\n0,0\n1,1\n");
  EXPECT_EQ(error_of(scene, folder.path()),
            "s.toml:11: device.hand.motion.file: " + csv + ":1: expected a column 'x', found 't_s,y'");
  write(csv, "t_s,x\n0,0\n1,nan\n");
  EXPECT_EQ(error_of(scene, folder.path()), "s.toml:11: device.hand.motion.file: " + csv +
                                                ":3: expected a finite number in column 1 (from 0), found 'nan'");
  EXPECT_EQ(error_of(scene + "time_column = -1\n", folder.path()),
            "s.toml:13: device.hand.motion.time_column: expected a column's name in quotes or its number, from 0, "
            "found -1");
}

TEST(SceneError, WhatOnlyAConstructorRefusesHasTheLineOfItsTable) {
  EXPECT_EQ(error_of(std::string(kHand) +
                     "kind = \"minimum-jerk\"\npoints_mm = [[0, 0, 0], [1, 0, 0]]\ndurations_ms = [1, 2]\n"),
            "s.toml:9: device.hand.motion: minimum_jerk.durations (their number) = 2: expected one fewer than points, "
            "one per leg");
  EXPECT_EQ(
      error_of(std::string(kHand) + "kind = \"sine\"\namplitude_mm = 1\nfrequency_hz = 1\ndirection = [0, 0, 0]\n"),
      "s.toml:9: device.hand.motion: sine.direction (its length) = 0: expected a vector that is not zero");
}

TEST(SceneError, OfAnElementInAListHasTheElementsLine) {
  EXPECT_EQ(
      error_of(std::string(kHand) + "kind = \"minimum-jerk\"\npoints_mm = [[0, 0, 0],\n[1, 0]]\ndurations_ms = [1]\n"),
      "s.toml:12: device.hand.motion.points_mm: expected [x, y, z] in mm, found an array of 2");
  EXPECT_EQ(error_of(std::string(kHand) +
                     "kind = \"minimum-jerk\"\npoints_mm = [[0, 0, 0], [1, 0, 0]]\ndurations_ms = [0]\n"),
            "s.toml:12: device.hand.motion.durations_ms: expected a number above 0 ms, found 0");
}

TEST(SceneError, SurvivesTheDeepestNestingThatFits) {
  std::string deep = "[a";
  while (deep.size() + 4 < kMaxSceneBytes) deep += ".a";
  EXPECT_EQ(
      error_of(deep + "]\n"),
      "s.toml:1: a: unknown table; known here: device, loop, safety, limiter, admittance, force, channel, network, "
      "recording");
  EXPECT_TRUE(error_of("a = " + std::string(16'000, '[')).starts_with("s.toml:1: not TOML: "));
}

// --- What ships ---------------------------------------------------------------------------------------

TEST(ShippedScenes, DemoIsAHandAtAWallWithTheLimiterOn) {
  const Scene scene = read_scene(std::filesystem::path(TENDON_SCENES) / "demo.toml");
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
  const Scene scene = read_scene(std::filesystem::path(TENDON_SCENES) / "admittance.toml");
  EXPECT_TRUE(scene.simulated().force_sensor);
  EXPECT_TRUE(scene.loop.control.admittance);
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

TEST(SceneError, OfAChannelHasItsLine) {
  EXPECT_EQ(error_of_minimal_and("[[channel]]\nname = \"a\"\n[[channel]]\nname = \"a\"\n"),
            "s.toml:7: channel[1].name: expected a name of its own, found \"a\" again");
  EXPECT_EQ(error_of_minimal_and("[[channel]]\nrule = \"sum\"\n"),
            "s.toml:4: channel[0].name: missing, expected a name of 1 to 24 letters, digits, - or _");
  EXPECT_EQ(error_of_minimal_and("[channel]\nname = \"a\"\n"),
            "s.toml:4: channel: expected 1 to 8 tables [[channel]], found a table");
  std::string nine;
  for (int i = 0; i < 9; ++i) nine += "[[channel]]\nname = \"c" + std::to_string(i) + "\"\n";
  EXPECT_EQ(error_of_minimal_and(nine), "s.toml:4: channel: expected 1 to 8 tables [[channel]], found an array of 9");
}

TEST(Scene, SeveralMakeOneServerWhoseNetworkIsTheFirstOnes) {
  const std::filesystem::path shipped(TENDON_SCENES);
  const auto scenes = read_scenes({shipped / "left.toml", shipped / "right.toml"});
  ASSERT_EQ(scenes.size(), 2U);
  EXPECT_EQ(scenes[0].name, "left");
  EXPECT_EQ(scenes[1].name, "right");
  EXPECT_EQ(scenes[1].loop.device, 1U);
  const auto error_of_both = [&](const std::filesystem::path& second) -> std::string {
    try {
      read_scenes({shipped / "left.toml", second});
    } catch (const SceneError& error) {
      return error.what();
    }
    return {};
  };
  EXPECT_TRUE(error_of_both(shipped / "left.toml").ends_with("expected a name of its own, found \"left\" again"));
  EXPECT_NE(error_of_both(shipped / "demo.toml").find("recording: expected in the first scene only"),
            std::string::npos);
}

TEST(ShippedScenes, TwoEnginesShareADevice) {
  const Scene scene = read_scene(std::filesystem::path(TENDON_SCENES) / "two-engines.toml");
  EXPECT_EQ(scene.loop.control.channels,
            (std::vector{ChannelRule::kSum, ChannelRule::kPriority, ChannelRule::kPriority}));
}

TEST(ShippedScenes, SafeListsEveryPartOfTheSafetyLayer) {
  const auto safety = read_scene(std::filesystem::path(TENDON_SCENES) / "safe.toml").safety;
  ASSERT_TRUE(safety);
  EXPECT_TRUE(safety->force_limit && safety->growth_limit && safety->ramp_in && safety->heat_limit &&
              safety->workspace && safety->speed_trip && safety->step_bound && safety->command_watchdog &&
              safety->link_watchdog && safety->dead_man);
}

TEST(ShippedScenes, MechanismHasWhatARealOneAdds) {
  const Scene scene = read_scene(std::filesystem::path(TENDON_SCENES) / "mechanism.toml");
  EXPECT_TRUE(scene.simulated().joint_friction && scene.simulated().structural_mode);
  EXPECT_EQ(scene.simulated().sample_delay, 1ms);
  EXPECT_EQ(scene.simulated().force_delay, 500us);
  EXPECT_EQ(scene.simulated().hand->mass, find_operator_profile("stylus")->mass.middle());
}

TEST(ShippedScenes, MinimalIsAcceptedAsItIs) {
  EXPECT_EQ(read_scene(std::filesystem::path(TENDON_SCENES) / "minimal.toml").simulated().name, "falcon");
}

TEST(ShippedScenes, RecordedHandFollowsTheRecordingBesideIt) {
  const ScratchFolder folder;
  std::filesystem::copy(std::filesystem::path(TENDON_SCENES) / "recorded-hand.toml", folder.path() / "scene.toml");
  write(folder.path() / "hand.csv", "t_s,master_pos_rad\n15,0\n16,0.5\n17,1\n");
  EXPECT_EQ(target(read_scene(folder.path() / "scene.toml"), 1).position, Vec3(0.0375, 0, 0));
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
          "      from one haptic step to the next.\n"
          "      a number from 100 to 4000 µs. Default: 1000.\n"))
      << text;
  for (const std::string_view key : {"[device]",
                                     "profile",
                                     "start_position_mm",
                                     "[device.effects]",
                                     "watchdog_ms",
                                     "[device.hand]",
                                     "[device.effects.joint_friction]",
                                     "upper_arm_mm",
                                     "coulomb_n_m",
                                     "[device.effects.structural_mode]",
                                     "sample_delay_ms",
                                     "one of \"fingertip\", \"stylus\", \"arm\"",
                                     "[device.hand.motion]",
                                     "kind = \"sine\"",
                                     "kind = \"ramp-hold\"",
                                     "kind = \"minimum-jerk\"",
                                     "kind = \"recorded\"",
                                     "position_column",
                                     "[limiter]",
                                     "[force]",
                                     "max_valid_for_ms",
                                     "[network]",
                                     "observer_timeout_ms",
                                     "[recording]"}) {
    EXPECT_TRUE(has(key)) << key;
  }
}

}  // namespace
}  // namespace tendon
