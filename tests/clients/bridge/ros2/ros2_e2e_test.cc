// SPDX-License-Identifier: Apache-2.0
// Tests a real tendond with programs that use Fast DDS (fast_peer).
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "clients/cpp/machine.h"
#include "tests/clients/bridge/ros2/ros2_stage.h"
#include "tests/e2e/stage/process.h"
#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::ros2_e2e_test {
namespace {

using std::chrono::milliseconds;
using tendon::testing::ScratchFolder;

/// Simulates a stylus that oscillates to the right and left of the operator. It has torque motors, a gripper, and a
/// button that is pressed after 1 s. The base frame is that of a Falcon.
constexpr std::string_view kScene = R"([device]
kind = "simulated"
profile = "touch"
axes = "right=x up=y user=z"

[device.effects.joint_friction]
kind = "arm"
upper_arm_mm = 140
forearm_mm = 140

[device.hand]
profile = "stylus"

[[device.hand.press]]
button = 0
from_ms = 1000
for_ms = 110000

[device.hand.motion]
kind = "sine"
amplitude_mm = 15
frequency_hz = 0.5

[device.rotation]
inertia_kg_m2 = 2e-5
viscous_friction_nm_s_per_rad = 2e-4
coulomb_friction_nm = 1e-3
max_torque_nm = 0.2
encoder_step_rad = 0.0005

[device.rotation.hand]
stiffness_nm_per_rad = 0.3
damping_nm_s_per_rad = 2e-3

[device.rotation.hand.motion]
kind = "minimum-jerk"
points_deg = [[0, 0, 0], [0, 0, 45], [0, 30, 0]]
durations_ms = [1000, 1000]

[device.gripper]
open_deg = 30
arm_mm_per_rad = 60
mass_kg = 0.02
viscous_friction_n_s_per_m = 0.5
coulomb_friction_n = 0.1
max_force_n = 3
encoder_step_rad = 0.0005

[device.gripper.hand]
stiffness_n_per_m = 300
damping_n_s_per_m = 3

[device.gripper.hand.motion]
kind = "ramp-hold"
from_deg = 25
to_deg = 5
ramp_ms = 500
hold_ms = 500

[limiter]
kind = "aol+"

[limiter.rotation]
coulomb_friction_nm = 5e-4
viscous_friction_nm_s_per_rad = 1e-4

[limiter.gripper]
coulomb_friction_n = 0.05
viscous_friction_n_s_per_m = 0.25
)";

class Peer : public Process {
 public:
  Peer(const ScratchFolder& folder, const Domain& domain, const std::vector<std::string>& more)
      : Process(std::filesystem::path(TENDON_PEERS) / "fast_peer", with({"--domain", domain.text()}, more),
                folder.path()) {}

  std::string until(const std::function<bool(const std::string&)>& holds) {
    const auto patience = read_clock() + kPatience;
    while (read_clock() < patience) {
      std::string line = wait_for_line(R"("event":)");
      if (holds(line)) return line;
    }
    throw std::runtime_error("what was waited for did not come; the peer's last words:\n" +
                             out().substr(out().size() < 3000 ? 0 : out().size() - 3000));
  }
  std::string until_some(const std::string& topic, double count = 1) {
    return until([&](const std::string& line) { return number(line, topic + "_n") >= count; });
  }
  std::string until_pushed(double newtons) {
    return until([&](const std::string& line) { return std::abs(number(line, "wrench_y") - newtons) < 1e-6; });
  }
  static double number(const std::string& line, const std::string& key) {
    return line.find('"' + key + "\":") == std::string::npos ? 1e9 : number_in(line, key);
  }
  std::string last() {
    const std::string line = wait_for_line(R"("event":"end")");
    EXPECT_EQ(wait(), 0) << err();
    return line;
  }
};

double number(const std::string& line, const std::string& key) { return Peer::number(line, key); }

struct Room {
  explicit Room(const std::vector<std::string>& of_bridge = {})
      : server(folder.path(), write(folder.path() / "device.toml", kScene)),
        bridge(folder, server.address(), domain, of_bridge) {}
  ScratchFolder folder;
  Domain domain;
  Server server;
  BridgeProcess bridge;
};

