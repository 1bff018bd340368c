// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/recordings/pair_report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include "server/recording/mcap_writer.h"
#include "server/recording/recording_codec.h"
#include "tests/server/scratch_folder.h"
#include "tests/support/refusal.h"
#include "tests/tools/lab/experiments/steps.h"

namespace tendon::lab::pair_report_test {
namespace {

using std::chrono::milliseconds;
using enum PairObserver::Which;

StepRecord step(std::uint64_t tick, double account, double x = 0) {
  StepRecord made;
  made.tick = tick;
  made.hand.at = LocalTime(milliseconds(tick));
  made.hand.position = Vec3(0, x, 0);
  made.applied = Vec3(0, -2 * x, 0);
  made.energy = account;
  return made;
}

PortRecord port(std::uint64_t tick, double credit, double withdraw) {
  PortRecord made;
  made.tick = tick;
  made.at = LocalTime(milliseconds(tick));
  made.settled = {.credit = credit, .withdraw = withdraw};
  return made;
}

TEST(PairObserver, CountsWhatIsUnderWayToThePair) {
  PairObserver observer;
  // Hands have put in 10 J and 1 J. In step 2 the leader pays 4 J, which arrive at the follower in step 4.
  for (std::uint64_t tick = 1; tick <= 6; ++tick) {
    observer.observe(kLeader, step(tick, tick <= 2 ? 10 : 6));
    observer.observe(kFollower, step(tick, tick <= 4 ? 1 : 5));
  }
  for (std::uint64_t tick = 1; tick <= 6; ++tick) {
    observer.observe(kLeader, port(tick, 0, tick == 2 ? 4 : 0));
    observer.observe(kFollower, port(tick, tick == 4 ? 4 : 0, 0));
  }
  const PairRun run = observer.run();
  ASSERT_EQ(run.pair.size(), 12U);
  EXPECT_EQ(run.pair.front().second, 10) << "the other end has not begun";
  for (std::size_t i = 1; i < run.pair.size(); ++i) EXPECT_EQ(run.pair[i].second, 11) << i;
  EXPECT_EQ(run.follower.account.back().second, 5);
  EXPECT_EQ(run.least_pair, 0);
}

TEST(PairObserver, FindsWhatBothTogetherGaveOut) {
  PairObserver observer;
  observer.observe(kLeader, step(1, 1, 0.01));
  observer.observe(kFollower, step(1, -0.5, 0.02));
  observer.observe(kFollower, step(2, -3, 0.04));
  observer.observe(kLeader, step(3, 2, 0.03));
  PortRecord touching = port(2, 0, 0);
  touching.sent.contact_force = Vec3(9, -7, 0);
  observer.observe(kFollower, touching);
  const PairRun run = observer.run();
  EXPECT_EQ(run.least_pair, -2);
  EXPECT_EQ(run.leader.least_account, 0);
  EXPECT_EQ(run.follower.least_account, -3);
  EXPECT_EQ(run.leader.largest_force, 0.06);
  ASSERT_EQ(run.felt.size(), 2U);
  EXPECT_EQ(run.felt.back().second, -0.06) << "along the axis that it moves on";
  ASSERT_EQ(run.contact.size(), 1U);
  EXPECT_EQ(run.contact.front().second, -7);
  EXPECT_NEAR(run.pair.back().first, 0.002, 1e-12);
}

TEST(PairObserver, OneEndAloneIsNoPair) {
  PairObserver observer;
  observer.observe(kLeader, step(1, 0));
  EXPECT_THROW(observer.run(), std::runtime_error);
}

class PairReport : public ::testing::Test {
 protected:
  /// As `tendon-replay --merge` does. The leader has `left` J after the first of two steps.
  std::filesystem::path merged(const std::string& name, double left) {
    const auto path = folder_.path() / name;
    FileSink sink(path);
    McapWriter writer("test", sink);
    const auto add = [&](std::string_view topic, std::string_view schema) {
      return writer.add_channel(writer.add_schema(schema, recording::kEncoding, recording::schema_data()), topic,
                                recording::kEncoding);
    };
    writer.write(add(recording::kClock.topic, recording::kClock.schema), 0, recording::encode(ClockRecord{}));
    for (const char* end : {"/leader", "/follower"}) {
      const auto steps = add(end + std::string(recording::kStep.topic), recording::kStep.schema);
      for (std::uint64_t tick = 1; tick <= 2; ++tick) {
        const StepRecord made = step(tick, tick == 2 ? left : 0.0, 0.01 * static_cast<double>(tick));
        writer.write(steps, static_cast<std::uint64_t>(made.hand.at.time_since_epoch().count()),
                     recording::encode(made));
      }
    }
    writer.close();
    return path;
  }

