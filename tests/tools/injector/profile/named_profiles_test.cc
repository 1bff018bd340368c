// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/profile/named_profiles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/refusal.h"
#include "tests/tools/injector/models/delay_model.h"

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
            "lan, wifi-good, wifi-bad, 5g-urllc, 5g-midband, lte-driving, leo-satellite, wan-intercontinental");
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

}  // namespace
}  // namespace tendon::injector::named_profiles_test
