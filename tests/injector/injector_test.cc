// SPDX-License-Identifier: Apache-2.0
#include "tests/injector/injector.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace tendon::injector {
namespace {

using namespace std::chrono_literals;

constexpr LocalTime kStart = LocalTime(5s);
constexpr int kMany = 100'000;

/// The decisions on `count` datagrams of 100 bytes, one each `period`, the first at kStart.
std::vector<Decision> decisions(const std::string& profile, int count, Duration period, std::uint64_t seed = 7) {
  Injector injector(parse_profile(profile), seed, 0, Direction::kUp);
  std::vector<Decision> all;
  all.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) all.push_back(injector.decide({.arrival = kStart + i * period, .size = 100}));
  return all;
}

bool lost(const Decision& d) { return d.verdict == Verdict::kDrop; }
Duration delay(const Decision& d) { return d.release - d.arrival; }
double count_if(const std::vector<Decision>& all, const std::function<bool(const Decision&)>& what) {
  return static_cast<double>(std::ranges::count_if(all, what));
}

/// Four standard deviations of the binomial distribution: a right injector fails for one seed in 16 000.
double four_sigma(double n, double p) { return 4 * std::sqrt(n * p * (1 - p)); }

TEST(Injector, SameSeedSameDecisions) {
  const std::string profile = "delay=lognormal(20ms,15ms) loss=10% duplicate=10%";
  EXPECT_EQ(decisions(profile, 10'000, 1ms, 7), decisions(profile, 10'000, 1ms, 7));
  EXPECT_NE(decisions(profile, 10'000, 1ms, 7), decisions(profile, 10'000, 1ms, 8));
}

TEST(Injector, APerfectNetworkChangesNothing) {
  for (const Decision& d : decisions("", 1000, 1us)) {
    EXPECT_EQ(d.verdict, Verdict::kPass);
    EXPECT_EQ(d.cause, Cause::kDelay);
    EXPECT_EQ(d.release, d.arrival);
    EXPECT_FALSE(d.duplicate || d.stale || d.flipped_bit || d.truncated_to);
  }
}

TEST(Injector, AConstantDelayIsExact) {
  for (const Decision& d : decisions("base=1ns delay=20ms", 1000, 1us)) EXPECT_EQ(delay(d), 20'000'001ns);
}

RC_GTEST_PROP(Injector, NeverReleasesADatagramBeforeOneThatArrivedEarlier, ()) {
  Profile profile;
  profile.base = Duration(*rc::gen::inRange<std::int64_t>(0, 100'000'000));
  profile.delay = UniformDelay{0ms, Duration(*rc::gen::inRange<std::int64_t>(0, 200'000'000))};
  profile.loss = RandomLoss{*rc::gen::inRange(0, 60) / 100.0};
  profile.duplicate = *rc::gen::inRange(0, 60) / 100.0;
  if (*rc::gen::arbitrary<bool>()) profile.stalls.push_back({{.at = 1ms, .every = 30ms, .lasts = 20ms}});
  if (*rc::gen::arbitrary<bool>()) profile.bottleneck.bits_per_second = 1'000'000;
  Injector injector(profile, *rc::gen::arbitrary<std::uint64_t>(), 0, Direction::kUp);
  const auto gaps = *rc::gen::container<std::vector<std::int64_t>>(rc::gen::inRange<std::int64_t>(0, 5'000'000));
  LocalTime arrival{};
  LocalTime last_release{};
  for (const std::int64_t gap : gaps) {
    arrival += Duration(gap);
    const Decision d = injector.decide({.arrival = arrival, .size = 100});
    RC_ASSERT(d.release >= arrival);
    RC_ASSERT(d.release >= last_release);
    if (d.duplicate) RC_ASSERT(*d.duplicate >= d.release);
    last_release = d.release;
  }
}

TEST(Injector, FifoHoldsEvenForAClockThatGoesBack) {
  Injector injector(parse_profile("delay=10ms"), 1, 0, Direction::kUp);
  EXPECT_EQ(injector.decide({.arrival = kStart}).release, kStart + 10ms);
  EXPECT_EQ(injector.decide({.arrival = kStart - 1ms}).release, kStart + 10ms);
}

TEST(Injector, LosesAndDuplicatesAsOftenAsTheProfileSays) {
  for (const double p : {0.001, 0.02, 0.3, 0.5, 0.97}) {
    const std::string share = std::to_string(p);
    const auto all = decisions("loss=" + share + " duplicate=" + share, kMany, 1ms, 11);
    const double gone = count_if(all, lost);
    EXPECT_NEAR(gone, kMany * p, four_sigma(kMany, p)) << p;
    const double twice = count_if(all, [](const Decision& d) { return d.duplicate.has_value(); });
    EXPECT_NEAR(twice, (kMany - gone) * p, four_sigma(kMany - gone, p)) << p;
  }
}

TEST(Injector, LosingMoreDatagramsLosesTheSameDatagramsAndMore) {
  const auto some = decisions("loss=5%", 10'000, 1ms);
  const auto more = decisions("loss=20%", 10'000, 1ms);
  for (std::size_t i = 0; i < some.size(); ++i) EXPECT_TRUE(!lost(some[i]) || lost(more[i])) << i;
}

TEST(Injector, ASecondCopyMayComeAfterNewerDatagrams) {
  const auto all = decisions("delay=uniform(0ms,40ms) duplicate=100%", 1000, 1ms);
  int stale = 0;
  for (std::size_t i = 0; i + 1 < all.size(); ++i) stale += all[i].duplicate.value() > all[i + 1].release ? 1 : 0;
  EXPECT_GT(stale, 10);
}

TEST(Injector, RefusesAnImpossibleProfile) {
  Profile profile;
  profile.loss = RandomLoss{-0.1};
  EXPECT_THROW(Injector(profile, 1, 0, Direction::kUp), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::injector
