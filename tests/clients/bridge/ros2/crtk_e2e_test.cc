// SPDX-License-Identifier: Apache-2.0
// Tests `tendon-bridge ros2 --crtk` with programs of CRTK. Those that import crtk_python_client (github.com, organization
// collaborative-robotics, MIT license) need a checkout of it, $TENDON_CRTK_CLIENT, and are skipped without it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

#include "clients/cpp/machine.h"
#include "tests/clients/bridge/ros2/ros2_stage.h"
#include "tests/e2e/stage/process.h"
#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::crtk_e2e_test {
namespace {

using tendon::testing::ScratchFolder;

const char* client() {
  return std::getenv("TENDON_CRTK_CLIENT");  // NOLINT(concurrency-mt-unsafe): one thread
}
bool has_client() {
  Process python(TENDON_PYTHON, {"-c", "import PyKDL, numpy"}, ".");
  return client() != nullptr && python.wait() == 0;
}
constexpr const char* kNoClient = "TENDON_CRTK_CLIENT is not set, or python3-pykdl and python3-numpy are missing";

std::string scene(const std::string& more) {
  return R"([device]
kind = "simulated"
profile = "falcon"
[device.hand]
stiffness_n_per_m = 300
damping_n_s_per_m = 10
mass_kg = 0.5
)" + more;
}
/// 25 mm to the right and left, slowly compared with the 5 ms of the example.
const std::string kMoves = R"([device.hand.motion]
kind = "sine"
amplitude_mm = 25
frequency_hz = 0.5
)";
const std::string kRests = R"([device.hand.motion]
kind = "ramp-hold"
from_mm = [0, 0, 0]
to_mm = [0, 0, 0]
ramp_ms = 100
)";
const std::string kNoLimiter = "[limiter]\nkind = \"none\"\n";

struct Room {
  explicit Room(const std::string& of_scene)
      : server(folder.path(), write(folder.path() / "device.toml", scene(of_scene)), {"--record", file.string()}) {}
  Recording recording() {
    server.stop();
    return read_recording(file);
  }
  ScratchFolder folder;
  std::filesystem::path file = folder.path() / "run.mcap";
  Domain domain;
  Server server;
};

class Peer : public Process {
 public:
  Peer(const Room& room, const std::vector<std::string>& arguments)
      : Process(TENDON_PYTHON, with(options(room), arguments), room.folder.path()) {}
  std::string ready() { return wait_for_line(R"("event":"ready")"); }

 private:
  static std::vector<std::string> options(const Room& room) {
    std::vector<std::string> all = {TENDON_CRTK_PEER, "--types", TENDON_PEER_TYPES, "--domain", room.domain.text()};
    return client() == nullptr ? all : with(std::move(all), {"--client", client()});
  }
};

const std::string kDeadMan = "[safety]\narm = \"by dead man\"\ndead_man.button = 0\n";

/// N/m or N·s/m, with the opposite sign: the slope of the force over the position or the velocity.
double slope(const std::vector<std::pair<double, double>>& points) {
  double n = 0;
  double x = 0;
  double y = 0;
  for (const auto& point : points) {
    n += 1;
    x += point.first;
    y += point.second;
  }
  double xx = 0;
  double xy = 0;
  for (const auto& point : points) {
    xx += (point.first - x / n) * (point.first - x / n);
    xy += (point.first - x / n) * (point.second - y / n);
  }
  return xy / xx;
}

Recording run_example(const std::string& name) {
  Room room(kMoves + kNoLimiter);
  BridgeProcess bridge(room.folder, room.server.address(), room.domain, {"--crtk"});
  Peer peer(room, {"example", name, "800"});
  peer.ready();
  peer.wait_for_line(R"("event":"end")");
  return room.recording();
}

