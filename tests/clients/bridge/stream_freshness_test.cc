// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/stream_freshness.h"

#include <gtest/gtest.h>

#include <chrono>
#include <utility>

namespace tendon::bridge::stream_freshness_test {
namespace {

using std::chrono::milliseconds;

constexpr LocalTime kStart{std::chrono::seconds(100)};

TEST(StreamFreshness, AFieldThatIsSentOnceOrTwiceLivesAsLongAsItsConnection) {
  StreamFreshness freshness;
  freshness.heard(kStart);
  freshness.heard(kStart + milliseconds(500));
  EXPECT_EQ(freshness.until(), LocalTime::max());
}

TEST(StreamFreshness, AStreamIsStaleAfterTenOfItsMedianGaps) {
  for (const auto& [gap_ms, stale_ms] :
       {std::pair{1, 100}, {5, 100}, {16, 160}, {33, 330}, {200, 2000}, {1000, 2000}}) {
    StreamFreshness freshness;
    LocalTime now = kStart;
    for (int i = 0; i < 100; ++i) freshness.heard(now += milliseconds(gap_ms));
    EXPECT_NEAR(static_cast<double>((freshness.until() - now) / milliseconds(1)), stale_ms, gap_ms < 10 ? 20 : 0)
        << gap_ms;
  }
}

TEST(StreamFreshness, ABurstOfSettingsIsNoStream) {
  StreamFreshness freshness;
  for (int i = 0; i < 50; ++i) freshness.heard(kStart + std::chrono::microseconds(100 * i));
  EXPECT_EQ(freshness.until(), LocalTime::max());
}

TEST(StreamFreshness, OnePauseIsForgivenAndAProgramOfRareChangesIsNoStream) {
  StreamFreshness freshness;
  LocalTime now = kStart;
  for (int i = 0; i < 20; ++i) freshness.heard(now += milliseconds(20));
  freshness.heard(now += milliseconds(1500));
  EXPECT_EQ(freshness.until() - now, milliseconds(200)) << "the median";
  freshness.forget();
  for (int i = 0; i < 5; ++i) freshness.heard(now += milliseconds(3000));
  EXPECT_EQ(freshness.until(), LocalTime::max()) << "it would end before the next could come";
}

}  // namespace
}  // namespace tendon::bridge::stream_freshness_test
