// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::engines_test {
namespace {

using testing::ScratchFolder;

void wait_until_felt(Process& echo, double at_least) {
  watch_force(echo, [at_least](double force) { return force < -at_least; });
}

TEST(Engines, TheForcesOfTwoAddUpOnOneDevice) {
  const ScratchFolder folder;
  const auto scene = folder.path() / "device.toml";
  write(scene, std::string(kPressingHand) + "[[channel]]\nname = \"one\"\n[[channel]]\nname = \"two\"\n");
  // An overrun of a busy machine takes energy from the account of the limiter, which then bounds the force on a hand at
  // rest.
  Server server(folder.path(), scene, {"--without-limiter"});
  Client echo("echo_motion", server.address(), folder.path(), {"--json"});
  Client one("virtual_wall", server.address(), folder.path(), {"--stiffness-n-per-m", "150"});
  wait_until_felt(echo, 0.3);
  Client two("virtual_wall", server.address(), folder.path(), {"--channel", "two", "--stiffness-n-per-m", "150"});
  two.wait_for_line("connected");
  // A wall of 150 N/m, 15 mm deep, and a grip of 300 N/m: 15 mm / 3, 1.5 N. With two walls: 7.5 mm, 2.25 N.
  wait_until_felt(echo, 1.9);
  const std::string end = server.stop();
  EXPECT_NE(end.find(R"("name":"one","forces":)"), std::string::npos) << end;
  EXPECT_EQ(end.find(R"("forces":0)"), std::string::npos) << "both channels had forces: " << end;
  EXPECT_EQ(count_in(end, "denied"), 0U);
}

TEST(Engines, ALeaseIsTakenFromAnEngineThatHangs) {
  const ScratchFolder folder;
  const auto scene = folder.path() / "device.toml";
  write(scene, std::string(kPressingHand) +
                   "[[channel]]\nname = \"tissue\"\nlease_ms = 300\n[network]\ncontroller_timeout_ms = 60000\n");
  Server server(folder.path(), scene);
  Client first("virtual_wall", server.address(), folder.path(), {"--channel", "tissue"});
  first.wait_for_line("connected");
  Client echo("echo_motion", server.address(), folder.path(), {"--json"});
  wait_until_felt(echo, 0.5);
  Client second("virtual_wall", server.address(), folder.path(), {"--channel", "tissue", "--take-lease"});
  second.wait_for_line("connected");
  first.signal(SIGSTOP);  // the session is kept for a minute
  server.process().wait_for_line("takes device/tissue from");
  wait_until_felt(echo, 0.5);
  first.signal(SIGCONT);
  const std::string end = server.stop();
  EXPECT_EQ(count_in(end, "handovers"), 1U);
  EXPECT_EQ(count_in(end, "welcomed"), 3U);
}

class NetworkThreads : public ::testing::TestWithParam<int> {};

TEST_P(NetworkThreads, OfManyCountedDevicesEachIsFoundByItsName) {
  const ScratchFolder folder;
  const auto scene = folder.path() / "finger.toml";
  const auto file = folder.path() / "run.mcap";
  std::string text(kPressingHand);
  text.insert(text.find("profile"), "count = 40\n");
  write(scene, text + "[network]\nthreads = " + std::to_string(GetParam()) + "\n");
  Server server(folder.path(), scene, {"--record", file.string()});
  Client first("virtual_wall", server.address(), folder.path(), {"--device", "finger-5"});
  Client second("virtual_wall", server.address(), folder.path(), {"--device", "finger-37"});
  Client echo("echo_motion", server.address(), folder.path(), {"--json", "--device", "finger-37"});
  wait_until_felt(echo, 1);
  Client third("virtual_wall", server.address(), folder.path(), {"--device", "finger-40"});
  server.process().wait_for_line("there is no device \"finger-40\", only \"finger-0\" to \"finger-39\"");
  const auto end = nlohmann::json::parse(server.stop());
  ASSERT_EQ(end.at("devices").size(), 40U);
  for (const auto& device : end.at("devices")) {
    const std::string name = device.at("name");
    const std::uint64_t forces = device.at("channels").at(0).at("forces");
    EXPECT_EQ(forces > 0, name == "finger-5" || name == "finger-37") << name;
  }
  EXPECT_EQ(end.at("denied"), 0);
  EXPECT_EQ(end.at("welcomed"), 3);
  EXPECT_EQ(end.at("refused"), 1);
  std::set<std::uint16_t> recorded;
  const Recording recording = read_recording(file);
  EXPECT_EQ(recording.losses, 0U);
  for (const DatagramRecord& datagram : recording.arrived) recorded.insert(datagram.peer.port);
  EXPECT_GE(recorded.size(), 4U) << "of every guest, whichever thread it is served by";
}

INSTANTIATE_TEST_SUITE_P(Are, NetworkThreads, ::testing::Values(1, 2));

std::vector<nlohmann::json> session_lines(const std::string& output) {
  std::vector<nlohmann::json> found;
  std::istringstream lines(output);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with(R"({"event":)")) continue;
    auto json = nlohmann::json::parse(line);
    if (json["event"] == "welcomed" || json["event"] == "left") found.push_back(std::move(json));
  }
  return found;
}

TEST(Engines, EachSessionIsToldByOneNameFromItsBeginningToItsEnd) {
  const ScratchFolder folder;
  const auto scene = folder.path() / "device.toml";
  write(scene, std::string(kPressingHand));
  Server server(folder.path(), scene);
  Client echo("echo_motion", server.address(), folder.path(), {"--json"});
  wait_until_felt(echo, -1);
  Client wall("virtual_wall", server.address(), folder.path());
  wait_until_felt(echo, 0.3);
  wall.signal(SIGTERM);
  wall.wait();
  server.stop();
  const auto lines = session_lines(server.process().out());
  ASSERT_EQ(lines.size(), 4U) << server.process().out();
  const auto expect_one_session = [](const nlohmann::json& came, const nlohmann::json& left) {
    EXPECT_EQ(came["event"], "welcomed");
    EXPECT_EQ(left["event"], "left");
    const std::string name = came["session"];
    EXPECT_EQ(name.size(), 32U);
    EXPECT_EQ(name.find_first_not_of("0123456789abcdef"), std::string::npos) << name;
    for (const char* const same : {"session", "device", "client", "role", "address"}) EXPECT_EQ(came[same], left[same]);
    EXPECT_EQ(came["device"], "device");
    EXPECT_GT(left["tick"], came["tick"]);
  };
  expect_one_session(lines[0], lines[3]);
  expect_one_session(lines[1], lines[2]);
  EXPECT_EQ(lines[0]["role"], "observer");
  EXPECT_EQ(lines[1]["client"], "virtual_wall");
  EXPECT_EQ(lines[1]["role"], "controller");
  EXPECT_EQ(lines[3]["why"], "the server is shutting down");
  const std::string first = lines[0]["session"];
  const std::string second = lines[1]["session"];
  EXPECT_EQ(first.substr(0, 24), second.substr(0, 24));
  EXPECT_NE(first, second);
}

}  // namespace
}  // namespace tendon::e2e::engines_test
