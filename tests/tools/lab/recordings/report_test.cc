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
#include <vector>

#include "tests/server/scratch_folder.h"
#include "tests/support/refusal.h"
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
    return thrown_by<std::exception>([&] { report(options, out_); });
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

class ReportOfSeveral : public Report {
 protected:
  /// true: with the limiter.
  std::filesystem::path several(const std::vector<bool>& limited) {
    const auto on = toy_run(Law::kAol, 6000);
    const auto off = toy_run(Law::kNone, 6000);
    std::vector<std::vector<StepRecord>> runs;
    std::vector<std::string> names;
    for (const bool is_limited : limited) {
      if (!runs.empty()) names.push_back("fleet-" + std::to_string(runs.size()));
      runs.push_back(is_limited ? on : off);
    }
    std::filesystem::path file = folder_.path() / ("of" + std::to_string(limited.size()) + ".mcap");
    std::filesystem::remove(file);
    testing::record_devices(file, runs, names);
    return file;
  }
};

TEST_F(ReportOfSeveral, HasAColumnForEachDevice) {
  report({.recordings = {several({true, false})}}, out_);
  const std::string text = out_.str();
  const std::string first_line = text.substr(0, text.find('\n'));
  EXPECT_LT(first_line.find("limiter on"), first_line.find("limiter off"));
  EXPECT_NE(first_line.find("limiter off"), std::string::npos);
  const std::size_t row = text.find("\ndevice ");
  ASSERT_NE(row, std::string::npos) << text;
  EXPECT_LT(text.find("first", row), text.find("fleet-1", row));
}

TEST_F(ReportOfSeveral, CheckFailsByAnyDeviceAndNamesIt) {
  EXPECT_EQ(error_of({.recordings = {several({true, true, true})}, .check = true}), "");
  const std::string error = error_of({.recordings = {several({true, false})}, .check = true});
  EXPECT_TRUE(error.starts_with("of2.mcap: the ledger of fleet-1 fell to −")) << error;
  EXPECT_NE(error_of({.recordings = {several({true, false})}, .devices = {"first"}, .check = true}), "")
      << "a device without a column is checked, too";
}

TEST_F(ReportOfSeveral, JsonIsALineForEachDevice) {
  report({.recordings = {several({true, false, true})}, .json = true}, out_);
  std::istringstream lines(out_.str());
  std::string line;
  for (const char* text : {R"("device":"first")", R"("device":"fleet-1")", R"("device":"fleet-2")"}) {
    ASSERT_TRUE(std::getline(lines, line));
    EXPECT_NE(line.find(text), std::string::npos) << line;
    EXPECT_EQ(line.find(R"("passive":false)") != std::string::npos, std::string(text).ends_with("1\""));
  }
  EXPECT_FALSE(std::getline(lines, line));
}

TEST_F(ReportOfSeveral, OfAFleetThoseThatFailedAreShownAndTheOthersCounted) {
  std::vector<bool> limited(16, true);
  for (const std::size_t device : {3U, 9U, 10U, 11U, 12U, 13U, 14U, 15U}) limited[device] = false;
  report({.recordings = {several(limited)}}, out_);
  const std::string text = out_.str();
  EXPECT_NE(text.find("Columns for 6 of 16 devices"), std::string::npos) << text;
  EXPECT_NE(text.find("8 of the others kept the promise"), std::string::npos) << text;
  EXPECT_NE(text.find("of16.mcap fleet-14: promise NOT kept, least energy −"), std::string::npos) << text;
  EXPECT_NE(text.find("of16.mcap fleet-15: promise NOT kept"), std::string::npos) << text;
  EXPECT_EQ(text.find("of16.mcap fleet-13:"), std::string::npos) << "it has a column";
  EXPECT_EQ(text.find("first"), std::string::npos);
}