TEST(Crtk, TheBoxOfTheClientsExampleIsFelt) {
  if (!has_client()) GTEST_SKIP() << kNoClient;
  const Recording recording = run_example("box");
  std::array<std::vector<std::pair<double, double>>, 2> sides;  // at the right and at the left wall of the box
  for (const StepRecord& step : recording.steps) {
    if (std::abs(step.applied.x()) > 0.3) {
      sides[step.applied.x() < 0 ? 0 : 1].emplace_back(step.hand.position.x(), step.applied.x());
    }
  }
  // The box is around the position at the start, so the hand can be closer to one of its walls.
  const auto& side = sides[0].size() > sides[1].size() ? sides[0] : sides[1];
  ASSERT_GT(side.size(), 1000U);
  std::cout << "box: " << slope(side) << " N/m of -500, n = " << side.size() << '\n';
  EXPECT_NEAR(slope(side), -500, 25);
}

TEST(Crtk, TheViscosityOfTheClientsExampleIsFelt) {
  if (!has_client()) GTEST_SKIP() << kNoClient;
  const Recording recording = run_example("viscosity");
  std::vector<std::pair<double, double>> points;
  for (const StepRecord& step : recording.steps) {
    if (!step.applied.isZero(0)) points.emplace_back(step.hand.velocity.x(), step.applied.x());
  }
  ASSERT_GT(points.size(), 2000U);
  std::cout << "viscosity: " << slope(points) << " N s/m of -40, n = " << points.size() << '\n';
  EXPECT_NEAR(slope(points), -40, 2);
}

TEST(Crtk, TheClientsExampleRunsFromItsMain) {
  if (!has_client()) GTEST_SKIP() << kNoClient;
  Room room(kMoves + kNoLimiter);
  BridgeProcess bridge(room.folder, room.server.address(), room.domain, {"--crtk"});
  Peer peer(room, {"script", "pq"});
  EXPECT_EQ(peer.wait(), 0) << peer.err();
  EXPECT_NE(peer.out().find("Position: ["), std::string::npos) << peer.out();
}

TEST(Crtk, EnableWaitsUntilTheOperatorHasArmedTheDevice) {
  if (!has_client()) GTEST_SKIP() << kNoClient;
  Room room(kRests + "[[device.hand.press]]\nbutton = 0\nfrom_ms = 8000\nfor_ms = 100000\n" + kDeadMan);
  BridgeProcess bridge(room.folder, room.server.address(), room.domain, {"--crtk"});
  Peer peer(room, {"device", "enable", "60"});
  EXPECT_EQ(text_in(peer.ready(), "state"), "DISABLED");
  bridge.wait_for_line("requested \"enable\": the operator arms the device");
  const std::string done = peer.wait_for_line(R"("event":"done")");
  EXPECT_NE(done.find(R"("done":true,"state":"ENABLED","homed":true)"), std::string::npos) << done;
  EXPECT_EQ(peer.wait(), 0) << peer.err();
  for (const StepRecord& step : room.recording().steps) {
    ASSERT_FALSE(step.rearmed && step.buttons == 0) << "only the button arms the device";
  }
}

TEST(Crtk, DisableDisarmsTheDevice) {
  if (!has_client()) GTEST_SKIP() << kNoClient;
  Room room(kRests + kNoLimiter);
  BridgeProcess bridge(room.folder, room.server.address(), room.domain, {"--crtk"});
  Peer push(room, {"push", "0.5"});
  bridge.wait_for_line("the hand feels its servo_cf");
  Peer peer(room, {"device", "disable", "30"});
  peer.ready();
  const std::string done = peer.wait_for_line(R"("event":"done")");
  EXPECT_NE(done.find(R"("done":true,"state":"DISABLED")"), std::string::npos) << done;
  bridge.wait_for_line("was disarmed for a program");
  const Recording recording = room.recording();
  EXPECT_TRUE(std::ranges::any_of(recording.steps, &StepRecord::disarmed));
  for (const StepRecord& step : recording.steps) {
    ASSERT_TRUE(!step.disarmed || step.applied.isZero(0)) << step.tick << ": " << step.applied.transpose();
  }
}

TEST(Crtk, EachEndpointCarriesTheHashThatPythonComputes) {
  Room room(kRests + kNoLimiter);
  BridgeProcess bridge(room.folder, room.server.address(), room.domain, {"--crtk"});
  Peer peer(room, {"hashes", "14"});
  const std::string line = peer.wait_for_line(R"("event":"endpoints")");
  EXPECT_NE(line.find(R"("count":14,"types":8,"wrong":[])"), std::string::npos) << line;
}

