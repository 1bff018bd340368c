// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/pictures/table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "tests/tools/lab/experiments/steps.h"

namespace tendon::lab::table_test {
namespace {

Run run_of(Law limiter, const std::string& label) {
  Run run;
  run.label = label;
  run.recording = label + ".mcap";
  run.summary = summarise(testing::toy_run(limiter, 6000));
  return run;
}

std::size_t width(const std::string& line) {
  return static_cast<std::size_t>(std::ranges::count_if(line, [](char c) { return (c & 0xC0) != 0x80; }));
}

TEST(WithUnit, HasThreeDigitsAndAPrefix) {
  EXPECT_EQ(with_unit(0, "J"), "0 J");
  EXPECT_EQ(with_unit(12.345, "J"), "12.3 J");
  EXPECT_EQ(with_unit(0.012345, "J"), "12.3 mJ");
  EXPECT_EQ(with_unit(-4e-10, "J"), "−400 pJ");
  EXPECT_EQ(with_unit(-1e-17, "J"), "0 J");
  EXPECT_EQ(with_unit(0.99999, "J"), "1.00 J");
  EXPECT_EQ(with_unit(999.9, "N"), "1.00 kN");
  EXPECT_EQ(with_unit(9.996, "N"), "10.0 N");
  EXPECT_EQ(with_unit(std::numeric_limits<double>::infinity(), "N"), "∞ N");
}

TEST(Table, TellsANewcomerWhichRunWasStable) {
  const std::vector runs = {run_of(Law::kNone, "off"), run_of(Law::kAol, "on")};
  const std::string table = to_table(runs);
  for (const char* text : {"off.mcap", "on.mcap", "not stable", "N/m", "NO", "yes", "limiter: not enough energy"})
    EXPECT_NE(table.find(text), std::string::npos) << text << " in\n" << table;
  EXPECT_EQ(table.find("device provided no position"), std::string::npos) << "a reason that never occurred";
  EXPECT_EQ(table.find('\x1b'), std::string::npos) << "colour codes";
}

TEST(Table, TellsOfTheWorkOfTorquesWhereAHandleTurns) {
  std::vector runs = {run_of(Law::kNone, "off"), run_of(Law::kAol, "on")};
  EXPECT_EQ(to_table(runs).find("torques"), std::string::npos);
  EXPECT_NE(to_json(runs[0]).find(R"("torque_work_j":null)"), std::string::npos);
  runs[0].summary.torque_work = 8.95;
  const std::string table = to_table(runs);
  const std::size_t row = table.find("  work of torques on the hand, maximum  ");
  ASSERT_NE(row, std::string::npos) << table;
  const std::string line = table.substr(row, table.find('\n', row) - row);
  EXPECT_TRUE(line.find("8.95 J ") < line.find("no rotation")) << line;
  EXPECT_NE(to_json(runs[0]).find(R"("torque_work_j":8.95)"), std::string::npos);
}

TEST(Table, ColumnsAreAlignedThoughSomeLettersHaveSeveralBytes) {
  std::vector runs = {run_of(Law::kNone, "größer"), run_of(Law::kAol, "µ")};
  std::istringstream table(to_table(runs));
  std::string line;
  std::getline(table, line);
  const std::size_t expected = width(line);
  while (std::getline(table, line) && !line.empty())
    if (line.find("  ", 2) != std::string::npos) {
      EXPECT_EQ(width(line), expected) << line;
    }
}

TEST(Table, SaysAtTheTopThatOverrunsMadeTheLimiterMoreCareful) {
  lab::Run run = run_of(Law::kAol, "on");
  EXPECT_EQ(to_table(std::vector{run}).find("more careful"), std::string::npos);
  run.summary.share_careful = 0.413;
  const std::string table = to_table(std::vector{run});
  const std::size_t row = table.find("limiter more careful after overruns, for");
  ASSERT_NE(row, std::string::npos) << table;
  EXPECT_LT(row, table.find("\nEnergy"));
  EXPECT_LT(table.find("41.3 %", row), table.find('\n', row));
  EXPECT_NE(to_json(run).find(R"("careful_percent":41.3)"), std::string::npos);
}

TEST(Table, SaysByHowMuchTheForceDiffersBesideTheShare) {
  lab::Run run = run_of(Law::kAol, "on");
  run.summary.difference = Difference{0.031, 1.9};
  const std::string table = to_table(std::vector{run});
  const std::size_t row = table.find("  difference, p50 / p95");
  ASSERT_NE(row, std::string::npos) << table;
  EXPECT_LT(table.find("0.03 / 1.90 N", row), table.find('\n', row)) << table;
}

TEST(Table, ForcesThatNoOneStiffnessDescribesAreNotMeasurable) {
  lab::Run run = run_of(Law::kAol, "on");
  run.summary.operational_stiffness.reset();
  EXPECT_NE(to_table(std::vector{run}).find("not measurable"), std::string::npos);
  run.summary.pushed = false;
  EXPECT_NE(to_table(std::vector{run}).find("no contact"), std::string::npos);
}

TEST(Table, SaysWhatIsMissingFromARecording) {
  lab::Run run = run_of(Law::kAol, "on");
  run.truncated = true;
  run.lost_steps = 1234;
  const std::string table = to_table(std::vector{run});
  EXPECT_NE(table.find("on.mcap: has no end mark"), std::string::npos);
  EXPECT_NE(table.find("lacks 1 234 steps"), std::string::npos);
}

TEST(Json, IsOneObjectWithTheUnitInEachKeyAndNullForWhatIsNotKnown) {
  lab::Run run = run_of(Law::kNone, "a \"b\"\n\\");
  const std::string json = to_json(run);
  EXPECT_EQ(json.front(), '{');
  EXPECT_EQ(json.back(), '}');
  EXPECT_EQ(json.find('\n'), std::string::npos);
  for (const char* text :
       {R"("label":"a \"b\"\n\\")", R"("stable":false)", R"("operational_stiffness_n_per_m":null)",
        R"("round_trip_p50_ms":null)", R"("limited_percent_by_reason":{"energy":0.0,)", R"("steps":6000)",
        R"("longest_interval_ms":1.0})", R"("energy_given_out_j":)", R"("passive":false)"})
    EXPECT_NE(json.find(text), std::string::npos) << text << " in " << json;
}

}  // namespace
}  // namespace tendon::lab::table_test