TEST(Ros2, EachTypeIsReadByFastDdsAndTheWrenchComesBack) {
  const ScratchFolder folder;
  const Domain domain;
  Process floor(std::filesystem::path(TENDON_PEERS) / "dds_floor", {domain.text(), "100"}, folder.path());
  floor.wait_for_line("listening");
  Peer peer(folder, domain,
            {"--read", "pose,twist,wrench,joy,joint_states,servo_pose,diagnostics", "--wrench",
             "0.5,-1.5,2.5,3.5,-4.5,5.5", "--frame", "any"});
  const std::string line = peer.until([](const std::string& all) {
    bool each = true;
    for (const char* topic : {"pose", "twist", "wrench", "joy", "joint_states", "servo_pose", "diagnostics"}) {
      each = each && number_in(all, std::string(topic) + "_n") > 0;
    }
    return each;
  });
  const auto has = [&](const std::string& text) { EXPECT_NE(line.find(text), std::string::npos) << text << line; };
  has(R"("pose_frame":"device_base")");
  has(R"("pose_x":1.0,"pose_y":2.0,"pose_z":3.0,"pose_qx":0.1,"pose_qy":0.2,"pose_qz":0.3,"pose_qw":0.5)");
  has(R"("twist_x":4.0,"twist_y":5.0,"twist_z":6.0,"twist_rx":7.0,"twist_ry":8.0,"twist_rz":9.0)");
  has(R"("wrench_frame":"any")");
  has(R"("wrench_x":0.5,"wrench_y":-1.5,"wrench_z":2.5,"wrench_rx":3.5,"wrench_ry":-4.5,"wrench_rz":5.5)");
  has(R"("joy_axis0":0.5,"joy_axis1":0.25,"joy_button0":0,"joy_button1":1,"joy_button2":1)");
  has(R"("joint_states_names":["waist","elbow"],"joint_states_position":[0.25,-0.5],"joint_states_velocity":[1.5,2.5])");
  has(R"("servo_pose_x":-1.0,"servo_pose_y":-2.0,"servo_pose_z":-3.0)");
  has(R"("diagnostics_level":1,"diagnostics_name":"tendon: device","diagnostics_message":"words","diagnostics_values":3)");
}

TEST(Ros2, ReliableAndBestEffortReadersGetEachTopicOfADevice) {
  Room room({"--servo", "twist", "--clutch", "0"});
  const std::vector<std::string> topics = {"--read", "pose,twist,wrench,joy,joint_states,servo_twist,diagnostics"};
  Peer reliable(room.folder, room.domain, topics);
  Peer best_effort(room.folder, room.domain, with(topics, {"--best-effort"}));
  for (Peer* peer : {&reliable, &best_effort}) {
    const std::string line = peer->until([](const std::string& all) {
      return number(all, "pose_n") > 100 && number(all, "twist_n") > 100 && number(all, "wrench_n") > 100 &&
             number(all, "joy_n") > 10 && number(all, "joint_states_n") > 100 && number(all, "servo_twist_n") > 100 &&
             number(all, "diagnostics_values") == 12;  // the last one of them is the safety layer
    });
    EXPECT_EQ(text_in(line, "pose_frame"), "device_base");
    EXPECT_EQ(text_in(line, "servo_twist_frame"), "device_servo");
    EXPECT_EQ(number(line, "joy_button0"), 1);
    EXPECT_EQ(text_in(line, "diagnostics_name"), "tendon: device");
    EXPECT_EQ(text_in(line, "diagnostics_message"), "ready");
    EXPECT_NEAR(number(line, "pose_x"), 0, 1e-3) << "the hand moves along its right alone, which is REP 103's −y";
    EXPECT_NEAR(number(line, "pose_z"), 0, 1e-3);
    for (const char* topic : {"pose", "twist", "wrench", "servo_twist"}) {
      EXPECT_EQ(number(line, std::string(topic) + "_back"), 0) << topic << ": never an older one after a newer one";
    }
  }
  reliable.until([](const std::string& line) { return number(line, "pose_y") < -0.005; });
  reliable.until([](const std::string& line) { return number(line, "pose_y") > 0.005; });
}