TEST(Crtk, ACommandFromBeforeTheBridgeIsNotObeyed) {
  Room room(kRests + kNoLimiter);
  Peer old(room, {"text", "disable"});
  Peer older(room, {"text", "enable"});
  old.ready();
  older.ready();
  BridgeProcess bridge(room.folder, room.server.address(), room.domain, {"--crtk"});
  old.wait_for_line(R"("event":"matched")");
  older.wait_for_line(R"("event":"matched")");
  old.wait_for_line(R"("state":"ENABLED")");
  Peer fresh(room, {"text", "disable", "late"});  // this command is received after the old ones
  fresh.wait_for_line(R"("state":"DISABLED")");
  bridge.wait_for_line("was disarmed for a program");
  EXPECT_EQ(bridge.err().find("requested \"enable\""), std::string::npos) << bridge.err();
  EXPECT_EQ(bridge.err().find("requested \"disable\""), bridge.err().rfind("requested \"disable\"")) << bridge.err();
}

TEST(Crtk, AProgramThatIsKilledLetsTheHandGoAndComesBack) {
  Room room(kRests + kNoLimiter);
  BridgeProcess bridge(room.folder, room.server.address(), room.domain, {"--crtk"});
  Client echo("echo_motion", room.server.address(), room.folder.path(), {"--json", "--rate-hz", "100"});
  LocalTime killed;
  {
    Peer program(room, {"push", "0.5"});
    watch_force(echo, [](double force) { return force < -0.4; });  // +y of REP 103 is the left of the hand
    killed = read_clock();
    program.signal(SIGKILL);
    watch_force(echo, [](double force) { return force == 0; });
  }
  Peer again(room, {"push", "0.5"});
  watch_force(echo, [](double force) { return force < -0.4; });
  const Recording recording = room.recording();
  const auto let_go = std::ranges::find_if(
      recording.steps, [&](const StepRecord& step) { return step.hand.at > killed && step.applied.isZero(0); });
  ASSERT_NE(let_go, recording.steps.end());
  const double taken = std::chrono::duration<double>(let_go->hand.at - killed).count();
  std::cout << "0 N " << 1000 * taken << " ms after the kill\n";
  EXPECT_GT(taken, 0);
  EXPECT_LT(taken, 0.8) << "300 ms, and what a machine may stand still";
}

TEST(Crtk, OnlyThePublisherThatLeavesIsSaidToHaveLeftAndTheOthersStay) {
  Room room(kRests + kNoLimiter);
  BridgeProcess bridge(room.folder, room.server.address(), room.domain, {"--crtk"});
  Client echo("echo_motion", room.server.address(), room.folder.path(), {"--json", "--rate-hz", "100"});
  const auto is_pushed = [](double force) { return force < -0.4; };
  const std::string wrench_command = "tendon/device/wrench_command";
  Peer owner(room, {"push", "0.5"});
  bridge.wait_for_line("the hand feels its servo_cf");
  Peer waits(room, {"push", "0.1", wrench_command});
  bridge.wait_for_line("a wrench_command of");
  Peer commands(room, {"text", "enable", "late"});
  bridge.wait_for_line("requested \"enable\"");
  watch_force(echo, is_pushed);
  const LocalTime begin = read_clock();
  Peer leaves(room, {"push", "0.1", wrench_command, "1"});
  leaves.wait_for_line(R"("event":"left")");
  bridge.wait_for_line("has left");
  watch_force(echo, is_pushed);
  const LocalTime end = read_clock();
  EXPECT_EQ(bridge.err().find("has left"), bridge.err().rfind("has left")) << bridge.err();
  int steps = 0;
  for (const StepRecord& step : room.recording().steps) {
    if (step.hand.at < begin || step.hand.at > end) continue;
    ++steps;
    ASSERT_FALSE(step.applied.isZero(0)) << step.tick << ": " << bridge.err();
  }
  EXPECT_GT(steps, 1000);
}

}  // namespace
}  // namespace tendon::e2e::crtk_e2e_test
