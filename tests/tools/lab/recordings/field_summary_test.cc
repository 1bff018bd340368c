// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/recordings/field_summary.h"

#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

#include "tests/server/scratch_folder.h"
#include "tests/tools/lab/experiments/steps.h"
#include "tests/tools/lab/pictures/table.h"
#include "tests/tools/lab/recordings/report.h"
#include "tests/tools/lab/recordings/run_summary.h"

namespace tendon::lab::field_summary_test {
namespace {

using testing::step_at;

/// Returns 1000 steps. Field 4 is used from step 100, field 5 from step 300 to 499, and field 9 from step 600.
std::vector<StepRecord> run_with_fields() {
  std::vector<StepRecord> run;
  for (std::uint64_t n = 0; n < 1000; ++n) {
    StepRecord step = step_at(n);
    step.energy = n == 50 ? 0.001 : 0.02;  // 50 has no field
    if (n >= 100 && n < 500) step.field = FieldStep{.generation = n < 300 ? 4U : 5U};
    if (n >= 600) step.field = FieldStep{.generation = 9};
    run.push_back(step);
  }
  for (std::uint64_t n = 250; n < 410; ++n) run[n].field->depth = 1e-3;
  for (std::uint64_t n = 300; n < 304; ++n) run[n].field->refused = 2e-3;
  run[310].field->refused = 1e-12;  // rounding
  run[320].field->credit = 3e-3;
  run[321].field->credit = 1e-3;
  run[330].field->stored = 7.5e-3;
  run[340].energy = 4e-3;
  run[299].applied = Vec3(9, 0, 0);  // a change of 9 N/ms before the swap
  run[300].applied = Vec3(9, 0, 0.25);
  run[301].applied = Vec3(9, 0.75, 0.25);  // the largest change after the swap
  for (std::uint64_t n = 302; n < 500; ++n) run[n].applied = Vec3(9, 0.75, 0.25);
  run[500].applied = Vec3(9, 0.75, 0.25);
  return run;  // the force falls by 9 N in step 501, which is 201 ms after the swap
}

TEST(FieldSummary, HasTheValuesOfTheSteps) {
  const auto fields = summarise(run_with_fields()).fields;
  ASSERT_TRUE(fields);
  EXPECT_EQ(fields->steps, 800U);
  EXPECT_EQ(fields->used, 3U);
  EXPECT_EQ(fields->swaps, 1U);
  EXPECT_DOUBLE_EQ(fields->share_in_contact(), 0.2);
  EXPECT_EQ(fields->refused_steps, 4U);
  EXPECT_NEAR(fields->refused, 8e-3, 1e-11);
  EXPECT_DOUBLE_EQ(fields->credit, 4e-3);
  EXPECT_EQ(fields->largest_stored, 7.5e-3);
  EXPECT_EQ(fields->least_account, 4e-3);
  EXPECT_DOUBLE_EQ(fields->swap_slew.value_or(0), 750);
}

TEST(FieldSummary, TheFirst200MsAfterASwapCountAndOverrunsAreLongerSteps) {
  auto run = run_with_fields();
  run[500].applied = Vec3(0, 0, 0);
  EXPECT_NEAR(summarise(run).fields->swap_slew.value_or(0), Vec3(9, 0.75, 0.25).norm() * 1e3, 1e-9);
  run.erase(run.begin() + 480, run.begin() + 500);  // the same change in 21 ms
  EXPECT_DOUBLE_EQ(summarise(run).fields->swap_slew.value_or(0), 750);
}

TEST(FieldSummary, AStepWithoutAPositionEndsNoUse) {
  auto run = run_with_fields();
  run[299].field.reset();
  EXPECT_EQ(summarise(run).fields->swaps, 0U) << "field 4 was released";
  EXPECT_FALSE(summarise(run).fields->swap_slew);
  run[299].reasons |= Reason::kUnseen;
  EXPECT_EQ(summarise(run).fields->swaps, 1U);
  EXPECT_EQ(summarise(run).fields->used, 3U);
}

TEST(FieldSummary, TwoChannelsInTurnAreNoSwaps) {
  auto run = run_with_fields();
  for (std::uint64_t n = 601; n < 1000; n += 2) run[n].field->channel = 1, run[n].field->generation = 2;
  EXPECT_EQ(summarise(run).fields->swaps, 1U);
  EXPECT_EQ(summarise(run).fields->used, 4U);
}

TEST(FieldSummary, ContactWithAFieldIsAContact) {
  auto run = run_with_fields();
  const auto table = [&run] { return to_table(std::vector{lab::Run{.label = "on", .summary = summarise(run)}}); };
  EXPECT_NE(table().find("only fields: "), std::string::npos);
  for (StepRecord& step : run) step.field.reset();
  EXPECT_NE(table().find("no contact"), std::string::npos);
}

class FieldReport : public ::testing::Test {
 protected:
  std::string reported(const std::vector<std::vector<StepRecord>>& runs, bool json = false) {
    ReportOptions options{.json = json};
    for (const auto& run : runs) {
      options.recordings.push_back(folder_.path() / (std::to_string(++recordings_) + ".mcap"));
      testing::record(options.recordings.back(), run);
    }
    std::ostringstream out;
    report(options, out);
    return out.str();
  }
  /// Returns the cells of the row, or an empty string.
  static std::string row(const std::string& table, const std::string& name) {
    const std::size_t begin = table.find("\n  " + name + "  ");
    if (begin == std::string::npos) return "";
    std::string cells = table.substr(begin + name.size() + 3);
    cells.resize(cells.find('\n'));
    return cells.substr(cells.find_first_not_of(' '));
  }

