// SPDX-License-Identifier: Apache-2.0
//
// [teleoperation]: what a coupling is, and what is refused.
#include <gtest/gtest.h>

#include <string>

#include "core/base/rotation.h"
#include "server/scene/scene.h"
#include "tests/server/scene/scene_text.h"

namespace tendon {
namespace {

using namespace std::chrono_literals;

const std::string kLeader =
    "[teleoperation]\n"
    "role = \"leader\"\n"
    "[teleoperation.coupling]\n"
    "stiffness_n_per_m = 400\n"
    "damping_n_s_per_m = 4\n"
    "[teleoperation.purse]\n";

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
  EXPECT_TRUE(coupling.spring.adapt_to_delay && coupling.purse);
  EXPECT_FALSE(coupling.clutch || coupling.engage_by || coupling.holds_place);
  EXPECT_TRUE(scene.loop.control.limiter.shared_account);
}

TEST(SceneTeleoperation, TakesEveryKeyInItsUnit) {
  const Scene scene = minimal_and(R"([teleoperation]
role = "follower"
method = "position-force"
dial = "[::1]:47999"
device = "right"
channel = "robot"
on_loss = "hold"
[teleoperation.map]
position_scale = 0.5
force_scale = 2
rotation_deg = [0, 0, 90]
axes = "xz"
[teleoperation.coupling]
stiffness_n_per_m = 300
damping_n_s_per_m = 3
mutual_damping_n_s_per_m = 1
adapt_to_delay = false
max_force_n = 2
[teleoperation.purse]
max_account_mj = 50
max_power_w = 1
[teleoperation.engage]
ramp_ms = 100
)");
  EXPECT_EQ(to_string(*scene.teleoperation->dial), "[::1]:47999");
  EXPECT_EQ(scene.teleoperation->device, "right");
  EXPECT_EQ(scene.teleoperation->channel, "robot");
  const Coupling::Config& coupling = *scene.loop.control.coupling;
  EXPECT_EQ(coupling.method, CouplingMethod::kPositionForce);
  EXPECT_TRUE(coupling.holds_place);
  EXPECT_EQ(coupling.map.position_scale, 0.5);
  EXPECT_EQ(coupling.map.force_scale, 2);
  EXPECT_LT((rotated(coupling.map.rotation, Vec3(1, 0, 0)) - Vec3(0, 1, 0)).norm(), 1e-15);
  EXPECT_EQ(coupling.map.axes, (std::array{true, false, true}));
  EXPECT_EQ(coupling.spring.damping, 1);
  EXPECT_FALSE(coupling.spring.adapt_to_delay);
  EXPECT_EQ(coupling.spring.max_force, 2);
  EXPECT_EQ(coupling.purse->max_account, 0.05);
  EXPECT_EQ(coupling.purse->max_power, 1);
  EXPECT_EQ(coupling.ramp, 100ms);
}

TEST(SceneTeleoperation, OfALeaderTheButtons) {
  const Scene scene = minimal_and(kLeader + R"([teleoperation.clutch]
button = 1
toggle = true
[teleoperation.engage]
by = "button"
button = 0
)");
  const Coupling::Config& coupling = *scene.loop.control.coupling;
  EXPECT_EQ(coupling.clutch->bit, 1U);
  EXPECT_TRUE(coupling.clutch->toggles);
  EXPECT_EQ(coupling.engage_by, 0U);
}

TEST(SceneTeleoperation, NamesEachMethodAndWavesShareAccountsWithoutAPurse) {
  const auto by = [](const std::string& method, const std::string& more = "") {
    return "[teleoperation]\nrole = \"leader\"\nmethod = \"" + method +
           "\"\n[teleoperation.coupling]\nstiffness_n_per_m = 400\ndamping_n_s_per_m = 4\n" + more;
  };
  for (const CouplingMethod method : kCouplingMethods) {
    const Scene scene = minimal_and(by(std::string(to_string(method)), "[teleoperation.purse]\n"));
    EXPECT_EQ(scene.loop.control.coupling->method, method) << to_string(method);
  }
  EXPECT_TRUE(minimal_and(by("waves")).loop.control.limiter.shared_account);
  EXPECT_FALSE(minimal_and(by("surface")).loop.control.limiter.shared_account);
  EXPECT_FALSE(minimal_and("[limiter]\nkind = \"none\"\n" + by("waves")).loop.control.limiter.shared_account);
  EXPECT_EQ(error_of_minimal_and("[limiter]\nkind = \"tdpa\"\n" + by("waves")),
            "s.toml:5: teleoperation.method: expected the limiter \"aol+\", \"aol\" or \"aol-box\": the others have no "
            "account that ports can share");
  EXPECT_EQ(error_of_minimal_and("[teleoperation]\nrole = \"leader\"\nmethod = \"waves\"\n[teleoperation.coupling]\n"
                                 "stiffness_n_per_m = 400\nadapt_to_delay = false\n"),
            "s.toml:6: teleoperation.coupling.damping_n_s_per_m: expected a number above 0: it is the impedance of the "
            "waves");
}

TEST(SceneTeleoperation, SaysWhatCannotBeTogether) {
  const auto refusal = [](const std::string& more) { return error_of_minimal_and(more); };
  EXPECT_EQ(
      refusal("[teleoperation]\nrole = \"leader\"\n[teleoperation.coupling]\nstiffness_n_per_m = 400\n"
              "damping_n_s_per_m = 4\n"),
      "s.toml:4: teleoperation.purse: missing, expected this table: behind a limiter of its own a follower cannot "
      "move unless the leader pays");
  EXPECT_EQ(refusal("[limiter]\nkind = \"tdpa\"\n" + kLeader),
            "s.toml:5: teleoperation.purse: expected the limiter \"aol+\", \"aol\" or \"aol-box\": the others have no "
            "account that ports can share");
  EXPECT_EQ(
      refusal("[limiter]\nkind = \"aol+\"\n[limiter.latency_reserve]\nholds = 2\n" + kLeader),
      "s.toml:6: limiter.latency_reserve: expected none with teleoperation.purse: the reserve is not proved for an "
      "account that ports share");
  EXPECT_EQ(
      refusal(kLeader + "[teleoperation.map]\naxes = \"zx\"\n"),
      "s.toml:11: teleoperation.map.axes: expected one or more of the letters x, y, z, in this order, found \"zx\"");
  EXPECT_EQ(refusal(kLeader + "[teleoperation.engage]\nby = \"button\"\n"),
            "s.toml:11: teleoperation.engage.by: expected \"button\" together with button, or \"request\" without");
  EXPECT_EQ(refusal("[teleoperation]\nrole = \"leader\"\ndial = \"192.0.2.7:47100\"\n[teleoperation.coupling]\n"
                    "stiffness_n_per_m = 400\ndamping_n_s_per_m = 4\n[teleoperation.purse]\n"),
            "s.toml:6: teleoperation.dial: expected an address of this machine, or a key besides: nothing crosses a "
            "network in the clear");
  EXPECT_EQ(refusal("[teleoperation]\nrole = \"leader\"\nkey = \"a.key\"\n[teleoperation.coupling]\n"
                    "stiffness_n_per_m = 400\ndamping_n_s_per_m = 4\n[teleoperation.purse]\n"),
            "s.toml:6: teleoperation.key: expected none without dial: who is dialled lets in by [network] keys");
  EXPECT_EQ(refusal("[teleoperation]\nrole = \"leader\"\non_loss = \"hold\"\n[teleoperation.coupling]\n"
                    "stiffness_n_per_m = 400\ndamping_n_s_per_m = 4\n[teleoperation.purse]\n"),
            "s.toml:6: teleoperation.on_loss: expected \"release\": a hand holds the leader");
  EXPECT_EQ(refusal("[teleoperation]\nrole = \"follower\"\n[teleoperation.coupling]\nstiffness_n_per_m = 400\n"
                    "damping_n_s_per_m = 4\n[teleoperation.purse]\n[teleoperation.clutch]\nbutton = 1\n"),
            "s.toml:10: teleoperation.clutch: expected none: the leader clutches");
}

const std::string kRotation = "[device.rotation]\ninertia_kg_m2 = 2e-5\nviscous_friction_nm_s_per_rad = 1e-3\n";
const std::string kGripper =
    "[device.gripper]\nopen_deg = 30\narm_mm_per_rad = 60\nmass_kg = 0.02\nviscous_friction_n_s_per_m = 1\n";
const std::string kTurnBounds = "[limiter.rotation]\ncoulomb_friction_nm = 0\nviscous_friction_nm_s_per_rad = 9e-4\n";
const std::string kGripBounds = "[limiter.gripper]\ncoulomb_friction_n = 0\nviscous_friction_n_s_per_m = 0.9\n";
const std::string kMotors = "max_torque_nm = 0.2\n";
const std::string kGripMotor = "max_force_n = 3\n";

std::string coupled_handle(const std::string& role, const std::string& what, const std::string& more = {}) {
  return "[teleoperation]\nrole = \"" + role + "\"\n" + more +
         "[teleoperation.coupling]\nstiffness_n_per_m = 400\ndamping_n_s_per_m = 4\n" + what;
}
const std::string kTurn = "[teleoperation.turn]\nstiffness_nm_per_rad = 0.5\ndamping_nm_s_per_rad = 0.005\n";
const std::string kGrip = "[teleoperation.grip]\nstiffness_n_per_m = 300\ndamping_n_s_per_m = 3\nspeed_mm_per_s = 40\n";
const std::string kPurse = "[teleoperation.purse]\n";

TEST(SceneTeleoperation, CouplesOrientationsAndGrippersThatItLists) {
  const Scene scene = minimal_and(kRotation + kMotors + kGripper + kGripMotor + kTurnBounds + kGripBounds +
                                  coupled_handle("follower", kTurn + kGrip + kPurse));
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
  EXPECT_TRUE(minimal_and(kRotation + coupled_handle("leader", kTurn + kPurse)).loop.control.coupling->turn)
      << "a leader that measures its orientation and feels no torque";
}

TEST(SceneTeleoperation, RefusesHandlesThatCannotBeCoupled) {
  EXPECT_EQ(error_of_minimal_and(coupled_handle("leader", kTurn + kPurse)),
            "s.toml:9: teleoperation.turn: expected a device with [device.rotation]: this one does not measure how its "
            "handle is turned");
  EXPECT_EQ(error_of_minimal_and(kRotation + coupled_handle("follower", kTurn + kPurse)),
            "s.toml:12: teleoperation.turn: expected a device with max_torque_nm in [device.rotation]: without motors "
            "that turn its handle a follower cannot turn as the leader does");
  EXPECT_EQ(
      error_of_minimal_and(coupled_handle("follower", kGrip + kPurse)),
      "s.toml:9: teleoperation.grip: expected a device with [device.gripper]: this one does not measure how far a "
      "gripper is open");
  EXPECT_EQ(
      error_of_minimal_and(kGripper + coupled_handle("leader", kGrip + kPurse)),
      "s.toml:14: teleoperation.grip: expected a device with max_force_n in [device.gripper]: a gripper without a "
      "motor neither follows nor is felt");
  EXPECT_EQ(
      error_of_minimal_and(kGripper + kGripMotor + kGripBounds +
                           coupled_handle("follower", kGrip, "method = \"surface\"\n")),
      "s.toml:19: teleoperation.purse: missing, expected this table: behind a limiter of its own a gripper cannot "
      "move unless the leader pays");
  EXPECT_EQ(error_of_minimal_and(kRotation + kMotors + kTurnBounds +
                                 coupled_handle("follower", kTurn, "method = \"waves\"\n")),
            "s.toml:17: teleoperation.purse: missing, expected this table: waves carry no turns, so what turns the "
            "follower has to be paid");
  EXPECT_EQ(error_of_minimal_and(kRotation + coupled_handle("leader",
                                                            "[teleoperation.turn]\n"
                                                            "stiffness_nm_per_rad = 0.5\n" +
                                                                kPurse)),
            "s.toml:7: teleoperation: turn.damping = 0: expected a number above 0 N·m·s/rad, because adapt_to_delay "
            "lowers the stiffness to 2 B over the round trip");
}

}  // namespace
}  // namespace tendon