TEST(Ros2, AReaderAtAKilohertzMissesFewStatesAndNeverTheNewest) {
  Room room;
  Peer peer(room.folder, room.domain, {"--read", "pose", "--duration-s", "3"});
  const std::string line = peer.last();
  const double share = number(line, "pose_n") / (1000 * number(line, "pose_span_s") + 1);
  std::cout << "of the states " << 100 * share << " %; " << line << '\n';
  EXPECT_EQ(number(line, "pose_back"), 0);
  EXPECT_GT(number(line, "pose_span_s"), 1);
  EXPECT_GT(share, 0.5) << "the machine is shared; 99 % were measured on an idle one";
  const std::string counts = room.bridge.wait_for_line(R"("published")");
  EXPECT_EQ(number(counts, "unsent"), 0);
}

TEST(Ros2, TwoDomainsDoNotMeet) {
  Room room;
  const Domain other;
  Peer stranger(room.folder, other, {"--read", "pose,diagnostics", "--wrench", "0,0.4,0"});
  Peer peer(room.folder, room.domain, {"--read", "pose,wrench"});
  peer.until_some("pose", 500);
  const std::string line = peer.until_some("wrench", 1000);
  EXPECT_EQ(number(line, "wrench_y"), 0);
  const std::string of_stranger = stranger.until([](const std::string& all) { return number(all, "written") > 500; });
  EXPECT_EQ(number(of_stranger, "pose_n"), 0);
  EXPECT_EQ(number(of_stranger, "diagnostics_n"), 0);
}

