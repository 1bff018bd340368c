// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/recordings/filter.h"

#include <gtest/gtest.h>

#include <sstream>

#include "server/scene/scene.h"
#include "tests/support/refusal.h"

namespace tendon::lab::filter_test {
namespace {

FilterOptions aol() {
  return {.limiter = {.law = Law::kAol,
                      .friction = {.coulomb = 0.005, .viscous = 0.26},
                      .longest_hold = std::chrono::milliseconds(1)}};
}

struct Result {
  int bad;
  std::string out;
  std::string errors;
};

Result filtered(const std::string& text, const FilterOptions& options = aol()) {
  std::istringstream in(text);
  std::ostringstream out;
  std::ostringstream errors;
  const int bad = filter(options, in, out, errors);
  return {bad, out.str(), errors.str()};
}

TEST(Filter, AddsWhatTheLawMakesOfEachRow) {
  // Computed by hand: E = b (0.1 mm)² / 1 ms + f_c 0.1 mm = 3.1 µJ; f = f_c + 2 √(b E / T).
  const Result result = filtered("t_s,x_m,wanted_n\n0,0,0\n0.001,0.0001,-1\n");
  EXPECT_EQ(result.bad, 0);
  EXPECT_EQ(result.out,
            "t_s,x_m,wanted_n,applied_n,permitted_n,energy_j,reason\n"
            "0,0,0,0,0.005,0,\n"
            "0.001,0.0001,-1,-0.061780278266313556,0.061780278266313556,3.1e-06,energy\n");
}

TEST(Filter, NamesTheLineOfABadRowAndWritesNothingForIt) {
  const Result result = filtered("t_s,x_m,wanted_n\n0,0,0\n0.001,nan,-1\n0.002,0,-1,7\n0.003,0\n0,0,0\n0.005,0,0\n");
  EXPECT_EQ(result.bad, 4);
  EXPECT_EQ(result.errors,
            "stdin:3: expected a finite number as x_m, found 'nan'\n"
            "stdin:4: expected 3 cells as in the first row, found 4; are these decimal commas? Use decimal points, or "
            "separate the cells by semicolons\n"
            "stdin:5: expected 3 cells as in the first row, found 2\n"
            "stdin:6: time does not increase\n");
  EXPECT_EQ(result.out.substr(result.out.find('\n') + 1), "0,0,0,0,0.005,0,\n0.005,0,0,0,0.005,0,overrun\n");
}

TEST(Filter, TakesThreeAxesAndKeepsTheDirectionOfTheForce) {
  const Result result =
      filtered("t_s,x_m,y_m,z_m,wanted_x_n,wanted_y_n,wanted_z_n\n0,0,0,0,0,0,0\n0.001,0.0001,0,0,-3,-4,0\n");
  std::istringstream last(result.out.substr(result.out.rfind('\n', result.out.size() - 2) + 1));
  std::vector<double> cells;
  for (std::string cell; std::getline(last, cell, ',') && cells.size() < 10;) cells.push_back(std::stod(cell));
  ASSERT_EQ(cells.size(), 10U);
  EXPECT_NEAR(cells[7] / cells[8], 0.75, 1e-12);
}

TEST(Filter, ReadsWhatASpreadsheetWrites) {
  const std::string plain = filtered("t_s,x_m,wanted_n\n0,0,0\n0.001,0.0001,-1\n").out;
  EXPECT_EQ(filtered("\xef\xbb\xbft_s;x_m;wanted_n\r\n0;0;0\r\n0,001;0,0001;-1\r\n").out, plain);
  EXPECT_EQ(filtered("\"wanted_n\",\"t_s\",\"x_m\"\n0,0,0\n-1,0.001,0.0001\n").out, plain);
}

TEST(Filter, RefusesAnUnknownHeader) { EXPECT_THROW(filtered("t,x,f\n0,0,0\n"), std::runtime_error); }

TEST(Filter, WorksForEveryLawOfTheCatalogue) {
  for (const LawInfo& law : laws()) {
    FilterOptions options = aol();
    options.limiter.law = law.law;
    options.limiter.max_force = 8;
    options.limiter.environment_stiffness = 500;
    EXPECT_EQ(filtered("t_s,x_m,wanted_n\n0,0,0\n0.001,0.0001,-1\n0.002,0.0002,-1\n", options).bad, 0) << law.name;
  }
}

TEST(Filter, TakesTheSettingsThatAReplayTakes) {
  const LimiterConfig config = limiter_of({.name = "aol+",
                                           .viscous = 0.26,
                                           .coulomb = 0.005,
                                           .period_us = 2000,
                                           .settings = {"limiter.knee.start=0.7", "limiter.energy_cap.energy_mj=3",
                                                        "limiter.robust_ledger.encoder_step_um=30"}});
  EXPECT_EQ(config.law, Law::kAolPlus);
  EXPECT_EQ(config.friction.viscous, 0.26);
  EXPECT_EQ(config.friction.coulomb, 0.005);
  EXPECT_EQ(config.longest_hold, std::chrono::milliseconds(2));
  ASSERT_TRUE(config.parts.knee);
  EXPECT_EQ(config.parts.knee->start, 0.7);
  EXPECT_TRUE(config.parts.energy_cap);
  EXPECT_TRUE(config.parts.robust_ledger);
  EXPECT_FALSE(config.parts.latency_reserve);
}

TEST(Filter, NamesTheSettingThatIsWrong) {
  const FilterLaw law{.viscous = 0.26, .coulomb = 0.005, .settings = {"limiter.knee.begin=0.7"}};
  EXPECT_NE(thrown_by<SceneError>([&] { limiter_of(law); }).find("limiter.knee.begin"), std::string::npos);
}

}  // namespace
}  // namespace tendon::lab::filter_test
