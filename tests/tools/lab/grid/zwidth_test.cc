// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/grid/zwidth.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <sstream>

namespace tendon::lab::zwidth_test {
namespace {

GridRow row(const char* law, const char* network, double stiffness, std::uint64_t seed, const Measured& measured) {
  return {.cell = {.law = law, .network = network, .stiffness = stiffness, .rate_hz = 100, .seed = seed},
          .measured = measured};
}

Measured wall(double round_trip, double felt, double vibration = 1e-3, double energy = 0) {
  return {.round_trip = round_trip, .felt_stiffness = felt, .least_energy = energy, .vibration = vibration};
}

TEST(ZWidth, AWallCountsIfItIsQuietAndPassiveWithEverySeed) {
  const std::vector<GridRow> rows = {
      row("aol", "far", 100, 1, wall(0.1, 50)),          row("aol", "far", 100, 2, wall(0.1, 70)),
      row("aol", "far", 200, 1, wall(0.1, 90)),          row("aol", "far", 200, 2, wall(0.1, 95, 9e-3)),
      row("aol", "near", 100, 1, wall(0.02, 99)),        row("aol", "near", 200, 1, wall(0.02, 190)),
      row("none", "far", 100, 1, wall(0.1, 100, 0, -1)), row("none", "near", 100, 1, Measured{.round_trip = 0.02}),
  };
  const auto widths = widths_of(rows, {});
  ASSERT_EQ(widths.size(), 2U);
  EXPECT_EQ(widths[0].law, "aol");
  ASSERT_EQ(widths[0].walls.size(), 2U);
  EXPECT_DOUBLE_EQ(widths[0].walls[0].round_trip, 0.02);
  EXPECT_DOUBLE_EQ(widths[0].walls[0].commanded, 200);
  EXPECT_DOUBLE_EQ(widths[0].walls[0].felt, 190);
  EXPECT_DOUBLE_EQ(widths[0].walls[1].commanded, 100);
  EXPECT_DOUBLE_EQ(widths[0].walls[1].felt, 70);
  for (const StiffestWall& none : widths[1].walls) EXPECT_DOUBLE_EQ(none.commanded + none.felt, 0);
}

TEST(ZWidth, TheLimitsDecideWhatIsQuietAndPassive) {
  const std::vector<GridRow> rows = {row("aol", "far", 100, 1, wall(0.1, 50, 9e-3, -50e-6))};
  EXPECT_DOUBLE_EQ(widths_of(rows, {})[0].walls[0].felt, 0);
  EXPECT_DOUBLE_EQ(widths_of(rows, {.vibration = 1e-2, .given_out = 1e-4})[0].walls[0].felt, 50);
  EXPECT_DOUBLE_EQ(widths_of(rows, {.vibration = 1e-2, .given_out = 1e-5})[0].walls[0].felt, 0);
}

TEST(ZWidth, BothPicturesCarryTheirCommand) {
  const Origin origin{.command = "tendon-lab sweep <a&b>.toml",
                      .scene_sha256 = std::string(64, 'a'),
                      .commit = "c0ffee",
                      .arithmetic = "beef"};
  const auto stem = std::filesystem::path(::testing::TempDir()) / "zwidth";
  const auto files = draw_zwidth(stem, {row("aol", "far", 100, 1, wall(0.1, 50))}, {}, origin);
  ASSERT_EQ(files.size(), 2U);
  for (const auto& file : files) {
    std::ifstream in(file, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    const bool svg = file.extension() == ".svg";
    EXPECT_NE(bytes.find(svg ? "tendon-lab sweep &lt;a&amp;b&gt;.toml" : "iTXtDescription"), std::string::npos) << file;
    EXPECT_NE(bytes.find("commit c0ffee"), std::string::npos) << file;
  }
}

TEST(GridTable, QuotesNetworksAndLeavesUnknownValuesEmpty) {
  const std::vector<GridRow> rows = {row("aol", "delay=uniform(1ms,2ms)", 100, 7, wall(0.1, 1.0 / 3)),
                                     row("aol", "lan", 100, 8, {})};
  std::istringstream csv(
      table_of(rows, {}, {"tendon-lab sweep x", "5ca1ab1e", "c0ffee", "f00d"}, {{"aol", "none"}}).str());
  std::string line;
  std::getline(csv, line);
  EXPECT_EQ(line, "# tendon-lab sweep x");
  std::getline(csv, line);
  EXPECT_EQ(line,
            "law,parts,network,rtt_p50_ms,loss_share,rate_hz,stiffness_npm,seed,felt_stiffness_npm,least_energy_j,"
            "vibration_mps,felt_db,force_error_n,limited_share,quiet,passive,scene_sha256,commit,arithmetic");
  std::getline(csv, line);
  EXPECT_EQ(line,
            "aol,none,\"delay=uniform(1ms,2ms)\",100,,100,100,7,0.333333,0,0.001,,,,yes,yes,5ca1ab1e,c0ffee,f00d");
  std::getline(csv, line);
  EXPECT_EQ(line, "aol,none,lan,,,100,100,8,,,,,,,,,5ca1ab1e,c0ffee,f00d");
}

}  // namespace
}  // namespace tendon::lab::zwidth_test
