// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/identify/ramp_csv.h"

#include <gtest/gtest.h>

#include <sstream>
#include <stdexcept>
#include <string>

#include "tests/support/refusal.h"

namespace tendon::lab::ramp_csv_test {
namespace {

RampRun read(const std::string& text) {
  std::istringstream in(text);
  return read_ramp_csv(in, "run.csv");
}

std::string error_of(const std::string& text) {
  return thrown_by<std::runtime_error>([&] { read(text); });
}

TEST(RampCsv, ReadsItsColumnsInAnyOrderAmongOthers) {
  const RampRun run = read("force_n, note ,t_s,x_m\r\n0.5,hello,0,1e-3\r\n\r\n0.6,,0.001,-2e-3\r\n");
  ASSERT_EQ(run.samples.size(), 2U);
  EXPECT_EQ(run.samples[0].t, 0);
  EXPECT_EQ(run.samples[0].position, 1e-3);
  EXPECT_EQ(run.samples[0].force, 0.5);
  EXPECT_EQ(run.samples[1].t, 0.001);
  EXPECT_EQ(run.samples[1].position, -2e-3);
}

TEST(RampCsv, SaysInWhichLineWhatIsWrong) {
  EXPECT_EQ(error_of(""), "run.csv:1: expected a header line with a column 't_s', found an empty file");
  EXPECT_EQ(error_of("0,0,0\n"), "run.csv:1: expected a header line with a column 't_s', found '0,0,0'");
  EXPECT_EQ(error_of("t_s,x_m\n"), "run.csv:1: expected a header line with a column 'force_n', found 't_s,x_m'");
  EXPECT_EQ(error_of("t_s,x_m,x_m,force_n\n"), "run.csv:1: expected one column 'x_m', found two");
  const std::string good = "t_s,x_m,force_n\n0,0,0\n";
  EXPECT_EQ(error_of(good + "\n1,2\n"), "run.csv:4: expected 3 cells as in the first row, found 2");
  EXPECT_EQ(error_of(good + "1,2 m,3\n"), "run.csv:3: expected a finite number as x_m, found '2 m'");
  EXPECT_EQ(error_of(good + "1,nan,3\n"), "run.csv:3: expected a finite number as x_m, found 'nan'");
  EXPECT_EQ(error_of(good + "1,,3\n"), "run.csv:3: expected a finite number as x_m, found ''");
  EXPECT_EQ(error_of(good + "0,1,1\n"), "run.csv:3: expected a time after that of the previous row, found '0'");
}

TEST(RampCsv, ConvertsTheUnitsThatItsColumnsName) {
  const RampRun run = read("t_ms;x_mm;Force [mN]\n0;1,5;500\n2;-2;600\n");
  ASSERT_EQ(run.samples.size(), 2U);
  EXPECT_EQ(run.samples[1].t, 0.002);
  EXPECT_EQ(run.samples[0].position, 0.0015);
  EXPECT_EQ(run.samples[1].force, 0.6);
}

TEST(RampCsv, SaysThatAFileIsNotThere) {
  EXPECT_THROW(load_ramp_csv("/no/such/file.csv"), std::runtime_error);
  EXPECT_THROW(load_ramp_csv("/"), std::runtime_error);
}

}  // namespace
}  // namespace tendon::lab::ramp_csv_test
