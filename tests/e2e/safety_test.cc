// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <csignal>
#include <string>

#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::safety_test {
namespace {

using testing::ScratchFolder;

bool felt(double force) { return force < -0.5; }  // N along x, away from the wall

std::string resting_hand(const std::string& safety) {
  return R"([device]
kind = "simulated"
profile = "falcon"
[device.hand]
stiffness_n_per_m = 300
damping_n_s_per_m = 3
mass_kg = 0.05
button_after_ms = 300
[device.hand.motion]
kind = "minimum-jerk"
points_mm = [[-10, 0, 0], [-10, 0, 0], [15, 0, 0]]
durations_ms = [1500, 300]
back_and_forth = false
)" + safety;
}

TEST(Safety, EverySignalToEndLeavesTheDeviceWithoutForce) {
  for (const int signal : {SIGTERM, SIGINT, SIGHUP, SIGQUIT}) {
    SCOPED_TRACE(signal);
    const ScratchFolder folder;
    Server server(folder.path(), write(folder.path() / "scene.toml", kPressingHand));
    Client echo("echo_motion", server.address(), folder.path(), {"--json", "--rate-hz", "100"});
    Client wall("virtual_wall", server.address(), folder.path());
    watch_force(echo, felt);
    const std::string end = server.stop(signal);
    EXPECT_EQ(text_in(end, "event"), "stopped");
    EXPECT_EQ(number_in(end, "force_n"), 0) << end;
  }
}

TEST(Safety, ADeviceThatNobodyHasArmedGivesNoForce) {
  const ScratchFolder folder;
  Server server(folder.path(), write(folder.path() / "scene.toml", resting_hand("[safety]\n")));
  Client echo("echo_motion", server.address(), folder.path(), {"--json", "--rate-hz", "100"});
  Client wall("virtual_wall", server.address(), folder.path());
  for (bool in_the_wall = false; !in_the_wall;) {
    const std::string state = echo.wait_for_line(R"("tick")");
    EXPECT_EQ(number_in(state, "force_n"), 0);
    in_the_wall = count_in(state, "tick") > 2100;
  }
  const std::string end = server.stop();
  EXPECT_EQ(text_in(end, "state"), "homed");
  EXPECT_EQ(count_in(end, "faults"), 0U);
}

TEST(Safety, OneThatArmsAtTheStartOrByItsButtonDoes) {
  for (const std::string arm : {"arm = \"at start\"\n", "arm = \"by dead man\"\ndead_man.button = 0\n"}) {
    SCOPED_TRACE(arm);
    const ScratchFolder folder;
    Server server(folder.path(), write(folder.path() / "scene.toml", resting_hand("[safety]\n" + arm)));
    server.process().wait_for_line("the device is armed");
    Client echo("echo_motion", server.address(), folder.path(), {"--json", "--rate-hz", "100"});
    Client wall("virtual_wall", server.address(), folder.path());
    watch_force(echo, felt);
    EXPECT_EQ(text_in(server.stop(), "state"), "armed");
  }
}

}  // namespace
}  // namespace tendon::e2e::safety_test
