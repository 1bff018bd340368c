// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/profile/named_profiles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "tests/support/refusal.h"
#include "tests/tools/injector/injector.h"
#include "tests/tools/injector/models/delay_model.h"
#include "tests/tools/injector/models/loss_model.h"
#include "tests/tools/injector/profile/timeline.h"
#include "tests/tools/injector/selftest/loss_chain.h"
#include "tests/tools/injector/selftest/statistics.h"

namespace tendon::injector::named_profiles_test {
namespace {

TEST(NamedProfiles, EachReadsBackAndHasOneWord) {
  for (const NamedProfile& named : named_profiles()) {
    for (const std::string_view line : {named.up, named.down}) {
      const Profile profile = parse_profile(line);
      EXPECT_EQ(parse_profile(to_string(profile)), profile) << named.name;
    }
    EXPECT_EQ(named.name.find_first_of(" =("), std::string_view::npos) << named.name;
    EXPECT_EQ(resolve_profile(named.name, Direction::kUp), parse_profile(named.up));
    EXPECT_EQ(resolve_profile(named.name, Direction::kDown), parse_profile(named.down));
  }
}

TEST(NamedProfiles, AreTheOnesThatTheManualPromises) {
  EXPECT_EQ(names_of_profiles(),
            "lan, wifi-good, wifi-bad, 5g-urllc, 5g-midband, lte-driving, leo-satellite, wan-intercontinental, "
            "netfi-delay-1, netfi-delay-2, netfi-delay-3, netfi-loss-1, netfi-loss-2, netfi-loss-3, netfi-gap-1, "
            "netfi-gap-2, netfi-gap-3");
  for (const NamedProfile& named : named_profiles()) {
    EXPECT_FALSE(named.source.empty()) << named.name;
    EXPECT_LE(named.source.size(), 110U) << named.name;
  }
}

TEST(NamedProfiles, FieldsAfterTheNameReplaceThoseOfTheProfile) {
  Profile expected = resolve_profile("wifi-bad", Direction::kUp);
  expected.loss = RandomLoss{0.05};
  expected.memory = {};
  expected.rho = 0.5;
  EXPECT_EQ(resolve_profile("  wifi-bad loss=5%  rho=0.5", Direction::kUp), expected);
  EXPECT_EQ(resolve_profile("loss=5%", Direction::kUp), parse_profile("loss=5%"));
  EXPECT_EQ(resolve_profile("", Direction::kUp), Profile{});
}

TEST(NamedProfiles, AnUnknownNameIsAnsweredWithThoseThatThereAre) {
  try {
    resolve_profile("wifi-ugly", Direction::kUp);
    FAIL() << "was accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("\"wifi-ugly\""), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("wifi-good, wifi-bad"), std::string::npos) << error.what();
  }
  EXPECT_TRUE(
      thrown_by([&] { resolve_profile("wifi-baad loss=1%", Direction::kUp); }).ends_with("; did you mean wifi-bad?"));
}

struct Moments {
  double mean = 0;
  double deviation = 0;
};

/// Moments of a delay table, from the midpoints of a million equal probabilities.
Moments moments(const Profile& profile) {
  const QuantileTable table = delay_table(profile.delay);
  constexpr std::uint64_t kShares = 1'000'000;
  double sum = 0;
  double squares = 0;
  for (std::uint64_t i = 0; i < kShares; ++i) {
    const double ms = static_cast<double>(table((2 * i + 1) * (~std::uint64_t{0} / kShares / 2))) * 1e-6;
    sum += ms;
    squares += ms * ms;
  }
  const double mean = sum / kShares;
  return {mean + seconds(profile.base) * 1e3, std::sqrt(squares / kShares - mean * mean)};
}