TEST(Ros2, AReaderThatComesLateGetsNothingOld) {
  Room room;
  std::this_thread::sleep_for(std::chrono::seconds(1));
  for (const char* reliability : {"--reliable", "--best-effort"}) {
    std::vector<std::string> arguments = {"--read", "pose"};
    if (std::string_view(reliability) == "--best-effort") arguments.emplace_back(reliability);
    Peer late(room.folder, room.domain, arguments);
    const std::string line = late.until_some("pose", 100);
    EXPECT_LT(number(line, "pose_first_age_us"), 500'000) << reliability;
  }
}

TEST(Ros2, AReaderOfRosLocalhostOnlyThatAsksNobodyIsFound) {
  Room room;
  std::this_thread::sleep_for(milliseconds(500));
  Peer late(room.folder, room.domain, {"--read", "pose,wrench", "--wrench", "0,0.3,0", "--localhost-only"});
  late.until_pushed(0.3);
}

TEST(Ros2, AWrenchIsFeltAndItsEndLeavesTheHandToTheStages) {
  Room room;
  Peer peer(room.folder, room.domain,
            {"--read", "wrench", "--wrench", "0,0.3,0,0.01,0,0", "--frame", "device_base", "--wrench-for-s", "2.5"});
  const std::string pushed = peer.until_pushed(0.3);
  EXPECT_NEAR(number(pushed, "wrench_rx"), 0.01, 1e-3) << "the stylus has motors that turn it";
  room.bridge.wait_for_line("controls the device: the hand feels its wrench_command");
  const std::string let_go =
      peer.until([](const std::string& line) { return line.find("let_go_us") != std::string::npos; });
  std::cout << "0 N " << number(let_go, "let_go_us") / 1000 << " ms after the last command\n";
  EXPECT_LT(number(let_go, "let_go_us"), 800'000) << "300 ms, and what a machine may stand still";
}

TEST(Ros2, TheTopicsOfCrtkAreReadAndWrittenByFastDds) {
  Room room({"--crtk", "--negate-measured"});
  Peer peer(room.folder, room.domain,
            {"--read", "measured_cp,measured_cv,measured_cf,wrench", "--write", "servo_cf", "--wrench", "0,0.3,0"});
  peer.until_pushed(0.3);
  const std::string line = peer.until([](const std::string& all) {
    return number(all, "measured_cp_n") > 100 && number(all, "measured_cv_n") > 100 &&
           std::abs(number(all, "measured_cf_y") + 0.3) < 1e-6;
  });
  EXPECT_EQ(text_in(line, "measured_cp_frame"), "device_base");
  EXPECT_NEAR(number(line, "measured_cp_x"), 0, 1e-3) << "the hand moves along its right alone";
}

TEST(Ros2, NegateIsNamedInTheFirstSentence) {
  Room room({"--negate"});
  EXPECT_EQ(room.bridge.err().substr(0, 24), "tendon-bridge: --negate:") << room.bridge.err();
  Peer peer(room.folder, room.domain, {"--read", "wrench", "--wrench", "0,0.3,0"});
  peer.until_pushed(-0.3);
}

TEST(Ros2, ASecondPublisherIsDroppedAndTold) {
  Room room;
  Peer owner(room.folder, room.domain, {"--read", "wrench", "--wrench", "0,0.3,0"});
  owner.until_pushed(0.3);
  {
    Peer second(room.folder, room.domain, {"--read", "wrench,diagnostics", "--wrench", "0,-0.3,0"});
    room.bridge.wait_for_line("was dropped: another program controls the device");
    const std::string line = second.until(
        [](const std::string& all) { return all.find("another program controls the device") != std::string::npos; });
    EXPECT_EQ(number(line, "diagnostics_level"), 1);
    EXPECT_GE(number(line, "wrench_y"), 0);
    owner.signal(SIGTERM);
    owner.wait();
    second.until_pushed(-0.3);
  }
}

/// Returns the time until the force is zero for a reader at 10 Hz. The force must not be zero at the start.
double seconds_to_no_force(Peer& reader) {
  const auto start = read_clock();
  reader.until_pushed(0);
  return std::chrono::duration<double>(read_clock() - start).count();
}

TEST(Ros2, AProgramThatIsKilledOrFrozenWithTheForceOnLetsTheHandGo) {
  Room room;
  Peer reader(room.folder, room.domain, {"--read", "wrench"});
  for (const int signal : {SIGSTOP, SIGKILL}) {
    Peer program(room.folder, room.domain, {"--wrench", "0,0.3,0"});
    reader.until_pushed(0.3);
    program.signal(signal);
    const double taken = seconds_to_no_force(reader);
    std::cout << "0 N seen " << 1000 * taken << " ms after signal " << signal << '\n';
    EXPECT_LT(taken, 1) << "signal " << signal;
    if (signal == SIGSTOP) {
      program.signal(SIGCONT);
      reader.until_pushed(0.3);
    }
  }
}

TEST(Ros2, AFrozenReaderHoldsNobodyUp) {
  Room room;
  Peer frozen(room.folder, room.domain, {"--read", "pose,twist,wrench"});
  Peer reader(room.folder, room.domain, {"--read", "pose"});
  frozen.until_some("pose", 100);
  frozen.signal(SIGSTOP);
  const double before = number(reader.until_some("pose", 100), "pose_n");
  const std::string line = reader.until([&](const std::string& all) { return number(all, "pose_n") > before + 1500; });
  EXPECT_LT(number(line, "pose_n"), before + 10000) << "within seconds";
  EXPECT_EQ(number(room.bridge.wait_for_line(R"("published")"), "unsent"), 0);
  frozen.signal(SIGCONT);
  const double n = number(frozen.until_some("pose", 100), "pose_n");
  frozen.until([&](const std::string& all) { return number(all, "pose_n") > n + 500; });
}

TEST(Ros2, TheServerDiesAndComesBack) {
  const ScratchFolder folder;
  const Domain domain;
  const std::string scene = write(folder.path() / "device.toml", kScene);
  std::optional<Server> server(std::in_place, folder.path(), scene);
  const std::string address = server->address();
  BridgeProcess bridge(folder, address, domain);
  Peer peer(folder, domain, {"--read", "pose,wrench,diagnostics", "--wrench", "0,0.3,0"});
  peer.until_pushed(0.3);
  server->process().signal(SIGKILL);
  server.reset();
  bridge.wait_for_line("lost " + address);
  const std::string lost = peer.until([](const std::string& line) { return number(line, "diagnostics_level") == 2; });
  EXPECT_EQ(text_in(lost, "diagnostics_message"), "no session with the server");
  Process again(program("tendond"), {scene, "--listen", address, "--duration-s", "100"}, folder.path());
  const double before = number(lost, "pose_n");
  peer.until([&](const std::string& line) {
    return number(line, "pose_n") > before + 500 && std::abs(number(line, "wrench_y") - 0.3) < 1e-6;
  });
  peer.until([](const std::string& line) { return number(line, "diagnostics_level") == 0; });
}

TEST(Ros2, ALinkThatStallsFor200MillisecondsIsFadedAndIsOverAfterIt) {
  const ScratchFolder folder;
  const Domain domain;
  Server server(folder.path(), write(folder.path() / "device.toml", kScene));
  Service proxy("tendon-inject",
                {"--to", server.address(), "--control", "control", "--max-release-error-us", "1000000"}, folder.path(),
                "start", "listen");
  const auto weather = [&](const std::string& line) {
    Process control(program("tendon-inject"), {"control", "control", "both", line}, folder.path());
    EXPECT_EQ(control.wait(), 0) << control.err();
  };
  BridgeProcess bridge(folder, proxy.address(), domain);
  Peer peer(folder, domain, {"--read", "pose,wrench", "--wrench", "0,0.3,0"});
  peer.until_pushed(0.3);
  weather("loss=100%");
  std::this_thread::sleep_for(milliseconds(200));
  weather("loss=0%");
  const double before = number(peer.until_some("pose"), "pose_n");
  const std::string line = peer.until([&](const std::string& all) {
    return number(all, "pose_n") > before + 300 && std::abs(number(all, "wrench_y") - 0.3) < 1e-6;
  });
  EXPECT_EQ(number(line, "pose_back"), 0);
  EXPECT_EQ(bridge.err().find("lost"), std::string::npos) << bridge.err();
}

TEST(Ros2, ItSleepsBetweenTheStates) {
  Room room;
  Peer peer(room.folder, room.domain, {"--read", "pose"});
  peer.until_some("pose", 100);
  const auto ticks = [&] {
    std::ifstream file("/proc/" + std::to_string(room.bridge.pid()) + "/stat");
    const std::vector<std::string> words{std::istream_iterator<std::string>(file), {}};
    return std::stod(words.at(13)) + std::stod(words.at(14));
  };
  const double before = ticks();
  const auto start = read_clock();
  std::this_thread::sleep_for(std::chrono::seconds(2));
  const double spent = (ticks() - before) / static_cast<double>(::sysconf(_SC_CLK_TCK));
  const double share = spent / std::chrono::duration<double>(read_clock() - start).count();
  std::cout << 100 * share << " % of a core\n";
  EXPECT_LT(share, 0.25) << "8 % is what is asked for; a busy wait would be 100";
}

TEST(Ros2, WhatTheCommandLineCannotMeanIsSaid) {
  const ScratchFolder folder;
  const auto said = [&](const std::vector<std::string>& arguments) {
    Process bridge(program("tendon-bridge"), with({"ros2", "--server", "127.0.0.1:9"}, arguments), folder.path());
    return std::to_string(bridge.wait()) + " " + bridge.err();
  };
  EXPECT_NE(said({"--domain", "233"}).find("233 not in range"), std::string::npos);
  EXPECT_NE(said({"--servo", "twist"}).find("--clutch"), std::string::npos);
  EXPECT_NE(said({"--interface", "eth0\"/><X"}).find("expected the name of an interface"), std::string::npos);
  EXPECT_NE(said({"--device", "a-b", "--device", "a_b"})
                .find("1 tendon-bridge: --device a_b: its ROS name would be a_b, which is already used for a-b"),
            std::string::npos);
  EXPECT_NE(
      said({"--interface", "nosuch0", "--domain", "3"}).find("DDS cannot create a participant in domain 3 on nosuch0"),
      std::string::npos);
}

}  // namespace
}  // namespace tendon::e2e::ros2_e2e_test
