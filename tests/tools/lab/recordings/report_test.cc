// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/recordings/report.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <string>

#include "tests/server/scratch_folder.h"
#include "tests/tools/lab/experiments/steps.h"
#include "tests/tools/lab/pictures/plot.h"

namespace tendon::lab::report_test {
namespace {

using testing::record;
using testing::toy_run;

bool gnuplot_is_there() {
  return std::system("command -v gnuplot >/dev/null") == 0;  // NOLINT(concurrency-mt-unsafe): one thread
}

std::string contents(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Of the pictures of a run, what they are made of.
Drawing drawing_of(Law limiter, const std::string& label) {
  const auto steps = toy_run(limiter, 6000);
  const RunSummary summary = summarise(steps);
  Trace trace({.start = summary.start, .span = summary.span, .columns = trace_columns(1), .axis = summary.axis});
  for (const StepRecord& step : steps) trace.observe(step);
  return {label, summary, trace};
}

class Report : public ::testing::Test {
 protected:
  Report() {
    record(off_, toy_run(Law::kNone, 6000));
    record(on_, toy_run(Law::kAol, 6000));
  }

  std::string error_of(const ReportOptions& options) {
    try {
      report(options, out_);
    } catch (const std::exception& error) {
      return error.what();
    }
    return "";
  }

  tendon::testing::ScratchFolder folder_;
  std::filesystem::path off_ = folder_.path() / "off.mcap";
  std::filesystem::path on_ = folder_.path() / "on.mcap";
  std::ostringstream out_;
};

TEST_F(Report, HasAColumnForEachRecordingNamedByWhatItsStepsShow) {
  report({.recordings = {off_, on_}}, out_);
  const std::string first_line = out_.str().substr(0, out_.str().find('\n'));
  EXPECT_LT(first_line.find("limiter off"), first_line.find("limiter on"));
}

TEST_F(Report, JsonIsOneLineForEachRecordingAndNothingElse) {
  report({.recordings = {off_, on_}, .labels = {"a", "b"}, .json = true}, out_);
  std::istringstream lines(out_.str());
  std::string line;
  for (const char* label : {R"("label":"a")", R"("label":"b")"}) {
    ASSERT_TRUE(std::getline(lines, line));
    EXPECT_EQ(line.front(), '{');
    EXPECT_NE(line.find(label), std::string::npos);
  }
  EXPECT_FALSE(std::getline(lines, line));
}

TEST_F(Report, CheckFailsByTheRecordingThatBreaksThePromiseAfterTheTable) {
  EXPECT_EQ(error_of({.recordings = {off_, on_}}), "") << "without it, a run without a limiter is as good as any";
  EXPECT_EQ(error_of({.recordings = {on_, on_}, .check = true}), "");
  out_.str("");
  const std::string error = error_of({.recordings = {on_, off_}, .check = true});
  EXPECT_TRUE(error.starts_with("off.mcap: the ledger fell to −")) << error;
  EXPECT_TRUE(error.ends_with(" J, expected −1.00 nJ or more")) << error;
  EXPECT_NE(out_.str().find("limiter off"), std::string::npos);
}

TEST_F(Report, ReadsWhatAKilledServerLeftAndSaysSo) {
  std::filesystem::remove(on_);
  record(on_, toy_run(Law::kAol, 3000), false);
  report({.recordings = {on_}}, out_);
  EXPECT_NE(out_.str().find("on.mcap: has no end mark"), std::string::npos);
}

TEST_F(Report, AFlippedBitIsReportedByFileAndPlaceAndNothingIsPrinted) {
  std::string bytes = contents(on_);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  std::ofstream(on_, std::ios::binary) << bytes;
  const std::string error = error_of({.recordings = {off_, on_}});
  EXPECT_NE(error.find("on.mcap: byte "), std::string::npos) << error;
  EXPECT_EQ(out_.str(), "");
}

TEST_F(Report, ARecordingWithoutAStepIsNoRun) {
  {
    std::filesystem::remove(on_);
    FileSink sink(on_);
    Recorder recorder({}, sink);
    recorder.close();
  }
  EXPECT_NE(error_of({.recordings = {on_}}).find("holds no haptic step"), std::string::npos);
}

TEST_F(Report, RefusesOptionsThatMakeNoSenseBeforeItReadsAnything) {
  const std::filesystem::path missing = folder_.path() / "missing.mcap";
  const auto refused = [&](const ReportOptions& options) {
    EXPECT_THROW(report(options, out_), std::invalid_argument);
  };
  refused({});
  refused({.recordings = {missing}, .labels = {"a", "b"}});
  refused({.recordings = {missing}, .picture = "runs.jpg"});
  refused({.recordings = {missing}, .picture = "a\nb.svg"});
  refused({.recordings = {missing, missing, missing, missing, missing}, .picture = "runs.svg"});
}

TEST_F(Report, DrawsAPictureThatTellsTheRunsApart) {
  if (!gnuplot_is_there()) GTEST_SKIP() << "gnuplot is not installed (package gnuplot-nox)";
  const std::filesystem::path picture = folder_.path() / "it's $(one) picture.svg";
  report({.recordings = {off_, on_}, .labels = {"without's", "with {it}_x"}, .picture = picture}, out_);
  const std::string svg = contents(picture);
  for (const char* text : {"<svg", "without", "with {it}_x", "Where the hand is", "Force on the hand", "permitted",
                           "wanted", "applied", "Energy put in by the hand", "not stable", "in contact", "</svg>"})
    EXPECT_NE(svg.find(text), std::string::npos) << text;
  EXPECT_LT(svg.size(), std::size_t{1} << 20);
  EXPECT_NE(out_.str().find("picture: " + picture.string()), std::string::npos);
}

TEST_F(Report, SaysWhenThePictureCannotBeDrawn) {
  if (!gnuplot_is_there()) GTEST_SKIP() << "gnuplot is not installed (package gnuplot-nox)";
  const std::string error = error_of({.recordings = {on_}, .picture = folder_.path() / "no-such-folder" / "a.svg"});
  EXPECT_NE(error.find("gnuplot failed"), std::string::npos) << error;
}

TEST(Plot, WithoutGnuplotItNamesThePackage) {
  const std::string path = std::getenv("PATH");  // NOLINT(concurrency-mt-unsafe): one thread
  ::setenv("PATH", "/nowhere", 1);               // NOLINT(concurrency-mt-unsafe)
  const Drawing drawing = drawing_of(Law::kAol, "on");
  std::string error;
  try {
    draw("a.svg", std::span(&drawing, 1));
  } catch (const std::runtime_error& caught) {
    error = caught.what();
  }
  ::setenv("PATH", path.c_str(), 1);  // NOLINT(concurrency-mt-unsafe)
  EXPECT_NE(error.find("gnuplot-nox"), std::string::npos) << error;
}

TEST(Plot, NoNameBecomesACommand) {
  const Drawing drawing = drawing_of(Law::kAol, "x'\n!touch owned\n`touch owned`");
  const std::string script = plot_script("|touch owned.svg", std::span(&drawing, 1));
  EXPECT_NE(script.find("set output '/"), std::string::npos) << "an absolute path cannot begin with a |";
  EXPECT_NE(script.find("'x'' !touch owned `touch owned`'"), std::string::npos) << "one line, one quoted text";
}

TEST(Plot, SaysWhenEnergiesAreDrawnToScalesOfTheirOwn) {
  std::vector drawings = {drawing_of(Law::kNone, "off"), drawing_of(Law::kAol, "on")};
  EXPECT_NE(plot_script("a.svg", drawings).find("× finer)"), std::string::npos);
  drawings[0] = drawings[1];
  EXPECT_EQ(plot_script("a.svg", drawings).find("× finer)"), std::string::npos);
}

}  // namespace
}  // namespace tendon::lab::report_test
