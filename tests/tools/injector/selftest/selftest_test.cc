// SPDX-License-Identifier: Apache-2.0
// $TENDON_SELFTEST_COUNT: datagrams for each model (a million in the release build). $TENDON_DATA: folder of
// histograms.
#include "tests/tools/injector/selftest/selftest.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/tools/injector/injector.h"
#include "tests/tools/injector/profile/named_profiles.h"

namespace tendon::injector::selftest_test {
namespace {

constexpr double kMs = 1e6;  // ns

/// Large enough to detect every wrong law below.
const SelftestOptions kSome{.count = 100'000};
const SelftestOptions kMany{.count = 500'000};

Cdf normal_law(double mean_ms, double deviation_ms) {
  return [=](double x) { return x < 0 ? 0 : normal_cdf((x - mean_ms * kMs) / (deviation_ms * kMs)); };
}

std::string failures(const std::vector<Check>& checks) {
  std::string names;
  for (const auto& check : checks) {
    if (!check.passed()) names += (names.empty() ? "" : "; ") + check.statistic;
  }
  return names;
}

TEST(SelfTest, EveryModelKeepsToItsLaw) {
  SelftestOptions options{.count = 20'000};
  if (const char* const count = std::getenv("TENDON_SELFTEST_COUNT")) options.count = std::strtoul(count, nullptr, 10);
  if (const char* const data = std::getenv("TENDON_DATA")) options.data = data;
  std::ostringstream out;
  EXPECT_TRUE(selftest(options, out)) << out.str();
}

TEST(SelfTest, AgreesWithTheRightLaw) {
  EXPECT_EQ(failures(check_delays("delay=normal(20ms,4ms) rho=0.9 order=free", normal_law(20, 4), 0.9, true, kSome)),
            "");
  EXPECT_EQ(failures(check_losses("loss=burst(5%,4)", LossChain::burst(0.05, 4), kSome)), "");
  EXPECT_EQ(failures(check_losses("loss=burst(20%,1.25)", LossChain::bernoulli(0.2), kSome)), "");
  EXPECT_EQ(failures(check_losses("loss=fourstate(0%,0%,0%,0%,5%)", LossChain::gilbert(0.05, 1, 1, 0), kSome)), "");
}

TEST(SelfTest, SeesALawThatIsNearTheRightOne) {
  const char* const normal = "delay=normal(20ms,4ms) order=free";
  EXPECT_NE(failures(check_delays(normal, normal_law(20, 4.2), 0, true, kSome)), "") << "deviation";
  EXPECT_NE(failures(check_delays(normal, normal_law(20.2, 4), 0, true, kSome)), "") << "mean";
  EXPECT_NE(failures(check_delays("delay=normal(20ms,4ms)", normal_law(20, 4), 0, true, kSome)), "") << "fifo";
  EXPECT_NE(failures(check_losses("loss=5%", LossChain::burst(0.05, 1.5), kMany)), "") << "single losses";
  EXPECT_NE(failures(check_losses("loss=burst(10%,4)", LossChain::burst(0.1, 4.4), kMany)), "") << "mean burst";
  EXPECT_NE(failures(check_losses("loss=gilbert(0.02,0.1,0.7,0.01)", LossChain::gilbert(0.02, 0.1, 0.7, 0.015), kMany)),
            "")
      << "losses of a state";
}

TEST(SelfTest, SeesAnotherCorrelation) {
  const std::string line = "delay=normal(20ms,4ms) rho=0.9 order=free";
  EXPECT_EQ(failures(check_delays(line, normal_law(20, 4), 0.89, true, kSome)),
            "autocorrelation of z against rho; innovations, Kolmogorov");
}

TEST(SelfTest, SeesALossThatIsATenthOff) {
  EXPECT_EQ(failures(check_losses("loss=5%", LossChain::bernoulli(0.055), kMany)), "loss rate");
}

TEST(SelfTest, NotANumberHasNotPassed) { EXPECT_FALSE((Check{"", "", std::nan(""), 1}.passed())); }

TEST(SelfTest, RefusesACountThatSaysNothing) {
  std::ostringstream out;
  EXPECT_THROW(selftest({.count = 999}, out), std::invalid_argument);
}

TEST(SelfTest, RefusesAFolderWithoutHistograms) {
  std::ostringstream out;
  EXPECT_THROW(selftest({.count = 1000, .data = "/nowhere"}, out), std::runtime_error);
}

struct Fit {
  const char* profile;
  Direction direction;
  const char* histogram;
  double bound;  ///< Kolmogorov distance of the fit by mean and deviation, rounded up, to detect regressions
};

void PrintTo(const Fit& fit, std::ostream* out) { *out << fit.profile << " against " << fit.histogram; }

class NamedProfileFit : public testing::TestWithParam<Fit> {};

/// Uses 100 000 independent delays, without order and loss.
double distance_from(const Fit& fit, const Cdf& law) {
  Profile profile = resolve_profile(fit.profile, fit.direction);
  profile.order = Order::kFree;
  Injector injector(profile, 7, 0, fit.direction);
  std::vector<double> delays;
  for (int i = 0; i < 100'000; ++i) {
    const LocalTime arrival{std::chrono::milliseconds(10) * i};
    delays.push_back(
        static_cast<double>((injector.decide({.arrival = arrival, .size = 100}).release - arrival).count()));
  }
  std::ranges::sort(delays);
  return kolmogorov_distance(delays, law);
}

TEST_P(NamedProfileFit, AreAsCloseToTheMeasuredHistogramsAsTheySay) {
  const char* const data = std::getenv("TENDON_DATA");
  if (data == nullptr) GTEST_SKIP() << "TENDON_DATA is not set: no measured histograms";
  const auto law = histogram_law(std::filesystem::path(data) / "d6g-tsn-5g/hist" / GetParam().histogram);
  ASSERT_TRUE(law);
  const double distance = distance_from(GetParam(), *law);
  std::cout << GetParam().profile << " is " << distance << " from " << GetParam().histogram << "\n";
  RecordProperty("distance", std::to_string(distance));
  EXPECT_LE(distance, GetParam().bound);
}

INSTANTIATE_TEST_SUITE_P(
    FiveG, NamedProfileFit,
    testing::Values(Fit{"5g-urllc", Direction::kUp, "5G-URLLC-mmW-Uplink_PD-Wireless-5G-3a.csv", 0.04},
                    Fit{"5g-urllc", Direction::kDown, "5G-URLLC-mmW-Downlink_PD-Wireless-5G-3a.csv", 0.022},
                    Fit{"5g-midband", Direction::kUp, "5G-midband-Uplink_PD-Wireless-5G-2a.csv", 0.075},
                    Fit{"5g-midband", Direction::kDown, "5G-midband-Downlink_PD-Wireless-5G-2a.csv", 0.072}));

}  // namespace
}  // namespace tendon::injector::selftest_test