TEST_F(ReportOfSeveral, ADeviceThatIsAskedForHasTheOnlyColumn) {
  const auto file = several({true, false, true});
  report({.recordings = {file}, .devices = {"fleet-2"}}, out_);
  EXPECT_NE(out_.str().find("fleet-2"), std::string::npos);
  EXPECT_EQ(out_.str().find("first"), std::string::npos);
  EXPECT_NE(out_.str().find("Columns for 1 of 3 devices"), std::string::npos) << out_.str();
  EXPECT_NE(out_.str().find("of3.mcap fleet-1: promise NOT kept"), std::string::npos) << out_.str();
  EXPECT_EQ(error_of({.recordings = {file}, .devices = {"left"}}),
            "no device has the name left; expected one of first, fleet-1, fleet-2");
}

TEST_F(ReportOfSeveral, SaysWhichDeviceWasNotExamined) {
  const std::filesystem::path file = folder_.path() / "absent.mcap";
  testing::record_devices(file, {toy_run(Law::kAol, 2000), {}}, {"absent"});
  report({.recordings = {file}}, out_);
  EXPECT_NE(out_.str().find("absent.mcap: device absent has no haptic steps: not examined"), std::string::npos)
      << out_.str();
}

TEST_F(ReportOfSeveral, ANameInARecordingCannotForgeALine) {
  const std::filesystem::path file = folder_.path() / "forged.mcap";
  testing::record_devices(file, {toy_run(Law::kAol, 2000), {}}, {"left\npromise kept\x1b[2J"});
  report({.recordings = {file}}, out_);
  EXPECT_NE(out_.str().find("device left\\npromise kept\\x1b[2J has no haptic step"), std::string::npos) << out_.str();
}

TEST_F(ReportOfSeveral, DrawsEachDevice) {
  if (!gnuplot_is_there()) GTEST_SKIP() << "gnuplot is not installed (package gnuplot-nox)";
  const std::filesystem::path picture = folder_.path() / "both.svg";
  report({.recordings = {several({true, false})}, .picture = picture}, out_);
  const std::string svg = contents(picture);
  for (const char* text : {"limiter on, first", "limiter off, fleet-1"})
    EXPECT_NE(svg.find(text), std::string::npos) << text;
  report({.recordings = {several({true, true, true, true, false})}, .picture = picture}, out_);
  EXPECT_NE(contents(picture).find("limiter off, fleet-4"), std::string::npos) << "who failed is drawn";
  EXPECT_NE(out_.str().find(", of 4 of 5 devices"), std::string::npos) << out_.str();
}

TEST_F(Report, ReadsWhatAKilledServerLeftAndSaysSo) {
  std::filesystem::remove(on_);
  record(on_, toy_run(Law::kAol, 3000), false);
  report({.recordings = {on_}}, out_);
  EXPECT_NE(out_.str().find("on.mcap: has no end mark"), std::string::npos);
}

TEST_F(Report, AFlippedBitIsNamedByFileAndPlaceAndTheRestIsRead) {
  std::string bytes = contents(on_);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  std::ofstream(on_, std::ios::binary) << bytes;
  report({.recordings = {off_, on_}}, out_);
  EXPECT_NE(out_.str().find("on.mcap: byte "), std::string::npos) << out_.str();
  EXPECT_NE(out_.str().find("on.mcap: lacks "), std::string::npos) << out_.str();
  std::ostringstream json;
  report({.recordings = {on_}, .json = true}, json);
  EXPECT_NE(json.str().find(R"("damage":[")"), std::string::npos) << json.str();
  EXPECT_EQ(json.str().find(R"("lost_steps":0)"), std::string::npos) << json.str();
}

TEST_F(Report, ARecordingWithoutAStepIsNoRun) {
  {
    std::filesystem::remove(on_);
    FileSink sink(on_);
    Recorder recorder({}, sink);
    recorder.close();
  }
  EXPECT_NE(error_of({.recordings = {on_}}).find("contains no haptic step"), std::string::npos);
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

TEST_F(Report, SaysThatThereIsNoFolderForThePicture) {
  if (!gnuplot_is_there()) GTEST_SKIP() << "gnuplot is not installed (package gnuplot-nox)";
  const std::string error = error_of({.recordings = {on_}, .picture = folder_.path() / "no-such-folder" / "a.svg"});
  EXPECT_NE(error.find("there is no folder"), std::string::npos) << error;
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
