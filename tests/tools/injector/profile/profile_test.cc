// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/profile/profile.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/refusal.h"

namespace tendon::injector::profile_test {
namespace {

using namespace std::chrono_literals;

std::string complaint_about(const std::string& line) {
  return thrown_by<std::exception>([&] { parse_profile(line); });
}

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
  profile.base = 5ms;
  profile.delay = LognormalDelay{20ms, 5ms};
  profile.rho = 0.9;
  profile.loss = BurstLoss{0.02, 4};
  profile.spikes = {{{.at = 15s, .every = 15s, .lasts = 50ms}, 80ms}};
  profile.bottleneck.bits_per_second = 10'000'000;
  profile.bottleneck.queue = 64'000;
  profile.bottleneck.queue_in_bytes = true;
  const std::string line =
      "base=5ms delay=lognormal(20ms,5ms) rho=0.9 loss=burst(2%,4) spike(every=15s,for=50ms,80ms) rate=10Mbit/s "
      "queue=64kB";
  EXPECT_EQ(to_string(profile), line);
  EXPECT_EQ(parse_profile(line), profile);
}

TEST(Profile, AnEmptyLineIsAPerfectNetwork) {
  EXPECT_EQ(parse_profile(""), Profile{});
  EXPECT_EQ(to_string(Profile{}), "base=0ms");
}

TEST(Profile, WritesPercentAndTimesWithoutRounding) {
  Profile profile;
  profile.base = 1ns;
  profile.loss = RandomLoss{0.07};
  profile.duplicate = 1;
  EXPECT_EQ(to_string(profile), "base=0.000001ms loss=7% duplicate=100%");
  profile.base = 1234567ns;
  profile.loss = RandomLoss{0.0001};
  profile.duplicate = 0.125;
  EXPECT_EQ(to_string(profile), "base=1.234567ms loss=0.01% duplicate=12.5%");
}

TEST(Profile, EveryFieldReadsAsTheManualWritesIt) {
  const std::string line =
      "base=5ms delay=pareto(2ms,1.5) memory=20ms loss=gilbert(1%,20%,80%,0.1%) drop(byte=16,mask=0x0f,value=0x03,50%) "
      "regime(clear,dwell=4s) regime(busy,dwell=1s,delay=uniform(1ms,2ms),loss=pattern(01)) step(at=5s,-20ms) "
      "ramp(from=5s,to=10s,30ms) spike(at=1s,every=15s,for=50ms,80ms) stall(every=2s,for=100ms) "
      "handover(every=15s,for=60ms,10ms) outage(at=5s,for=300ms) outage(clear=8500ms,for=uniform(0ms,3s)) duplicate=1% "
      "replay(1%,64) flip=0.1% truncate=0.2% "
      "rebind(every=10s) order=free jump(1%,3) rate=10Mbit/s queue=50packets overhead=42";
  const Profile p = parse_profile(line);
  EXPECT_EQ(to_string(p), line);
  EXPECT_EQ(p.delay, Delay(ParetoDelay{2ms, 1.5}));
  EXPECT_EQ(p.memory, 20ms);
  EXPECT_EQ(p.loss, Loss(GilbertLoss{0.01, 0.2, 0.8, 0.001}));
  EXPECT_EQ(p.rules, (std::vector<DropRule>{{16, 0x0f, 3, 0.5}}));
  EXPECT_EQ(p.regimes,
            (std::vector<Regime>{{"clear", 4s, {}, {}}, {"busy", 1s, UniformDelay{1ms, 2ms}, PatternLoss{"01"}}}));
  EXPECT_EQ(p.steps, (std::vector<Step>{{5s, -20ms}}));
  EXPECT_EQ(p.ramps, (std::vector<Ramp>{{5s, 10s, 30ms}}));
  EXPECT_EQ(p.spikes, (std::vector<Spike>{{{1s, 15s, 50ms}, 80ms}}));
  EXPECT_EQ(p.stalls, (std::vector<Stall>{{{2s, 2s, 100ms}}}));
  EXPECT_EQ(p.handovers, (std::vector<Handover>{{{15s, 15s, 60ms}, 10ms}}));
  EXPECT_EQ(p.outages, (std::vector<Outage>{{{5s, 0s, 300ms}}}));
  EXPECT_EQ(p.random_outages, (std::vector<RandomOutage>{{8500ms, UniformDelay{0ms, 3s}}}));
  EXPECT_EQ(p.replay, (Replay{0.01, 64}));
  EXPECT_EQ(p.jump, (Jump{0.01, 3}));
  EXPECT_EQ(p.rebind, 10s);
  EXPECT_EQ(p.order, Order::kFree);
  EXPECT_EQ(p.bottleneck.bits_per_second, 10'000'000U);
  EXPECT_EQ(p.bottleneck.queue, 50U);
  EXPECT_EQ(p.bottleneck.overhead, 42U);
}

TEST(Profile, ReadsAndWritesMixturesAndBursts) {
  const std::string line =
      "delay=mixture(70ms,0.72645:36.886758ms,0.27355:11.724704ms) loss=bursts(pareto2,5%,10%,4.428:1.638,4.966:0.271)";
  const Profile p = parse_profile(line);
  EXPECT_EQ(to_string(p), line);
  EXPECT_EQ(p.delay, Delay(MixtureDelay{70ms, {{36886758ns, 0.72645}, {11724704ns, 0.27355}}}));
  EXPECT_EQ(p.loss, Loss(ParetoBurstLoss{0.05, 0.1, {{{4.428, 1.638}, {4.966, 0.271}}}}));
}

TEST(Profile, FieldsComeInAnyOrderWithAnyBlanks) {
  EXPECT_EQ(parse_profile("  loss=burst( 2% , 4 )\t base=0.005s drop( value=0x3 , byte=1 )"),
            parse_profile("drop(byte=1,value=3,100%) base=5ms loss=burst(2%,4)"));
}

TEST(Profile, OnTopOfAnotherReplacesFieldsAndAddsEvents) {
  const Profile under = parse_profile("base=5ms loss=2% memory=9ms outage(at=1s,for=1s) opportunities(1,2)");
  EXPECT_EQ(parse_profile("loss=3% rho=0.5 outage(at=5s,for=1s) rate=1kbit/s", under),
            parse_profile("base=5ms loss=3% rho=0.5 outage(at=1s,for=1s) outage(at=5s,for=1s) rate=1kbit/s"));
}

double any_probability() { return static_cast<double>(*rc::gen::arbitrary<std::uint64_t>()) / 18446744073709551616.0; }
Duration any_duration(std::int64_t least = 0, std::int64_t most = kMaxDelay.count()) {
  return Duration(*rc::gen::inRange<std::int64_t>(least, most + 1));
}
bool coin() { return *rc::gen::arbitrary<bool>(); }

std::vector<Weighted> any_table() {
  std::vector<Weighted> table;
  Duration value{};
  for (int n = *rc::gen::inRange(1, 6); n > 0; --n)
    table.push_back({value += any_duration(1, 1'000'000'000), any_probability() + 1e-9});
  return table;
}

Delay any_delay() {
  const Duration mean = any_duration(1000, 1'000'000'000);
  const Duration deviation = mean / *rc::gen::inRange(1, 90);
  switch (*rc::gen::inRange(0, 10)) {
    case 0:
      return ConstantDelay{any_duration()};
    case 1:
      return UniformDelay{mean, mean + deviation};
    case 2:
      return NormalDelay{any_duration(), any_duration()};
    case 3:
      return ExponentialDelay{mean - deviation, mean};
    case 4:
      return LognormalDelay{mean, deviation};
    case 5:
      return ParetoDelay{any_duration(), any_probability() + 0.1};
    case 6:
      return GammaDelay{mean, deviation};
    case 7:
      return HistogramDelay{any_table()};
    case 8:
      return MixtureDelay{mean, {{deviation, any_probability() + 1e-9}, {mean, 1}}};
    default:
      return SampledDelay{any_table()};
  }
}

Loss any_loss() {
  const double p = any_probability();
  switch (*rc::gen::inRange(0, 6)) {
    case 0:
      return RandomLoss{p};
    case 1:
      return BurstLoss{p / 2, 1 + 100 * any_probability()};
    case 2:
      return GilbertLoss{p, any_probability(), any_probability(), any_probability()};
    case 3:
      return FourStateLoss{p / 2, any_probability() / 2, any_probability() / 2, any_probability(), p / 3};
    case 4:
      return ParetoBurstLoss{p, any_probability(), {{{1 + p, 9 * p}, {2, any_probability()}}}};
    default:
      return PatternLoss{coin() ? "0001" : "1"};
  }
}

Window any_window() {
  const Duration lasts = any_duration(1, 1'000'000'000);
  const Duration every = coin() ? Duration::zero() : lasts + any_duration(1000, 1'000'000'000);
  return {.at = coin() ? every : any_duration(), .every = every, .lasts = lasts};
}

Profile any_profile() {
  Profile p;
  p.base = any_duration();
  p.delay = any_delay();
  if (coin())
    p.rho = any_probability() * 0.999;
  else if (coin())
    p.memory = any_duration(1000);
  p.loss = any_loss();
  if (coin())
    p.rules.push_back({*rc::gen::inRange(0U, 1000U), 0xff, *rc::gen::arbitrary<std::uint8_t>(), any_probability()});
  if (coin()) {
    p.regimes.push_back({"clear", any_duration(1'000'000), any_delay(), std::nullopt});
    p.regimes.push_back({"busy-2", any_duration(1'000'000), ConstantDelay{}, any_loss()});
  }
  if (coin()) p.steps.push_back({any_duration(), any_duration(-kMaxDelay.count())});
  if (coin()) p.ramps.push_back({1s, 1s + any_duration(1), any_duration(-kMaxDelay.count())});
  for (int n = *rc::gen::inRange(0, 3); n > 0; --n) p.spikes.push_back({any_window(), any_duration()});
  if (coin()) p.stalls.push_back({any_window()});
  if (coin()) p.handovers.push_back({any_window(), any_duration()});
  if (coin()) p.outages.push_back({any_window()});
  if (coin()) p.random_outages.push_back({any_duration(1'000'000), any_delay()});
  p.duplicate = any_probability();
  if (coin()) p.replay = {any_probability() / 2 + 0.1, *rc::gen::inRange(1U, kMaxReplayDepth + 1)};
  p.flip = any_probability();
  p.truncate = any_probability();
  if (coin()) p.rebind = any_duration(1'000'000);
  p.order = coin() ? Order::kFifo : Order::kFree;
  if (coin()) p.jump = {any_probability() / 2 + 0.1, *rc::gen::inRange(1U, kMaxJump + 1)};
  if (coin())
    p.bottleneck.bits_per_second = *rc::gen::inRange<std::uint64_t>(1, 1'000'000'000'000);
  else if (coin())
    p.bottleneck.opportunities_ms = {0, 7, 7, *rc::gen::inRange(8U, 1000U)};
  p.bottleneck.queue = *rc::gen::inRange<std::uint64_t>(1, 1'000'000);
  p.bottleneck.queue_in_bytes = coin();
  p.bottleneck.overhead = *rc::gen::inRange(0U, 65'536U);
  return p;
}

RC_GTEST_PROP(Profile, ReadsBackExactlyWhatItWrote, ()) {
  const Profile p = any_profile();
  RC_ASSERT(parse_profile(to_string(p)) == p);
}

RC_GTEST_PROP(Profile, AnyTextIsReadOrRefusedAndNothingElseHappens, ()) {
  std::string line = to_string(any_profile());
  for (int n = *rc::gen::inRange(0, 6); n > 0; --n) {
    const auto where = *rc::gen::inRange<std::size_t>(0, line.size());
    if (coin())
      line[where] = *rc::gen::element('(', ')', ',', '=', ' ', '-', '9', 'e', '%', 's', '\x01');
    else
      line.erase(where, *rc::gen::inRange<std::size_t>(1, 9));
    if (line.empty()) break;
  }
  try {
    const Profile p = parse_profile(line);
    RC_ASSERT(parse_profile(to_string(p)) == p);
  } catch (const std::exception& error) {  // a runtime_error if the text has become the name of a file
    RC_ASSERT(std::string(error.what()).find("expected") != std::string::npos);
  }
}

TEST(Profile, RefusesTheImpossibleByFieldValueAndExpectation) {
  expect_refusals(
      Profile{}, check,
      {{"base is -1ms, expected 0ms to 60s", [](Profile& p) { p.base = -1ms; }},
       {"base is 61s, expected 0ms to 60s", [](Profile& p) { p.base = 61s; }},
       {"loss is 150%, expected a probability from 0% to 100%", [](Profile& p) { p.loss = RandomLoss{1.5}; }},
       {"loss is nan, expected a probability from 0% to 100%", [](Profile& p) { p.loss = RandomLoss{std::nan("")}; }},
       {"duplicate is -50%, expected a probability from 0% to 100%", [](Profile& p) { p.duplicate = -0.5; }},
       {"rho is 1, expected 0 to 0.999999", [](Profile& p) { p.rho = 1; }},
       {"rho is 0.5, expected 0 if memory is set, because the correlation is either by packet or by time",
        [](Profile& p) { p.rho = 0.5, p.memory = 1ms; }},
       {"step, ramp, spike, stall, handover or outage is 65 events, expected at most 64",
        [](Profile& p) { p.steps.resize(65); }}});
}

TEST(Profile, RefusesALineItDoesNotUnderstandAndSaysWhere) {
  EXPECT_TRUE(complaint_about("latency=20ms")
                  .starts_with("a field of the profile is \"latency=20ms\", expected base, delay, "));
  EXPECT_TRUE(complaint_about("loss").starts_with("a field of the profile is \"loss\", expected "));
  EXPECT_TRUE(complaint_about("loss(2%)").starts_with("a field of the profile is \"loss(2%)\", expected "));
  for (const auto& [line, complaint] : std::vector<std::pair<std::string, std::string>>{
           {"delay=20", "delay is \"20\", expected a number with its unit like 20ms (ns, us, ms or s)"},
           {"delay=nanms", "delay is \"nanms\", expected a number with its unit like 20ms (ns, us, ms or s)"},
           {"delay=1e300s", "delay is \"1e300s\", expected a number with its unit like 20ms (ns, us, ms or s)"},
           {"loss=two%", "loss is \"two%\", expected a probability like 2% or 0.02"},
           {"loss=2", "loss is 200%, expected a probability from 0% to 100%"},
           {"loss=1% loss=2%", "loss is given twice, expected once"},
           {"jump(1%,1) jump(1%,1)", "jump is given twice, expected once"},
           {"delay=gauss(1ms,2ms)",
            "delay is \"gauss\", expected uniform, normal, exponential, lognormal, pareto, gamma, mixture, histogram, "
            "samples or netem"},
           {"delay=mixture(70ms,36ms:1)",
            "delay is \"36ms:1\", expected mixture(LEAST,WEIGHT:MEAN,…) like mixture(70ms,0.7:37ms,0.3:12ms)"},
           {"delay=mixture(70ms,0:36ms)", "delay=mixture: weight is 0, expected 1e-09 to 1e+09"},
           {"delay=mixture(70ms,1:0ms)", "delay=mixture: mean is 0ms, expected 0.000001ms to 60s"},
           {"loss=bursts(pareto,5%,10%,4:1,4:1)",
            "loss is \"bursts(pareto,5%,10%,4:1,4:1)\", expected bursts(pareto2,P12,P21,SHAPE1:SCALE1,SHAPE2:SCALE2)"},
           {"loss=bursts(pareto2,5%,10%,0.9:1,4:1)", "loss=bursts: shape is 0.9, expected 1 to 100"},
           {"outage(clear=0ms,for=1s)", "outage: clear is 0ms, expected 1ms to 86400s"},
           {"delay=normal(1ms)", "delay is \"normal(1ms)\", expected normal of two durations"},
           {"delay=normal(1ms,2ms", "delay is \"normal(1ms,2ms\", expected a closing bracket at its end"},
           {"delay=uniform(2ms,1ms)", "delay: upper end is 1ms, expected 2ms to 60s"},
           {"delay=gamma(20ms,1us)", "delay: standard deviation is 0.001ms, expected 0.2ms to 200ms"},
           {"delay=histogram(2ms:1,1ms:1)",
            "delay=histogram, entry 1: value is 1ms, expected more than 2ms, the previous one"},
           {"delay=histogram(1ms:0)",
            "delay=histogram: the sum of all weights is 0, expected a finite number above zero"},
           {"loss=burst(50%,0.5)", "loss=burst: mean length is 0.5, expected 1 to 1e+06"},
           {"loss=burst(80%,2)", "loss=burst: mean length is 2, expected 4.000000000000001 to 1e+06"},
           {"loss=pattern(012)", "loss=pattern is \"012\", expected 1 to 65536 digits 0 and 1"},
           {"loss=fourstate(90%,10%,10%,10%,20%)",
            "loss=fourstate: p13 + p14 is 110%, expected a probability from 0% to 100%"},
           {"drop(byte=1,mask=0x0f,value=0x10)", "drop: value is 0x10, expected bits within the mask 0x0f"},
           {"drop(value=1)", "drop is \"drop(value=1)\", expected drop(byte=16,mask=0x0f,value=3,50%)"},
           {"regime(a,dwell=1s)", "regime is one, expected two or more, or none"},
           {"stall(for=1s)", "stall is \"stall(for=1s)\", expected stall(every=2s,for=100ms)"},
           {"stall(every=1s,for=1s)", "stall: for is 1s, expected 0.000001ms to 999.999999ms"},
           {"outage(at=1s,for=1s,twice)",
            "outage is \"outage(at=1s,for=1s,twice)\", expected outage(at=5s,for=300ms) or outage(clear=5s,for=LAW)"},
           {"replay(1%,65)", "replay: depth is \"65\", expected a whole number from 0 to 64"},
           {"replay(1%,0)", "replay: depth is 0, expected 1 to 64 with a probability above zero"},
           {"rate=10",
            "rate is \"10\", expected a number with its unit like 10Mbit/s (bit/s, kbit/s, Mbit/s, Gbit/s), at most "
            "1000Gbit/s"},
           {"queue=9", "queue is \"9\", expected a number with its unit like 64kB or 50packets (B, kB, MB, packets)"},
           {"opportunities(3,2)", "opportunities is not rising, expected times in order"},
           {"opportunities(none.trace)",
            "cannot read none.trace: No such file or directory, expected a time in whole ms in each line"},
           {"order=lifo", "order is \"lifo\", expected fifo or free"}}) {
    EXPECT_EQ(complaint_about(line), complaint) << line;
  }
}

TEST(ProfileFiles, AHistogramMayHaveTabsCommasSemicolonsBlanksAndComments) {
  const std::string begin = "# edge in ms, count\n";
  for (const std::string& text : std::vector<std::string>{
           begin + "0.560000\t0.000720\n0.5877\t5\r\n\n1\t7 # a comment\n", begin + "0.56, 0.00072\n0.5877,5\n1,7\n",
           "edge;count\n" + begin + "0,56;0,00072\n0,5877 ;5\n1;7\n", " 0.56   0.00072\n0.5877 5\n  1   7  \n",
           "\xef\xbb\xbf"
           "edge_us,count\n560,0.00072\n587.7,5\n1000,7\n"}) {
    const TemporaryFile file(text);
    EXPECT_EQ(parse_profile("delay=histogram(" + file.path().string() + ")").delay,
              Delay(HistogramDelay{{{560us, 0.00072}, {587'700ns, 5}, {1ms, 7}}}))
        << text;
  }
}

TEST(ProfileFiles, SamplesComeInAnyOrderAndAreCounted) {
  for (const char* text :
       {"3\n1\n3\n2\n2\n", "delay_ms,weight\n3,2\n1,1\n2,2\n", "Delay [s];weight\n0,003;2\n0,001;1\n0,002;2\n"}) {
    const TemporaryFile file(text);
    EXPECT_EQ(parse_profile("delay=samples(" + file.path().string() + ")").delay,
              Delay(SampledDelay{{{1ms, 1}, {2ms, 2}, {3ms, 2}}}))
        << text;
  }
}

TEST(ProfileFiles, SamplesAreWhatImportCsvReads) {
  for (const char* text :
       {"t_ms,delay_ms\n0,3\n10,1\n20,\n30,3\n", "3\n1\n\n3\n",
        "dir,link,index,t_ms,delay_ms,actual_delay_ms\nup,0,0,0,3,\nup,0,1,1,,\ndown,0,0,0,1,\nup,0,2,2,3,\n"}) {
    const TemporaryFile file(text);
    EXPECT_EQ(parse_profile("delay=samples(" + file.path().string() + ")").delay,
              Delay(SampledDelay{{{1ms, 1}, {3ms, 2}}}))
        << text;
  }
}

TEST(ProfileFiles, ATableOfNetemIsInUnitsOfTheDeviationOver8192) {
  const TemporaryFile file("# a comment\n-32768 -8192\n0 4096 4096\n");
  EXPECT_EQ(parse_profile("delay=netem(" + file.path().string() + ",20ms,8ms)").delay,
            Delay(SampledDelay{{{0ms, 1}, {12ms, 1}, {20ms, 1}, {24ms, 2}}}));
}

TEST(ProfileFiles, OpportunitiesAreLinesOfWholeMilliseconds) {
  const TemporaryFile file("1\n1\n3\n");
  EXPECT_EQ(parse_profile("opportunities(" + file.path().string() + ")"), parse_profile("opportunities(1,1,3)"));
}

TEST(ProfileFiles, WhatCannotBeReadIsNamedByFileAndLine) {
  const auto complaint_in = [](const std::string& content, const std::string& kind = "histogram(") {
    const TemporaryFile file(content);
    const std::string said = complaint_about("delay=" + kind + file.path().string() + ")");
    const std::string path = file.path().string();
    EXPECT_TRUE(said.starts_with(path)) << said;
    return said.substr(std::min(path.size(), said.size()));
  };
  EXPECT_EQ(complaint_in("1,2\nedge,count\n"), ":2: expected a finite number in column 0 (from 0), found 'edge'");
  EXPECT_EQ(complaint_in("1\n"), ":1: expected LOWER_EDGE_MS,COUNT like 0.56,72, found 1 column");
  EXPECT_EQ(complaint_in("1,2,3\n"), ":1: expected LOWER_EDGE_MS,COUNT like 0.56,72, found 3 columns");
  EXPECT_EQ(complaint_in("1,2\n\n1,2\n"), ":3: value is 1ms, expected more than 1ms, the previous one");
  EXPECT_EQ(complaint_in("1,-2\n"), ":1: weight is -2, expected a number that is zero or more");
  EXPECT_EQ(complaint_in("1e300,2\n"), ":1: value is 1e+300ms, expected 0ms to 60s");
  EXPECT_EQ(complaint_in("x\n", "samples("),
            ":1: expected numbers, or names of columns with delay_ms among them, found \"x\"");
  EXPECT_EQ(complaint_in("20,1\n", "samples("),
            ":1: expected one delay in ms in each line, or a first line with the names of the columns, like "
            "t_ms;delay_ms, found 2 numbers in \"20,1\": are these decimal commas, or are they time and delay?");
  EXPECT_EQ(complaint_in(""), " is empty, expected one value in ms and its weight in each line");
  EXPECT_EQ(complaint_about("delay=histogram(no/such.csv)"),
            "cannot read no/such.csv: No such file or directory, expected one value in ms and its weight in each line");
  EXPECT_NE(complaint_about("delay=histogram(" + testing::TempDir() + ")"), "");
}

TEST(ProfileFiles, ANamedPipeIsRefusedAndNotWaitedFor) {
  const std::string pipe = testing::TempDir() + "histogram_pipe.csv";
  std::filesystem::remove(pipe);
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(complaint_about("delay=histogram(" + pipe + ")"),
            "cannot read " + pipe +
                ": it is a named pipe, expected a regular file, expected one value in ms and its weight in each line");
  std::filesystem::remove(pipe);
}

}  // namespace
}  // namespace tendon::injector::profile_test
