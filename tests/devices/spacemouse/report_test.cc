// SPDX-License-Identifier: Apache-2.0
#include "devices/spacemouse/report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/support/dice.h"

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

// For arbitrary bytes, an accepted report must have a valid id and length, and its values must match its bytes.
TEST(SpaceMouseReport, OfBytesThatNobodyPlannedNothingElseIsTaken) {
  Dice dice(1);
  std::array<int, 3> taken{};
  for (int i = 0; i < 400'000; ++i) {
    Bytes bytes(dice.bits() % 16);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(dice.bits());
    if (!bytes.empty() && dice.chance(0.8)) bytes[0] = std::array<std::uint8_t, 4>{1, 2, 3, 0x17}[dice.bits() % 4];
    const auto report = parse(bytes);
    const std::size_t size = bytes.size();
    const int id = bytes.empty() ? -1 : bytes[0];
    const bool motion = (id == 1 && (size == 7 || size == 13)) || (id == 2 && size == 7);
    const bool buttons = id == 3 && size >= 2;
    const bool battery = id == 0x17 && size >= 2 && bytes[1] <= 100;
    ASSERT_EQ(report.has_value(), motion || buttons || battery);
    if (!report) continue;
    ++taken[report->index()];
    if (motion) {
      Bytes again{bytes[0]};
      const auto& [translation, rotation] = std::get<Motion>(*report);
      for (const auto& axes : {translation, rotation}) {
        if (!axes) continue;
        for (const int value : *axes) {
          again.push_back(static_cast<std::uint8_t>(value & 255));
          again.push_back(static_cast<std::uint8_t>((value >> 8) & 255));
        }
      }
      ASSERT_EQ(again, bytes);
    } else if (buttons) {
      std::uint64_t bits = 0;
      for (std::size_t at = size; at-- > 1;) bits = bits << 8 | bytes[at];
      if (size <= 9) {
        ASSERT_EQ(std::get<Buttons>(*report).held, static_cast<std::uint32_t>(bits));
      }
    } else {
      ASSERT_EQ(std::get<Battery>(*report).percent, bytes[1]);
    }
  }
  EXPECT_GT(*std::ranges::min_element(taken), 5000);
}

}  // namespace
}  // namespace tendon::spacemouse::report_test
