// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/grid/grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "tests/support/full_disk.h"
#include "tests/support/refusal.h"

namespace tendon::lab::grid_test {
namespace {

const std::filesystem::path kScene = std::filesystem::path(TENDON_SCENES) / "demo.toml";

/// Each test has its own folder, because they run at the same time.
std::filesystem::path folder(const char* name) {
  const auto path = std::filesystem::path(::testing::TempDir()) / (std::string("grid-") + name);
  std::filesystem::remove_all(path);
  return path;
}

GridOptions small() {
  GridOptions options;
  options.scene = kScene;
  options.networks = "delay={1,40}ms loss=1%";
  options.stiffness = "200,2000";
  options.laws = "none,aol";
  options.seeds = 2;
  options.length_s = 2;
  return options;
}

std::string table_of(const GridOptions& options) {
  std::ostringstream out;
  run_grid(options, out);
  return out.str();
}

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Measures several laws on the same bench.
std::vector<Measured> measured(const std::vector<std::string>& laws, const std::string& network, double stiffness,
                               double rate_hz = 1000, std::uint64_t seed = 1) {
  GridBench bench(kScene);
  bench.add_network(network);
  for (const std::string& law : laws) bench.scene_of(law);
  std::vector<Measured> all;
  for (const std::string& law : laws) {
    all.push_back(bench.run({.law = law, .network = network, .stiffness = stiffness, .rate_hz = rate_hz, .seed = seed},
                            std::chrono::seconds(4)));
  }
  return all;
}

TEST(Grid, TheLastOptionVariesFastest) {
  const auto cells = cells_of(small());
  ASSERT_EQ(cells.size(), 16U);
  EXPECT_EQ(cells[0].seed, 1U);
  EXPECT_EQ(cells[1].seed, 2U);
  EXPECT_DOUBLE_EQ(cells[2].stiffness, 2000);
  EXPECT_EQ(cells[4].network, "delay=40ms loss=1%");
  EXPECT_EQ(cells[8].law, "aol");
}

TEST(Grid, TheTableDoesNotDependOnTheNumberOfJobs) {
  GridOptions options = small();
  const std::string one = table_of(options);
  EXPECT_EQ(std::ranges::count(one, '\n'), 18);
  options.jobs = 3;
  EXPECT_EQ(table_of(options), one);
}

TEST(Grid, MergedShardsGiveTheSameTable) {
  GridOptions options = small();
  const std::string whole = table_of(options);
  const auto file = folder("shards");
  std::filesystem::create_directories(file);
  options.part.units = Units{0, 16};
  std::ofstream(file / "merged") << table_of(options);
  options.part = {.from = file / "merged"};
  EXPECT_EQ(table_of(options), whole);
}

TEST(Grid, AnInterruptedSweepContinuesAndGivesTheSameBytes) {
  GridOptions options = small();
  options.out = folder("whole");
  table_of(options);
  const std::string whole = text_of(options.out / "cells.csv");

  options.out = folder("interrupted");
  {
    std::filesystem::create_directories(options.out);
    const tendon::testing::FullDisk full(2000);
    EXPECT_EQ(thrown_by<std::runtime_error>([&] { table_of(options); }),
              "cannot write " + (options.out / "cells.partial").string() +
                  ": is the disk full? The finished cells are kept; the same command continues");
  }
  EXPECT_GT(text_of(options.out / "cells.partial").size(), 1000U);
  EXPECT_TRUE(table_of(options).starts_with("continuing: "));
  EXPECT_EQ(text_of(options.out / "cells.csv"), whole);
  EXPECT_FALSE(std::filesystem::exists(options.out / "cells.partial"));
}

TEST(Grid, DoesNotContinueASweepOfAnotherCommit) {
  GridOptions options = small();
  options.out = folder("commits");
  std::filesystem::create_directories(options.out);
  {
    const tendon::testing::FullDisk full(2000);
    EXPECT_NE(thrown_by<std::runtime_error>([&] { table_of(options); }), "");
  }
  std::string partial = text_of(options.out / "cells.partial");
  const std::string key = "\"commit\":\"";
  partial.insert(partial.find(key) + key.size(), "old");
  std::ofstream(options.out / "cells.partial") << partial;
  EXPECT_NE(thrown_by([&] { table_of(options); }).find("cells.partial belongs to another sweep"), std::string::npos);
  EXPECT_EQ(text_of(options.out / "cells.partial"), partial);
}

TEST(Grid, DoesNotOverwriteAnotherSweep) {
  GridOptions options = small();
  options.seeds = 1;
  options.networks = "lan";
  options.laws = "aol";
  options.out = folder("other");
  table_of(options);
  const std::string first = text_of(options.out / "cells.csv");
  options.stiffness = "300";
  EXPECT_NE(thrown_by([&] { table_of(options); }).find("cells.csv is not the table of this command, but begins with"),
            std::string::npos);
  EXPECT_EQ(text_of(options.out / "cells.csv"), first);

  std::filesystem::remove(options.out / "cells.csv");
  std::ofstream(options.out / "cells.partial") << "{\"command\":\"tendon-lab sweep other.toml\"}\n";
  EXPECT_NE(thrown_by([&] { table_of(options); }).find("cells.partial belongs to another sweep"), std::string::npos);
}

TEST(Grid, SaysWhatIsWrongWithACommand) {
  const auto refused = [](void (*change)(GridOptions&)) {
    GridOptions options = small();
    change(options);
    return thrown_by([&options] { table_of(options); });
  };
  const std::string scenes = TENDON_SCENES;
  EXPECT_EQ(refused([](GridOptions& o) { o.networks = "delay=0:50:20ms"; }),
            "--network: expected a range A:B:STEP that reaches B in whole steps, found 0:50:20");
  EXPECT_EQ(refused([](GridOptions& o) { o.stiffness = "0"; }),
            "--stiffness: expected numbers from 1 to 1000000 or a range A:B:STEP, found \"0\"");
  EXPECT_EQ(refused([](GridOptions& o) { o.rates = "100:200"; }),
            "--rate-hz: expected numbers from 0.001 to 100000 or a range A:B:STEP, found \"100:200\"");
  EXPECT_EQ(refused([](GridOptions& o) { o.seeds = 0; }), "--seeds: expected at least 1");
  EXPECT_EQ(refused([](GridOptions& o) { o.length_s = 0.5; }), "--for-s: expected more than 1 s");
  EXPECT_EQ(refused([](GridOptions& o) { o.seeds = 1'000'000; }), "expected at most 1000000 cells, found 8e+06");
  EXPECT_EQ(refused([](GridOptions& o) { o.laws = "aol,"; }),
            "--law: expected a value on both sides of each comma, found \"aol,\"");
  EXPECT_NE(refused([](GridOptions& o) { o.laws = "feeel"; }).find("; did you mean feel?"), std::string::npos);
  EXPECT_EQ(refused([](GridOptions& o) {
              o.scene = std::filesystem::path(TENDON_SCENES) / "fleet.toml";
            }).substr(scenes.size()),
            "/fleet.toml: expected a scene with one device, found count = 64");
  EXPECT_EQ(refused([](GridOptions& o) {
              o.scene = std::filesystem::path(TENDON_SCENES) / "falcon.toml";
            }).substr(scenes.size()),
            "/falcon.toml: expected a simulated device, found kind = \"falcon\"");
  EXPECT_NE(refused([](GridOptions& o) { o.networks = "lann"; }), "");
  EXPECT_EQ(thrown_by<std::runtime_error>([] {
              GridOptions options = small();
              options.networks = "trace:/none.csv";
              table_of(options);
            }),
            "cannot read trace /none.csv: No such file or directory");
}

TEST(Grid, ThePlainLawsHaveNoPartsAndThePresetHasSeveral) {
  GridBench bench(kScene);
  EXPECT_EQ(bench.parts_of("aol"), "none");
  EXPECT_EQ(bench.parts_of("aol+"), "none");
  EXPECT_NE(bench.parts_of("feel").find("damper"), std::string::npos);
  EXPECT_EQ(bench.parts_of("scene"), bench.parts_of("feel"));
}

TEST(Grid, WithoutALimiterANearbySoftWallIsFeltAsItIs) {
  const Measured wall = measured({"none"}, "delay=0.1ms", 300).front();
  EXPECT_NEAR(wall.felt_stiffness.value(), 300, 15);
  EXPECT_NEAR(wall.round_trip.value(), 0.2e-3, 1e-6);
  EXPECT_LE(wall.vibration.value(), kMostVibration);
  EXPECT_DOUBLE_EQ(wall.limited_share.value(), 0);
}

TEST(Grid, ADelayedWallGivesOutEnergyUnlessItIsLimited) {
  const auto walls = measured({"none", "aol", "feel"}, "delay=40ms", 2000, 100);
  EXPECT_LT(walls[0].least_energy.value(), -1e-3);
  EXPECT_GT(walls[0].vibration.value(), kMostVibration);
  EXPECT_GT(walls[1].least_energy.value(), -1e-4);
  EXPECT_GT(walls[1].limited_share.value(), 0.1);
  EXPECT_GE(walls[2].least_energy.value(), -1e-9);
}

TEST(Grid, TheSeedChangesTheNetworkAndNothingElseDoes) {
  const auto lossy = [](std::uint64_t seed) {
    const Measured one = measured({"aol"}, "delay=uniform(5ms,15ms) loss=10%", 1000, 100, seed).front();
    return std::pair(one.loss.value(), one.force_error.value());
  };
  EXPECT_EQ(lossy(1), lossy(1));
  EXPECT_NE(lossy(1), lossy(2));
  EXPECT_NEAR(lossy(1).first, 0.1, 0.02);
}

TEST(Grid, ADeadNetworkIsNotKnownToBeQuiet) {
  const Measured dead = measured({"aol"}, "loss=100%", 1000).front();
  EXPECT_FALSE(dead.vibration.has_value());
  EXPECT_FALSE(dead.least_energy.has_value());
  EXPECT_FALSE(quiet(dead, {}).has_value());
}

}  // namespace
}  // namespace tendon::lab::grid_test
