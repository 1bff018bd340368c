// SPDX-License-Identifier: Apache-2.0
#include "devices/woodenhaptics/report.h"

#include <gtest/gtest.h>

#include <vector>

namespace tendon::woodenhaptics::report_test {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes bytes_of(const ReportBytes& bytes) { return {bytes.begin(), bytes.end()}; }

TEST(WoodenHapticsReport, CurrentsAreMilliamperesLeastByteFirstAndNoCommand) {
  EXPECT_EQ(bytes_of(encode({0x1234, -2, -2000})), (Bytes{0x34, 0x12, 0xFE, 0xFF, 0x30, 0xF8, 0, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(bytes_of(encode({})), Bytes(14, 0)) << "what the guardian writes";
}

TEST(WoodenHapticsReport, CalibratingIsCommand1WithCountersAndNoCurrent) {
  EXPECT_EQ(bytes_of(encode_calibration({0, -5000, 6000})),
            (Bytes{0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0x78, 0xEC, 0x70, 0x17}));
}

TEST(WoodenHapticsReport, IsSixCountersAndWhetherTheButtonWasPressed) {
  const auto report = parse(Bytes{0x34, 0x12, 0xFF, 0xFF, 0x00, 0x80, 4, 0, 5, 0, 6, 0, 1, 0});
  ASSERT_TRUE(report);
  EXPECT_EQ(report->counters, (std::array<std::int16_t, 6>{0x1234, -1, -32768, 4, 5, 6}));
  EXPECT_TRUE(report->calibrate);
  EXPECT_FALSE(parse(Bytes(14, 0))->calibrate);
}

TEST(WoodenHapticsReport, EveryCountOf16BitsComesThroughInEachCounter) {
  for (int value = -32768; value <= 32767; ++value) {
    for (std::size_t counter = 0; counter < 6; ++counter) {
      ReportBytes bytes{};
      bytes[2 * counter] = static_cast<std::uint8_t>(value);
      bytes[2 * counter + 1] = static_cast<std::uint8_t>(value >> 8);
      const auto report = parse(bytes);
      ASSERT_TRUE(report);
      std::array<std::int16_t, 6> expected{};
      expected[counter] = static_cast<std::int16_t>(value);
      ASSERT_EQ(report->counters, expected);
    }
  }
}

TEST(WoodenHapticsReport, TheSwitchAtTheTipIsBeyond5000InCounterD) {
  Report report;
  EXPECT_FALSE(switch_is_closed(report));
  report.counters = {9000, 9000, 9000, 5000, 9000, 9000};
  EXPECT_FALSE(switch_is_closed(report));
  report.counters = {0, 0, 0, 5001, 0, 0};
  EXPECT_TRUE(switch_is_closed(report));
}

}  // namespace
}  // namespace tendon::woodenhaptics::report_test
