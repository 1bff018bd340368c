// SPDX-License-Identifier: Apache-2.0
// Key changes and session ages within minutes. day.sh runs whole days.
#include "tests/tools/worlds/day.h"

#include <gtest/gtest.h>

namespace tendon::simulation::day_test {
namespace {

DayConfig short_day(std::uint64_t seed) {
  DayConfig config;
  config.seed = seed;
  config.length = std::chrono::minutes(6);
  config.loop_hz = 200;
  config.rekey.datagrams = 4000;  // Z's keys change by count, those of the observers by age
  config.rekey.age = std::chrono::seconds(40);
  config.session_life = std::chrono::minutes(3);
  return config;
}

class Days : public testing::TestWithParam<std::uint64_t> {};

TEST_P(Days, WedgeNoSessionByBadWeatherAbsenceTakeoverRekeyAgeOrAnotherAddress) {
  const DayReport day = run_day(short_day(GetParam()));
  EXPECT_FALSE(day.broken) << *day.broken;
  EXPECT_GE(day.troubles, 4U);
  EXPECT_GE(day.rekeys, 20U);
  EXPECT_GE(day.expired, 2U);
  EXPECT_GE(day.roamed, 1U);
  EXPECT_GE(day.requests, day.carried_out);
  EXPECT_GE(day.carried_out, 100U);
}
INSTANTIATE_TEST_SUITE_P(Seeds, Days, testing::Range<std::uint64_t>(1, 5));

TEST(Day, TheSameSeedIsTheSameDay) {
  DayConfig config = short_day(4);
  config.length = std::chrono::minutes(2);
  const DayReport once = run_day(config);
  const DayReport again = run_day(config);
  EXPECT_EQ(once.network.sent, again.network.sent);
  EXPECT_EQ(once.forces, again.forces);
  EXPECT_EQ(once.carried_out, again.carried_out);
}

}  // namespace
}  // namespace tendon::simulation::day_test
