// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/injector.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

// selftest_test.cc checks the distributions and rates.
namespace tendon::injector::injector_test {
namespace {

using namespace std::chrono_literals;

constexpr LocalTime kStart = LocalTime(5s);

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

/// Four standard deviations of the binomial distribution: a correct injector fails for one seed in 16 000.
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

constexpr const char* kPlain = "base=5ms delay=uniform(0ms,30ms) rho=0.5";

TEST(Injector, AFieldThatIsAddedToAProfileMovesNoOtherRelease) {
  const auto plain = decisions(kPlain, 10'000, 1ms);
  // 1 kHz with 30 ms of jitter: most datagrams wait for a predecessor, so the claim includes waiting.
  EXPECT_GT(count_if(plain, [](const Decision& d) { return d.cause == Cause::kFifo; }), 5000);
  for (const std::string added :
       {"loss=30%", "loss=burst(10%,4)", "loss=gilbert(1%,10%,90%,1%)", "loss=fourstate(1%,20%,10%,30%,1%)",
        "loss=pattern(01)", "duplicate=20%", "replay(10%,64)", "flip=10%", "truncate=10%", "rebind(every=1s)",
        "outage(every=1s,for=100ms)", "handover(every=1s,for=100ms,0ms)",
        "regime(a,dwell=1s) regime(b,dwell=1s,loss=50%)",
        "loss=10% duplicate=10% replay(5%,9) flip=5% truncate=5% outage(at=2s,for=1s)"}) {
    const auto more = decisions(kPlain + (" " + added), 10'000, 1ms);
    for (std::size_t i = 0; i < plain.size(); ++i) ASSERT_EQ(plain[i].release, more[i].release) << added << " " << i;
    EXPECT_NE(plain, more) << added;
  }
}

TEST(Injector, WhoIsLostDoesNotDependOnHowLongItTakes) {
  const auto plain = decisions("loss=burst(5%,3)", 10'000, 1ms);
  for (const std::string added :
       {"base=5ms", "delay=normal(20ms,5ms)", "delay=gamma(20ms,5ms) memory=20ms", "jump(5%,3)", "order=free",
        "step(at=1s,20ms) stall(every=1s,for=100ms) spike(every=1s,for=100ms,50ms)", "rate=10Mbit/s"}) {
    const auto more = decisions("loss=burst(5%,3) " + added, 10'000, 1ms);
    for (std::size_t i = 0; i < plain.size(); ++i) ASSERT_EQ(lost(plain[i]), lost(more[i])) << added << " " << i;
  }
}

TEST(Injector, ABottleneckThatRefusesShiftsNoDraw) {
  const std::string plain = "delay=uniform(0ms,10ms) rho=0.9 loss=gilbert(5%,20%,90%,1%) order=free";
  const auto wide = decisions(plain + " rate=1000Mbit/s queue=100packets overhead=0", 20'000, 1ms);
  const auto narrow = decisions(plain + " rate=0.7Mbit/s queue=1packets overhead=0", 20'000, 1ms);
  int refused = 0;
  for (std::size_t i = 0; i < wide.size(); ++i) {
    if (narrow[i].cause == Cause::kQueueFull) {
      ++refused;
      continue;
    }
    ASSERT_EQ(lost(wide[i]), lost(narrow[i])) << i;
    // 800 bits take 800 ns on one link and 1143 µs on the other.
    const Duration later = narrow[i].release - wide[i].release;
    EXPECT_GE(later, 1142us) << i;
    EXPECT_LT(later, 1143us + 1ns) << i;
  }
  EXPECT_GT(refused, 9000);
}

TEST(Injector, LinksAndDirectionsMeetDifferentFatesAndAlikeInEveryRun) {
  const Profile profile = parse_profile("loss=50%");
  std::vector<std::string> fates;
  for (const std::uint32_t link : {0U, 1U}) {
    for (const Direction direction : {Direction::kUp, Direction::kDown}) {
      Injector injector(profile, 7, link, direction);
      std::string text;
      for (int i = 0; i < 64; ++i) text += lost(injector.decide({.arrival = kStart})) ? "-" : "+";
      fates.push_back(text);
    }
  }
  std::ranges::sort(fates);
  EXPECT_EQ(std::ranges::adjacent_find(fates), fates.end());
}

TEST(Injector, ForAnotherLinkIsAsIfBuiltForIt) {
  const Profile profile = parse_profile(
      "delay=gamma(20ms,5ms) memory=50ms loss=burst(5%,3) regime(a,dwell=100ms) "
      "regime(b,dwell=100ms,delay=uniform(0ms,9ms),loss=50%) rate=1Mbit/s");
  const Injector first(profile, 7, 0, Direction::kDown);
  Injector copied = first.for_link(3);
  Injector built(profile, 7, 3, Direction::kDown);
  for (int i = 0; i < 2000; ++i) {
    const Packet packet{.arrival = kStart + i * 1ms, .size = 100};
    ASSERT_EQ(copied.decide(packet), built.decide(packet)) << i;
  }
}

std::vector<double> delays_ms(const std::string& profile, int count, Duration period) {
  std::vector<double> all;
  for (const Decision& d : decisions(profile, count, period)) all.push_back(seconds(delay(d)) * 1e3);
  return all;
}

using Delays = std::vector<double>;

TEST(Injector, StepsRampsAndSpikesComeWhenTheyShould) {
  EXPECT_EQ(delays_ms("base=10ms step(at=2s,5ms) step(at=3s,-7ms)", 5, 1s), (Delays{10, 10, 15, 8, 8}));
  EXPECT_EQ(delays_ms("base=10ms ramp(from=1s,to=3s,4ms)", 6, 500ms * 1), (Delays{10, 10, 10, 11, 12, 13}));
  EXPECT_EQ(delays_ms("ramp(from=1s,to=3s,4ms)", 5, 1s), (Delays{0, 0, 2, 4, 4}));
  EXPECT_EQ(delays_ms("spike(every=4s,for=2s,9ms)", 10, 1s), (Delays{0, 0, 0, 0, 9, 9, 0, 0, 9, 9}));
  EXPECT_EQ(delays_ms("spike(at=1s,every=4s,for=2s,9ms)", 7, 1s), (Delays{0, 9, 9, 0, 0, 9, 9}));
  EXPECT_EQ(delays_ms("spike(at=1s,for=2s,9ms)", 7, 1s), (Delays{0, 9, 9, 0, 0, 0, 0}));
  EXPECT_EQ(delays_ms("step(at=1s,-7ms)", 2, 1s), (Delays{0, 0}));
}

TEST(Injector, AStallHoldsAllBackAndThenReleasesThemTogether) {
  EXPECT_EQ(delays_ms("base=1ms stall(at=2s,for=3s)", 7, 1s), (Delays{1, 1, 3000, 2000, 1000, 1, 1}));
  const auto all = decisions("base=1ms stall(at=2s,for=3s)", 4, 1s);
  EXPECT_EQ(all[2].cause, Cause::kStall);
  EXPECT_EQ(all[2].release, kStart + 5s);
  EXPECT_EQ(delays_ms("stall(at=1s,for=2s) stall(at=2s,for=2s)", 3, 1s), (Delays{0, 3000, 2000}));
}

TEST(Injector, AnOutageLosesAllThatArriveInItAndNoOther) {
  std::string fates;
  for (const Decision& d : decisions("outage(every=4s,for=2s)", 10, 1s)) {
    fates += d.cause == Cause::kOutage && lost(d) ? "-" : "+";
  }
  EXPECT_EQ(fates, "++++--++--");
}

TEST(Injector, ADropRuleMeetsOnlyTheDatagramsOfItsType) {
  Injector injector(parse_profile("drop(byte=1,mask=0xf,value=3,50%) drop(byte=3,value=0xff)"), 7, 0, Direction::kUp);
  int threes = 0;
  for (int i = 0; i < 4000; ++i) {
    const auto type = static_cast<std::byte>(i % 16 + 16 * (i % 3));
    const std::vector<std::byte> bytes = {std::byte{3}, type, std::byte{3}};
    const Decision d = injector.decide({.arrival = kStart, .size = 3, .bytes = bytes});
    EXPECT_TRUE(i % 16 == 3 || !lost(d));
    EXPECT_EQ(d.cause == Cause::kRule, lost(d));
    threes += lost(d) ? 1 : 0;
  }
  EXPECT_NEAR(threes, 125, four_sigma(250, 0.5));
  const std::vector<std::byte> marked(4, std::byte{0xff});
  EXPECT_TRUE(lost(injector.decide({.arrival = kStart, .size = 4, .bytes = marked})));
  EXPECT_FALSE(lost(injector.decide({.arrival = kStart, .size = 4})));  // bytes unknown
}

TEST(Injector, RegimesTakeTurnsInTheSharesOfTheirDwellTimesWhateverIsSent) {
  const std::string chain = "regime(clear,dwell=300ms) regime(busy,dwell=100ms,loss=100%)";
  const auto often = decisions(chain, 400'000, 1ms);
  const auto seldom = decisions(chain, 40'000, 10ms);
  for (std::size_t i = 0; i < seldom.size(); ++i) ASSERT_EQ(lost(seldom[i]), lost(often[10 * i])) << i;
  // 1000 visits to each; the share of exponential times varies by about √(2/1000)·¾·¼.
  EXPECT_NEAR(count_if(often, lost) / 400'000, 0.25, 4 * 0.0084);
  double changes = 0;
  for (std::size_t i = 1; i < often.size(); ++i) changes += lost(often[i]) != lost(often[i - 1]) ? 1 : 0;
  EXPECT_NEAR(changes / 2, 1000, 4 * std::sqrt(1000.0));
  EXPECT_EQ(often.front().verdict, Verdict::kPass);  // starts with the first regime
}

TEST(Injector, TheLossOfTheProfileGoesOnUnderTheLossOfARegime) {
  const auto plain = decisions("loss=gilbert(5%,10%,100%,0%)", 20'000, 1ms);
  const auto regimes =
      decisions("loss=gilbert(5%,10%,100%,0%) regime(a,dwell=50ms) regime(b,dwell=50ms,loss=100%)", 20'000, 1ms);
  for (std::size_t i = 0; i < plain.size(); ++i) {
    ASSERT_TRUE(regimes[i].cause == Cause::kRegime || lost(regimes[i]) == lost(plain[i])) << i;
  }
}

TEST(Injector, AJumpOvertakesAsManyDatagramsAsItSaysAndMovesNoOther) {
  const auto plain = decisions("delay=10ms", 5000, 1ms);
  const auto jumping = decisions("delay=10ms jump(10%,3)", 5000, 1ms);
  double jumps = 0;
  for (std::size_t i = 0; i < plain.size(); ++i) {
    if (jumping[i].cause == Cause::kReorder) {
      ++jumps;
      EXPECT_EQ(jumping[i].release, plain[i - 3].release - 1ns);
    } else {
      EXPECT_EQ(jumping[i].release, plain[i].release);
    }
  }
  EXPECT_NEAR(jumps, 500, four_sigma(5000, 0.1));
  const auto waiting = decisions(kPlain, 5000, 1ms);
  const auto overtaken = decisions(kPlain + std::string(" jump(10%,3)"), 5000, 1ms);
  for (std::size_t i = 0; i < waiting.size(); ++i) {
    ASSERT_TRUE(overtaken[i].cause == Cause::kReorder || overtaken[i].release == waiting[i].release) << i;
  }
  for (const Decision& d : decisions("delay=10ms jump(100%,1)", 100, 50ms)) EXPECT_EQ(delay(d), 10ms);
  for (const Decision& d : decisions("base=9.5ms delay=0.5ms jump(100%,1)", 100, 1ms)) EXPECT_GE(delay(d), 9500us);
}

TEST(Injector, AStaleReplayBringsBackOneOfTheLastDatagrams) {
  const auto all = decisions("delay=10ms replay(20%,16) loss=50%", 20'000, 1ms);
  std::array<int, 17> ages{};
  for (const Decision& d : all) {
    if (!d.stale) continue;
    EXPECT_GE(d.stale->back, 1U);
    EXPECT_LE(d.stale->back, d.index);
    EXPECT_EQ(d.stale->release, d.release);
    ++ages.at(d.stale->back);
  }
  for (std::size_t age = 1; age <= 16; ++age) EXPECT_NEAR(ages.at(age), 250, 4 * std::sqrt(250.0)) << age;
}

TEST(Injector, WhereNoPayloadIsNoneIsDamaged) {
  Injector empty(parse_profile("flip=100% truncate=100%"), 7, 0, Direction::kUp);
  const Decision d = empty.decide({.arrival = kStart});
  EXPECT_FALSE(d.flipped_bit || d.truncated_to);
}

TEST(Injector, TheSourcePortChangesEachTime) {
  const auto all = decisions("rebind(every=2s)", 6, 1s);
  std::vector<std::uint32_t> rebinds;
  for (const Decision& d : all) rebinds.push_back(d.rebinds);
  EXPECT_EQ(rebinds, (std::vector<std::uint32_t>{0, 0, 1, 1, 2, 2}));
}

TEST(Injector, WaitingAtTheBottleneckComesBeforeTheDelay) {
  // 100 + 25 bytes at 1 Mbit/s take 1 ms.
  const auto all = decisions("base=5ms rate=1Mbit/s queue=3packets overhead=25", 5, 0ms);
  EXPECT_EQ(delay(all[0]), 6ms);
  EXPECT_EQ(delay(all[2]), 8ms);
  EXPECT_EQ(all[2].cause, Cause::kQueue);
  EXPECT_EQ(all[3].cause, Cause::kQueueFull);
  EXPECT_TRUE(lost(all[3]));
}

TEST(Injector, TimesCountFromTheStartThatIsGivenElseFromTheFirstArrival) {
  const Profile profile = parse_profile("step(at=2s,5ms)");
  Injector given(profile, 7, 0, Direction::kUp, kStart - 1s);
  Injector own(profile, 7, 0, Direction::kUp);
  EXPECT_EQ(delay(given.decide({.arrival = kStart})), 0ms);
  EXPECT_EQ(delay(own.decide({.arrival = kStart})), 0ms);
  EXPECT_EQ(delay(given.decide({.arrival = kStart + 1s})), 5ms);
  EXPECT_EQ(delay(own.decide({.arrival = kStart + 1s})), 0ms);
}

TEST(Injector, AChangeIsInForceFromItsTimeAndNothingStartsAnew) {
  Injector injector(parse_profile("delay=50ms"), 7, 0, Direction::kUp);
  EXPECT_EQ(delay(injector.decide({.arrival = kStart})), 50ms);
  injector.change(parse_profile("delay=1ms step(at=100ms,5ms)"), kStart + 10ms);
  const Decision second = injector.decide({.arrival = kStart + 10ms});
  EXPECT_EQ(second.index, 1U);
  EXPECT_EQ(delay(second), 40ms);  // behind the first
  EXPECT_EQ(second.cause, Cause::kFifo);
  EXPECT_EQ(delay(injector.decide({.arrival = kStart + 109ms})), 1ms);
  EXPECT_EQ(delay(injector.decide({.arrival = kStart + 110ms})), 6ms);
}

TEST(Injector, AChangeToTheSameProfileChangesNothing) {
  const Profile profile =
      parse_profile("delay=gamma(20ms,5ms) rho=0.9 loss=gilbert(5%,20%,90%,1%) rate=1Mbit/s replay(5%,9)");
  Injector changed(profile, 7, 0, Direction::kUp);
  Injector plain(profile, 7, 0, Direction::kUp);
  for (int i = 0; i < 3000; ++i) {
    const Packet packet{.arrival = kStart + i * 1ms, .size = 100};
    if (i % 1000 == 500) changed.change(profile, packet.arrival);
    ASSERT_EQ(changed.decide(packet), plain.decide(packet)) << i;
  }
}

TEST(Injector, AnImpossibleChangeIsRefusedAndLeavesEverythingAsItWas) {
  Injector injector(parse_profile("delay=5ms"), 7, 0, Direction::kUp);
  Profile profile;
  profile.duplicate = 2;
  EXPECT_THROW(injector.change(profile, kStart), std::invalid_argument);
  EXPECT_THROW(Injector(profile, 1, 0, Direction::kUp), std::invalid_argument);
  EXPECT_EQ(delay(injector.decide({.arrival = kStart})), 5ms);
}

TEST(Injector, NamesOfVerdictsAndCausesReadBack) {
  for (int i = 0; i <= static_cast<int>(Verdict::kDuplicate); ++i) {
    EXPECT_EQ(parse_verdict(to_string(static_cast<Verdict>(i))), static_cast<Verdict>(i));
  }
  for (int i = 0; i <= static_cast<int>(Cause::kReplay); ++i) {
    EXPECT_EQ(parse_cause(to_string(static_cast<Cause>(i))), static_cast<Cause>(i));
  }
  EXPECT_FALSE(parse_cause("bad luck"));
}

}  // namespace
}  // namespace tendon::injector::injector_test
