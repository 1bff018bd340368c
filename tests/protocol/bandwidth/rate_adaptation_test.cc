// SPDX-License-Identifier: Apache-2.0
#include "protocol/bandwidth/rate_adaptation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <map>
#include <stdexcept>
#include <vector>

#include "tests/support/dice.h"

namespace tendon::rate_adaptation_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr LocalTime kStart{seconds(1)};

/// A 1 kHz sender on a FIFO link that can carry a limited number of datagrams per second. The delay is 5 ms in each
/// direction, and the queue is unbounded. The peer answers each datagram immediately.
class NarrowLink {
 public:
  explicit NarrowLink(const RateAdaptation::Config& config = {}) : adaptation_(config, kStart) {}

  void run(Duration length, double datagrams_per_second, double loss = 0) {
    const Duration service = from_seconds(1 / datagrams_per_second);
    for (const LocalTime end = now_ + length; now_ < end; now_ += milliseconds(1)) {
      while (!answers_.empty() && answers_.front().at <= now_) {
        const Answer answer = answers_.front();
        answers_.pop_front();
        adaptation_.observe(now_, answer.at - answer.sent, answer.seen, answer.missed);
      }
      queue_s_ = std::max(0.0, tendon::seconds(free_ - now_));
      longest_queue_s_ = std::max(longest_queue_s_, queue_s_);
      time_at_[adaptation_.one_in()] += milliseconds(1);
      if (++tick_ % adaptation_.one_in() != 0) continue;
      free_ = std::max(free_, now_) + service;
      if (dice_.chance(loss)) {
        ++missed_;
      } else {
        answers_.push_back({free_ + milliseconds(10), now_, ++seen_, missed_});
      }
    }
  }

  const RateAdaptation& adaptation() const { return adaptation_; }
  double queue_s() const { return queue_s_; }
  double longest_queue_s() const { return longest_queue_s_; }
  std::map<std::uint32_t, Duration> take_times() { return std::exchange(time_at_, {}); }

 private:
  struct Answer {
    LocalTime at;
    LocalTime sent;
    std::uint64_t seen;
    std::uint64_t missed;
  };
  RateAdaptation adaptation_;
  LocalTime now_ = kStart;
  LocalTime free_ = kStart;
  std::uint64_t tick_ = 0;
  std::uint64_t seen_ = 0;
  std::uint64_t missed_ = 0;
  double queue_s_ = 0;
  double longest_queue_s_ = 0;
  std::deque<Answer> answers_;
  std::map<std::uint32_t, Duration> time_at_;
  Dice dice_{1};
};

TEST(RateAdaptation, LeavesAWideLinkAlone) {
  NarrowLink link;
  link.run(seconds(60), 5000, 0.01);
  EXPECT_EQ(link.take_times().size(), 1U);
  EXPECT_EQ(link.adaptation().one_in(), 1U);
}

TEST(RateAdaptation, FitsTheRateToANarrowLinkSoThatItsQueueStaysShort) {
  for (const auto& [capacity, fits] : std::map<double, std::uint32_t>{{700, 2}, {300, 4}, {130, 10}, {60, 20}}) {
    NarrowLink link;
    link.run(seconds(60), capacity);
    link.take_times();
    link.run(seconds(240), capacity);
    EXPECT_LT(link.queue_s(), 0.5) << capacity;
    auto times = link.take_times();
    EXPECT_GT(times[fits], seconds(200)) << capacity;
  }
}

TEST(RateAdaptation, ComesBackToTheFullRateWhenTheLinkIsWideAgain) {
  NarrowLink link;
  link.run(seconds(20), 130);
  EXPECT_GE(link.adaptation().one_in(), 10U);
  link.run(seconds(60), 5000);
  EXPECT_EQ(link.adaptation().one_in(), 1U);
}

TEST(RateAdaptation, TriesAHigherRateMoreAndMoreRarelyWhenThatKeepsFailing) {
  NarrowLink link;
  link.run(seconds(100), 700);
  link.take_times();
  link.run(seconds(300), 700);
  EXPECT_LT(link.take_times()[1], seconds(6));  // it only tries for a few 100 ms every 80 s
}

TEST(RateAdaptation, LossLowersTheRateAndATenthBreaksTheCircuitAtTheLowest) {
  NarrowLink lossy;
  lossy.run(seconds(10), 5000, 0.08);
  EXPECT_EQ(lossy.adaptation().one_in(), 20U);
  lossy.run(seconds(60), 5000, 0.02);
  EXPECT_FALSE(lossy.adaptation().unusable());

  NarrowLink unusable;
  unusable.run(milliseconds(700), 5000, 0.4);
  EXPECT_FALSE(unusable.adaptation().unusable());
  unusable.run(seconds(8), 5000, 0.4);
  EXPECT_TRUE(unusable.adaptation().unusable());
  unusable.run(seconds(3), 5000, 0);
  EXPECT_FALSE(unusable.adaptation().unusable());
}

TEST(RateAdaptation, RefusesWhatIsImpossible) {
  EXPECT_THROW(RateAdaptation({.queueing = Duration(0)}, kStart), std::invalid_argument);
  EXPECT_THROW(RateAdaptation({.loss = 1.5}, kStart), std::invalid_argument);
  EXPECT_THROW(RateAdaptation({.longest_clean = seconds(1)}, kStart), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::rate_adaptation_test