TEST(NamedProfiles, The5gOnesHaveTheMeanAndTheDeviationOfTheirMeasurements) {
  const char* const data = std::getenv("TENDON_DATA");  // NOLINT(concurrency-mt-unsafe): one thread
  if (data == nullptr) GTEST_SKIP() << "TENDON_DATA is not set: the measured histograms are not checked";
  const std::filesystem::path folder = std::filesystem::path(data) / "d6g-tsn-5g/hist";
  struct Pair {
    const char* name;
    Direction direction;
    const char* file;
  };
  for (const Pair& pair : {Pair{"5g-urllc", Direction::kUp, "5G-URLLC-mmW-Uplink_PD-Wireless-5G-3a.csv"},
                           Pair{"5g-urllc", Direction::kDown, "5G-URLLC-mmW-Downlink_PD-Wireless-5G-3a.csv"},
                           Pair{"5g-midband", Direction::kUp, "5G-midband-Uplink_PD-Wireless-5G-2a.csv"},
                           Pair{"5g-midband", Direction::kDown, "5G-midband-Downlink_PD-Wireless-5G-2a.csv"}}) {
    const Moments ours = moments(resolve_profile(pair.name, pair.direction));
    const Moments measured = moments(parse_profile("delay=histogram(" + (folder / pair.file).string() + ")"));
    EXPECT_NEAR(ours.mean / measured.mean, 1, 0.01) << pair.file;
    EXPECT_NEAR(ours.deviation / measured.deviation, 1, 0.03) << pair.file;
  }
}

/// The closed form of the delays, in ns, with libm.
struct LawOf {
  Cdf operator()(const GammaDelay& d) const {
    const double shape = std::pow(ns(d.mean) / ns(d.deviation), 2);
    return [=](double x) { return incomplete_gamma(shape, x * shape / ns(d.mean)); };
  }
  Cdf operator()(const LognormalDelay& d) const {
    const double variance = std::log1p(std::pow(ns(d.deviation) / ns(d.mean), 2));
    return [=](double x) {
      return x <= 0 ? 0 : normal_cdf((std::log(x / ns(d.mean)) + variance / 2) / std::sqrt(variance));
    };
  }
  Cdf operator()(const MixtureDelay& d) const {
    return [=](double x) {
      double total = 0;
      double longer = 0;
      for (const Weighted& part : d.parts) {
        total += part.weight;
        longer += part.weight * std::exp(-std::max(x - ns(d.least), 0.0) / ns(part.value));
      }
      return 1 - longer / total;
    };
  }
  Cdf operator()(const HistogramDelay& d) const {
    return [=](double x) {
      double total = 0;
      double below = 0;
      for (std::size_t i = 0; i < d.bins.size(); ++i) {
        const std::size_t lower = std::min(i, d.bins.size() - 2);
        const double width = ns(d.bins[lower + 1].value - d.bins[lower].value);
        total += d.bins[i].weight;
        below += d.bins[i].weight * std::clamp((x - ns(d.bins[i].value)) / width, 0.0, 1.0);
      }
      return below / total;
    };
  }
  template <class Other>
  Cdf operator()(const Other&) const {
    return {};
  }
  static double ns(Duration d) { return static_cast<double>(d.count()); }
};

TEST(NamedProfiles, EachDelayKeepsToItsLaw) {
  constexpr std::uint64_t kDraws = 60'000;
  int laws = 0;
  for (const NamedProfile& named : named_profiles()) {
    for (const Direction direction : {Direction::kUp, Direction::kDown}) {
      const Profile profile = resolve_profile(named.name, direction);
      const Cdf law = std::visit(LawOf{}, profile.delay);
      if (!law || (direction == Direction::kDown && named.up == named.down)) continue;
      ++laws;
      const QuantileTable table = delay_table(profile.delay);
      const Draws draws(7, 0, direction);
      std::vector<double> samples;
      for (std::uint64_t i = 0; i < kDraws; ++i) {
        samples.push_back(static_cast<double>(table(draws(Purpose::kDelay, i))));
      }
      std::ranges::sort(samples);
      EXPECT_LE(kolmogorov_distance(samples, law), 0.01) << named.name;
    }
  }
  EXPECT_EQ(laws, 15);
}

