// SPDX-License-Identifier: Apache-2.0
// Tests `tendon-fem serve` with a hand and with faulty workers. No times are measured.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::proxy_engine_test {
namespace {

using testing::ScratchFolder;

/// Forces fade so fast that a gap of 0.5 s, the minimum of a proxy, passes through every stage.
std::string pressing_hand() {
  std::string text(kPressingHand);
  const auto force = text.find("[force]");
  return text.replace(force, std::string::npos, "[force]\nhold_ms = 100\nsafe_stop_ms = 200\n");
}

struct Outcome {
  std::string out;
  std::string err;
  Recording recording;
  std::vector<Mode> modes;
  std::uint64_t late_engine = 0;
  std::uint64_t late_network = 0;

  std::uint64_t workers(const std::string& key) const { return count_in(out.substr(out.rfind(R"({"workers")")), key); }
  std::uint64_t sessions() const { return count_in(out.substr(out.rfind(R"({"summary")")), "sessions"); }
  /// Returns whether `wanted` is a subsequence of the modes.
  bool went_through(const std::vector<Mode>& wanted) const {
    auto next = wanted.begin();
    for (const Mode mode : modes) {
      if (next != wanted.end() && mode == *next) ++next;
    }
    return next == wanted.end();
  }
};

Outcome run(const std::string& way, const std::vector<std::string>& more = {}, const std::string& seconds = "2") {
  const ScratchFolder folder;
  const auto scene_file = folder.path() / "hand.toml";
  write(scene_file, pressing_hand());
  const auto file = folder.path() / "run.mcap";
  Server server(folder.path(), scene_file, {"--record", file.string()});
  std::vector<std::string> arguments = {"serve",        "scene.toml",     "--worker",  TENDON_FAKE_WORKER " " + way,
                                        "--server",     server.address(), "--dead-ms", "200",
                                        "--duration-s", seconds,          "--json"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  Process proxy(program("tendon-fem"), arguments, folder.path());
  EXPECT_EQ(proxy.wait(), 0) << proxy.err();
  server.stop();
  Outcome run{.out = proxy.out(), .err = proxy.err(), .recording = read_recording(file), .modes = {}};
  for (std::size_t at = 0; (at = run.out.find(R"({"report")", at)) != std::string::npos; ++at) {
    run.late_engine += count_in(run.out.substr(at), "late_engine");
    run.late_network += count_in(run.out.substr(at), "late_network");
  }
  expect_passive(run.recording, read_scene(scene_file));
  LocalTime newest{};
  std::uint64_t sequence = 0;
  for (const StepRecord& step : run.recording.steps) {
    if (run.modes.empty() || run.modes.back() != step.mode) run.modes.push_back(step.mode);
    if (step.force_sequence == sequence || step.force_sequence == 0) continue;
    sequence = step.force_sequence;
    const LocalTime answered = step.hand.at - step.loop_age;
    EXPECT_GE(answered, newest) << "a force answers an older motion than the one before";
    newest = answered;
  }
  return run;
}

const std::vector<Mode> kLadder = {Mode::kActive, Mode::kHolding, Mode::kDecaying, Mode::kSafeStop, Mode::kActive};

class ProxyWorker : public ::testing::TestWithParam<const char*> {};

TEST_P(ProxyWorker, ThatGoesWrongIsReplacedInOneSession) {
  const std::string way = GetParam();
  const Outcome gone = run(way + " 300");
  EXPECT_TRUE(gone.went_through(kLadder)) << gone.err;
  EXPECT_EQ(gone.sessions(), 1U);
  EXPECT_GE(gone.workers("launches"), 2U) << gone.err;
  EXPECT_GE(gone.workers("answers"), 300U);
  EXPECT_GT(gone.late_engine, gone.late_network) << "blamed on the engine, not on the network";
  EXPECT_NE(gone.err.find("tendon-fem: worker 1 was stopped: "), std::string::npos) << gone.err;
}

INSTANTIATE_TEST_SUITE_P(AllWays, ProxyWorker, ::testing::Values("dies", "stops", "sleeps", "nan", "shouts"),
                         [](const auto& way) {
                           std::string name = way.param;
                           std::erase(name, '-');
                           return name;
                         });

TEST(ProxyEngine, RefusesNoiseAndTakesTheAnswerAfterIt) {
  const Outcome noise = run("babbles 300");
  EXPECT_GE(noise.workers("refused"), 1000U);
  EXPECT_GE(noise.workers("answers"), 301U);
  EXPECT_NE(noise.err.find("an answer of the worker was rejected: it is not a Datagram"), std::string::npos)
      << noise.err;
}

TEST(ProxyEngine, DoesNotSendLateAnswersAndKeepsTheWorker) {
  const Outcome late = run("is-slow 300", {"--deadline-ms", "60"});
  EXPECT_TRUE(late.went_through({Mode::kActive, Mode::kHolding, Mode::kDecaying, Mode::kSafeStop})) << late.err;
  EXPECT_EQ(late.workers("launches"), 1U) << late.err;
  EXPECT_GE(late.workers("late"), 3U);
  EXPECT_GT(late.late_engine, late.late_network);
}

TEST(ProxyEngine, WithoutAWorkerThatStartsIsASilentEngine) {
  const Outcome none = run("ends-at-once");
  EXPECT_EQ(none.sessions(), 1U);
  EXPECT_GE(none.workers("launches"), 2U);
  EXPECT_EQ(none.modes, std::vector<Mode>{Mode::kIdle});
  EXPECT_NE(none.err.find("it exited with status 3; the next one starts in 0.5 s"), std::string::npos) << none.err;
}

TEST(ProxyEngine, AnswersFromATableUntilTheNextWorker) {
  const ScratchFolder folder;
  const auto scene = demo_scene().replace_filename("softbody.toml").string();
  const auto table = (folder.path() / "soft.table").string();
  Process condense(program("tendon-softbody"), {"condense", scene, table}, folder.path());
  ASSERT_EQ(condense.wait(), 0) << condense.err();
  std::ifstream in(scene);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const auto scene_file = folder.path() / "hand.toml";
  write(scene_file, pressing_hand());
  write(folder.path() / "scene.toml", text);
  const auto file = folder.path() / "run.mcap";
  Server server(folder.path(), scene_file, {"--record", file.string()});
  Process proxy(program("tendon-fem"),
                {"serve", "scene.toml", "--worker", TENDON_FAKE_WORKER " dies 300", "--server", server.address(),
                 "--fallback", table, "--duration-s", "3", "--json"},
                folder.path());
  EXPECT_EQ(proxy.wait(), 0) << proxy.err();
  server.stop();
  const std::string workers = proxy.out().substr(proxy.out().rfind(R"({"workers")"));
  EXPECT_GE(count_in(workers, "launches"), 2U) << proxy.err();
  EXPECT_GE(count_in(workers, "fallback"), 100U);
  EXPECT_GE(count_in(workers, "answers"), 300U);

  const Scene hand = read_scene(scene_file);
  const Recording recording = read_recording(file);
  expect_passive(recording, hand);
  bool begun = false;
  std::size_t with_error = 0;
  for (const StepRecord& step : recording.steps) {
    begun = begun || step.mode == Mode::kActive;
    if (begun) {
      EXPECT_NE(step.mode, Mode::kSafeStop) << "never worse than fading";
    }
    with_error += step.force_error && *step.force_error > 0.02 ? 1 : 0;  // a current answer reports 0.01
    const double grows = step.force.norm() - step.was_applied.norm();
    EXPECT_LE(grows, 1.001 * hand.loop.control.max_slew * 1e-9 * static_cast<double>(step.held.count()) + 1e-9);
  }
  EXPECT_GE(with_error, 50U) << "the fallback's error is raised by what it differs from live answers";
}

TEST(ProxyEngine, KilledLeavesNoWorkerBehind) {
  const ScratchFolder folder;
  const auto scene_file = folder.path() / "hand.toml";
  write(scene_file, pressing_hand());
  const auto file = folder.path() / "run.mcap";
  Server server(folder.path(), scene_file, {"--record", file.string()});
  {
    Process proxy(
        program("tendon-fem"),
        {"serve", "scene-of-a-killed-proxy.toml", "--worker", TENDON_FAKE_WORKER, "--server", server.address()},
        folder.path());
    proxy.wait_for_line("worker 1 is ready");
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    proxy.signal(SIGKILL);
    proxy.wait();
  }
  const auto left = [] {
    int count = 0;
    std::error_code ignored;
    for (const auto& entry : std::filesystem::directory_iterator("/proc", ignored)) {
      std::ifstream process(entry.path() / "cmdline", std::ios::binary);
      const std::string line{std::istreambuf_iterator<char>(process), {}};
      count += line.find("scene-of-a-killed-proxy") != std::string::npos ? 1 : 0;
    }
    return count;
  };
  for (int i = 0; i < 300 && left() > 0; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(left(), 0);
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  server.stop();
  const Recording recording = read_recording(file);
  expect_passive(recording, read_scene(scene_file));
  EXPECT_EQ(recording.steps.back().mode, Mode::kSafeStop);
}

TEST(ProxyEngine, ExplainsABodyWithoutAServer) {
  const ScratchFolder folder;
  const auto scene = demo_scene().replace_filename("softbody.toml").string();
  Process explain(program("tendon-fem"), {"explain", scene, "--ranks", "1,64"}, folder.path());
  EXPECT_EQ(explain.wait(), 0) << explain.err();
  EXPECT_NE(explain.out().find("Recommended: the table"), std::string::npos) << explain.out();
  Process wrong(program("tendon-fem"), {"explain", scene, "--ranks", "0"}, folder.path());
  EXPECT_EQ(wrong.wait(), 2);
  Process none(program("tendon-fem"), {}, folder.path());
  EXPECT_EQ(none.wait(), 2);
}

}  // namespace
}  // namespace tendon::e2e::proxy_engine_test
