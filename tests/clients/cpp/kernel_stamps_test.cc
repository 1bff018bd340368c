// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/kernel_stamps.h"

#include <gtest/gtest.h>

#include "core/base/time.h"

namespace tendon::kernel_stamps_test {
namespace {

using namespace std::chrono_literals;

constexpr Duration kUnix = 1'700'000'000s;  // the Unix time at the local time 0
constexpr Duration kWaited = 40us;

/// The first datagram, which only shows the difference of the clocks.
KernelStamps& begun(KernelStamps& stamps) {
  stamps.observe(kUnix, kUnix, LocalTime{});
  return stamps;
}

TEST(KernelStamps, TellWhenADatagramHasReachedTheMachine) {
  KernelStamps stamps;
  begun(stamps).observe(kUnix + 2s, kUnix + 2s + kWaited, LocalTime(2s + kWaited));
  EXPECT_EQ(stamps.reached(), LocalTime(2s));
  EXPECT_EQ(stamps.read(), LocalTime(2s + kWaited));
  // The result is late by the time between the two readings.
  stamps.observe(kUnix + 3s, kUnix + 3s + kWaited, LocalTime(3s + kWaited + 100ns));
  EXPECT_EQ(stamps.reached(), LocalTime(3s + 100ns));
  EXPECT_EQ(stamps.refused(), 0U);
}

TEST(KernelStamps, TheFirstOneIsNotUsedBecauseTheClockMayHaveBeenSet) {
  KernelStamps stamps;
  stamps.observe(kUnix, kUnix + kWaited, LocalTime(kWaited));
  EXPECT_EQ(stamps.reached(), LocalTime(kWaited));
  EXPECT_EQ(stamps.refused(), 0U);
}

TEST(KernelStamps, WithoutOneTheTimeOfReadingIsUsed) {
  KernelStamps stamps;
  begun(stamps).observe(LocalTime(1s));
  EXPECT_EQ(stamps.reached(), LocalTime(1s));
  EXPECT_EQ(stamps.refused(), 0U);
  stamps.observe(kUnix + 2s, kUnix + 2s + kWaited, LocalTime(2s + kWaited));
  EXPECT_EQ(stamps.reached(), LocalTime(2s));
}

TEST(KernelStamps, AClockThatWasSetIsCountedAndMovesNoTime) {
  for (const Duration step :
       {Duration(3us), Duration(1ms), Duration(1h), Duration(-3us), Duration(-1ms), Duration(-1h)}) {
    KernelStamps stamps;
    // The clock is set after the stamp, and before the datagram is read.
    const LocalTime read(1s + kWaited);
    begun(stamps).observe(kUnix + 1s, kUnix + 1s + kWaited + step, read);
    EXPECT_EQ(stamps.reached(), read) << step.count();
    EXPECT_EQ(stamps.refused(), 1U) << step.count();
    stamps.observe(kUnix + 2s + step, kUnix + 2s + step + kWaited, LocalTime(2s + kWaited));
    EXPECT_EQ(stamps.reached(), LocalTime(2s)) << "and the next one is used again";
    EXPECT_EQ(stamps.refused(), 1U) << step.count();
  }
}

TEST(KernelStamps, AnInterruptionBetweenTheTwoClocksCostsTwoStamps) {
  KernelStamps stamps;
  begun(stamps).observe(kUnix + 1s, kUnix + 1s + kWaited, LocalTime(1s + 5ms));
  EXPECT_EQ(stamps.reached(), LocalTime(1s + 5ms));
  stamps.observe(kUnix + 2s, kUnix + 2s + kWaited, LocalTime(2s + kWaited));
  EXPECT_EQ(stamps.reached(), LocalTime(2s + kWaited));
  stamps.observe(kUnix + 3s, kUnix + 3s + kWaited, LocalTime(3s + kWaited));
  EXPECT_EQ(stamps.reached(), LocalTime(3s));
  EXPECT_EQ(stamps.refused(), 2U);
}

TEST(KernelStamps, AStampOfTheFutureOrOfLongAgoIsRefused) {
  for (const Duration waited : {Duration(-1ns), KernelStamps::kMostWait + 1ns, kUnix}) {
    KernelStamps stamps;
    begun(stamps).observe(kUnix + 1s - waited, kUnix + 1s, LocalTime(1s));
    EXPECT_EQ(stamps.reached(), LocalTime(1s)) << waited.count();
    EXPECT_EQ(stamps.refused(), 1U) << waited.count();
  }
  KernelStamps stamps;
  begun(stamps).observe(kUnix + 1s - KernelStamps::kMostWait, kUnix + 1s, LocalTime(1s));
  EXPECT_EQ(stamps.reached(), LocalTime(1s) - KernelStamps::kMostWait);
}

}  // namespace
}  // namespace tendon::kernel_stamps_test
