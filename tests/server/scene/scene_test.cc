// SPDX-License-Identifier: Apache-2.0
#include "server/scene/scene.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <utility>
#include <variant>

#include "devices/simulated/profiles.h"
#include "tests/server/scene/scene_text.h"
#include "tests/server/scratch_folder.h"

namespace tendon::scene_test {
namespace {

using namespace std::chrono_literals;
using testing::ScratchFolder;

// A recording contains the scene with its command-line settings.
TEST(Scene, WithSettingsItsTextIsTheSceneThatTheyMake) {
  const Scene as_written = shipped("demo.toml");
  const Friction friction = as_written.loop.control.limiter.friction;
  const auto settings = limiter_settings("none", as_written.loop.control);
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
  HapticController::Config control;
  control.limiter.friction = {.coulomb = odd / 100, .viscous = odd / 70};
  const Scene changed = parse_scene(kMinimal, "s.toml", {}, limiter_settings("aol", control));
  const Scene again = parse_scene(changed.text, "s.toml", {});
  EXPECT_EQ(again.loop.control.limiter.friction.coulomb, odd / 100);
  EXPECT_EQ(again.loop.control.limiter.friction.viscous, odd / 70);
}

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
  EXPECT_EQ(scene.network.unix_path, std::nullopt);
  EXPECT_EQ(scene.network.max_observers, NetworkLoop::Config{}.max_observers);
  EXPECT_EQ(scene.network.controller_timeout, NetworkLoop::Config{}.controller_timeout);
  EXPECT_EQ(scene.network.observer_timeout, NetworkLoop::Config{}.observer_timeout);
  EXPECT_FALSE(scene.network.busy);
  EXPECT_EQ(scene.network.dscp, std::nullopt);
  EXPECT_FALSE(scene.recording);
  EXPECT_FALSE(scene.discovery);
  EXPECT_EQ(scene.text, kMinimal);
}

TEST(Scene, ReadsEveryKey) {
  const std::string head = "[device]\nkind = \"simulated\"\nprofile = \"phantom-premium\"\n";
  const std::vector<Setting> settings = {
      {"device.start_position_mm=[1, -2.5, 3]", 1,
       [](S s) -> double { return s.simulated().start_position == Vec3(0.001, -0.0025, 0.003); }},
      {"device.effects.mass_kg=0.1", 0.1, [](S s) { return s.simulated().mass; }},
      {"device.effects.viscous_friction_n_s_per_m=0.2", 0.2, [](S s) { return *s.simulated().viscous_friction; }},
      {"device.effects.coulomb_friction_n=0.3", 0.3, [](S s) { return *s.simulated().coulomb_friction; }},
      {"device.effects.encoder_step_um=43", 43e-6, [](S s) { return *s.simulated().encoder_step; }},
      {"device.effects.max_force_n=9", 9, [](S s) { return *s.simulated().max_force; }},
      {"device.effects.amplifier_bandwidth_hz=250", 250, [](S s) { return *s.simulated().amplifier_bandwidth; }},
      {"device.effects.watchdog_ms=5.5", 5.5e-3, [](S s) { return seconds(*s.simulated().watchdog); }},
      {"device.hand.stiffness_n_per_m=300", 300, [](S s) { return s.simulated().hand->stiffness; }},
      {"device.hand.damping_n_s_per_m=3", 3, [](S s) { return s.simulated().hand->damping; }},
      {"device.hand.mass_kg=0.05", 0.05, [](S s) { return s.simulated().hand->mass; }},
      {"device.hand.motion.kind=sine", 0, [](S s) { return target(s, 0).position.x(); }},
      {"device.hand.motion.amplitude_mm=15", 0.015, [](S s) { return target(s, 0.5).position.z(); }},
      {"device.hand.motion.frequency_hz=0.5", -0.015, [](S s) { return target(s, 1.5).position.z(); }},
      {"device.hand.motion.centre_mm=[0, 10, 0]", 0.01, [](S s) { return target(s, 0.5).position.y(); }},
      {"device.hand.motion.direction=[0, 0, 2]", 0, [](S s) { return target(s, 0.5).position.x(); }},
      {"loop.period_us=500", 500e-6, [](S s) { return seconds(s.loop.period); }},
      {"loop.longest_hold_us=1500", 1500e-6, [](S s) { return seconds(s.loop.control.limiter.longest_hold); }},
      {"loop.hold_memory_ms=5000", 5, [](S s) { return seconds(s.loop.control.limiter.follow_holds->memory); }},
      {"loop.hold_margin=0.5", 0.5, [](S s) { return s.loop.control.limiter.follow_holds->margin; }},
      {"loop.hold_most=3", 3, [](S s) { return s.loop.control.limiter.follow_holds->most; }},
      {"loop.max_speed_m_per_s=10", 10, [](S s) { return *s.loop.control.max_speed; }},
      {"limiter.kind=aol-per-axis", 1, [](S s) -> double { return s.loop.control.limiter.law == Law::kAolPerAxis; }},
      {"limiter.coulomb_friction_n=0.1", 0.1, [](S s) { return s.loop.control.limiter.friction.coulomb; }},
      {"limiter.viscous_friction_n_s_per_m=0.15", 0.15, [](S s) { return s.loop.control.limiter.friction.viscous; }},
      {"force.max_force_n=5", 5, [](S s) { return s.loop.control.max_force; }},
      {"force.max_slew_n_per_s=inf", std::numeric_limits<double>::infinity(),
       [](S s) { return s.loop.control.max_slew; }},
      {"force.hold_ms=10", 10e-3, [](S s) { return seconds(s.loop.control.hold.hold); }},
      {"force.decay_ms=20", 20e-3, [](S s) { return seconds(s.loop.control.hold.decay); }},
      {"force.safe_stop_ms=30", 30e-3, [](S s) { return seconds(s.loop.control.hold.safe_stop); }},
      {"force.ramp_in_ms=40", 40e-3, [](S s) { return seconds(s.loop.control.hold.ramp_in); }},
      {"force.max_valid_for_ms=50", 50e-3, [](S s) { return seconds(s.loop.control.hold.max_valid_for); }},
      {"network.listen=[::1]:5000", 1, [](S s) -> double { return to_string(s.network.listen) == "[::1]:5000"; }},
      {"network.keys=keys", 1, [](S s) -> double { return s.network.keys == "keys"; }},
      {"network.suites=[\"chacha20-poly1305\"]", 1,
       [](S s) -> double { return s.network.suites == Suites{Suite::kNoise}; }},
      {"network.unix=/run/tendon.sock", 1, [](S s) -> double { return s.network.unix_path == "/run/tendon.sock"; }},
      {"network.max_observers=3", 3, [](S s) -> double { return static_cast<double>(s.network.max_observers); }},
      {"network.controller_timeout_ms=1500", 1.5, [](S s) { return seconds(s.network.controller_timeout); }},
      {"network.observer_timeout_ms=2500", 2.5, [](S s) { return seconds(s.network.observer_timeout); }},
      {"network.adapt_state_rate=true", 1, [](S s) -> double { return s.network.adapt_state_rate; }},
      {"network.busy=true", 1, [](S s) -> double { return s.network.busy; }},
      {"network.dscp=ef", 1, [](S s) -> double { return s.network.dscp == Dscp::kExpedited; }},
      {"discovery.announce=true", 1, [](S s) -> double { return s.discovery->announce; }},
      {"discovery.name=\"falcon at bench 3\"", 1,
       [](S s) -> double { return s.discovery->name == "falcon at bench 3"; }},
      {"recording.path=\"run.mcap\"", 1, [](S s) -> double { return s.recording->path == "run.mcap"; }},
      {"recording.rotate_mb=50", 50e6, [](S s) { return s.recording->rotate_bytes; }},
      {"recording.rotate_min=90", 5400, [](S s) { return s.recording->rotate_after; }},
      {"recording.budget_mb=200.5", 200.5e6, [](S s) { return *s.recording->budget_bytes; }},
      {"recording.keep=faults", 1, [](S s) -> double { return s.recording->keep == Keep::kFaults; }},
      {"recording.one_in=1000", 1000, [](S s) -> double { return static_cast<double>(*s.recording->one_in); }},
      {"recording.datagrams_kb_per_s=100", 100e3, [](S s) { return s.recording->datagram_bytes_per_s; }},
  };
  expect_made(head, settings);
  EXPECT_EQ(parse(head + "[device.effects]\nwatchdog_ms = 5.5\n").loop.control.watchdog, 5500us);
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
  write(folder.path() / "hand.csv", "0,0\n1,1\n2,2\n");
  const Scene scene = parse(std::string(kHand) +
                                "kind = \"recorded\"\nfile = \"hand.csv\"\ntime_column = 0\nposition_column = 1\n"
                                "at_end = \"repeat\"\n",
                            folder.path());
  EXPECT_EQ(target(scene, 3).position, Vec3(1, 0, 0));
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
  const std::string hand =
      "[device.hand]\nstiffness_n_per_m = 300\nbutton_after_ms = 500\n"
      "[device.hand.motion]\nkind = \"sine\"\namplitude_mm = 0\nfrequency_hz = 0\n";
  const std::vector<Setting> settings = {
      {"safety.arm=\"by dead man\"", 1,
       [](S s) -> double { return s.safety->arming.by == SafeDevice::Arming::By::kDeadMan; }},
      {"safety.rest_speed_m_per_s=0.03", 0.03, [](S s) { return s.safety->arming.rest_speed; }},
      {"safety.rest_force_n=0.2", 0.2, [](S s) { return s.safety->arming.rest_force; }},
      {"safety.patience_ms=400", 0.4, [](S s) { return seconds(s.safety->arming.patience); }},
      {"safety.force_limit.max_n=7", 7, [](S s) { return s.safety->force_limit->max; }},
      {"safety.growth_limit.rate_n_per_s=500", 500, [](S s) { return s.safety->growth_limit->rate; }},
      {"safety.ramp_in.time_ms=200", 0.2, [](S s) { return seconds(s.safety->ramp_in->time); }},
      {"safety.heat_limit.peak_n=8", 8, [](S s) { return s.safety->heat_limit->peak; }},
      {"safety.heat_limit.continuous_n=2", 2, [](S s) { return s.safety->heat_limit->continuous; }},
      {"safety.heat_limit.time_constant_ms=30000", 30,
       [](S s) { return seconds(s.safety->heat_limit->time_constant); }},
      {"safety.workspace.kind=box", 1,
       [](S s) -> double { return std::holds_alternative<Workspace::Box>(s.safety->workspace->shape); }},
      {"safety.workspace.half_mm=[50, 40, 30]", 1,
       [](S s) -> double {
         return std::get<Workspace::Box>(s.safety->workspace->shape).half == Vec3(0.05, 0.04, 0.03);
       }},
      {"safety.workspace.centre_mm=[0, 0, 125]", 1,
       [](S s) -> double { return s.safety->workspace->centre == Vec3(0, 0, 0.125); }},
      {"safety.workspace.margin_mm=10", 0.01, [](S s) { return s.safety->workspace->margin; }},
      {"safety.speed_trip.max_m_per_s=1.5", 1.5, [](S s) { return s.safety->speed_trip->max; }},
      {"safety.step_bound.max_speed_m_per_s=10", 10, [](S s) { return s.safety->step_bound->max_speed; }},
      {"safety.command_watchdog.timeout_ms=30", 30e-3,
       [](S s) { return seconds(s.safety->command_watchdog->timeout); }},
      {"safety.command_watchdog.ramp_ms=10", 10e-3, [](S s) { return seconds(s.safety->command_watchdog->ramp); }},
      {"safety.link_watchdog.timeout_ms=20", 20e-3, [](S s) { return seconds(s.safety->link_watchdog->timeout); }},
      {"safety.dead_man.button=0", 0, [](S s) -> double { return s.safety->dead_man->button; }},
  };
  expect_made(std::string(kMinimal) + hand, settings);
  EXPECT_EQ(minimal_and("[safety.link_watchdog]\ntimeout_ms = 20\n").safety->link_watchdog->ramp,
            Watchdog::Config{}.ramp);
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
  // The identified friction can be equal to the friction of the device, but it must not be larger.
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
  // 0.4 N·m at the longest lever of the turntable (0.14 m plus the reach) is more at 0.14 m. The other two joints,
  // whose levers are constant, set the minimum at the center.
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

}  // namespace
}  // namespace tendon::scene_test
