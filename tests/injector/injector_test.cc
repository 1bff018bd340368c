// SPDX-License-Identifier: Apache-2.0
#include "tests/injector/injector.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <vector>

namespace tendon::injector {
namespace {

using namespace std::chrono_literals;

constexpr LocalTime kStart = LocalTime(5s);
constexpr int kMany = 100'000;

/// The fates of `count` datagrams, one each `period`.
std::vector<Fate> fates_of(const Profile& profile, std::uint64_t seed, int count, Duration period) {
  Injector injector(profile, seed);
  std::vector<Fate> fates;
  fates.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) fates.push_back(injector.next(kStart + i * period));
  return fates;
}

bool same(const Fate& a, const Fate& z) { return a.lost == z.lost && a.delay == z.delay && a.duplicate == z.duplicate; }

TEST(Injector, SameSeedSameFates) {
  const Profile profile = parse_profile("delay=20ms jitter=15ms loss=10% duplicate=10%");
  const auto a = fates_of(profile, 7, 10'000, 1ms);
  EXPECT_TRUE(std::ranges::equal(a, fates_of(profile, 7, 10'000, 1ms), same));
  EXPECT_FALSE(std::ranges::equal(a, fates_of(profile, 8, 10'000, 1ms), same));
}

// Golden: recordings and bug reports name seeds, so these must never change, on any compiler.
TEST(Injector, TheFatesOfASeedAreTheSameOnEveryMachine) {
  const auto fates =
      fates_of(parse_profile("delay=1ms loss=30% duplicate=50% histogram=1ms:1,2ms:3,5ms:2.5"), 42, 8, 20ms);
  std::string text;
  for (const Fate& fate : fates) {
    text += (fate.lost ? "lost " : "") + std::to_string(fate.delay.count());
    if (fate.duplicate) text += "+" + std::to_string(fate.duplicate->count());
    text += "; ";
  }
  EXPECT_EQ(text, "6184444; 2611444; lost 4536760; 6171237; 4917954+4917954; 2970570+2970570; lost 2612120; 2796367; ");
}

TEST(Injector, APerfectNetworkChangesNothing) {
  for (const Fate& fate : fates_of(Profile{}, 1, 1000, 1us)) {
    EXPECT_FALSE(fate.lost);
    EXPECT_EQ(fate.delay, 0ns);
    EXPECT_FALSE(fate.duplicate);
  }
}

TEST(Injector, AConstantDelayIsExact) {
  for (const Fate& fate : fates_of(parse_profile("delay=20.000001ms"), 1, 1000, 1us)) {
    EXPECT_EQ(fate.delay, 20'000'001ns);
  }
}

RC_GTEST_PROP(Injector, NeverReleasesADatagramBeforeOneThatArrivedEarlier, ()) {
  Profile profile;
  profile.delay = Duration(*rc::gen::inRange<std::int64_t>(0, 100'000'000));
  profile.jitter = Duration(*rc::gen::inRange<std::int64_t>(0, 200'000'000));
  profile.loss = *rc::gen::inRange(0, 60) / 100.0;
  profile.duplicate = *rc::gen::inRange(0, 60) / 100.0;
  Injector injector(profile, *rc::gen::arbitrary<std::uint64_t>());
  const auto gaps = *rc::gen::container<std::vector<std::int64_t>>(rc::gen::inRange<std::int64_t>(0, 5'000'000));
  LocalTime arrival{};
  LocalTime last_release{};
  for (const std::int64_t gap : gaps) {
    arrival += Duration(gap);
    const Fate fate = injector.next(arrival);
    RC_ASSERT(fate.delay >= 0ns);
    RC_ASSERT(arrival + fate.delay >= last_release);
    if (fate.duplicate) RC_ASSERT(*fate.duplicate >= fate.delay);
    last_release = arrival + fate.delay;
  }
}

TEST(Injector, FifoHoldsEvenForAClockThatGoesBack) {
  Injector injector(parse_profile("delay=10ms"), 1);
  EXPECT_EQ(injector.next(kStart).delay, 10ms);
  EXPECT_EQ(injector.next(kStart - 1ms).delay, 11ms);
}

TEST(Injector, LosesAndDuplicatesAsOftenAsTheProfileSays) {
  for (const double probability : {0.001, 0.02, 0.3, 0.5, 0.97}) {
    Profile profile;
    profile.loss = probability;
    profile.duplicate = probability;
    const auto fates = fates_of(profile, 11, kMany, 1ms);
    const auto lost = static_cast<double>(std::ranges::count_if(fates, &Fate::lost));
    const auto twice =
        static_cast<double>(std::ranges::count_if(fates, [](const Fate& f) { return f.duplicate.has_value(); }));
    // Four standard deviations of the binomial distribution: a right injector fails for one seed in 16 000.
    const auto four_sigma = [&](double n) { return 4 * std::sqrt(n * probability * (1 - probability)); };
    EXPECT_NEAR(lost, kMany * probability, four_sigma(kMany)) << probability;
    const double through = kMany - lost;
    EXPECT_NEAR(twice, through * probability, four_sigma(through)) << probability;
  }
}

TEST(Injector, ZeroNeverHappensAndOneAlways) {
  Profile profile;
  profile.duplicate = 1;
  for (const Fate& fate : fates_of(profile, 1, 10'000, 1ms)) {
    EXPECT_FALSE(fate.lost);
    EXPECT_TRUE(fate.duplicate);
  }
  profile.loss = 1;
  for (const Fate& fate : fates_of(profile, 1, 10'000, 1ms)) {
    EXPECT_TRUE(fate.lost);
    EXPECT_FALSE(fate.duplicate);
  }
}

TEST(Injector, JitterIsCentredOnTheDelayAndFillsItsRange) {
  // 100 ms apart: no datagram has to wait for another.
  Duration least = 1h;
  Duration most{};
  double sum_s = 0;
  for (const Fate& fate : fates_of(parse_profile("delay=20ms jitter=5ms"), 3, kMany, 100ms)) {
    least = std::min(least, fate.delay);
    most = std::max(most, fate.delay);
    sum_s += seconds(fate.delay);
  }
  EXPECT_GE(least, 15ms);
  EXPECT_LE(most, 25ms);
  // The extremes of n uniform draws miss the ends by width/n on average; ten times that is one seed in 20 000.
  EXPECT_LT(least, 15ms + 1us);
  EXPECT_GT(most, 25ms - 1us);
  // Standard deviation of the mean: 10 ms/√12/√n.
  EXPECT_NEAR(sum_s / kMany, 20e-3, 4 * 10e-3 / std::sqrt(12.0 * kMany));
}

TEST(Injector, JitterReachesBothEndsInclusive) {
  bool low = false;
  bool high = false;
  for (const Fate& fate : fates_of(parse_profile("delay=5ns jitter=1ns"), 3, 1000, 1ms)) {
    EXPECT_GE(fate.delay, 4ns);
    EXPECT_LE(fate.delay, 6ns);
    low = low || fate.delay == 4ns;
    high = high || fate.delay == 6ns;
  }
  EXPECT_TRUE(low && high);
}

TEST(Injector, DelaysBelowZeroBecomeZero) {
  const auto fates = fates_of(parse_profile("delay=1ms jitter=4ms"), 3, 10'000, 100ms);
  const auto zeros = std::ranges::count_if(fates, [](const Fate& f) { return f.delay == 0ns; });
  EXPECT_NEAR(static_cast<double>(zeros), 3.0 / 8 * 10'000, 4 * std::sqrt(10'000 * 3.0 / 8 * 5 / 8));
}

TEST(Injector, LossAndDuplicatesDoNotShiftTheDelaysOfTheOthers) {
  // 1 kHz with ±15 ms: most datagrams wait for one ahead of them, so waiting is in the claim.
  const auto clean = fates_of(parse_profile("delay=20ms jitter=15ms"), 7, 10'000, 1ms);
  const auto lossy = fates_of(parse_profile("delay=20ms jitter=15ms loss=30% duplicate=20%"), 7, 10'000, 1ms);
  int lost = 0;
  for (std::size_t i = 0; i < clean.size(); ++i) {
    EXPECT_EQ(clean[i].delay, lossy[i].delay) << i;
    lost += lossy[i].lost ? 1 : 0;
  }
  EXPECT_GT(lost, 2500);
}

TEST(Injector, MoreLossLosesTheSameDatagramsAndMore) {
  const auto some = fates_of(parse_profile("loss=5%"), 7, 10'000, 1ms);
  const auto more = fates_of(parse_profile("loss=20%"), 7, 10'000, 1ms);
  for (std::size_t i = 0; i < some.size(); ++i) EXPECT_TRUE(!some[i].lost || more[i].lost) << i;
}

TEST(Injector, ASecondCopyMayComeAfterNewerDatagrams) {
  Injector injector(parse_profile("delay=20ms jitter=20ms duplicate=100%"), 7);
  int stale = 0;
  LocalTime second_copy = LocalTime::min();
  for (int i = 0; i < 1000; ++i) {
    const LocalTime arrival = kStart + i * 1ms;
    const Fate fate = injector.next(arrival);
    stale += second_copy > arrival + fate.delay ? 1 : 0;
    second_copy = arrival + fate.duplicate.value();
  }
  EXPECT_GT(stale, 10);
}

TEST(Injector, RefusesAnImpossibleProfile) {
  Profile profile;
  profile.loss = -0.1;
  EXPECT_THROW(Injector(profile, 1), std::invalid_argument);
}

/// The share of the histogram's weight below `x`, straight within a bin: the CDF as a person would
/// write it down, to check the injector's integer inverse of it.
double cdf(const std::vector<Profile::Bin>& bins, Duration x) {
  double below = 0;
  double total = 0;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    const Duration width = i + 1 < bins.size() ? bins[i + 1].lower - bins[i].lower
                           : i > 0             ? bins[i].lower - bins[i - 1].lower
                                               : Duration(1);
    total += bins[i].weight;
    below += bins[i].weight * std::clamp(seconds(x - bins[i].lower) / seconds(width), 0.0, 1.0);
  }
  return below / total;
}

/// The Kolmogorov-Smirnov distance of kMany draws from the histogram they were drawn from.
double kolmogorov_smirnov(const std::vector<Profile::Bin>& bins, std::uint64_t seed) {
  Profile profile;
  profile.histogram = bins;
  std::vector<Duration> delays;
  // Further apart than any delay: none has to wait for another.
  for (const Fate& fate : fates_of(profile, seed, kMany, kMaxDelay)) delays.push_back(fate.delay);
  std::ranges::sort(delays);
  double distance = 0;
  for (std::size_t i = 0; i < delays.size(); ++i) {
    const double expected = cdf(bins, delays[i]);
    distance = std::max({distance, std::abs(static_cast<double>(i) / kMany - expected),
                         std::abs(static_cast<double>(i + 1) / kMany - expected)});
  }
  return distance;
}

/// Critical value at 1 % for kMany draws, 1.628/√n (asymptotic, Smirnov 1948). A right injector fails for one seed in
/// a hundred; the seeds are fixed.
constexpr double kKsCritical = 1.628 / 316.227766;

TEST(InjectorHistogram, DrawsFollowTheCdf) {
  const std::vector<Profile::Bin> two_humps_with_a_hole = {{1ms, 5},    {1500us, 40},  {2ms, 10},    {3ms, 0}, {4ms, 0},
                                                           {10ms, 3.5}, {10100us, 12}, {40ms, 0.25}, {41ms, 0}};
  EXPECT_LT(kolmogorov_smirnov(two_humps_with_a_hole, 1), kKsCritical);
}

TEST(InjectorHistogram, NeverDrawsFromAnEmptyBin) {
  for (const Fate& fate : fates_of(parse_profile("histogram=1ms:0,2ms:1,3ms:0,4ms:1,5ms:0"), 1, 10'000, 1s)) {
    EXPECT_TRUE((fate.delay >= 2ms && fate.delay < 3ms) || (fate.delay >= 4ms && fate.delay < 5ms));
  }
}

TEST(InjectorHistogram, TheLastBinIsAsWideAsTheOneBeforeIt) {
  Duration most{};
  for (const Fate& fate : fates_of(parse_profile("histogram=1ms:0,3ms:1"), 1, 10'000, 1s))
    most = std::max(most, fate.delay);
  EXPECT_LT(most, 5ms);
  EXPECT_GT(most, 4990us);
}

TEST(InjectorHistogram, ASingleBinIsAConstantDelayAndTheConstantPartIsAdded) {
  for (const Fate& fate : fates_of(parse_profile("delay=3ms histogram=2ms:8"), 1, 100, 1s)) EXPECT_EQ(fate.delay, 5ms);
}

TEST(InjectorHistogram, DrawsFollowEachMeasured5gHistogram) {
  const char* const data = std::getenv("TENDON_DATA");  // NOLINT(concurrency-mt-unsafe): one thread
  const std::filesystem::path folder = std::filesystem::path(data != nullptr ? data : "") / "d6g-tsn-5g/hist";
  if (data == nullptr) GTEST_SKIP() << "TENDON_DATA is not set: the measured histograms are not checked";
  if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << folder << " is not there";
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::vector<Profile::Bin> bins = histogram_from_csv(entry.path());
    EXPECT_GE(bins.size(), 100U) << entry.path();
    const double distance = kolmogorov_smirnov(bins, 1);
    EXPECT_LT(distance, kKsCritical) << entry.path();
    RecordProperty(entry.path().stem().string(), std::to_string(distance));
    ++files;
  }
  EXPECT_EQ(files, 6);
}

}  // namespace
}  // namespace tendon::injector