  tendon::testing::ScratchFolder folder_;
  std::ostringstream out_;
};

TEST_F(PairReport, SaysInWordsWhatThePairGaveOut) {
  report_pairs({.recordings = {merged("off.mcap", -0.25), merged("on.mcap", 0.25)}, .labels = {"off", "on"}}, out_);
  EXPECT_NE(out_.str().find("off: the pair gave out 500 mJ that was never put in."), std::string::npos) << out_.str();
  EXPECT_NE(out_.str().find("on: the pair gave out no energy that was never put in; its least value is 0 J."),
            std::string::npos)
      << out_.str();
}

TEST_F(PairReport, JsonIsOneLineForEachPair) {
  report_pairs({.recordings = {merged("off.mcap", -0.25)}, .json = true}, out_);
  EXPECT_NE(out_.str().find("\"least_pair_j\":-0.5"), std::string::npos) << out_.str();
  EXPECT_EQ(std::ranges::count(out_.str(), '\n'), 1);
}

TEST_F(PairReport, CheckFailsByThePairThatGaveOutWhatNobodyHadPutIn) {
  const auto on = merged("on.mcap", 0.25);
  EXPECT_NO_THROW(report_pairs({.recordings = {on}, .check = true}, out_));
  EXPECT_EQ(thrown_by<std::runtime_error>([&] {
              report_pairs({.recordings = {on, merged("off.mcap", -0.25)}, .check = true}, out_);
            }),
            "off.mcap: the pair fell to −500 mJ, expected −1.00 nJ or more");
}

TEST_F(PairReport, RefusesWhatIsNoMerge) {
  const auto single = folder_.path() / "single.mcap";
  testing::record(single, testing::toy_run(Law::kAol, 100));
  EXPECT_NE(thrown_by<std::runtime_error>([&] {
              report_pairs({.recordings = {single}}, out_);
            }).find("tendon-replay --merge"),
            std::string::npos);
  const auto pair = merged("on.mcap", 0);
  EXPECT_THROW(report_pairs({.recordings = {pair, pair, pair}, .picture = "x.svg"}, out_), std::invalid_argument);
  EXPECT_THROW(report_pairs({.recordings = {pair}, .labels = {"a", "b"}}, out_), std::invalid_argument);
}

TEST_F(PairReport, DrawsBothEndsAndThePair) {
  if (std::system("command -v gnuplot >/dev/null") != 0) GTEST_SKIP() << "gnuplot is not installed";  // NOLINT
  const auto picture = folder_.path() / "pairs.svg";
  report_pairs({.recordings = {merged("off.mcap", -0.25), merged("on.mcap", 0.25)}, .picture = picture}, out_);
  std::ifstream in(picture);
  const std::string svg{std::istreambuf_iterator<char>(in), {}};
  for (const char* text :
       {"where both ends are", "felt at the leader", "account of the leader", "the pair", "off.mcap"})
    EXPECT_NE(svg.find(text), std::string::npos) << text;
}

}  // namespace
}  // namespace tendon::lab::pair_report_test