  const tendon::testing::ScratchFolder folder_;
  int recordings_ = 0;
};

TEST_F(FieldReport, HasTheValuesOfTheRecording) {
  const std::string table = reported({run_with_fields()});
  EXPECT_NE(table.find("\nFields\n"), std::string::npos) << table;
  EXPECT_EQ(row(table, "fields used"), "3") << table;
  EXPECT_EQ(row(table, "swaps while a field is in use"), "1");
  EXPECT_EQ(row(table, "fastest force change after a swap"), "0.750 N/ms");
  EXPECT_EQ(row(table, "steps in contact"), "20.0 %");
  EXPECT_EQ(row(table, "steps with energy refused by the gate"), "0.5 %");
  EXPECT_EQ(row(table, "refused energy, sum over the steps"), "8.00 mJ");
  EXPECT_EQ(row(table, "energy credited by the tank"), "4.00 mJ");
  EXPECT_EQ(row(table, "largest stored energy H"), "7.50 mJ");
  EXPECT_EQ(row(table, "least account E with a field"), "4.00 mJ");
  const std::string json = reported({run_with_fields()}, true);
  EXPECT_NE(json.find(R"("fields":{"steps":800,"used":3,"swaps":1,"swap_force_change_n_per_ms":0.75,)"
                      R"("contact_percent":20.0,"refused_steps":4,"refused_j":0.008)"),
            std::string::npos)
      << json;
}

TEST_F(FieldReport, ARecordingWithoutFieldsHasNothingNew) {
  auto without = run_with_fields();
  for (StepRecord& step : without) step.field.reset();
  for (const bool json : {false, true}) {
    const std::string text = reported({without}, json);
    for (const char* word : {"ield", "swap", "tank", "refused"}) EXPECT_EQ(text.find(word), std::string::npos) << text;
  }
  const std::string both = reported({without, run_with_fields()});
  const std::string cells = row(both, "fields used");
  EXPECT_TRUE(cells.starts_with("no fields ") && cells.ends_with(" 3")) << cells;
}

}  // namespace
}  // namespace tendon::lab::field_summary_test
