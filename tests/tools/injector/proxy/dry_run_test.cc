// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/proxy/dry_run.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>

#include "tests/server/scratch_folder.h"
#include "tests/support/refusal.h"
#include "tests/tools/injector/proxy/status.h"
#include "tests/tools/injector/traces/trace.h"

namespace tendon::injector::dry_run_test {
namespace {

using testing::ScratchFolder;

std::string printed(const NetworkOptions& network, const DryRun& options) {
  std::ostringstream out;
  dry_run(prepare(network), options, out, nullptr);
  return out.str();
}

TEST(DryRun, PrintsOneObjectPerPacketUpAndDownByTurns) {
  const NetworkOptions network{.profile = {}, .up = "delay=20ms", .down = "loss=100%", .seed = 7};
  EXPECT_EQ(
      printed(network, {.count = 5, .json = true}),
      "{\"dir\":\"up\",\"index\":0,\"t_in_ns\":0,\"verdict\":\"pass\",\"cause\":\"delay\",\"t_out_ns\":20000000}\n"
      "{\"dir\":\"down\",\"index\":0,\"t_in_ns\":0,\"verdict\":\"drop\",\"cause\":\"loss\",\"t_out_ns\":null}\n"
      "{\"dir\":\"up\",\"index\":1,\"t_in_ns\":1000000,\"verdict\":\"pass\",\"cause\":\"delay\",\"t_out_ns\":21000000}"
      "\n"
      "{\"dir\":\"down\",\"index\":1,\"t_in_ns\":1000000,\"verdict\":\"drop\",\"cause\":\"loss\",\"t_out_ns\":null}\n"
      "{\"dir\":\"up\",\"index\":2,\"t_in_ns\":2000000,\"verdict\":\"pass\",\"cause\":\"delay\",\"t_out_ns\":22000000}"
      "\n");
}

TEST(DryRun, OfTheSameSeedIsTheSameAndOfAnotherAnother) {
  NetworkOptions network{.profile = "wifi-bad", .seed = 7};
  const std::string once = printed(network, {.count = 1000, .json = true});
  EXPECT_EQ(printed(network, {.count = 1000, .json = true}), once);
  network.seed = 8;
  EXPECT_NE(printed(network, {.count = 1000, .json = true}), once);
}

TEST(DryRun, SizeAndRateMeetABottleneck) {
  // 1000 bits take 1 ms: at 500 Hz no datagram waits, at 2 kHz all but the first do.
  const NetworkOptions network{.profile = "rate=1Mbit/s overhead=0", .seed = 7};
  EXPECT_NE(printed(network, {.count = 4, .rate_hz = 500, .bytes = 125})
                .find("up   1  at 2.000000 ms  pass queue  after 1.000000 ms"),
            std::string::npos);
  EXPECT_NE(printed(network, {.count = 4, .rate_hz = 2000, .bytes = 125})
                .find("up   1  at 0.500000 ms  pass queue  after 1.500000 ms"),
            std::string::npos);
}

TEST(DryRun, RecordsATraceWhoseReplayIsTheSame) {
  const NetworkOptions network{.profile = "delay=uniform(5ms,35ms) loss=10% duplicate=5%", .seed = 7};
  const PreparedNetwork prepared = prepare(network);
  std::ostringstream decisions;
  std::ostringstream recorded;
  {
    TraceWriter trace(recorded, prepared.header());
    dry_run(prepared, {.count = 2000, .json = true}, decisions, &trace);
  }
  PreparedNetwork again = prepare({.seed = 1});
  std::istringstream file(recorded.str());
  again.replay = std::make_unique<const Trace>(read_trace(file, "trace"));
  std::ostringstream replayed;
  dry_run(again, {.count = 2000, .json = true}, replayed, nullptr);
  EXPECT_EQ(replayed.str(), decisions.str());
}

/// Writes the record of a dry run.
std::filesystem::path recorded(const ScratchFolder& folder, const std::string& profile, std::uint64_t count) {
  const PreparedNetwork network = prepare({.profile = profile, .seed = 7});
  std::ofstream file(folder.path() / "trace.csv");
  std::ostringstream ignored;
  TraceWriter trace(file, network.header());
  dry_run(network, {.count = count}, ignored, &trace);
  return folder.path() / "trace.csv";
}

TEST(DryRun, RepeatsStopsOrPassesAtTheEndOfATraceAndSaysHowOftenItWasPlayed) {
  using AtEnd = TracePlayer::AtEnd;
  const ScratchFolder folder;
  const std::filesystem::path file = recorded(folder, "delay=20ms loss=pattern(01)", 20);
  const auto run = [&](std::optional<AtEnd> at_end) {
    const PreparedNetwork network = prepare({.replay = file, .at_end = at_end});
    std::ostringstream out;
    const auto [up, down] = dry_run(network, {.count = 70}, out, nullptr);
    const std::string text = out.str();
    return std::to_string(std::ranges::count(text, '\n')) + " lines, played " + played_text(up) + " and " +
           played_text(down);
  };
  EXPECT_EQ(run({}), "70 lines, played 3.5 and 3.5");
  EXPECT_EQ(run(AtEnd::kRepeat), "70 lines, played 3.5 and 3.5");
  EXPECT_EQ(run(AtEnd::kStop), "20 lines, played 1 and 1");
  EXPECT_EQ(run(AtEnd::kPass), "70 lines, played 1 and 1");
}

TEST(Prepare, TheRecordOfAReplayWithAnAddedProfileNamesBoth) {
  const ScratchFolder folder;
  const std::filesystem::path file = recorded(folder, "delay=20ms", 20);
  const TraceHeader header = prepare({.replay = file, .add = "loss=burst(1%,3)", .seed = 9}).header();
  EXPECT_EQ(header.seed, 9U);
  EXPECT_EQ(header.up, "replay of " + file.string() + ", then loss=burst(1%,3)");
  EXPECT_EQ(header.up, header.down);
  EXPECT_EQ(prepare({.replay = file}).header().up, "");
}

TEST(Prepare, AProfileThatIsAddedToATraceThatReordersIsFree) {
  const ScratchFolder folder;
  const std::filesystem::path file = recorded(folder, "delay=uniform(0ms,20ms) order=free", 200);
  EXPECT_TRUE(prepare({.replay = file, .add = "loss=1%"}).text[0].ends_with(", then loss=1% order=free"));
}

TEST(Prepare, NamesTheOptionThatIsWrong) {
  const auto refusal = [](const NetworkOptions& network) {
    return thrown_by<std::exception>([&] { prepare(network); });
  };
  EXPECT_TRUE(refusal({.profile = "loss=2"}).starts_with("--profile: ")) << refusal({.profile = "loss=2"});
  EXPECT_TRUE(refusal({.profile = "lan", .down = "loss=2"}).starts_with("--down: "));
  EXPECT_NE(refusal({.replay = "none.csv"}).find("none.csv"), std::string::npos);
  const ScratchFolder folder;
  const std::filesystem::path file = recorded(folder, "delay=20ms", 20);
  EXPECT_TRUE(refusal({.replay = file, .seed = 7}).starts_with("--seed: expected --add"));
  EXPECT_TRUE(refusal({.replay = file, .add = "loss=2"}).starts_with("--add: loss is 200%"));
  std::ofstream(file) << "# tendon-trace 1\n# benign up 20000000\n"
                      << "dir,link,index,t_in_ns,bytes,hash,verdict,cause,t_out_ns,t_actual_ns,duplicate_ns,"
                         "stale_back,stale_ns,flipped_bit,truncated_to,rebinds\n";
  EXPECT_EQ(refusal({.replay = file, .at_end = TracePlayer::AtEnd::kRepeat}),
            "--at-end: " + file.string() + " is sparse and has no end");
  EXPECT_EQ(refusal({.replay = file}), "");
}

}  // namespace
}  // namespace tendon::injector::dry_run_test
