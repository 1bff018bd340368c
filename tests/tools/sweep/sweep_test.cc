// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/server/scratch_folder.h"
#include "tests/tools/sweep/child.h"
#include "tests/tools/sweep/results.h"
#include "tests/tools/sweep/submit.h"

namespace tendon::sweep::sweep_test {
namespace {

std::string contents(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class Sweep : public ::testing::Test {
 protected:
  ChildEnd sweep(std::vector<std::string> arguments, std::vector<std::string> environment = {}) const {
    arguments.insert(arguments.begin(), program());
    return run({.command = arguments, .environment = std::move(environment)});
  }
  ChildEnd plan(const std::string& units, const std::string& per_shard) {
    return sweep({"plan", folder(), "--units", units, "--per-shard", per_shard, "--", TENDON_TOY, faults()});
  }
  /// Injects this fault into the next program of the sweep that looks for it.
  void fault(const std::string& name) const { std::ofstream(faults() + "/" + name) << "!"; }
  std::string toy(const std::string& units) const {
    return run({.command = {TENDON_TOY, faults(), "--units", units, "--json"}}).output;
  }
  std::string folder() const { return (scratch_.path() / "sweep").string(); }
  std::string faults() const { return scratch_.path().string(); }
  std::string merged() const { return contents(folder() + "/merged.jsonl"); }

  /// tendon-sweep, or the mutant named by the environment.
  static std::string program() {
    const char* const other = std::getenv("TENDON_SWEEP_PROGRAM");  // NOLINT(concurrency-mt-unsafe): nobody sets it
    return other != nullptr ? other : TENDON_SWEEP;
  }

 private:
  testing::ScratchFolder scratch_;
};

TEST_F(Sweep, ShardsOfAnySizeMakeUpWhatOneProcessPrints) {
  for (const std::string per_shard : {"1", "7", "100"}) {
    ASSERT_EQ(plan("5:40", per_shard).status, 0);
    EXPECT_EQ(sweep({"here", folder(), "--jobs", "3"}).status, 0);
    const ChildEnd end = sweep({"merge", folder()});
    EXPECT_EQ(end.status, 0) << end.errors;
    EXPECT_EQ(end.output, "40\n") << "what the program says of the lines";
    EXPECT_EQ(merged(), toy("5:40")) << per_shard;
    std::filesystem::remove_all(folder());
  }
}

TEST_F(Sweep, AShardThatIsKilledOrBreaksOffIsNotDoneAndRunsAgain) {
  ASSERT_EQ(plan("1:30", "10").status, 0);
  fault("die-11");
  fault("cut-21");
  EXPECT_EQ(sweep({"here", folder(), "--jobs", "1"}).status, 1);
  const ChildEnd status = sweep({"status", folder()});
  EXPECT_NE(status.output.find("1 of 3 shards are done\nmissing: 1-2\n"), std::string::npos) << status.output;
  EXPECT_NE(status.output.find("shard 1 failed: signal 9"), std::string::npos) << status.output;
  EXPECT_EQ(sweep({"status", folder(), "--missing"}).output, "1-2\n");
  const ChildEnd early = sweep({"merge", folder()});
  EXPECT_EQ(early.status, 1);
  EXPECT_NE(early.errors.find("2 of 3 shards are missing: 1-2"), std::string::npos) << early.errors;
  EXPECT_EQ(sweep({"run", folder(), "--task", "1", "--of", "2"}).status, 0);
  EXPECT_EQ(sweep({"here", folder()}).status, 0);
  EXPECT_EQ(sweep({"merge", folder()}).status, 0);
  EXPECT_EQ(merged(), toy("1:30"));
}

TEST_F(Sweep, AShardThatLeavesOutAUnitIsRefused) {
  ASSERT_EQ(plan("1:20", "10").status, 0);
  fault("skip-11");
  const ChildEnd end = sweep({"run", folder(), "--shard", "1"});
  EXPECT_EQ(end.status, 1);
  EXPECT_NE(end.output.find("the end of units 11:9, expected that of 11:10; failed"), std::string::npos) << end.output;
}

TEST_F(Sweep, AShardThatRanTwiceCountsOnce) {
  ASSERT_EQ(plan("1:20", "10").status, 0);
  EXPECT_EQ(sweep({"here", folder()}).status, 0);
  const ChildEnd again = sweep({"run", folder(), "--shard", "1"});
  EXPECT_EQ(again.status, 0);
  EXPECT_NE(again.output.find("already done, with the same result"), std::string::npos) << again.output;
  EXPECT_EQ(sweep({"merge", folder()}).status, 0);
  EXPECT_EQ(sweep({"merge", folder()}).status, 0) << "a second merge changes nothing";
  EXPECT_EQ(merged(), toy("1:20"));
}

TEST_F(Sweep, TwoResultsThatDifferAreBothKeptAndMergeNamesTheUnit) {
  ASSERT_EQ(plan("1:20", "10").status, 0);
  EXPECT_EQ(sweep({"here", folder()}).status, 0);
  const std::string before = contents(folder() + "/done/000001.json");
  fault("mind-13");
  EXPECT_EQ(sweep({"run", folder(), "--shard", "1"}).status, 1);
  EXPECT_EQ(contents(folder() + "/done/000001.json"), before) << "nothing that exists is overwritten";
  const ChildEnd end = sweep({"merge", folder()});
  EXPECT_EQ(end.status, 1);
  EXPECT_NE(end.errors.find("shard 1, units 11:10, has two results that differ in unit 13: tendon-sweep run " +
                            folder() + " --shard 1 --bisect"),
            std::string::npos)
      << end.errors;
}

TEST_F(Sweep, BisectNamesTheUnitWithALineAndWithoutOne) {
  for (const bool quiet : {false, true}) {
    if (quiet) fault("quiet");
    ASSERT_EQ(plan("1:20", "10").status, 0);
    EXPECT_EQ(sweep({"here", folder()}).status, 0);
    EXPECT_EQ(sweep({"run", folder(), "--shard", "1", "--bisect"}).status, 2) << "one result";
    fault("mind-13");
    EXPECT_EQ(sweep({"run", folder(), "--shard", "1"}).status, 1);
    const ChildEnd end = sweep({"run", folder(), "--shard", "1", "--bisect"});
    EXPECT_EQ(end.status, 0) << end.errors;
    for (const char* said :
         {"two results that differ in unit 13\n", "on this node, the shard gives a third\n",
          "unit 13, run 3 times alone: 3 results\n", "The program gives different results in each run"}) {
      EXPECT_NE(end.output.find(said), std::string::npos) << said << " in " << end.output;
    }
    EXPECT_EQ(end.output.find("second: {\"unit\":13,\"value\":170}") == std::string::npos, quiet) << end.output;
    std::filesystem::remove(faults() + "/mind-13");
    std::filesystem::remove_all(folder());
  }
}

TEST_F(Sweep, BisectNamesAUnitThatDifferedOnceAndSaysThatThisNodeIsSure) {
  fault("quiet");
  ASSERT_EQ(plan("1:20", "10").status, 0);
  fault("mind-13");
  EXPECT_EQ(sweep({"run", folder(), "--shard", "1"}).status, 0);
  std::filesystem::remove(faults() + "/mind-13");
  EXPECT_EQ(sweep({"run", folder(), "--shard", "1"}).status, 1);
  const ChildEnd end = sweep({"run", folder(), "--shard", "1", "--bisect"});
  EXPECT_EQ(end.status, 0) << end.errors;
  for (const char* said :
       {"two results that differ in unit 13\n", "on this node, the shard gives the second, ",
        "unit 13, run 3 times alone: always the same result\n", "This node always gives the same result."}) {
    EXPECT_NE(end.output.find(said), std::string::npos) << said << " in " << end.output;
  }
}

TEST_F(Sweep, BisectFindsOneOfSeveralUnitsWithoutLinesByHalves) {
  fault("quiet");
  ASSERT_EQ(plan("1:20", "10").status, 0);
  for (const char* unit : {"mind-12", "mind-13", "mind-19"}) fault(unit);
  EXPECT_EQ(sweep({"run", folder(), "--shard", "1"}).status, 0);
  EXPECT_EQ(sweep({"run", folder(), "--shard", "1"}).status, 1);
  const ChildEnd end = sweep({"run", folder(), "--shard", "1", "--bisect"});
  EXPECT_EQ(end.status, 0) << end.errors;
  for (const char* said :
       {"two results that differ in several units\n", "units 11:5 give different results in each run\n",
        "units 11:2 give different results in each run; they differ in unit 12\n",
        "unit 12, run 3 times alone: 3 results\n"}) {
    EXPECT_NE(end.output.find(said), std::string::npos) << said << " in " << end.output;
  }
}

TEST_F(Sweep, ABrokenPromiseIsTheExitOfMergeAndNotOfAShard) {
  ASSERT_EQ(plan("1:20", "10").status, 0);
  fault("broken-13");
  EXPECT_EQ(sweep({"here", folder()}).status, 0);
  EXPECT_EQ(sweep({"merge", folder()}).status, 1);
}

TEST_F(Sweep, AnotherPlanAnotherProgramOrNoneIsRefused) {
  ASSERT_EQ(plan("1:20", "10").status, 0);
  EXPECT_EQ(plan("1:20", "10").status, 0) << "the same plan again is no other";
  const ChildEnd other = plan("1:20", "5");
  EXPECT_EQ(other.status, 1);
  EXPECT_NE(other.errors.find("plan.json is a different plan"), std::string::npos) << other.errors;
  EXPECT_EQ(sweep({"plan", faults() + "/b", "--units", "1:0", "--per-shard", "1", "--", TENDON_TOY}).status, 2);
  EXPECT_EQ(sweep({"plan", faults() + "/b", "--units", "1:5", "--per-shard", "1", "--", "no-such-program"}).status, 1);
  EXPECT_EQ(sweep({"here", faults() + "/b"}).status, 1);
  EXPECT_EQ(sweep({"run", folder(), "--shard", "2"}).status, 2);
  EXPECT_EQ(sweep({"run", folder(), "--task", "2", "--of", "2"}).status, 2);

  const std::string copy = faults() + "/program";
  std::filesystem::copy_file(TENDON_TOY, copy);
  ASSERT_EQ(sweep({"plan", faults() + "/c", "--units", "1:5", "--per-shard", "1", "--", copy, faults()}).status, 0);
  std::ofstream(copy, std::ios::app) << "# a newer build\n";
  const ChildEnd newer = sweep({"run", faults() + "/c", "--shard", "0"});
  EXPECT_EQ(newer.status, 1);
  EXPECT_NE(newer.errors.find("is not the program of the plan"), std::string::npos) << newer.errors;
}

TEST_F(Sweep, SameBytesWithAndWithoutFma) {
  const std::vector<std::string> old_processor = {"GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4"};
  if (sweep({"arithmetic"}).output == sweep({"arithmetic"}, old_processor).output) {
    GTEST_SKIP() << "this processor, or its C library, has no other arithmetic";
  }
  const auto planned = [&](const std::string& name, const std::string& arithmetic) {
    const std::string place = faults() + "/" + name;
    EXPECT_EQ(sweep({"plan", place, "--units", "700:1", "--per-shard", "1", "--arithmetic", arithmetic, "--",
                     "tendon-lab", "compare"})
                  .status,
              0);
    return place;
  };
  const std::string portable = planned("portable", "portable");
  EXPECT_EQ(sweep({"run", portable, "--shard", "0"}).status, 0);
  EXPECT_EQ(sweep({"run", portable, "--shard", "0"}, old_processor).status, 0) << "with another result";
  const std::string native = planned("native", "native");
  EXPECT_EQ(sweep({"run", native, "--shard", "0"}).status, 0);
  const ChildEnd refused = sweep({"run", native, "--shard", "0"}, old_processor);
  EXPECT_EQ(refused.status, 1);
  EXPECT_NE(refused.errors.find("use --arithmetic portable in the plan"), std::string::npos) << refused.errors;
}

/// Compares a sharded sweep of one of our programs with a run in one process.
class SweepOf : public Sweep {
 protected:
  void expect_the_same(std::vector<std::string> command, const std::string& units, const std::string& per_shard) {
    command.front() = program_of(command.front());
    std::vector<std::string> planned = {"plan",    folder(),       "--units", units, "--per-shard",
                                        per_shard, "--arithmetic", "native",  "--"};
    planned.insert(planned.end(), command.begin(), command.end());
    ASSERT_EQ(sweep(planned).status, 0);
    const ChildEnd here = sweep({"here", folder(), "--jobs", "1"});
    EXPECT_EQ(here.status, 0) << here.output;
    const ChildEnd merged = sweep({"merge", folder()});
    EXPECT_EQ(merged.status, 0) << merged.errors;
    const ChildEnd one = run({.command = command});
    EXPECT_EQ(one.status, 0) << one.errors;
    EXPECT_GT(one.output.size(), 100U);
    EXPECT_EQ(merged.output, one.output);
  }

 private:
  /// The program, or the mutant of tendon-lab named by the environment.
  static std::string program_of(const std::string& name) {
    const char* const other = std::getenv("TENDON_LAB_PROGRAM");  // NOLINT(concurrency-mt-unsafe): nobody sets it
    return other != nullptr && name == "tendon-lab" ? other : TENDON_BIN "/" + name;
  }
};

TEST_F(SweepOf, CompareIsWhatOneProcessSays) {
  expect_the_same({"tendon-lab", "compare", "--every", "1153", "--seed", "7"}, "0:2", "1");
}

TEST_F(SweepOf, BoundaryIsWhatOneProcessSays) {
  expect_the_same({"tendon-lab", "boundary", "--mass", "0.01"}, "0:18", "7");
}

TEST_F(SweepOf, PaperIsWhatOneProcessSays) { expect_the_same({"tendon-lab", "paper"}, "0:31", "9"); }

TEST_F(SweepOf, SweepIsWhatOneProcessSays) {
  expect_the_same({"tendon-lab", "sweep", TENDON_SCENES "/demo.toml", "--network", "delay={1,20}ms loss=2%", "--law",
                   "aol,feel", "--for-s", "2", "--seeds", "2"},
                  "0:8", "3");
}

TEST_F(SweepOf, TeleopIsWhatOneProcessSays) {
  expect_the_same({"tendon-lab", "teleop", "--hands", "1", "--seed", "5"}, "0:48", "31");
}

TEST_F(SweepOf, AccuracyIsWhatOneProcessSaysWithoutAClock) {
  expect_the_same({"tendon-lab", "accuracy", "--errors-only", "--block-mm", "60x60x30", "--truth-cells", "2",
                   "--models", "condensed,stvk", "--elements", "hex8-sri", "--n", "3,4"},
                  "0:4", "3");
}

TEST_F(SweepOf, IdentifyIsWhatOneProcessSays) {
  expect_the_same({"tendon-identify", "--simulate-friction", "0.005,0.05"}, "0:30", "11");
  std::filesystem::remove_all(folder());
  expect_the_same({"tendon-identify", "--of", "rotation", "--simulate-friction", "0.0005,0.001", "--json"}, "0:30",
                  "30");
}

TEST_F(SweepOf, LinesOfOtherArgumentsAreRefused) {
  const std::string identify = TENDON_BIN "/tendon-identify";
  const std::string lines = faults() + "/lines";
  std::ofstream(lines)
      << run({.command = {identify, "--simulate-friction", "0.005,0.05", "--units", "0:30", "--json"}}).output;
  const ChildEnd other =
      run({.command = {identify, "--of", "rotation", "--simulate-friction", "0.005,0.05", "--from", lines}});
  EXPECT_EQ(other.status, 2);
  EXPECT_NE(other.errors.find("unit 0 of the runs: "), std::string::npos) << other.errors;
  const ChildEnd beyond = run({.command = {identify, "--simulate-friction", "0.005,0.05", "--units", "29:2"}});
  EXPECT_EQ(beyond.status, 2);
  EXPECT_NE(beyond.errors.find("units 29:2: expected some of 0 to 29"), std::string::npos) << beyond.errors;
}

TEST_F(Sweep, AResultIsSyncedBeforeItHasItsName) {
  if (sweep({"--version"}, {std::string("LD_PRELOAD=") + TENDON_SYNC_RECORDER}).status != 0) {
    GTEST_SKIP() << "nothing can be preloaded into this build";
  }
  ASSERT_EQ(plan("1:20", "10").status, 0);
  const ChildEnd end = sweep({"run", folder(), "--shard", "0"}, {std::string("LD_PRELOAD=") + TENDON_SYNC_RECORDER});
  EXPECT_EQ(end.status, 0) << "99: it was not";
}

TEST_F(Sweep, OfManyThatKeepAFileOneHasMadeItAndTheOthersSeeTheSame) {
  const std::filesystem::path file = faults() + "/kept";
  std::atomic<int> made{0};
  std::atomic<int> same{0};
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < 8; ++i) {
      threads.emplace_back([&] { ++(keep(file, "the same text\n") == Kept::kNew ? made : same); });
    }
  }
  EXPECT_EQ(made, 1);
  EXPECT_EQ(same, 7);
  EXPECT_EQ(keep(file, "another text\n"), Kept::kOther);
  EXPECT_EQ(contents(file), "the same text\n");
  std::size_t files = 0;
  for ([[maybe_unused]] const auto& one : std::filesystem::directory_iterator(faults())) ++files;
  EXPECT_EQ(files, 1U) << "no draft is left";
}

TEST_F(Sweep, TwoResultsMayDifferInTheirEndsAlone) {
  const std::string one = toy("1:5");
  std::string other = one;
  other.replace(other.find("\"broken\":0"), 10, "\"broken\":1");
  EXPECT_EQ(difference(one, other, {1, 5}), "no unit, but in their last lines");
  EXPECT_EQ(difference(one, one.substr(one.find('\n') + 1), {1, 5}), "unit 1") << "a line is missing";
}

TEST_F(Sweep, RangesAreWhatSlurmReads) {
  EXPECT_EQ(ranges({}), "");
  EXPECT_EQ(ranges({0, 1, 2, 3, 17}), "0-3,17");
  EXPECT_EQ(ranges({4, 6, 7}), "4,6-7");
}

TEST_F(Sweep, AJobForSlurmRunsWhatIsMissingAndNoMore) {
  ASSERT_EQ(plan("1:40", "10").status, 0);
  EXPECT_EQ(sweep({"run", folder(), "--shard", "1"}).status, 0);
  EXPECT_EQ(sweep({"submit", folder(), "--to", "slurm"}).output, "sbatch " + folder() + "/job.sbatch\n");
  const std::string job = contents(folder() + "/job.sbatch");
  EXPECT_NE(job.find("#SBATCH --array=0,2-3\n"), std::string::npos) << job;
  EXPECT_NE(job.find(" --shard \"$SLURM_ARRAY_TASK_ID\"\n"), std::string::npos) << job;
  EXPECT_EQ(sweep({"submit", folder(), "--to", "slurm", "--max-array", "2"}).status, 0);
  const std::string few = contents(folder() + "/job.sbatch");
  EXPECT_NE(few.find("#SBATCH --array=0-1\n"), std::string::npos) << few;
  EXPECT_NE(few.find(" --task \"$SLURM_ARRAY_TASK_ID\" --of 2\n"), std::string::npos) << few;
  EXPECT_EQ(sweep({"here", folder()}).status, 0);
  const ChildEnd done = sweep({"submit", folder(), "--to", "slurm"});
  EXPECT_EQ(done.status, 0);
  EXPECT_NE(done.output.find("no shards are missing"), std::string::npos) << done.output;
}

TEST_F(Sweep, AJobForKubernetesIsIndexedAndForgivesADrainedNode) {
  ASSERT_EQ(plan("1:40", "10").status, 0);
  EXPECT_EQ(sweep({"submit", folder(), "--to", "kubernetes"}).status, 2) << "without an image";
  const ChildEnd job = sweep({"submit", folder(), "--to", "kubernetes", "--image", "i", "--volume", "v"});
  EXPECT_EQ(job.status, 0);
  for (const char* line :
       {"completionMode: Indexed\n", "completions: 4\n", "backoffLimitPerIndex: 3\n", "podReplacementPolicy: Failed\n",
        "type: DisruptionTarget\n", "values: [2]\n", "claimName: v\n"}) {
    EXPECT_NE(job.output.find(line), std::string::npos) << line;
  }
}

}  // namespace
}  // namespace tendon::sweep::sweep_test
