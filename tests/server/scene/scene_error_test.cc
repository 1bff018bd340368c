// SPDX-License-Identifier: Apache-2.0
#include "server/scene/scene.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/server/scene/scene_text.h"
#include "tests/server/scratch_folder.h"
#include "tests/support/refusal.h"

namespace tendon::scene_error_test {
namespace {

using testing::ScratchFolder;

std::string one_of_the_kinds() {
  std::string text = "expected one of ";
  for (const Driver* const driver : drivers()) {
    text += (driver == drivers().front() ? "\"" : ", \"") + std::string(driver->kind) + "\"";
  }
  return text;
}

TEST(SceneError, NamesTheFileThatCannotBeRead) {
  const ScratchFolder folder;
  const auto error = [](const std::filesystem::path& file) { return thrown_by<SceneError>([&] { read_scene(file); }); };
  const std::string missing = (folder.path() / "missing.toml").string();
  EXPECT_EQ(error(missing), "cannot read " + missing + ": No such file or directory");
  EXPECT_EQ(error(folder.path()), "cannot read " + folder.path().string() + ": Is a directory");
  EXPECT_EQ(error("/dev/zero"), "cannot read /dev/zero: it is a device, expected a regular file");
  const std::string long_one = (folder.path() / "long.toml").string();
  write(long_one, std::string(kMaxSceneBytes + 1, '#'));
  EXPECT_EQ(error(long_one), long_one + ": expected a scene of at most 16384 bytes, found more");
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

TEST(SceneError, ADecimalCommaIsNamed) {
  const std::string error = error_of_minimal_and("[device.effects]\nmass_kg = 0,05\n");
  EXPECT_TRUE(error.starts_with("s.toml:5: not TOML: ") && error.ends_with(" (a decimal point?)")) << error;
  expect_errors({
      {"[device.effects]\nmass_kg = \"0,05\"\n",
       "s.toml:5: device.effects.mass_kg: expected a number above 0 kg, found \"0,05\" (a decimal point?)"},
  });
  EXPECT_EQ(error_of("[device]\nkind = [1,2\n").find("decimal"), std::string::npos);
}

TEST(SceneError, AMotionThatNoHandleHasIsRefused) {
  const std::string hand(kHand);
  const auto refused = [](const std::string& line, const std::string& found) {
    return "s.toml:" + line +
           ": device.hand.motion: expected a motion of at most 3000 mm from end to end, which no handle exceeds, "
           "found " +
           found + " mm";
  };
  EXPECT_EQ(error_of(hand + "kind = \"sine\"\namplitude_mm = 15000\nfrequency_hz = 1\n"), refused("11", "30000"));
  EXPECT_EQ(error_of(hand + "kind = \"sine\"\namplitude_mm = 1500\nfrequency_hz = 1\n"), "no error");
  EXPECT_EQ(error_of(hand + "kind = \"ramp-hold\"\nfrom_mm = [0, 0, 0]\nto_mm = [0, -4000, 0]\nramp_ms = 1\n"),
            refused("12", "4000"));
  EXPECT_EQ(error_of(hand + "kind = \"minimum-jerk\"\npoints_mm = [[0, 0, 0], [1, 0, 3100]]\ndurations_ms = [1]\n"),
            refused("11", "3100"));
  const ScratchFolder folder;
  write(folder.path() / "hand.csv", "t_s,x_mm\n0,-10\n1,30\n");
  const std::string recorded = hand + "kind = \"recorded\"\nfile = \"hand.csv\"\nposition_column = \"x_mm\"\n";
  EXPECT_EQ(error_of(recorded, folder.path()), refused("11", "40000"));
  EXPECT_EQ(error_of(recorded + "scale_m = 0.001\n", folder.path()), "no error");
}

TEST(SceneError, AFrictionThatNoHandleHasIsRefusedOfARealDevice) {
  const auto falcon = [](const std::string& coulomb, const std::string& viscous) {
    return error_of("[device]\nkind = \"falcon\"\n[limiter]\ncoulomb_friction_n = " + coulomb +
                    "\nviscous_friction_n_s_per_m = " + viscous + "\n");
  };
  const std::string why = ", because no handle has more friction and a higher bound voids the limiter's proof, found ";
  const std::string question = ": were all columns in the units that tendon-identify expects (s, m, N)?";
  EXPECT_EQ(falcon("0.1", "476.3"),
            "s.toml:5: limiter.viscous_friction_n_s_per_m: expected at most 50 N·s/m" + why + "476.3" + question);
  EXPECT_EQ(falcon("100", "0.4"),
            "s.toml:4: limiter.coulomb_friction_n: expected at most 20 N" + why + "100" + question);
  EXPECT_EQ(falcon("0.1", "0.476"), "no error");
}

TEST(SceneError, OfACountSaysWhatMayBeCounted) {
  expect_errors({
      {"count = 0\n", "s.toml:4: device.count: expected a whole number from 1 to 1024, found 0"},
      {"count = 1025\n", "s.toml:4: device.count: expected a whole number from 1 to 1024, found 1025"},
      {"name = \"abcdefghijklmnopqrstuvw\"\ncount = 11\n",
       "s.toml:5: device.name: expected a name with which \"abcdefghijklmnopqrstuvw-10\" has at most 24 letters, found "
       "26"},
      {"count = 2\n[discovery]\nannounce = true\n",
       "s.toml:4: device.count: expected 1 with [discovery], which announces one device, found 2"},
      {"count = 1\n[discovery]\nannounce = true\n", "no error"},
      {"count = 1024\n", "no error"},
      {"substep_us = 5\n", "s.toml:4: device.substep_us: expected a number from 10 to 4000 µs, found 5"},
  });
  EXPECT_EQ(error_of("[device]\nkind = \"falcon\"\ncount = 2\n[limiter]\ncoulomb_friction_n = 0.1\n"
                     "viscous_friction_n_s_per_m = 0.1\n"),
            "s.toml:3: device.count: expected 1, because kind is \"falcon\" and only simulated devices can have a "
            "count, found 2");
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
       "s.toml:4: safety: dead_man: expected this table, because the device is armed by its button"},
      {"[safety.dead_man]\nbutton = 0\n",
       "s.toml:5: safety.dead_man.button: expected 0 with button_after_ms of [device.hand], or a button of "
       "[[device.hand.press]]: a simulated device has no other buttons"},
      {"[safety.thermal]\n",
       "s.toml:4: safety.thermal: unknown table; expected one of arm, rest_speed_m_per_s, rest_force_n, "
       "rest_torque_nm, patience_ms, force_limit, growth_limit, ramp_in, heat_limit, workspace, speed_trip, "
       "step_bound, command_watchdog, link_watchdog, dead_man, torque_limit, torque_growth_limit, turn_trip, "
       "grip_limit, grip_growth_limit"},
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
       "s.toml:5: recording.filename: unknown key; expected one of path, rotate_mb, rotate_min, budget_mb, keep, "
       "one_in, datagrams_kb_per_s"},
      {"[device.gravity]\n",
       "s.toml:4: device.gravity: unknown table; expected one of kind, name, count, axes, group, held_by, profile, "
       "substep_us, start_position_mm, effects, hand, environment, rotation, gripper"},
      {"[loop]\n" + std::string(10'000, 'x') + " = 1\n",
       "s.toml:5: loop." + std::string(10'000, 'x') +
           ": unknown key; expected one of period_us, longest_hold_us, hold_memory_ms, hold_margin, hold_most, "
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
    EXPECT_TRUE(error_of(text).starts_with("s.toml:" + line + ": " + table + ".zzzzzz: unknown key; expected one of "))
        << error_of(text);
  }
  EXPECT_EQ(error_of_minimal_and("[other]\nzzzzzz = 1\n"),
            "s.toml:4: other: unknown table; expected one of device, loop, safety, limiter, admittance, force, field, "
            "channel, teleoperation, network, discovery, recording");
}

TEST(SceneError, TheKeysOfOneKindOfMotionAreUnknownToAnother) {
  EXPECT_EQ(error_of(std::string(kHand) + "kind = \"sine\"\namplitude_mm = 1\nfrequency_hz = 1\nramp_ms = 3\n"),
            "s.toml:13: device.hand.motion.ramp_ms: unknown key; expected one of kind, amplitude_mm, frequency_hz, "
            "centre_mm, direction");
}

TEST(SceneError, ReportsTheFirstMistakeInTheFile) {
  EXPECT_EQ(error_of_minimal_and("[network]\nzzzzzz = 1\n[loop]\naaaaaa = 1\n"),
            "s.toml:5: network.zzzzzz: unknown key; expected one of listen, unix, keys, suites, max_observers, "
            "controller_timeout_ms, observer_timeout_ms, adapt_state_rate, takeover, busy, dscp, threads");
  EXPECT_EQ(error_of_minimal_and("[loop]\nperiod_us = \"x\"\n[force]\nhold_us = 1\n"),
            "s.toml:5: loop.period_us: expected a number from 100 to 4000 µs, found \"x\"");
}

TEST(SceneError, NamesTheValueThatWasMeant) {
  expect_errors({
      {"[safety]\narm = \"at strat\"\n",
       "s.toml:5: safety.arm: expected one of \"by request\", \"at start\", \"by dead man\", found \"at strat\"; did "
       "you mean at start?"},
  });
  EXPECT_EQ(error_of("[device]\nkind = \"simulated\"\nprofile = \"falcoon\"\n"),
            "s.toml:3: device.profile: expected one of \"phantom-premium\", \"touch\", \"falcon\", found \"falcoon\"; "
            "did you mean falcon?");
  EXPECT_TRUE(error_of_minimal_and("[limiter]\nkind = \"aoll+\"\n").ends_with("found \"aoll+\"; did you mean aol+?"));
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
      {"[discovery]\nannounce = true\nname = \"\"\n",
       "s.toml:6: discovery.name: expected a name of 1 to 63 bytes like \"falcon at bench 3\", found \"\""},
      {"[recording]\npath = 3\n", "s.toml:5: recording.path: expected a path in quotes, found 3"},
      {"[recording]\npath = \"\"\n", "s.toml:5: recording.path: expected a path in quotes, found \"\""},
      {"[network]\nmax_observers = 2.5\n",
       "s.toml:5: network.max_observers: expected a whole number from 0 to 1000, found 2.5"},
      {"[network]\nunix = \"" + std::string(108, 'x') + "\"\n",
       "s.toml:5: network.unix: expected a path of at most 107 bytes, found 108"},
      {"[network]\nthreads = 0\n", "s.toml:5: network.threads: expected a whole number from 1 to 64, found 0"},
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
            "s.toml:2: device.kind: " + one_of_the_kinds() + ", found \"real\"");
  EXPECT_EQ(error_of("[device]\nkind = \"simulated\"\nprofile = \"hawk\"\n"),
            "s.toml:3: device.profile: expected one of \"phantom-premium\", \"touch\", \"falcon\", found \"hawk\"");
  EXPECT_EQ(error_of(std::string(kHand) + "kind = \"cosine\"\n"),
            "s.toml:10: device.hand.motion.kind: expected one of \"sine\", \"ramp-hold\", \"minimum-jerk\", "
            "\"recorded\", found \"cosine\"; did you mean sine?");
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
       "s.toml:6: limiter.clamp_n: unknown key; expected one of kind, coulomb_friction_n, viscous_friction_n_s_per_m, "
       "preset, rotation, gripper"},
      {"[limiter]\nkind = \"aol\"\n[limiter.knee]\n",
       "s.toml:6: limiter.knee: unknown table; expected one of kind, coulomb_friction_n, viscous_friction_n_s_per_m, "
       "preset, rotation, gripper"},
      {"[limiter.knee]\nstart = 1\n", "s.toml:5: limiter.knee.start: expected a number from 0.01 to 0.99, found 1"},
      {"[limiter.latency_reserve]\nholds = 17\n",
       "s.toml:5: limiter.latency_reserve.holds: expected a whole number from 1 to 16, found 17"},
      {"[device.effects]\nencoder_step_um = false\n[limiter.robust_ledger]\n",
       "s.toml:6: limiter.robust_ledger.encoder_step_um: missing, expected a number of 0 µm or more, because the "
       "device has no encoder_step_um"},
      {"[limiter.latency_reserve]\n[limiter.bounded_acceleration]\n[limiter.shaping]\n",
       "s.toml:4: limiter: bounded_acceleration is not proved for forces that are held late, so it cannot be used with "
       "latency_reserve"},
  });
}

