// SPDX-License-Identifier: Apache-2.0
// The exit code must be 2 if the command line or the scene is wrong, and 1 if a file or a port cannot be used.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::bad_input_test {
namespace {

using testing::ScratchFolder;

struct BadInput {
  std::string what;
  std::string program;
  std::vector<std::string> arguments;
  std::vector<std::string> says;
  int exit_code = 2;
};

void expect_refusals(const std::filesystem::path& folder, const std::vector<BadInput>& inputs) {
  for (const BadInput& input : inputs) {
    SCOPED_TRACE(input.program + ": " + input.what);
    Process process(program(input.program), input.arguments, folder);
    EXPECT_EQ(process.wait(), input.exit_code);
    EXPECT_EQ(process.out(), "");
    for (const std::string& words : input.says) {
      EXPECT_NE(process.err().find(words), std::string::npos) << "not \"" << words << "\" in: " << process.err();
    }
  }
}

constexpr std::string_view kFalcon = "[device]\nkind = \"simulated\"\nprofile = \"falcon\"\n";

TEST(BadInput, OfTendondIsAnsweredWithWhatIsWrong) {
  const ScratchFolder folder;
  const auto path = [&](const std::string& name) { return (folder.path() / name).string(); };
  const std::string demo = demo_scene().string();
  const std::string unit = write(path("unit.toml"), std::string(kFalcon) + "[loop]\nperiod_ms = 1\n");
  const std::string unknown = write(path("unknown.toml"), std::string(kFalcon) + "[loop]\ncolour = 1\n");
  const std::string negative =
      write(path("negative.toml"), std::string(kFalcon) + "[device.effects]\nmass_kg = -0.2\n");
  const std::string syntax = write(path("syntax.toml"), "[device\n");
  const std::string pipe = path("pipe.toml");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  expect_refusals(
      folder.path(),
      {
          {"no scene named", "tendond", {}, {"SCENE", "required"}},
          {"missing scene file", "tendond", {path("none.toml")}, {"cannot read", "none.toml", "No such file"}, 1},
          {"a named pipe as scene", "tendond", {pipe}, {"cannot read", "named pipe, expected a regular file"}, 1},
          {"a folder as scene", "tendond", {path("")}, {"cannot read", "Is a directory"}, 1},
          {"not TOML", "tendond", {syntax}, {syntax + ":1"}},
          {"key in the wrong unit", "tendond", {unit}, {unit + ":5: loop.period_ms: unknown key", "period_us"}},
          {"unknown key", "tendond", {unknown}, {unknown + ":5: loop.colour: unknown key"}},
          {"negative mass", "tendond", {negative}, {negative + ":5: device.effects.mass_kg: expected", "found -0.2"}},
          {"recording into a missing folder",
           "tendond",
           {demo, "--listen", "127.0.0.1:0", "--record", path("none/run.mcap")},
           {"cannot write recording " + path("none/run.mcap"), "No such file or directory"},
           1},
          {"recording over a folder",
           "tendond",
           {demo, "--listen", "127.0.0.1:0", "--record", path("")},
           {"cannot write recording", "Is a directory"},
           1},
          {"unknown option", "tendond", {demo, "--recrod", "run.mcap"}, {"--recrod"}},
          {"no address", "tendond", {demo, "--listen", "here"}, {"expected HOST:PORT like 127.0.0.1:47100", "here"}},
          {"negative duration", "tendond", {demo, "--duration-s", "-1"}, {"--duration-s", "-1"}},
          {"empty duration",
           "tendond",
           {demo, "--listen", "127.0.0.1:0", "--duration-s", ""},
           {"--duration-s: expected a value, got an empty text"}},
          {"decimal comma", "tendond", {demo, "--duration-s", "1,5"}, {"--duration-s", "1,5", "(a decimal point?)"}},
          {"IPv6 without brackets", "tendond", {demo, "--listen", "::1:47100"}, {"or [::1]:47100"}},
      });
}

TEST(BadInput, OfTheInjectorIsAnsweredWithWhatIsWrong) {
  const ScratchFolder folder;
  const std::vector<std::string> ends = {"--listen", "127.0.0.1:0", "--to", "127.0.0.1:47100"};
  const auto path = [&](const std::string& name) { return (folder.path() / name).string(); };
  const std::string delays = write(path("delays.csv"), "20\n21\n");
  const auto with = [&](const std::string& option, const std::string& value) {
    std::vector<std::string> arguments = ends;
    arguments.insert(arguments.end(), {option, value});
    return arguments;
  };
  expect_refusals(
      folder.path(),
      {
          {"no argument", "tendon-inject", {}, {"--listen", "required"}},
          {"no server", "tendon-inject", {"--listen", "127.0.0.1:0"}, {"--to", "required"}},
          {"loss of 150 %", "tendon-inject", with("--profile", "loss=150%"), {"--profile: loss", "150%"}},
          {"negative delay", "tendon-inject", with("--up", "delay=-5ms"), {"--up: delay", "-5ms"}},
          {"delay that is no number", "tendon-inject", with("--down", "delay=some"), {"--down: delay", "some"}},
          {"no such histogram", "tendon-inject", with("--profile", "delay=histogram(none.csv)"), {"none.csv"}, 1},
          {"no such name", "tendon-inject", with("--profile", "wifi-ugly"), {"wifi-ugly", "wifi-bad"}},
          {"a network that is said twice",
           "tendon-inject",
           [&] {
             auto arguments = with("--profile", "lan");
             arguments.insert(arguments.end(), {"--replay", "run.csv"});
             return arguments;
           }(),
           {"--replay", "--profile"}},
          {"no such trace", "tendon-inject", with("--replay", "none.csv"), {"none.csv"}, 1},
          {"the end of no trace", "tendon-inject", with("--at-end", "stop"), {"--at-end", "--replay"}},
          {"added to no trace", "tendon-inject", with("--add", "loss=1%"), {"--add", "--replay"}},
          {"another end",
           "tendon-inject",
           {"--dry-run", "--replay", "run.csv", "--at-end", "loop"},
           {"--at-end", "loop", "repeat, stop, pass"}},
          {"no such capture",
           "tendon-inject",
           {"import", "pcap", "none.pcap", "--out", "run.csv"},
           {"cannot read none.pcap"},
           1},
          {"a full disk", "tendon-inject", {"import", "csv", delays, "--out", "/dev/full"}, {"/dev/full"}, 1},
          {"importing to a folder", "tendon-inject", {"import", "csv", delays, "--out", path("")}, {path("")}, 1},
          {"no such scenario", "tendon-inject", with("--scenario", "none.toml"), {"none.toml"}, 1},
          {"recording into a missing folder",
           "tendon-inject",
           with("--record", "none/run.csv"),
           {"none/run.csv", "there is no folder none"},
           1},
          {"a server without a port",
           "tendon-inject",
           {"--listen", "127.0.0.1:0", "--to", "127.0.0.1:0"},
           {"--to", "port"}},
          {"a host without a port",
           "tendon-inject",
           {"--listen", "127.0.0.1:0", "--to", "haptics"},
           {"--to", "HOST:PORT"}},
          {"name of DNS-SD, without a key",
           "tendon-inject",
           {"--listen", "127.0.0.1:0", "--to", "dns-sd:falcon"},
           {"--to", "HOST:PORT", "no key"}},
          {"a count without a dry run", "tendon-inject", with("--count", "5"), {"--count", "--dry-run"}},
          {"unknown option", "tendon-inject", with("--lose", "2%"), {"--lose"}},
      });
}

TEST(BadInput, OfASweepIsAnsweredWithWhatIsWrong) {
  if (!std::filesystem::exists(program("tendon-lab"))) GTEST_SKIP() << "tendon-lab is not built with sanitizers";
  const ScratchFolder folder;
  const auto path = [&](const std::string& name) { return (folder.path() / name).string(); };
  const std::string demo = demo_scene().string();
  const std::string scenes = demo_scene().parent_path().string();
  const std::string text = write(path("text.csv"), "t_ms,delay_ms\n0,20\n");
  std::vector<BadInput> inputs;
  const auto refused = [&](std::vector<std::string> arguments, std::vector<std::string> says, int exit_code = 2) {
    std::string what;
    for (const std::string& argument : arguments) what += argument + " ";
    arguments.insert(arguments.begin(), "sweep");
    inputs.push_back({what, "tendon-lab", std::move(arguments), std::move(says), exit_code});
  };
  const auto with = [&](std::vector<std::string> options, std::vector<std::string> says, int exit_code = 2) {
    options.insert(options.begin(), {demo, "--network", "lan"});
    refused(std::move(options), std::move(says), exit_code);
  };
  refused({"--network", "lan"}, {"scene", "required"});
  refused({demo}, {"--network", "required"});
  refused({scenes + "/fleet.toml", "--network", "lan"}, {"expected a scene with one device, found count = 64"});
  refused({scenes + "/falcon.toml", "--network", "lan"}, {"expected a simulated device, found kind = \"falcon\""});
  refused({path("none.toml"), "--network", "lan"}, {"cannot read", "none.toml", "No such file"}, 1);
  refused({path(""), "--network", "lan"}, {"cannot read", "Is a directory"}, 1);
  refused({demo, "--network", "lann"}, {"--network", "lann", "did you mean lan?"});
  refused({demo, "--network", "delay=0:50:20ms"}, {"--network", "reaches B in whole steps", "0:50:20"});
  refused({demo, "--network", "loss={0,1"}, {"--network", "expected } at the end of {0,1"});
  refused({demo, "--network", "trace:none.csv"}, {"cannot read trace none.csv", "No such file"}, 1);
  refused({demo, "--network", "trace:" + text}, {text + ":1", "expected"}, 1);
  with({"--stiffness", "10:0:1"}, {"--stiffness", "10:0:1"});
  with({"--stiffness", "soft"}, {"--stiffness", "soft"});
  with({"--rate-hz", "0"}, {"--rate-hz", "\"0\""});
  with({"--law", "feeel"}, {"feeel", "did you mean feel?"});
  with({"--law", "clamp"}, {"clamp"});
  with({"--seeds", "0"}, {"--seeds: expected at least 1"});
  with({"--seeds", "-1"}, {"--seeds: expected a whole number from 0, got -1"});
  with({"--first-seed", "-1"}, {"--first-seed: expected a whole number from 0, got -1"});
  with({"--for-s", "0.5"}, {"--for-s: expected more than 1 s"});
  with({"--jobs", "0"}, {"--jobs", "0"});
  with({"--quiet-mps", "-1"}, {"--quiet-mps", "-1"});
  with({"--passive-j", "-1"}, {"--passive-j", "-1"});
  with({"--plot", "box", "--out", path("a")}, {"--plot", "box", "zwidth"});
  with({"--plot", "zwidth"}, {"--plot", "--out"});
  with({"--json", "--out", path("a")}, {"--json", "--out"});
  with({"--units", "7"}, {"units \"7\": expected FIRST:COUNT"});
  with({"--out", text}, {"cannot use " + text + ": Not a directory"}, 1);
  with({"--out", "/proc/none"}, {"cannot use /proc/none: No such file or directory"}, 1);
  expect_refusals(folder.path(), inputs);
  EXPECT_FALSE(std::filesystem::exists(path("a")));
}

TEST(BadInput, OfAClientIsAnsweredWithWhatIsWrong) {
  const ScratchFolder folder;
  std::vector<BadInput> inputs;
  for (const std::string client : {"virtual_wall", "echo_motion"}) {
    inputs.push_back({"bad address", client, {"--server", "there"}, {"--server", "expected HOST:PORT", "there"}});
    inputs.push_back({"bad name", client, {"--server", "dns-sd:a."}, {"--server", "expected NAME", "a domain"}});
    inputs.push_back({"port too high", client, {"--server", "127.0.0.1:70000"}, {"--server", "127.0.0.1:70000"}});
    inputs.push_back({"negative rate", client, {"--rate-hz", "-1"}, {"--rate-hz", "-1"}});
    inputs.push_back({"empty rate", client, {"--rate-hz", ""}, {"--rate-hz: ", "\"\""}});
    inputs.push_back({"decimal comma", client, {"--rate-hz", "1,5"}, {"--rate-hz", "(a decimal point?)"}});
    inputs.push_back({"unknown option", client, {"--sevrer", "127.0.0.1:47100"}, {"--sevrer"}});
  }
  inputs.push_back({"not a number", "virtual_wall", {"--stiffness-n-per-m", "nan"}, {"--stiffness-n-per-m", "nan"}});
  expect_refusals(folder.path(), inputs);
}

TEST(BadInput, ASecondServerOnAUsedPortSaysSoAndTouchesNoRecording) {
  const ScratchFolder folder;
  const auto file = folder.path() / "run.mcap";
  Server server(folder.path(), demo_scene(), {"--record", file.string()});
  expect_refusals(folder.path(), {{"port in use",
                                   "tendond",
                                   {demo_scene().string(), "--listen", server.address(), "--record", file.string()},
                                   {"cannot listen on " + server.address() + ": Address already in use"},
                                   1}});
  expect_refusals(folder.path(), {{"port in use",
                                   "tendon-inject",
                                   {"--listen", server.address(), "--to", "127.0.0.1:9"},
                                   {"cannot listen on " + server.address() + ": Address already in use"},
                                   1}});
  const std::string end = server.stop();
  EXPECT_EQ(read_recording(file).steps.size(), count_in(end, "steps"));
}

TEST(BadInput, AnAddressThatOthersCanReachIsRefusedWithTheReason) {
  const ScratchFolder folder;
  const std::string reason = "anyone on the network could command forces";
  const std::string scene =
      write(folder.path() / "open.toml", std::string(kFalcon) + "[network]\nlisten = \"0.0.0.0:47100\"\n");
  const std::string demo = demo_scene().string();
  expect_refusals(
      folder.path(),
      {
          {"all IPv4", "tendond", {demo, "--listen", "0.0.0.0:0"}, {"cannot listen on 0.0.0.0:0", reason}},
          {"all IPv6", "tendond", {demo, "--listen", "[::]:0"}, {"cannot listen on [::]:0", reason}},
          {"another's", "tendond", {demo, "--listen", "192.0.2.1:0"}, {"cannot listen on 192.0.2.1:0", reason}},
          {"in the scene", "tendond", {scene}, {scene + ":5: network.listen: expected", "loopback"}},
          {"the injector's",
           "tendon-inject",
           {"--listen", "0.0.0.0:0", "--to", "127.0.0.1:9"},
           {"cannot listen on 0.0.0.0:0", "anyone on the network", "--open-to-network"}},
      });
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "demo.mcap"));
}

TEST(Help, OfEveryProgramHasAnExample) {
  const ScratchFolder folder;
  std::vector<std::string> programs = {"tendond", "tendon-inject", "virtual_wall", "echo_motion"};
  if (std::filesystem::exists(program("tendon-lab"))) programs.emplace_back("tendon-lab");
  for (const std::string& name : programs) {
    SCOPED_TRACE(name);
    Process process(program(name), {"--help"}, folder.path());
    EXPECT_EQ(process.wait(), 0);
    EXPECT_EQ(process.err(), "");
    std::string help = process.out();
    std::transform(help.begin(), help.end(), help.begin(), [](unsigned char c) { return std::tolower(c); });
    EXPECT_NE(help.find("example"), std::string::npos) << help;
  }
}

}  // namespace
}  // namespace tendon::e2e::bad_input_test
