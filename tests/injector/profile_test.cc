// SPDX-License-Identifier: Apache-2.0
#include "tests/injector/profile.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <stdexcept>

namespace tendon::injector {
namespace {

using namespace std::chrono_literals;

/// What `call` complains about; "" when it does not.
template <typename Call>
std::string complaint_of(Call call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

std::string complaint_about(const Profile& profile) {
  return complaint_of([&] { check(profile); });
}

std::string complaint_about(const std::string& line) {
  return complaint_of([&] { parse_profile(line); });
}

/// A file that is gone at the end of the test.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& content)
      : path_(std::filesystem::path(testing::TempDir()) /
              (std::string(testing::UnitTest::GetInstance()->current_test_info()->name()) + ".csv")) {
    std::ofstream(path_) << content;
  }
  ~TemporaryFile() { std::filesystem::remove(path_); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

TEST(Profile, ReadsAndWritesTheLineOfTheManual) {
  Profile profile;
  profile.delay = 20ms;
  profile.jitter = 5ms;
  profile.loss = 0.02;
  EXPECT_EQ(to_string(profile), "delay=20ms jitter=5ms loss=2%");
  EXPECT_EQ(parse_profile("delay=20ms jitter=5ms loss=2%"), profile);
  EXPECT_EQ(parse_profile("  loss=0.02\tjitter=5000us   delay=0.02s "), profile);
}

TEST(Profile, AnEmptyLineIsAPerfectNetwork) {
  EXPECT_EQ(parse_profile(""), Profile{});
  EXPECT_EQ(to_string(Profile{}), "delay=0ms");
}

TEST(Profile, WritesPercentAndMillisecondsWithoutRounding) {
  Profile profile;
  profile.delay = 1ns;
  profile.loss = 0.07;
  profile.duplicate = 1;
  EXPECT_EQ(to_string(profile), "delay=0.000001ms loss=7% duplicate=100%");
  profile.delay = 1234567ns;
  profile.loss = 0.0001;
  profile.duplicate = 0.125;
  EXPECT_EQ(to_string(profile), "delay=1.234567ms loss=0.01% duplicate=12.5%");
}

RC_GTEST_PROP(Profile, ReadsBackExactlyWhatItWrote, ()) {
  const auto probability = [] {
    return static_cast<double>(*rc::gen::arbitrary<std::uint64_t>()) / 18446744073709551616.0;
  };
  const auto duration = [] { return Duration(*rc::gen::inRange<std::int64_t>(0, kMaxDelay.count() + 1)); };
  Profile profile;
  profile.delay = duration();
  profile.loss = probability();
  profile.duplicate = probability();
  if (*rc::gen::arbitrary<bool>()) {
    profile.jitter = duration();
  } else {
    Duration edge{};
    for (int bins = *rc::gen::inRange(1, 5); bins > 0; --bins) {
      edge += Duration(*rc::gen::inRange<std::int64_t>(1, 1'000'000'000));
      profile.histogram.push_back({edge, probability() + 0.5});
    }
  }
  RC_ASSERT(parse_profile(to_string(profile)) == profile);
}

TEST(Profile, RefusesTheImpossibleByFieldValueAndExpectation) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  Profile p;
  p.delay = -1ms;
  EXPECT_EQ(complaint_about(p), "delay is -1ms, expected 0ms to 60000ms");
  p = {};
  p.delay = 61s;
  EXPECT_EQ(complaint_about(p), "delay is 61000ms, expected 0ms to 60000ms");
  p = {};
  p.jitter = -1ns;
  EXPECT_EQ(complaint_about(p), "jitter is -0.000001ms, expected 0ms to 60000ms");
  p = {};
  p.loss = 1.5;
  EXPECT_EQ(complaint_about(p), "loss is 150%, expected a probability from 0% to 100%");
  p = {};
  p.duplicate = -0.5;
  EXPECT_EQ(complaint_about(p), "duplicate is -50%, expected a probability from 0% to 100%");
  p = {};
  p.loss = kNan;
  EXPECT_EQ(complaint_about(p), "loss is nan, expected a probability from 0% to 100%");
}

TEST(Profile, RefusesAnImpossibleHistogramByBin) {
  const auto with = [](std::vector<Profile::Bin> bins) {
    Profile p;
    p.histogram = std::move(bins);
    return p;
  };
  EXPECT_EQ(complaint_about(with({{2ms, 1}, {1ms, 1}})),
            "histogram bin 1: lower edge is 1ms, expected more than 2ms of the bin before it");
  EXPECT_EQ(complaint_about(with({{1ms, 1}, {2ms, -3}})),
            "histogram bin 1: weight is -3, expected a number that is zero or more");
  EXPECT_EQ(complaint_about(with({{-1ms, 1}})), "histogram bin 0: lower edge is -1ms, expected 0ms to 60000ms");
  EXPECT_EQ(complaint_about(with({{1ms, 0}})),
            "histogram: the sum of all weights is 0, expected a finite number above zero");
  EXPECT_EQ(complaint_about(with({{1ms, 1.7e308}, {2ms, 1.7e308}})),
            "histogram: the sum of all weights is inf, expected a finite number above zero");
  EXPECT_EQ(complaint_about(with(std::vector<Profile::Bin>(10'001))),
            "histogram is 10001 bins, expected at most 10000");
  Profile both = with({{1ms, 1}});
  both.jitter = 1ms;
  EXPECT_EQ(complaint_about(both),
            "jitter is 1ms, expected 0ms together with a histogram, which already says how delays vary");
}

TEST(Profile, RefusesALineItDoesNotUnderstandAndSaysWhere) {
  EXPECT_EQ(complaint_about("latency=20ms"),
            "a field of the profile is \"latency\", expected delay, jitter, loss, duplicate or histogram");
  EXPECT_EQ(complaint_about("delay=20"),
            "delay is \"20\", expected a number with its unit like 20ms (ns, us, ms or s)");
  EXPECT_EQ(complaint_about("delay=ms"),
            "delay is \"ms\", expected a number with its unit like 20ms (ns, us, ms or s)");
  EXPECT_EQ(complaint_about("delay"), "delay is \"\", expected a number with its unit like 20ms (ns, us, ms or s)");
  EXPECT_EQ(complaint_about("delay=nanms"),
            "delay is \"nanms\", expected a number with its unit like 20ms (ns, us, ms or s)");
  EXPECT_EQ(complaint_about("delay=1e300s"),
            "delay is \"1e300s\", expected a number with its unit like 20ms (ns, us, ms or s)");
  EXPECT_EQ(complaint_about("loss=two%"), "loss is \"two%\", expected a probability like 2% or 0.02");
  EXPECT_EQ(complaint_about("loss=2"), "loss is 200%, expected a probability from 0% to 100%");
  EXPECT_EQ(complaint_about("loss=1% loss=2%"), "loss is given twice, expected once");
  EXPECT_EQ(complaint_about("histogram=1ms"),
            "histogram is 1ms, expected bins as LOWER_EDGE:WEIGHT like 0.56ms:72,0.59ms:5058");
}

TEST(HistogramCsv, ReadsTabsCommasSemicolonsBlanksAndComments) {
  const TemporaryFile file("# edge in ms, count\n0.560000\t0.000720\n0.5877, 5\r\n\n1 ; 7 # a comment\n  2.5   8  \n");
  const std::vector<Profile::Bin> expected = {{560us, 0.00072}, {587'700ns, 5}, {1ms, 7}, {2500us, 8}};
  EXPECT_EQ(histogram_from_csv(file.path()), expected);
}

TEST(HistogramCsv, NamesFileAndLineOfWhatItCannotRead) {
  const auto complaint_in = [](const std::string& content) {
    const TemporaryFile file(content);
    const std::string said = complaint_of([&] { histogram_from_csv(file.path()); });
    const std::string path = file.path().string();
    EXPECT_TRUE(said.starts_with(path)) << said;
    return said.substr(std::min(path.size(), said.size()));
  };
  EXPECT_EQ(complaint_in("1,2\nedge,count\n"), ":2: expected LOWER_EDGE_MS,COUNT like 0.56,72, got \"edge,count\"");
  EXPECT_EQ(complaint_in("1\n"), ":1: expected LOWER_EDGE_MS,COUNT like 0.56,72, got \"1\"");
  EXPECT_EQ(complaint_in("1,2,3\n"), ":1: expected LOWER_EDGE_MS,COUNT like 0.56,72, got \"1,2,3\"");
  EXPECT_EQ(complaint_in("1,2\n\n1,2\n"), ":3: lower edge is 1ms, expected more than 1ms of the bin before it");
  EXPECT_EQ(complaint_in("1,-2\n"), ":1: weight is -2, expected a number that is zero or more");
  EXPECT_EQ(complaint_in("1e300,2\n"), ":1: lower edge is 1e+300ms, expected 0ms to 60000ms");
  EXPECT_EQ(complaint_in("70000,2\n"), ":1: lower edge is 70000ms, expected 0ms to 60000ms");
  EXPECT_EQ(complaint_in("1,0\n"), ": the sum of all weights is 0, expected a finite number above zero");
  EXPECT_EQ(complaint_in(""), ": cannot be read or is empty, expected a histogram as CSV");
}

TEST(HistogramCsv, NamesAFileThatIsNotThere) {
  EXPECT_EQ(complaint_of([] { histogram_from_csv("no/such/histogram.csv"); }),
            "no/such/histogram.csv: cannot be read or is empty, expected a histogram as CSV");
  EXPECT_NE(complaint_of([] { histogram_from_csv(testing::TempDir()); }), "");
}

}  // namespace
}  // namespace tendon::injector
