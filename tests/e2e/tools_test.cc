// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "server/recording/byte_sink.h"
#include "server/recording/recorder.h"
#include "tests/e2e/stage/process.h"
#include "tests/e2e/stage/small_disk.h"
#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::tools_test {
namespace {

using testing::ScratchFolder;

TEST(Tools, ANamedPipeIsNoInputAndIsNotWaitedFor) {
  const ScratchFolder folder;
  const std::string pipe = folder.path() / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const std::string histogram = "delay=histogram(" + pipe + ")";
  for (const auto& [tool, arguments] : std::vector<std::pair<std::string, std::vector<std::string>>>{
           {"tendon-inject", {"--dry-run", "--profile", histogram}},
           {"tendon-inject", {"--dry-run", "--scenario", pipe}},
           {"tendon-inject", {"--dry-run", "--replay", pipe}},
           {"tendon-inject", {"import", "ping", pipe, "--out", "run.csv"}},
           {"tendon-inject", {"export", pipe}},
           {"tendon-identify", {pipe}},
           {"tendon-worlds", {"run", "--seeds", pipe}},
           {"tendon-report", {pipe}}}) {
    Process process(program(tool), arguments, folder.path());
    SCOPED_TRACE(tool + " " + arguments.front());
    EXPECT_NE(process.wait(), 0);
    EXPECT_NE(process.err().find("it is a named pipe, expected a regular file"), std::string::npos) << process.err();
  }
}

std::vector<std::filesystem::path> programs() {
  std::vector<std::filesystem::path> found;
  const auto shown = program("tendond").parent_path();
  for (const auto& file : std::filesystem::directory_iterator(shown)) {
    if (file.is_regular_file() && access(file.path().c_str(), X_OK) == 0) found.push_back(file.path());
  }
  for (const std::string name : {"definiteness_soak", "falcon-server", "golden_decisions", "tendon-soak"}) {
    const auto file = shown.parent_path() / "tests" / name;
    if (std::filesystem::exists(file)) found.push_back(file);
  }
  std::ranges::sort(found);
  return found;
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(Tools, EachHasHelpWithAnExampleAndAVersionAndWritesNothing) {
  const ScratchFolder folder;
  ASSERT_GT(programs().size(), 5U);
  for (const auto& tool : programs()) {
    SCOPED_TRACE(tool);
    Process help(tool, {"--help"}, folder.path());
    EXPECT_EQ(help.wait(), 0) << help.err();
    EXPECT_TRUE(has(help.out(), "Example")) << help.out();
    EXPECT_TRUE(has(help.out(), "Exit: 0 ")) << help.out();
    for (const char* const leftover : {"FLOAT", "TEXT:", " in [", ":{", "(1x)", " x 3"}) {
      EXPECT_FALSE(has(help.out(), leftover)) << leftover << '\n' << help.out();
    }
    Process version(tool, {"--version"}, folder.path());
    EXPECT_EQ(version.wait(), 0) << version.err();
    EXPECT_TRUE(version.out().starts_with("0.") && version.out().size() < 40) << version.out();
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  }
}

TEST(Tools, EachRefusesAnUnknownOptionWithTwoAndWritesNothing) {
  const ScratchFolder folder;
  for (const auto& tool : programs()) {
    SCOPED_TRACE(tool);
    Process process(tool, {"--no-such-option"}, folder.path());
    EXPECT_EQ(process.wait(), 2) << process.out();
    EXPECT_TRUE(has(process.err(), "--no-such-option")) << process.err();
    EXPECT_EQ(process.out(), "");
    EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  }
}

TEST(Tools, AMisspeltWordIsAnsweredWithTheOneThatWasMeant) {
  const ScratchFolder folder;
  for (const auto& [tool, arguments, meant] :
       std::vector<std::tuple<std::string, std::vector<std::string>, std::string>>{
           {"tendond", {"explian", "demo.toml"}, "did you mean explain?"},
           {"tendond", {demo_scene().string(), "--duraton-s", "1"}, "did you mean --duration-s?"},
           {"tendond", {"--scene-help", "limitr"}, "did you mean limiter?"},
           {"tendon-lab", {"comparee", "--out", "x"}, "did you mean compare?"},
           {"tendon-inject", {"import", "pign", "a", "--out", "b"}, "did you mean ping?"},
           {"tendon-inject", {"--dry-run", "--profile", "wifi-baad"}, "did you mean wifi-bad?"},
           {"tendon-worlds", {"rnu"}, "did you mean run?"},
           {"tendon-replay", {"--merg", "b"}, "did you mean --merge?"},
           {"virtual_wall", {"--stifness-n-per-m", "1"}, "did you mean --stiffness-n-per-m?"}}) {
    Process process(program(tool), arguments, folder.path());
    EXPECT_EQ(process.wait(), 2) << tool;
    EXPECT_TRUE(has(process.err(), meant)) << process.err();
  }
}

std::filesystem::path recording_in(const std::filesystem::path& folder) {
  Process server(
      program("tendond"),
      {demo_scene().string(), "--listen", "127.0.0.1:0", "--record", "run.mcap", "--duration-s", "0.5", "--json"},
      folder);
  EXPECT_EQ(server.wait(), 0) << server.err();
  return folder / "run.mcap";
}

TEST(Tools, APictureThatTheDiskHasNoRoomForIsAFailureWithASentence) {
  const ScratchFolder folder;
  const SmallDisk disk(folder.path() / "disk", "16k");
  if (disk.error() != 0) GTEST_SKIP() << disk.why_not();
  const auto run = recording_in(folder.path());
  for (const std::string name : {"run.png", "run.svg"}) {
    const auto picture = disk.path() / name;
    Process report(program("tendon-report"), {run.string(), "--out", picture.string()}, folder.path());
    EXPECT_EQ(report.wait(), 1) << report.out() << report.err();
    EXPECT_NE(report.err().find(picture.string()), std::string::npos) << report.err();
    EXPECT_EQ(report.out().find("picture: "), std::string::npos) << report.out();
    std::filesystem::remove(picture);
  }
}

TEST(Tools, ATableThatTheDiskHasNoRoomForIsAFailureWithASentence) {
  const ScratchFolder folder;
  const SmallDisk disk(folder.path() / "disk", "16k");
  if (disk.error() != 0) GTEST_SKIP() << disk.why_not();
  const auto run = recording_in(folder.path());
  const auto table = disk.path() / "run.csv";
  Process replay(program("tendon-replay"), {run.string(), "--csv", table.string()}, folder.path());
  EXPECT_EQ(replay.wait(), 1) << replay.out() << replay.err();
  EXPECT_NE(replay.err().find(table.string()), std::string::npos) << replay.err();
}

TEST(Tools, AFolderWithoutWritePermissionIsNamed) {
  const ScratchFolder folder;
  SmallDisk disk(folder.path() / "disk", "16k");
  if (disk.error() != 0) GTEST_SKIP() << disk.why_not();
  ASSERT_TRUE(disk.make_read_only());
  const std::string demo = demo_scene().string();
  write(folder.path() / "delays.csv", "1\n2\n3\n");
  for (const auto& [tool, arguments] : std::vector<std::pair<std::string, std::vector<std::string>>>{
           {"tendon-lab", {"sweep", demo, "--network", "lan", "--for-s", "2", "--out", "disk"}},
           {"tendon-lab", {"sweep", demo, "--network", "lan", "--for-s", "2", "--out", "disk/new"}},
           {"tendon-lab", {"boundary", "--out", "disk/new"}},
           {"tendon-inject", {"import", "csv", "delays.csv", "--out", "disk/run.csv"}},
           {"tendon-sweep",
            {"plan", "disk/plan", "--units", "1:5", "--per-shard", "1", "--", program("tendon-lab")}}}) {
    SCOPED_TRACE(tool + " " + arguments.front());
    Process process(program(tool), arguments, folder.path());
    EXPECT_EQ(process.wait(), 1) << process.out() << process.err();
    EXPECT_TRUE(has(process.err(), "disk")) << process.err();
    EXPECT_TRUE(has(process.err(), "Read-only file system") || has(process.err(), "write permission")) << process.err();
  }
}

TEST(Tools, AnExperimentThatCannotBeRunIsRefusedWithTheReason) {
  const ScratchFolder folder;
  const auto scene = [](const char* name) { return demo_scene().replace_filename(name).string(); };
  const std::string demo = demo_scene().string();
  write(folder.path() / "letter.pcap", "a letter to a friend\n");
  write(folder.path() / "empty.pcap", "");
  struct Case {
    std::vector<std::string> command;
    int exit_code;
    std::string says;
  };
  for (const Case& one : std::vector<Case>{
           {{"tendon-lab", "sweep", scene("fleet.toml"), "--network", "lan"}, 2, "expected a scene with one device"},
           {{"tendon-lab", "sweep", scene("leader.toml"), "--network", "lan"}, 2, "expected a scene without [teleop"},
           {{"tendon-lab", "sweep", scene("falcon.toml"), "--network", "lan"}, 2, "expected a simulated device"},
           {{"tendon-lab", "sweep", scene("handle.toml"), "--network", "lan", "--law", "energy-bounding"},
            2,
            "the other laws only limit the force on a point"},
           {{"tendon-lab", "sweep", demo, "--network", "delay=10:0:5ms"}, 2, "expected a range A:B:STEP"},
           {{"tendon-lab", "sweep", demo, "--network", "loss={}"}, 2, "expected a value on both sides of each comma"},
           {{"tendon-lab", "sweep", demo, "--network", "lan", "--stiffness", "500:100:100"}, 2, "--stiffness"},
           {{"tendon-lab", "sweep", demo, "--network", "trace:none.csv"}, 1, "cannot read trace none.csv"},
           {{"tendon-lab", "sweep", demo, "--network", "trace:letter.pcap"}, 1, "letter.pcap"},
           {{"tendon-inject", "import", "pcap", "none.pcap", "letter.pcap", "--port", "1", "--out", "x.csv"},
            1,
            "none.pcap"},
           {{"tendon-inject", "import", "pcap", "letter.pcap", "letter.pcap", "--port", "1", "--out", "x.csv"},
            1,
            "letter.pcap: expected a capture (pcap or pcapng), found another file"},
           {{"tendon-inject", "import", "pcap", "empty.pcap", "empty.pcap", "--port", "1", "--out", "x.csv"},
            1,
            "empty.pcap: expected a capture (pcap or pcapng), found less than 4 bytes"}}) {
    std::string line;
    for (const std::string& word : one.command) line += word + " ";
    SCOPED_TRACE(line);
    Process process(program(one.command.front()), {one.command.begin() + 1, one.command.end()}, folder.path());
    EXPECT_EQ(process.wait(), one.exit_code) << process.err();
    EXPECT_TRUE(has(process.err(), one.says)) << process.err();
    EXPECT_EQ(process.out(), "");
    EXPECT_FALSE(std::filesystem::exists(folder.path() / "x.csv"));
  }
}

// Uses bash, because `head` must exit while the bench is still writing. Exit code 124 would come from timeout.
TEST(Tools, TheBenchEndsWhenItsReaderGoes) {
  const ScratchFolder folder;
  Process bash(
      "/bin/bash",
      {"-c", "timeout -k 1 25 \"$0\" bench --only round-trip --quick --json | head -1; echo \"exit ${PIPESTATUS[0]}\"",
       program("tendon-lab")},
      folder.path());
  EXPECT_EQ(bash.wait(), 0) << bash.err();
  EXPECT_NE(bash.out().find("exit 1\n"), std::string::npos) << bash.out() << bash.err();
}

struct Mistake {
  std::string what;
  int exit_code;
  std::vector<std::vector<std::string>> made_by;
};

TEST(ExitCodes, OfTheSameMistakeAreTheSameInEveryProgram) {
  const ScratchFolder folder;
  const std::string run = recording_in(folder.path());
  const std::string demo = demo_scene().string();
  const std::string soft = demo_scene().replace_filename("softbody.toml").string();
  const std::string wrong = write(folder.path() / "wrong.toml", "[devise]\n");
  const std::string there = "a.file";
  write(folder.path() / there, "a letter to a friend\n");
  Server server(folder.path(), demo_scene());
  const std::string& port = server.address();
  const std::vector<Mistake> mistakes = {
      {"a file is missing",
       1,
       {{"tendond", "none.toml"},
        {"tendond", "explain", "none.toml"},
        {"tendon-report", "none.mcap"},
        {"tendon-report", "--pairs", "none.mcap"},
        {"tendon-replay", "none.mcap"},
        {"tendon-replay", run, "none.mcap"},
        {"tendon-replay", "none.mcap", "--repair", "whole.mcap"},
        {"tendon-replay", run, "--merge", "none.mcap", "--into", "pair.mcap"},
        {"tendon-identify", "none.csv"},
        {"tendon-identify", "--simulate", "touch", "--from", "none.json"},
        {"tendon-lab", "boundary", "--from", "none.json"},
        {"tendon-worlds", "run", "--seeds", "none.txt"},
        {"tendon-lab", "sweep", "none.toml", "--network", "lan"},
        {"tendon-lab", "sweep", demo, "--network", "trace:none.csv"},
        {"tendon-inject", "--dry-run", "--replay", "none.csv"},
        {"tendon-inject", "--dry-run", "--scenario", "none.toml"},
        {"tendon-inject", "--dry-run", "--profile", "delay=histogram(none.csv)"},
        {"tendon-inject", "import", "ping", "none.txt", "--out", "run.csv"},
        {"tendon-inject", "import", "pcap", "none.pcap", "none.pcap", "--port", "1", "--out", "run.csv"},
        {"tendon-inject", "export", "none.csv"},
        {"tendon-softbody", "none.toml"},
        {"tendon-softbody", "explain", "none.toml"},
        {"tendon-softbody", "condense", "none.toml", "x.table"},
        {"tendon-fem", "explain", "none.toml"},
        {"tendon-mesh", "none.stl", "--size", "5", "--out", "x.msh"},
        {"tendon-sweep", "here", "none"},
        {"tendon-sweep", "plan", "plan", "--units", "1:5", "--per-shard", "1", "--", "no-such-program"},
        {"tendon-dash", "--key", "none.key"},
        {"tendon-bridge", "vrpn", "--key", "none.key"},
        {"virtual_wall", "--key", "none.key"},
        {"tendon-conformance", "server", "127.0.0.1:9", "--key", "none.key"}}},
      {"a folder is missing",
       1,
       {{"tendond", demo, "--listen", "127.0.0.1:0", "--record", "none/run.mcap"},
        {"tendond", "keygen", "wall", "--out", "none/wall.key"},
        {"tendon-report", run, "--out", "none/x.svg"},
        {"tendon-replay", run, "--csv", "none/x.csv"},
        {"tendon-replay", run, "--repair", "none/x.mcap"},
        {"tendon-inject", "--dry-run", "--record", "none/x.csv"},
        {"tendon-inject", "--listen", "127.0.0.1:0", "--to", "127.0.0.1:9", "--record", "none/x.csv"},
        {"tendon-dash", "--listen", "127.0.0.1:0", "--recordings", "none"}}},
      {"a file of another kind is there",
       1,
       {{"tendond", demo, "--listen", "127.0.0.1:0", "--record", there},
        {"tendon-replay", run, "--csv", there},
        {"tendon-replay", run, "--repair", there},
        {"tendon-inject", "--dry-run", "--record", there}}},
      {"a port is in use",
       1,
       {{"tendond", demo, "--listen", port},
        {"tendon-inject", "--listen", port, "--to", "127.0.0.1:9"},
        {"tendon-conformance", "client", "--listen", port, "--", "/bin/true"}}},
      {"an option is unknown",
       2,
       {{"tendond", demo, "--colour"},
        {"tendon-report", run, "--colour"},
        {"tendon-replay", run, "--colour"},
        {"tendon-identify", "--colour"},
        {"tendon-lab", "boundary", "--colour"},
        {"tendon-worlds", "run", "--colour"},
        {"tendon-inject", "--colour"},
        {"tendon-softbody", soft, "--colour"},
        {"tendon-fem", "explain", soft, "--colour"},
        {"tendon-mesh", "a.stl", "--colour"},
        {"tendon-sweep", "here", "plan", "--colour"},
        {"tendon-dash", "--colour"},
        {"tendon-bridge", "vrpn", "--colour"},
        {"virtual_wall", "--colour"},
        {"tendon-conformance", "server", "127.0.0.1:9", "--colour"}}},
      {"a scene has a word that means nothing",
       2,
       {{"tendond", wrong},
        {"tendond", "explain", wrong},
        {"tendon-lab", "sweep", wrong, "--network", "lan"},
        {"tendon-worlds", "replay", demo, "--trace", "none.csv"},
        {"tendon-softbody", wrong},
        {"tendon-softbody", "explain", wrong},
        {"tendon-softbody", "condense", wrong, "x.table"},
        {"tendon-fem", "explain", wrong}}},
      {"an address is none",
       2,
       {{"tendond", demo, "--listen", "here"},
        {"tendon-inject", "--listen", "here", "--to", "127.0.0.1:9"},
        {"tendon-dash", "--listen", "here"},
        {"tendon-bridge", "vrpn", "--server", "here"},
        {"virtual_wall", "--server", "here"},
        {"tendon-conformance", "server", "here"}}},
  };
  for (const Mistake& mistake : mistakes) {
    for (std::vector<std::string> words : mistake.made_by) {
      const auto path = program(words.front());
      if (!std::filesystem::exists(path)) continue;
      std::string line;
      for (const std::string& word : words) line += word + " ";
      SCOPED_TRACE(mistake.what + ": " + line);
      words.erase(words.begin());
      Process process(path, words, folder.path());
      EXPECT_EQ(process.wait(), mistake.exit_code) << process.err();
      EXPECT_EQ(process.out(), "");
      EXPECT_NE(process.err(), "");
      EXPECT_EQ(process.err().find("terminate called"), std::string::npos) << process.err();
    }
  }
}

TEST(ExitCodes, OfARecordingWhoseSceneIsWrongIsNotThatOfWrongUsage) {
  const ScratchFolder folder;
  FileSink sink(folder.path() / "run.mcap");
  Recorder recorder({.scene = {.text = "[devise]\n", .version = "1", .commit = "c"}}, sink);
  StepRecord step;
  step.tick = 1;
  recorder.record(step);
  recorder.close();
  Process replay(program("tendon-replay"), {"run.mcap"}, folder.path());
  EXPECT_EQ(replay.wait(), 1);
  EXPECT_NE(replay.err().find("run.mcap: the recorded scene:1: "), std::string::npos) << replay.err();
  EXPECT_EQ(replay.err().find("--help"), std::string::npos) << replay.err();
}

TEST(ExitCodes, TooLittleMemoryIsSaidInASentence) {
  const ScratchFolder folder;
  const std::string run = recording_in(folder.path());
  bool said = false;
  for (const auto& [name, arguments] : std::vector<std::pair<std::string, std::string>>{
           {"tendond", demo_scene().string() + " --listen 127.0.0.1:0 --record none.mcap --duration-s 0.1"},
           {"tendon-report", run},
           {"tendon-replay", run}}) {
    for (const int limit_mb : {10, 15, 20, 25, 27, 28, 29, 30, 31, 32, 33, 35, 40, 60}) {
      SCOPED_TRACE(name + " with " + std::to_string(limit_mb) + " MB");
      std::filesystem::remove(folder.path() / "none.mcap");
      Process process(
          "/bin/bash",
          {"-c", "ulimit -v " + std::to_string(1000 * limit_mb) + "; exec \"$0\" " + arguments, program(name)},
          folder.path());
      const int exit_code = process.wait();
      if (exit_code == 127) continue;  // the libraries cannot be loaded
      EXPECT_TRUE(exit_code == 0 || exit_code == 1) << exit_code << ": " << process.err();
      EXPECT_EQ(process.err().find("bad_alloc"), std::string::npos) << process.err();
      said = said || process.err().find("out of memory") != std::string::npos;
    }
  }
  EXPECT_TRUE(said) << "no limit was between too little and enough";
}

TEST(Tools, ARecordingOfAFolderThatVanishesIsSaidAndTheExitCodeIsOne) {
  const ScratchFolder folder;
  const auto runs = folder.path() / "runs";
  std::filesystem::create_directory(runs);
  Server server(folder.path(), demo_scene(), {"--record", (runs / "run.mcap").string()});
  Client echo("echo_motion", server.address(), folder.path(), {"--json"});
  echo.wait_for_line(R"("tick")");
  std::filesystem::remove_all(runs);
  const std::string told = server.process().wait_for_line("recording has stopped, but the device continues");
  EXPECT_NE(told.find("runs/run.mcap: it was deleted in the meantime"), std::string::npos) << told;
  const std::string end = server.stop(SIGTERM, 1);
  EXPECT_EQ(count_in(end, "recorded_steps") + count_in(end, "lost_steps"), count_in(end, "steps"));
  EXPECT_NE(server.process().err().find("the recording is incomplete: "), std::string::npos) << server.process().err();
}

}  // namespace
}  // namespace tendon::e2e::tools_test
