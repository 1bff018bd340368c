// SPDX-License-Identifier: Apache-2.0
// Runs chai3d_program with libhdPhantom.so, tendon-bridge and tendond.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::chai3d_e2e_test {
namespace {

using testing::ScratchFolder;

std::string old_program(const std::string& name) { return std::string(TENDON_OLD_PROGRAMS) + "/" + name; }

Process bridge(const std::string& server, const ScratchFolder& folder, std::vector<std::string> program,
               const std::vector<std::string>& options = {}) {
  std::vector<std::string> arguments = {"chai3d", "--server", server};
  arguments.insert(arguments.end(), options.begin(), options.end());
  arguments.emplace_back("--");
  arguments.push_back(old_program("chai3d_program"));
  arguments.insert(arguments.end(), program.begin(), program.end());
  return {e2e::program("tendon-bridge"), arguments, folder.path()};
}

std::vector<double> array_in(const std::string& line, const std::string& key) {
  const std::size_t begin = line.find("\"" + key + "\":[") + key.size() + 4;
  std::istringstream text(line.substr(begin, line.find(']', begin) - begin));
  std::vector<double> numbers;
  for (std::string one; std::getline(text, one, ',');) numbers.push_back(std::stod(one));
  return numbers;
}

std::vector<std::string> lines_with(const std::string& text, const std::string& words) {
  std::istringstream all(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(all, line);) {
    if (line.find(words) != std::string::npos) lines.push_back(line);
  }
  return lines;
}

double processor_time(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string text;
  std::getline(file, text);
  std::istringstream rest(text.substr(text.rfind(')') + 2));
  std::string word;
  double ticks = 0;
  for (int i = 3; i <= 15; ++i) {
    rest >> word;
    if (i >= 14) ticks += std::stod(word);
  }
  return ticks / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

TEST(Chai3d, AProgramFindsTheDeviceAndMovesWithItOneTurnAStep) {
  const ScratchFolder folder;
  Server server(folder.path(), demo_scene());
  Process old = bridge(server.address(), folder, {"--seconds", "2.5"});
  const std::string devices = old.wait_for_line(R"("event":"devices")");
  EXPECT_EQ(number_in(devices, "count"), 1);
  EXPECT_LT(number_in(devices, "took_s"), 0.4);
  EXPECT_EQ(text_in(old.wait_for_line(R"("event":"open")"), "type").empty(), false);
  old.wait_for_line(R"("position")");
  const double before = processor_time(old.pid());
  const std::string end = old.wait_for_line(R"("event":"end")");
  const double used = processor_time(old.pid()) - before;
  const double took = number_in(end, "took_s");
  EXPECT_EQ(old.wait(), 0);
  EXPECT_EQ(number_in(end, "failed"), 0);
  // The loop of the program has one iteration per haptic step, or per 2 ms if the machine pauses. The hand does not move
  // in all of them, because several steps have the same encoder counts where it reverses.
  EXPECT_GT(number_in(end, "moved"), 0.4 * number_in(end, "turns"));
  EXPECT_LT(number_in(end, "turns"), 1.02 * 1000 * number_in(end, "took_s") + 10);
  EXPECT_GT(number_in(end, "turns"), 0.5 * 1000 * number_in(end, "took_s"));
  EXPECT_EQ(number_in(end, "threads"), 1) << "the library has none of its own";
  double least = 0;
  double most = 0;
  for (const std::string& line : lines_with(old.out(), R"("position")")) {
    const std::vector<double> position = array_in(line, "position");
    least = std::min(least, position[1]);
    most = std::max(most, position[1]);
    EXPECT_LT(std::abs(position[0]) + std::abs(position[2]), 1e-3);
  }
  EXPECT_LT(least, -0.010);
  EXPECT_GT(most, 0.010);
  std::printf("%.1f %% of a core, %.0f turns in %.3f s, getter p99 %.2f us\n", 100 * used / took,
              number_in(end, "turns"), took, number_in(end, "getter_p99_us"));
  // Measured: 8 % of a core on an idle machine. The bound can only detect a loop that does not sleep.
  EXPECT_LT(used / took, 0.25) << "of a core";
}

TEST(Chai3d, WithoutAServerTheProgramFindsNoDeviceAndGoesOn) {
  const ScratchFolder folder;
  Process old = bridge("127.0.0.1:9", folder, {});
  const std::string devices = old.wait_for_line(R"("event":"devices")");
  EXPECT_EQ(number_in(devices, "count"), 0);
  EXPECT_GT(number_in(devices, "took_s"), 0.35);
  EXPECT_EQ(old.wait(), 4) << "the program's own exit code";
  EXPECT_NE(
      old.err().find("tendon-bridge: no state was received from any device; starting the program without a device"),
      std::string::npos)
      << old.err();
}

TEST(Chai3d, WithoutTheBridgeTheLibrarySaysOneLineHowToStartTheProgram) {
  const ScratchFolder folder;
  Process alone(
      old_program("chai3d_program"), {}, folder.path(),
      {"LD_LIBRARY_PATH=" + program("tendon-bridge").parent_path().parent_path().string() + "/lib/tendon/chai3d"});
  EXPECT_EQ(alone.wait(), 4);
  EXPECT_EQ(alone.err(), "libhdPhantom: no device; start this program with `tendon-bridge chai3d -- PROGRAM`\n");
}

TEST(Chai3d, TwoDevicesAreTwoPhantoms) {
  const ScratchFolder folder;
  const std::filesystem::path scenes = demo_scene().parent_path();
  Server server(folder.path(), scenes / "left.toml", {(scenes / "right.toml").string()});
  Process old = bridge(server.address(), folder, {"--seconds", "1"},
                       {"--device", "left", "--device", "right", "--model", "Touch"});
  EXPECT_EQ(number_in(old.wait_for_line(R"("event":"devices")"), "count"), 2);
  EXPECT_EQ(text_in(old.wait_for_line(R"("device":1)"), "type"), "Touch");
  EXPECT_EQ(number_in(old.wait_for_line(R"("event":"end")"), "failed"), 0);
  EXPECT_EQ(old.wait(), 0);
  EXPECT_FALSE(lines_with(old.out(), R"({"device":1,"position")").empty());
}

TEST(Chai3d, AnotherProcessOfTheProgramCannotTakeAnOpenDevice) {
  const ScratchFolder folder;
  Server server(folder.path(), demo_scene());
  Process old = bridge(server.address(), folder, {"--second-process", "--seconds", "0.2"});
  const std::string second = old.wait_for_line(R"("event":"second")");
  EXPECT_EQ(number_in(second, "open"), -1);
  EXPECT_EQ(number_in(second, "force"), -1);
  EXPECT_EQ(old.wait(), 0);
}

TEST(Chai3d, ASecondBridgeIsToldThatTheChannelIsTaken) {
  const ScratchFolder folder;
  Server server(folder.path(), demo_scene());
  Process first = bridge(server.address(), folder, {"--seconds", "2"});
  first.wait_for_line("uses the forces of a program");
  Process second = bridge(server.address(), folder, {"--seconds", "0.5"});
  second.wait_for_line("uses no forces: ");
  EXPECT_EQ(number_in(second.wait_for_line(R"("event":"end")"), "failed"), 0) << "it looks on";
  EXPECT_EQ(second.wait(), 0);
  EXPECT_EQ(first.wait(), 0);
}

/// Pushes along the x axis of the device. There is no limiter in the scene, so the device applies the requested force.
struct Pushing {
  explicit Pushing(const ScratchFolder& folder)
      : server(folder.path(), write(folder.path() / "hand.toml", kPressingHand), {"--without-limiter"}),
        echo("echo_motion", server.address(), folder.path(), {"--json"}),
        old(bridge(server.address(), folder, {"--push", "0", "1", "0", "--seconds", "60"})),
        program(static_cast<pid_t>(number_in(old.wait_for_line(R"("event":"devices")"), "pid"))) {
    watch_force(echo, [](double force) { return force > 0.9; });
  }
  Server server;
  Client echo;
  Process old;
  pid_t program;
};

TEST(Chai3d, AProgramKilledWithItsForceOnIsLetGo) {
  const ScratchFolder folder;
  Pushing pushing(folder);
  ::kill(pushing.program, SIGKILL);
  watch_force(pushing.echo, [](double force) { return force == 0; });
  EXPECT_EQ(pushing.old.wait(), 128 + SIGKILL);
}

TEST(Chai3d, AProgramThatIsStoppedIsLetGoAndFeltAgainWhenItGoesOn) {
  const ScratchFolder folder;
  Pushing pushing(folder);
  ::kill(pushing.program, SIGSTOP);
  watch_force(pushing.echo, [](double force) { return force == 0; });
  ::kill(pushing.program, SIGCONT);
  watch_force(pushing.echo, [](double force) { return force > 0.9; });
  ::kill(pushing.program, SIGKILL);
  pushing.old.wait();
}

TEST(Chai3d, ADeviceThatIsKilledLeavesAProgramThatKnowsIt) {
  const ScratchFolder folder;
  Pushing pushing(folder);
  pushing.old.signal(SIGKILL);
  watch_force(pushing.echo, [](double force) { return force == 0; });
  EXPECT_EQ(::kill(pushing.program, 0), 0) << "it lives";
  ::kill(pushing.program, SIGKILL);
}

TEST(Chai3d, AServerThatComesBackMovesTheProgramsHandAgain) {
  const ScratchFolder folder;
  auto server = std::make_unique<Server>(folder.path(), demo_scene());
  const std::string address = server->address();
  Process old = bridge(address, folder, {"--seconds", "12"});
  old.wait_for_line(R"("fine":true)");
  server->process().signal(SIGKILL);
  server.reset();
  old.wait_for_line(R"("fine":false)");
  old.wait_for_line("tendon-bridge: device: lost ");
  Process again(program("tendond"), {demo_scene().string(), "--listen", address, "--duration-s", "30"}, folder.path());
  old.wait_for_line("tendon-bridge: device: connected to ");
  old.wait_for_line(R"("fine":true)");
  old.signal(SIGTERM);
  EXPECT_EQ(old.wait(), 128 + SIGTERM) << "the program was asked to end";
}

TEST(Chai3d, AProgramLinkedToOpenHapticsIsRefusedInASentence) {
  const ScratchFolder folder;
  Process old(program("tendon-bridge"), {"chai3d", "--", old_program("openhaptics_program")}, folder.path());
  EXPECT_EQ(old.wait(), 1);
  EXPECT_NE(old.err().find("is linked to OpenHaptics (libHD.so)"), std::string::npos) << old.err();
}

/// Runs CHAI3D's wall of 1000 N/m over a delay of 20 ms in each direction. Returns the recording.
Recording wall_far_away(const ScratchFolder& folder, const std::vector<std::string>& more) {
  std::vector<std::string> options = {"--record", "run.mcap"};
  options.insert(options.end(), more.begin(), more.end());
  Server server(folder.path(), demo_scene(), options);
  Service network("tendon-inject", {"--to", server.address(), "--profile", "delay=20ms", "--seed", "7"}, folder.path(),
                  "start", "listen");
  Process old = bridge(network.address(), folder, {"--wall", "1000", "--seconds", "3.2"});
  EXPECT_EQ(old.wait(), 0) << old.err();
  server.stop();
  return read_recording(folder.path() / "run.mcap");
}

double given_out(const Recording& recording) {
  double least = 0;
  for (const StepRecord& step : recording.steps) least = std::min(least, step.energy);
  return std::abs(least);
}

TEST(Chai3d, AWall20MsAwayGivesOutNothingWithTheLimiter) {
  const ScratchFolder folder;
  const Recording recording = wall_far_away(folder, {});
  expect_passive(recording, read_scene(demo_scene()));
  const double out = given_out(recording);
  RecordProperty("given_out_j", std::to_string(out));
  std::printf("with AOL+: %.3g J given out, %zu steps\n", out, recording.steps.size());
  EXPECT_TRUE(std::any_of(recording.steps.begin(), recording.steps.end(), [](const StepRecord& step) {
    return step.applied.x() < -0.5;
  })) << "the wall is felt";
}

TEST(Chai3d, AWall20MsAwayGivesOutMoreThanAJouleWithoutTheLimiter) {
  const ScratchFolder folder;
  const double out = given_out(wall_far_away(folder, {"--without-limiter"}));
  std::printf("without: %.3g J given out\n", out);
  EXPECT_GT(out, 1);
}

}  // namespace
}  // namespace tendon::e2e::chai3d_e2e_test