TEST(SceneError, NamesWhatIsMissing) {
  EXPECT_EQ(error_of(""), "s.toml: device.kind: missing, " + one_of_the_kinds());
  EXPECT_EQ(error_of("\n[device]\n"), "s.toml:2: device.kind: missing, " + one_of_the_kinds());
  EXPECT_EQ(error_of("[device]\nkind = \"simulated\"\n"),
            "s.toml:1: device.effects.mass_kg: missing, expected a number above 0 kg");
  expect_errors({
      {"[recording]\n", "s.toml:4: recording.path: missing, expected a path in quotes"},
      {"[discovery]\n", "s.toml:4: discovery.announce: missing, expected true or false"},
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
  EXPECT_EQ(
      error_of(std::string(kWithoutProfile) + "[force]\nmax_force_n = 5\n[limiter]\n"),
      "s.toml:7: limiter.coulomb_friction_n: missing, expected a number of 0 N or more, because there is no profile");
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
       "s.toml:6: device.effects.joint_friction.upper_arm_mm: unknown key; expected one of kind, coulomb_n_m, "
       "viscous_n_m_s, centre_mm"},
      {joints + "kind = \"falcon\"\ncoulomb_n_m = 0.1\n",
       "s.toml:6: device.effects.joint_friction.coulomb_n_m: expected [x, y, z] in N·m, found 0.1"},
      {joints + "kind = \"falcon\"\ncoulomb_n_m = [0.1, -0.1, 0.1]\n",
       "s.toml:4: device.effects.joint_friction: joint_friction.coulomb[1] = -0.1: expected a finite number of 0 or "
       "more"},
      {"[device.effects]\ncoulomb_friction_n = 0.3\n" + joints + "kind = \"falcon\"\ncoulomb_n_m = [1, 1, 1]\n",
       "s.toml:5: device.effects.coulomb_friction_n: expected false with coulomb_n_m of "
       "[device.effects.joint_friction], found 0.3: the friction is either in the joints or at the handle"},
      {"[device.effects.structural_mode]\nhandle_mass_kg = 0.1\n",
       "s.toml:4: device.effects.structural_mode.stiffness_n_per_m: missing, expected a number above 0 N/m"},
      {"[device.effects.structural_mode]\nhandle_mass_kg = 0.2\nstiffness_n_per_m = 1000\n",
       "s.toml:5: device.effects.structural_mode.handle_mass_kg: expected less than mass_kg, which is 0.2 kg, found "
       "0.2"},
      {"[device.hand]\nprofile = \"foot\"\n",
       "s.toml:5: device.hand.profile: expected one of \"fingertip\", \"stylus\", \"arm\", found \"foot\""},
  });
  EXPECT_EQ(error_of(std::string(kWithoutProfile) + joints + "kind = \"falcon\"\n[force]\nmax_force_n = 1\n"),
            "s.toml:5: device.effects.joint_friction: joint_friction.coulomb = 0: expected friction in at least one "
            "joint (omit joint_friction if there is none)");
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
           "0.3 (from the profile)"},
      {"[device.effects]\nviscous_friction_n_s_per_m = false\n",
       "s.toml:5: limiter.viscous_friction_n_s_per_m: expected at most 0 N·s/m, the true friction of the simulated "
       "device" +
           why + "0.5 (from the profile)"},
  });
  const std::string per_axis = error_of_minimal_and("[limiter]\nkind = \"aol-per-axis\"\ncoulomb_friction_n = 0.3\n");
  EXPECT_TRUE(per_axis.starts_with("s.toml:6: limiter.coulomb_friction_n: expected at most 0.2309")) << per_axis;
  EXPECT_NE(per_axis.find("(each axis has 1/√3 of it)"), std::string::npos) << per_axis;
}

