// SPDX-License-Identifier: Apache-2.0
// The invariants of all worlds are checked by `tendon-worlds run` (ctest -R Worlds).
#include "tests/tools/worlds/explore.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/tools/injector/traces/trace.h"
#include "tests/tools/worlds/runner.h"
#include "tests/tools/worlds/shrink_world.h"

namespace tendon::simulation::explore_test {
namespace {

TEST(Worlds, SameSeedSameWorld) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    EXPECT_EQ(describe(draw_world(seed)), describe(draw_world(seed)));
    const Outcome once = run(draw_world(seed));
    const Outcome again = run(draw_world(seed));
    EXPECT_EQ(once.least_energy, again.least_energy);
    EXPECT_EQ(once.steps, again.steps);
    EXPECT_EQ(once.network.sent, again.network.sent);
    EXPECT_EQ(once.network.delivered, again.network.delivered);
  }
}

TEST(Worlds, OnlySeedsFromABillionOnDrawSuite2) {
  for (std::uint64_t seed = 1; seed <= 500; ++seed) {
    EXPECT_EQ(draw_world(seed).config.suites, Suites{Suite::kNoise}) << seed;
    EXPECT_EQ(describe(draw_world(seed)).find("aes"), std::string::npos) << seed;
  }
  int by_aes = 0;
  int with_older_clients = 0;
  int forbid_suite_1 = 0;
  for (std::uint64_t seed = kFirstSeedOfSuite2; seed < kFirstSeedOfSuite2 + 500; ++seed) {
    const DrawnWorld world = draw_world(seed);
    if (!contains(world.config.suites, Suite::kAesGcm)) continue;
    ++by_aes;
    forbid_suite_1 += world.config.suites.size() == 1 ? 1 : 0;
    with_older_clients += describe(world).find("does not support suite 2") != std::string::npos ? 1 : 0;
    EXPECT_TRUE(world.sealed());
  }
  EXPECT_GT(by_aes, 80);
  EXPECT_GT(with_older_clients, 15);
  EXPECT_GT(forbid_suite_1, 15);
}

TEST(Worlds, ItsRecordedNetworkMakesTheSameWorldAgain) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const DrawnWorld world = draw_world(seed);
    const Outcome drawn = run(world);
    const Outcome played = run_with_network(world, record_network(world));
    EXPECT_EQ(drawn.least_energy, played.least_energy);
    EXPECT_EQ(drawn.network.sent, played.network.sent);
    EXPECT_EQ(drawn.network.delivered, played.network.delivered);
  }
}

int broken_by(const Sabotage& sabotage) {
  int broken = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const Outcome outcome = run(draw_world(seed, sabotage));
    if (outcome.breach && outcome.breach->oracle == Oracle::kLedger) ++broken;
  }
  return broken;
}

TEST(Worlds, ADeviceThatGivesOutOnePercentMoreThanTheBoundBreaksThem) {
  // In the other worlds, the force rarely reaches the bound, or the law has a margin.
  EXPECT_GT(broken_by({.force = 1.01}), 10);
}

TEST(Worlds, SoDoesOnePercentMoreTorqueOrGrip) {
  // Two of ten laws have torque and grip.
  EXPECT_GT(broken_by({.torque = 1.01}), 3);
  EXPECT_GT(broken_by({.grip = 1.01}), 3);
}

std::string lines_of(const Units& seeds, unsigned jobs) {
  std::ostringstream out;
  explore_units(seeds, jobs, out);
  return out.str();
}

TEST(Worlds, UnitsHaveOneDigestHoweverTheyAreCutAndOnAnyNumberOfThreads) {
  const std::string whole = lines_of({1, 24}, 2);
  EXPECT_EQ(lines_of({1, 24}, 1), whole);
  ShardEnd end = ShardEnd::parse(lines_of({1, 7}, 1));
  end.add(ShardEnd::parse(lines_of({8, 17}, 3)));
  EXPECT_EQ(end.line() + "\n", whole);
  EXPECT_NE(ShardEnd::parse(lines_of({2, 24}, 2)).digest.text(), end.digest.text());
}

TEST(Worlds, ASweepIsJudgedByWhatItsShardsPrinted) {
  const std::string kept = lines_of({1, 3}, 1);
  std::istringstream lines(kept);
  std::ostringstream said;
  EXPECT_TRUE(judge(lines, said));
  EXPECT_NE(said.str().find("3 worlds of 10 s, seeds 1 to 3; digest "), std::string::npos) << said.str();

  std::string broken = kept;
  broken.replace(broken.find("\"broken\":0"), 10, "\"broken\":1");
  std::istringstream one("{\"kind\":\"broken\",\"seed\":2}\n" + broken);
  EXPECT_FALSE(judge(one, said));

  std::string idle = kept;
  idle.replace(idle.find("\"worlds\":3"), 10, "\"worlds\":900");
  std::istringstream nothing_happens(idle);
  EXPECT_THROW(judge(nothing_happens, said), std::runtime_error);

  for (const std::string& bad : {std::string(), std::string("a line\n") + kept, kept + kept}) {
    std::istringstream refused(bad);
    EXPECT_THROW(judge(refused, said), std::invalid_argument) << bad;
  }
}

TEST(Worlds, EveryOracleHasANameAndASentence) {
  for (std::size_t i = 0; i < oracles().size(); ++i) {
    EXPECT_EQ(static_cast<std::size_t>(oracles()[i].oracle), i);
    EXPECT_FALSE(oracles()[i].name.empty());
    EXPECT_FALSE(oracles()[i].sentence.empty());
  }
}

TEST(Worlds, SeedsAreReadFromTheBeginningOfEachLine) {
  const auto file = std::filesystem::path(testing::TempDir()) / "seeds.txt";
  std::ofstream(file) << "# why\n\n17 a bug\n4\n";
  EXPECT_EQ(read_seeds(file), (std::vector<std::uint64_t>{17, 4}));
  std::ofstream(file) << "17 a bug\nseventeen\n";
  try {
    read_seeds(file);
    ADD_FAILURE();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("seeds.txt:2: expected a seed"), std::string::npos) << error.what();
  }
}

TEST(Worlds, AWorldThatKeepsItsPromisesIsNotShrunk) {
  std::ostringstream out;
  EXPECT_FALSE(shrink_world(1, std::filesystem::path(testing::TempDir()) / "world.csv", out));
  EXPECT_NE(out.str().find("nothing to shrink"), std::string::npos);
}

}  // namespace
}  // namespace tendon::simulation::explore_test