TEST(NamedProfiles, TheDelaysOfNetFiHaveItsMeanAnd99Percent) {
  const double figures[][2] = {{100.0, 228.1}, {299.2, 626.6}, {501.0, 849.9}};
  for (int i = 0; i < 3; ++i) {
    Injector injector(resolve_profile("netfi-delay-" + std::to_string(i + 1), Direction::kUp), 7, 0, Direction::kUp);
    std::vector<double> delays;
    for (int k = 0; k < 100'000; ++k) {
      const LocalTime now = LocalTime{} + std::chrono::milliseconds(k);
      delays.push_back(seconds(injector.decide({.arrival = now, .size = 200}).release - now) * 1e3);
    }
    std::ranges::sort(delays);
    const double mean = std::accumulate(delays.begin(), delays.end(), 0.0) / static_cast<double>(delays.size());
    EXPECT_NEAR(mean / figures[i][0], 1, 0.005) << i;
    EXPECT_NEAR(delays[delays.size() * 99 / 100] / figures[i][1], 1, 0.01) << i;
  }
}

TEST(NamedProfiles, TheLossesOfNetFiHaveItsShareAndBursts) {
  constexpr std::size_t kDatagrams = 1'000'000;
  const double share[] = {0.098, 0.304, 0.505};
  const double mean_burst[] = {1.40, 1.77, 2.45};
  for (std::size_t i = 0; i < 3; ++i) {
    const Profile profile = resolve_profile("netfi-loss-" + std::to_string(i + 1), Direction::kUp);
    const auto& law = std::get<ParetoBurstLoss>(profile.loss);
    const LossChain chain = LossChain::pareto_bursts(law.p12, law.p21, {law.lengths[0].shape, law.lengths[1].shape},
                                                     {law.lengths[0].scale, law.lengths[1].scale}, 100);
    LossModel model(profile.loss, Purpose::kLoss, Purpose::kLossState);
    const Draws draws(7, 0, Direction::kUp);
    std::vector<double> bursts;
    double lost = 0;
    double burst = 0;
    for (std::uint64_t k = 0; k < kDatagrams; ++k) {
      if (model.lost(draws, k)) {
        ++lost;
        ++burst;
      } else if (burst > 0) {
        bursts.push_back(std::exchange(burst, 0));
      }
    }
    EXPECT_NEAR(lost / kDatagrams, chain.rate(), 0.002) << i;
    EXPECT_NEAR(lost / kDatagrams, share[i], 0.003) << i;
    EXPECT_NEAR(lost / static_cast<double>(bursts.size()), mean_burst[i], 0.02) << i;
    const std::vector<double> lengths = chain.bursts(100);
    std::ranges::sort(bursts);
    const double distance = kolmogorov_distance(bursts, [&](double x) {
      const auto last = std::min(static_cast<std::ptrdiff_t>(std::max(x, 0.0)), std::ssize(lengths));
      return std::accumulate(lengths.begin(), lengths.begin() + last, 0.0);
    });
    EXPECT_LE(distance, 0.01) << i;
  }
}

TEST(NamedProfiles, TheOutagesOfNetFiHaveItsLengthsAndShare) {
  const double longest_ms[] = {3000, 1000, 2000};
  const double share[] = {0.15, 1.0 / 3, 0.5};
  for (std::size_t i = 0; i < 3; ++i) {
    const Profile profile = resolve_profile("netfi-gap-" + std::to_string(i + 1), Direction::kUp);
    const RandomOutage& outage = profile.random_outages.at(0);
    const QuantileTable table = delay_table(outage.length);
    const Draws draws(7, 0, Direction::kUp);
    OutageChain chain(outage.clear, LocalTime{}, 0);
    std::vector<double> lengths_ms;
    LocalTime ended{};
    for (int k = 0; k < 50'000; ++k) {
      const LocalTime begins = ended + outage.clear;
      ASSERT_FALSE(chain.end(begins - Duration(1), table, draws)) << k;
      ended = chain.end(begins, table, draws).value_or(begins);
      lengths_ms.push_back(seconds(ended - begins) * 1e3);
    }
    const double out = std::accumulate(lengths_ms.begin(), lengths_ms.end(), 0.0);
    EXPECT_NEAR(out / 1e3 / seconds(ended - LocalTime{}), share[i], 0.003) << i;
    std::ranges::sort(lengths_ms);
    EXPECT_LE(kolmogorov_distance(lengths_ms, [&](double x) { return std::clamp(x / longest_ms[i], 0.0, 1.0); }), 0.01)
        << i;
  }
}

}  // namespace
}  // namespace tendon::injector::named_profiles_test
