// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/base/rotation.h"
#include "server/scene/scene.h"
#include "tests/server/scene/scene_text.h"

namespace tendon::scene_teleoperation_test {
namespace {

using namespace std::chrono_literals;

/// `more` is appended to the table [teleoperation], and `what` to the table [teleoperation.coupling].
std::string coupled(const std::string& role, const std::string& what, const std::string& more = {}) {
  return "[teleoperation]\nrole = \"" + role + "\"\n" + more +
         "[teleoperation.coupling]\nstiffness_n_per_m = 400\ndamping_n_s_per_m = 4\n" + what;
}
const std::string kTank = "[teleoperation.energy_tank]\n";
const std::string kLeader = coupled("leader", kTank);

const std::string kRate = "[teleoperation.rate]\ndead_zone_mm = 3\ngain_per_s = 4\nmax_speed_mm_per_s = 50\n";

TEST(SceneTeleoperation, WithoutItsTableThereIsNone) {
  const Scene scene = minimal_and("");
  EXPECT_FALSE(scene.teleoperation || scene.loop.control.coupling);
  EXPECT_FALSE(scene.loop.control.limiter.shared_account);
}

TEST(SceneTeleoperation, HasWhatItListsAndTheRestIsSimple) {
  const Scene scene = minimal_and(kLeader);
  ASSERT_TRUE(scene.teleoperation && scene.loop.control.coupling);
  EXPECT_FALSE(scene.teleoperation->dial || scene.teleoperation->key);
  const Coupling::Config& coupling = *scene.loop.control.coupling;
  EXPECT_EQ(coupling.role, PortRole::kLeader);
  EXPECT_EQ(coupling.method, CouplingMethod::kPositionPosition);
  EXPECT_EQ(coupling.map.position_scale, 1);
  EXPECT_EQ(coupling.map.axes, (std::array{true, true, true}));
  EXPECT_EQ(coupling.spring.stiffness, 400);
  EXPECT_EQ(coupling.spring.own_damping, 4);
  EXPECT_EQ(coupling.spring.period, 1ms);
  EXPECT_EQ(coupling.spring.max_force, scene.loop.control.max_force);
  EXPECT_TRUE(coupling.spring.adapt_to_delay && coupling.tank);
  EXPECT_FALSE(coupling.clutch || coupling.engage_by || coupling.holds_place);
  EXPECT_TRUE(scene.loop.control.limiter.shared_account);
}

TEST(SceneTeleoperation, KnowsTheCountsOfItsDevice) {
  const auto step = [](const std::string& more) {
    return minimal_and(kLeader + more).loop.control.coupling->encoder_step;
  };
  EXPECT_EQ(step("[device.effects]\nencoder_step_um = 100\n"), 1e-4);
  EXPECT_EQ(step("[device.effects]\nencoder_step_um = 100\n[limiter.robust_ledger]\nencoder_step_um = 50\n"), 5e-5);
  EXPECT_EQ(step("[device.effects]\nencoder_step_um = false\n"), 0);
}

const Coupling::Config& coupling(S scene) { return *scene.loop.control.coupling; }

TEST(SceneTeleoperation, TakesEveryKeyInItsUnit) {
  const std::vector<Setting> settings = {
      {"teleoperation.role=follower", 1, [](S s) -> double { return coupling(s).role == PortRole::kFollower; }},
      {"teleoperation.method=position-force", 1,
       [](S s) -> double { return coupling(s).method == CouplingMethod::kPositionForce; }},
      {"teleoperation.dial=[::1]:47999", 1,
       [](S s) -> double { return to_string(*s.teleoperation->dial) == "[::1]:47999"; }},
      {"teleoperation.device=right", 1, [](S s) -> double { return s.teleoperation->device == "right"; }},
      {"teleoperation.channel=robot", 1, [](S s) -> double { return s.teleoperation->channel == "robot"; }},
      {"teleoperation.on_loss=hold", 1, [](S s) -> double { return coupling(s).holds_place; }},
      {"teleoperation.map.position_scale=0.5", 0.5, [](S s) { return coupling(s).map.position_scale; }},
      {"teleoperation.map.force_scale=2", 2, [](S s) { return coupling(s).map.force_scale; }},
      {"teleoperation.map.rotation_deg=[0, 0, 90]", 1,
       [](S s) { return rotated(coupling(s).map.rotation, Vec3(1, 0, 0)).y(); }},
      {"teleoperation.map.axes=xz", 1,
       [](S s) -> double {
         return coupling(s).map.axes == std::array{true, false, true};
       }},
      {"teleoperation.coupling.mutual_damping_n_s_per_m=1", 1, [](S s) { return coupling(s).spring.damping; }},
      {"teleoperation.coupling.adapt_to_delay=false", 0,
       [](S s) -> double { return coupling(s).spring.adapt_to_delay; }},
      {"teleoperation.coupling.max_force_n=2", 2, [](S s) { return coupling(s).spring.max_force; }},
      {"teleoperation.energy_tank.max_account_mj=50", 0.05, [](S s) { return coupling(s).tank->max_account; }},
      {"teleoperation.energy_tank.max_power_w=1", 1, [](S s) { return coupling(s).tank->max_power; }},
      {"teleoperation.engage.ramp_ms=100", 0.1, [](S s) { return seconds(coupling(s).ramp); }}};
  expect_made(std::string(kMinimal) + kLeader, settings);
}

TEST(SceneTeleoperation, OfALeaderTheButtons) {
  const Scene scene = minimal_and(kLeader + R"([teleoperation.clutch]
button = 1
toggle = true
[teleoperation.engage]
by = "button"
button = 0
)");
  EXPECT_EQ(coupling(scene).clutch->bit, 1U);
  EXPECT_TRUE(coupling(scene).clutch->toggles);
  EXPECT_EQ(coupling(scene).engage_by, 0U);
}

TEST(SceneTeleoperation, NamesEachMethodAndWavesShareAccountsWithoutATank) {
  const auto by = [](const std::string& method, const std::string& more = "") {
    return coupled("leader", more, "method = \"" + method + "\"\n");
  };
  for (const CouplingMethod method : kCouplingMethods) {
    const std::string more = method == CouplingMethod::kRate ? kRate : "";
    const Scene scene = minimal_and(by(std::string(to_string(method)), kTank + more));
    EXPECT_EQ(scene.loop.control.coupling->method, method) << to_string(method);
  }
  EXPECT_TRUE(minimal_and(by("waves")).loop.control.limiter.shared_account);
  EXPECT_FALSE(minimal_and(by("surface")).loop.control.limiter.shared_account);
  EXPECT_FALSE(minimal_and("[limiter]\nkind = \"none\"\n" + by("waves")).loop.control.limiter.shared_account);
  EXPECT_EQ(error_of_minimal_and("[limiter]\nkind = \"tdpa\"\n" + by("waves")),
            "s.toml:5: teleoperation.method: expected the limiter \"aol+\", \"aol\" or \"aol-box\": other limiters "
            "have no energy account that ports can share");
  EXPECT_EQ(error_of_minimal_and("[teleoperation]\nrole = \"leader\"\nmethod = \"waves\"\n[teleoperation.coupling]\n"
                                 "stiffness_n_per_m = 400\nadapt_to_delay = false\n"),
            "s.toml:6: teleoperation.coupling.damping_n_s_per_m: expected a number above 0: it is the wave impedance");
}

TEST(SceneTeleoperation, AnAbsoluteMapAlignsAndHasNoClutch) {
  const Scene scene = minimal_and(kLeader +
                                  "[teleoperation.map]\nabsolute = true\n[teleoperation.engage]\n"
                                  "within_mm = 8\nalign_energy_mj = 15\n");
  EXPECT_EQ(scene.loop.control.coupling->absolute->within, 0.008);
  EXPECT_EQ(scene.loop.control.coupling->absolute->energy, 0.015);
  EXPECT_FALSE(minimal_and(kLeader).loop.control.coupling->absolute);
  EXPECT_EQ(error_of_minimal_and(kLeader + "[teleoperation.engage]\nwithin_mm = 8\n"),
            "s.toml:11: teleoperation.engage.within_mm: expected no within_mm, except for a leader with map.absolute: "
            "only this leader is aligned");
  EXPECT_EQ(error_of_minimal_and(kLeader + "[teleoperation.engage]\nalign_energy_mj = 8\n"),
            "s.toml:11: teleoperation.engage.align_energy_mj: expected 0, except for a leader with map.absolute and an "
            "energy tank: the energy is paid into its account");
  EXPECT_EQ(
      error_of_minimal_and(kLeader + "[teleoperation.map]\nabsolute = true\n[teleoperation.clutch]\nbutton = 1\n"),
      "s.toml:12: teleoperation.clutch: expected no clutch with map.absolute: a clutch changes the offset, which is "
      "always 0");
  EXPECT_EQ(error_of_minimal_and(coupled("leader", "[teleoperation.map]\nabsolute = true\n", "method = \"waves\"\n")),
            "s.toml:11: teleoperation.map.absolute: expected the method \"position-position\", \"position-force\", "
            "\"surface\" or \"set-position\" with map.absolute: the other methods have no absolute positions");
}

TEST(SceneTeleoperation, TakesWhatPassivityRateAndSlowLinksNeed) {
  const auto by = [](const std::string& role, const std::string& method, const std::string& more) {
    return coupled(role, more, "method = \"" + method + "\"\nmax_delay_ms = 800\n" + kTank);
  };
  const Scene passivity = minimal_and(by("follower", "passivity", "drift_rate_per_s = 50\n"));
  EXPECT_EQ(passivity.loop.control.coupling->drift_rate, 50);
  EXPECT_EQ(passivity.loop.control.coupling->max_delay, 800ms);
  EXPECT_EQ(minimal_and(by("leader", "passivity", "")).loop.control.coupling->drift_rate, 100);
  EXPECT_EQ(minimal_and(kLeader).loop.control.coupling->max_delay, Duration::max());
  const Scene rate = minimal_and(by("leader", "rate", kRate + "centring_n_per_m = 200\n"));
  const Coupling::Config& coupling = *rate.loop.control.coupling;
  EXPECT_EQ(*coupling.rate, (RateControl{.dead_zone = 0.003, .gain = 4, .max_speed = 0.05}));
  EXPECT_EQ(coupling.centring, 200);
}

TEST(SceneTeleoperation, SaysWhichMethodHasNoUseForAKey) {
  const auto refusal = [](const std::string& method, const std::string& more, const char* role = "leader") {
    return error_of_minimal_and("[teleoperation]\nrole = \"" + std::string(role) + "\"\nmethod = \"" + method +
                                "\"\n[teleoperation.coupling]\nstiffness_n_per_m = 400\n" + more);
  };
  const std::string tank = "damping_n_s_per_m = 4\n[teleoperation.energy_tank]\n";
  for (const char* const method : {"passivity", "set-position"}) {
    EXPECT_EQ(
        refusal(method, "damping_n_s_per_m = 4\n"),
        "s.toml:4: teleoperation.energy_tank: missing, expected this table: with its own limiter, a follower can only "
        "move with energy from the leader");
  }
  EXPECT_EQ(refusal("rate", tank),
            "s.toml:6: teleoperation.rate: missing, expected this table with method \"rate\": it sets the speed of the "
            "follower");
  EXPECT_EQ(refusal("waves", tank + kRate),
            "s.toml:11: teleoperation.rate: expected none with method \"waves\": only the method \"rate\" uses it");
  EXPECT_EQ(refusal("rate", tank + kRate + "centring_n_per_m = 200\n", "follower"),
            "s.toml:15: teleoperation.rate.centring_n_per_m: expected 0 or no value for a follower: only the leader's "
            "handle is centred");
  EXPECT_EQ(refusal("rate", tank + "[teleoperation.rate]\ndead_zone_mm = 3\ngain_per_s = 4\n"),
            "s.toml:11: teleoperation.rate.max_speed_mm_per_s: missing, expected a number above 0 mm/s");
  EXPECT_EQ(refusal("surface", "drift_rate_per_s = 5\n" + tank),
            "s.toml:9: teleoperation.coupling.drift_rate_per_s: expected none with method \"surface\": only "
            "\"passivity\" corrects drift");
  EXPECT_EQ(refusal("set-position", "mutual_damping_n_s_per_m = 1\n" + tank),
            "s.toml:9: teleoperation.coupling.mutual_damping_n_s_per_m: expected 0 or no value with method "
            "\"set-position\": it does not use the velocity of the other end");
  EXPECT_EQ(refusal("passivity", "[teleoperation.energy_tank]\n"),
            "s.toml:6: teleoperation.coupling.damping_n_s_per_m: expected a number above 0: nothing else absorbs "
            "energy, so no motion could start");
}

TEST(SceneTeleoperation, TheFormerNameOfATableIsAnsweredWithItsNewOne) {
  EXPECT_EQ(error_of_minimal_and(kLeader + "[teleoperation.purse]\n"),
            "s.toml:10: teleoperation.purse: renamed to teleoperation.energy_tank");
}

TEST(SceneTeleoperation, SaysWhatCannotBeTogether) {
  const auto refusal = [](const std::string& more) { return error_of_minimal_and(more); };
  EXPECT_EQ(
      refusal(coupled("leader", "")),
      "s.toml:4: teleoperation.energy_tank: missing, expected this table: with its own limiter, a follower can only "
      "move with energy from the leader");
  EXPECT_EQ(
      refusal("[limiter]\nkind = \"tdpa\"\n" + kLeader),
      "s.toml:5: teleoperation.energy_tank: expected the limiter \"aol+\", \"aol\" or \"aol-box\": other limiters have "
      "no energy account that ports can share");
  EXPECT_EQ(
      refusal("[limiter]\nkind = \"aol+\"\n[limiter.latency_reserve]\nholds = 2\n" + kLeader),
      "s.toml:6: limiter.latency_reserve: expected none with teleoperation.energy_tank: the reserve is not proved for "
      "an account that is shared by several ports");
  EXPECT_EQ(
      refusal(kLeader + "[teleoperation.map]\naxes = \"zx\"\n"),
      "s.toml:11: teleoperation.map.axes: expected one or more of the letters x, y, z, in this order, found \"zx\"");
  EXPECT_EQ(refusal(kLeader + "[teleoperation.engage]\nby = \"button\"\n"),
            "s.toml:11: teleoperation.engage.by: expected \"button\" together with button, or \"request\" without");
  EXPECT_EQ(refusal(coupled("leader", kTank, "dial = \"192.0.2.7:47100\"\n")),
            "s.toml:6: teleoperation.dial: expected a loopback address, or a key: connections over a network must be "
            "encrypted");
  EXPECT_EQ(refusal(coupled("leader", kTank, "key = \"a.key\"\n")),
            "s.toml:6: teleoperation.key: expected no key without dial, because a server that is dialled uses the keys "
            "of [network]");
  EXPECT_EQ(refusal(coupled("leader", kTank, "on_loss = \"hold\"\n")),
            "s.toml:6: teleoperation.on_loss: expected \"release\" for a leader, which is held by a hand");
  EXPECT_EQ(refusal(coupled("follower", kTank + "[teleoperation.clutch]\nbutton = 1\n")),
            "s.toml:10: teleoperation.clutch: expected no clutch for a follower: only the leader has a clutch");
}

/// This adds ten lines to kMinimal, so the rest begins at line 14.
const std::string kTwoLeaders =
    "[[channel]]\nname = \"trainer\"\n[[channel]]\nname = \"trainee\"\n" + coupled("follower", kTank);

std::string leader(const std::string& channel, const std::string& share) {
  return "[[teleoperation.leader]]\nchannel = \"" + channel + "\"\nshare = " + share + "\n";
}

TEST(SceneTeleoperation, AFollowerNamesItsLeadersByTheirChannels) {
  const Scene scene = minimal_and(kTwoLeaders + leader("trainee", "0.3") + leader("trainer", "0.7"));
  const auto& leaders = scene.loop.control.leaders;
  ASSERT_EQ(leaders.size(), 2U);
  EXPECT_EQ(leaders[0].channel, 1U);
  EXPECT_EQ(leaders[0].share, 0.3);
  EXPECT_EQ(leaders[1].channel, 0U);
  EXPECT_EQ(leaders[1].share, 0.7);
  EXPECT_TRUE(minimal_and(kTwoLeaders).loop.control.leaders.empty());
  EXPECT_NO_THROW(minimal_and(kTwoLeaders + leader("trainer", "0.9999999995") + leader("trainee", "0")));
}

TEST(SceneTeleoperation, SaysWhyLeadersCannotBeSo) {
  const auto refusal = [](const std::string& more) { return error_of_minimal_and(more); };
  const std::string two = leader("trainer", "0.7") + leader("trainee", "0.3");
  EXPECT_EQ(refusal(kTwoLeaders + leader("trainer", "0.7") + leader("trainee", "0.25")),
            "s.toml:14: teleoperation.leader: expected shares with the sum 1, found 0.95");
  EXPECT_EQ(refusal(kTwoLeaders + leader("trainer", "1")),
            "s.toml:14: teleoperation.leader: expected 2 to 4 tables, or no table for a single leader on any channel");
  EXPECT_EQ(refusal(kTwoLeaders + leader("trainer", "0.7") + leader("robot", "0.3")),
            "s.toml:18: teleoperation.leader[1].channel: expected the name of a [[channel]], found \"robot\"");
  EXPECT_EQ(refusal(kTwoLeaders + leader("trainer", "0.7") + leader("trainer", "0.3")),
            "s.toml:18: teleoperation.leader[1].channel: expected a different channel for each leader, found "
            "\"trainer\" again");
  EXPECT_EQ(refusal(kTwoLeaders + leader("trainer", "1.2") + leader("trainee", "-0.2")),
            "s.toml:16: teleoperation.leader[0].share: expected a number from 0 to 1, found 1.2");
  EXPECT_EQ(refusal(kTwoLeaders + two + two + leader("trainer", "0")),
            "s.toml:14: teleoperation.leader: expected 1 to 4 tables [[teleoperation.leader]], found an array of 5");
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = kTwoLeaders + two;
    text.replace(text.find(from), from.size(), to);
    return refusal(text);
  };
  EXPECT_EQ(
      with("role = \"follower\"", "role = \"leader\""),
      "s.toml:14: teleoperation.leader: expected no such table for a leader, because the follower lists all leaders");
  EXPECT_EQ(with("role = \"follower\"\n", "role = \"follower\"\ndial = \"127.0.0.1:47999\"\n"),
            "s.toml:10: teleoperation.dial: expected no dial with [[teleoperation.leader]]: several leaders dial their "
            "follower");
  for (const std::string method : {"waves", "surface", "passivity", "set-position", "rate"}) {
    EXPECT_EQ(with("role = \"follower\"\n", "role = \"follower\"\nmethod = \"" + method + "\"\n"),
              "s.toml:10: teleoperation.method: expected \"position-position\" or \"position-force\" with several "
              "leaders, found \"" +
                  method + "\"");
  }
}

const std::string kRotation = "[device.rotation]\ninertia_kg_m2 = 2e-5\nviscous_friction_nm_s_per_rad = 1e-3\n";
const std::string kGripper =
    "[device.gripper]\nopen_deg = 30\narm_mm_per_rad = 60\nmass_kg = 0.02\nviscous_friction_n_s_per_m = 1\n";
const std::string kTurnBounds = "[limiter.rotation]\ncoulomb_friction_nm = 0\nviscous_friction_nm_s_per_rad = 9e-4\n";
const std::string kGripBounds = "[limiter.gripper]\ncoulomb_friction_n = 0\nviscous_friction_n_s_per_m = 0.9\n";
const std::string kMotors = "max_torque_nm = 0.2\n";
const std::string kGripMotor = "max_force_n = 3\n";

const std::string kTurn = "[teleoperation.turn]\nstiffness_nm_per_rad = 0.5\ndamping_nm_s_per_rad = 0.005\n";
const std::string kGrip = "[teleoperation.grip]\nstiffness_n_per_m = 300\ndamping_n_s_per_m = 3\nspeed_mm_per_s = 40\n";

TEST(SceneTeleoperation, CouplesOrientationsAndGrippersThatItLists) {
  const Scene scene = minimal_and(kRotation + kMotors + kGripper + kGripMotor + kTurnBounds + kGripBounds +
                                  coupled("follower", kTurn + kGrip + kTank));
  const Coupling::Config& coupling = *scene.loop.control.coupling;
  ASSERT_TRUE(coupling.turn && coupling.grip);
  EXPECT_EQ(coupling.turn->stiffness, 0.5);
  EXPECT_EQ(coupling.turn->damping, 0.005);
  EXPECT_EQ(coupling.turn->max_torque, 0.2);
  EXPECT_EQ(coupling.grip->stiffness, 300);
  EXPECT_EQ(coupling.grip->damping, 3);
  EXPECT_DOUBLE_EQ(coupling.grip->speed, 0.04);
  EXPECT_DOUBLE_EQ(coupling.grip->arm, 0.06);
  EXPECT_EQ(coupling.grip->max_force, 3);
  const Scene points = minimal_and(kRotation + kMotors + kTurnBounds + kLeader);
  EXPECT_TRUE(points.loop.control.rotation && points.loop.control.coupling);
  EXPECT_FALSE(points.loop.control.coupling->turn) << "a position alone, on a device with six motors";
  EXPECT_TRUE(minimal_and(kRotation + coupled("leader", kTurn + kTank)).loop.control.coupling->turn)
      << "a leader that measures its orientation and feels no torque";
}

TEST(SceneTeleoperation, RefusesHandlesThatCannotBeCoupled) {
  EXPECT_EQ(error_of_minimal_and(coupled("leader", kTurn + kTank)),
            "s.toml:9: teleoperation.turn: expected a device with [device.rotation]: this device does not measure the "
            "orientation of its handle");
  EXPECT_EQ(error_of_minimal_and(kRotation + coupled("follower", kTurn + kTank)),
            "s.toml:12: teleoperation.turn: expected a device with max_torque_nm in [device.rotation]: a follower "
            "requires motors that turn its handle");
  EXPECT_EQ(error_of_minimal_and(coupled("follower", kGrip + kTank)),
            "s.toml:9: teleoperation.grip: expected a device with [device.gripper]: this device does not measure the "
            "opening of a gripper");
  EXPECT_EQ(error_of_minimal_and(kGripper + coupled("leader", kGrip + kTank)),
            "s.toml:14: teleoperation.grip: expected a device with max_force_n in [device.gripper]: a gripper without "
            "a motor cannot follow and cannot be felt");
  EXPECT_EQ(
      error_of_minimal_and(kGripper + kGripMotor + kGripBounds + coupled("follower", kGrip, "method = \"surface\"\n")),
      "s.toml:19: teleoperation.energy_tank: missing, expected this table: with its own limiter, a gripper can only "
      "move with energy from the leader");
  EXPECT_EQ(
      error_of_minimal_and(kRotation + kMotors + kTurnBounds + coupled("follower", kTurn, "method = \"waves\"\n")),
      "s.toml:17: teleoperation.energy_tank: missing, expected this table: waves do not transmit rotations, so the "
      "energy that turns the follower must come from the leader");
  EXPECT_EQ(error_of_minimal_and(kRotation + coupled("leader",
                                                     "[teleoperation.turn]\n"
                                                     "stiffness_nm_per_rad = 0.5\n" +
                                                         kTank)),
            "s.toml:7: teleoperation: turn.damping = 0: expected a number above 0 N·m·s/rad, because adapt_to_delay "
            "limits the stiffness to 2 B divided by the round-trip time");
}

}  // namespace
}  // namespace tendon::scene_teleoperation_test
