// SPDX-License-Identifier: Apache-2.0
#include "devices/spacemouse/report.h"

#include <gtest/gtest.h>

#include <optional>
#include <vector>

namespace tendon::spacemouse::report_test {
namespace {

using Bytes = std::vector<std::uint8_t>;

template <class Kind>
std::optional<Kind> parsed(const Bytes& bytes) {
  const auto report = parse(bytes);
  const Kind* const kind = report ? std::get_if<Kind>(&*report) : nullptr;
  return kind != nullptr ? std::optional(*kind) : std::nullopt;
}

// "Rotation about the second axis" from a public Wireshark log of a SpaceNavigator.
TEST(SpaceMouseReport, ANavigatorTellsTranslationAndRotationInTwoReports) {
  const auto still = parsed<Motion>({1, 0, 0, 0, 0, 0, 0});
  ASSERT_TRUE(still);
  EXPECT_EQ(still->translation, (Axes{0, 0, 0}));
  EXPECT_FALSE(still->rotation);
  const auto turned = parsed<Motion>({2, 0, 0, 0xE2, 0xFF, 0, 0});
  ASSERT_TRUE(turned);
  EXPECT_EQ(turned->rotation, (Axes{0, -30, 0}));
  EXPECT_FALSE(turned->translation);
}

TEST(SpaceMouseReport, ANewerOneTellsBothInOne) {
  const auto motion = parsed<Motion>({1, 0x5E, 0x01, 0xA2, 0xFE, 1, 0, 2, 0, 3, 0, 0xFF, 0xFF});
  ASSERT_TRUE(motion);
  EXPECT_EQ(motion->translation, (Axes{350, -350, 1}));
  EXPECT_EQ(motion->rotation, (Axes{2, 3, -1}));
}

TEST(SpaceMouseReport, ButtonsAreBitsHoweverManyBytesThereAre) {
  EXPECT_EQ(parsed<Buttons>({3, 2})->held, 2U);
  EXPECT_EQ(parsed<Buttons>({3, 3, 0})->held, 3U);
  EXPECT_EQ(parsed<Buttons>({3, 0x01, 0x02, 0x04, 0x80, 0xFF, 0xFF})->held, 0x80040201U);
}

TEST(SpaceMouseReport, AWirelessOneTellsItsBattery) {
  EXPECT_EQ(parsed<Battery>({0x17, 83, 0})->percent, 83);
  EXPECT_FALSE(parse(Bytes{0x17, 101}));
}

TEST(SpaceMouseReport, EveryNumberOf16BitsComesThroughOnEachAxis) {
  for (int value = -32768; value <= 32767; ++value) {
    const auto low = static_cast<std::uint8_t>(value);
    const auto high = static_cast<std::uint8_t>(value >> 8);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Bytes bytes{1, 0, 0, 0, 0, 0, 0};
      bytes[1 + 2 * axis] = low;
      bytes[2 + 2 * axis] = high;
      Axes expected{};
      expected[axis] = static_cast<std::int16_t>(value);
      ASSERT_EQ(parsed<Motion>(bytes)->translation, expected);
    }
  }
}

}  // namespace
}  // namespace tendon::spacemouse::report_test
