// SPDX-License-Identifier: Apache-2.0
#include "core/base/time.h"

#include <gtest/gtest.h>

#include <concepts>

namespace tendon::time_test {
namespace {

template <typename A, typename B>
concept Subtractable = requires(A a, B b) {
  a - b;
};
template <typename Clock>
concept CanBeRead = requires {
  Clock::now();
};

TEST(Time, APeersTimeCannotBeSubtractedFromOurs) {
  static_assert(Subtractable<LocalTime, LocalTime>);
  static_assert(Subtractable<PeerTime, PeerTime>);
  static_assert(!Subtractable<LocalTime, PeerTime>);
  static_assert(!Subtractable<PeerTime, LocalTime>);
}

TEST(Time, NoClockOfTheCoreCanBeRead) {
  static_assert(!CanBeRead<LocalClock>);
  static_assert(!CanBeRead<PeerClock>);
}

TEST(Time, SecondsAndNanosecondsAgree) {
  EXPECT_EQ(seconds(std::chrono::milliseconds(250)), 0.25);
  EXPECT_EQ(from_seconds(0.25), std::chrono::milliseconds(250));
  EXPECT_EQ(from_seconds(-0.25), std::chrono::milliseconds(-250));
}

TEST(Time, SecondsAreRoundedDownBelowZeroToo) {
  EXPECT_EQ(from_seconds(1.5e-9), Duration(1));
  EXPECT_EQ(from_seconds(-1.5e-9), Duration(-2));
  EXPECT_EQ(from_seconds(-2e-9), Duration(-2));
}

}  // namespace
}  // namespace tendon::time_test