TEST(SceneError, WithoutKeysItListensOnThisMachineOnly) {
  for (const std::string text : {"0.0.0.0:47100", "192.168.1.20:47100", "[::]:47100"}) {
    EXPECT_EQ(error_of_minimal_and("[network]\nlisten = \"" + text + "\"\n"),
              "s.toml:5: network.listen: expected a loopback address like \"127.0.0.1:47100\" or \"[::1]:47100\", or a "
              "folder of keys: without keys, anyone on the network could command forces");
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

TEST(SceneError, OneInOfARecordingThatKeepsAllIsRefused) {
  expect_errors({{"[recording]\npath = \"x.mcap\"\none_in = 10\n",
                  "s.toml:6: recording.one_in: expected keep = \"faults\" with one_in, found keep = \"all\", which "
                  "keeps every file"}});
}

TEST(SceneError, OfTheSuitesSaysWhichThereAreAndWhatTheyNeed) {
  const std::string known = "[…], each one of \"aes-256-gcm\", \"chacha20-poly1305\"";
  EXPECT_EQ(error_of_minimal_and("[network]\nkeys = \"keys\"\nsuites = [\"plain\"]\n"),
            "s.toml:6: network.suites: expected one of \"aes-256-gcm\", \"chacha20-poly1305\", found \"plain\"");
  EXPECT_EQ(error_of_minimal_and("[network]\nkeys = \"keys\"\nsuites = \"aes-256-gcm\"\n"),
            "s.toml:6: network.suites: expected " + known + ", found \"aes-256-gcm\"");
  EXPECT_EQ(error_of_minimal_and("[network]\nkeys = \"keys\"\nsuites = []\n"),
            "s.toml:6: network.suites: expected some of aes-256-gcm, chacha20-poly1305, found an empty list");
  EXPECT_EQ(error_of_minimal_and("[network]\nsuites = [\"aes-256-gcm\"]\n"),
            "s.toml:5: network.suites: expected no suites without keys, because the sessions are not encrypted");
  const Scene scene = parse(std::string(kMinimal) + "[network]\nkeys = \"keys\"\n", "lab");
  EXPECT_EQ(scene.network.suites, all_suites());
}

TEST(SceneError, PassesOnWhatIsWrongWithARecordedMotion) {
  const ScratchFolder folder;
  const std::string csv = (folder.path() / "hand.csv").string();
  const std::string scene = std::string(kHand) + "kind = \"recorded\"\nfile = \"hand.csv\"\nposition_column = \"x\"\n";
  const std::string where = "s.toml:11: device.hand.motion.file: cannot read ";
  EXPECT_EQ(error_of(scene, folder.path()), where + csv + ": No such file or directory");
  write(csv, "t_s,y\n0,0\n1,1\n");
  EXPECT_EQ(error_of(scene, folder.path()), "s.toml:11: device.hand.motion.file: " + csv +
                                                ":1: expected a header line with a column 'x', found 't_s,y'");
  EXPECT_EQ(
      error_of(scene + "time_column = -1\n", folder.path()),
      "s.toml:13: device.hand.motion.time_column: expected a column's name in quotes or its number, from 0, found -1");
}

TEST(SceneError, WhatOnlyAConstructorRefusesHasTheLineOfItsTable) {
  EXPECT_EQ(error_of(std::string(kHand) +
                     "kind = \"minimum-jerk\"\npoints_mm = [[0, 0, 0], [1, 0, 0]]\ndurations_ms = [1, 2]\n"),
            "s.toml:9: device.hand.motion: minimum_jerk.durations (their number) = 2: expected one fewer than points");
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
      "s.toml:1: a: unknown table; expected one of device, loop, safety, limiter, admittance, force, field, channel, "
      "teleoperation, network, discovery, recording");
  EXPECT_TRUE(error_of("a = " + std::string(16'000, '[')).starts_with("s.toml:1: not TOML: "));
}

TEST(SceneError, OfAChannelHasItsLine) {
  EXPECT_EQ(error_of_minimal_and("[[channel]]\nname = \"a\"\n[[channel]]\nname = \"a\"\n"),
            "s.toml:7: channel[1].name: expected a unique name, found \"a\" again");
  EXPECT_EQ(error_of_minimal_and("[[channel]]\nrule = \"sum\"\n"),
            "s.toml:4: channel[0].name: missing, expected a name of 1 to 24 letters, digits, - or _");
  EXPECT_EQ(error_of_minimal_and("[channel]\nname = \"a\"\n"),
            "s.toml:4: channel: expected 1 to 8 tables [[channel]], found a table");
  std::string nine;
  for (int i = 0; i < 9; ++i) nine += "[[channel]]\nname = \"c" + std::to_string(i) + "\"\n";
  EXPECT_EQ(error_of_minimal_and(nine), "s.toml:4: channel: expected 1 to 8 tables [[channel]], found an array of 9");
}

}  // namespace
}  // namespace tendon::scene_error_test
