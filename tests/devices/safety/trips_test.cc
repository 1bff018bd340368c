// SPDX-License-Identifier: Apache-2.0
#include "devices/safety/trips.h"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

namespace tendon::trips_test {
namespace {

using namespace std::chrono_literals;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(SpeedTrip, TripsAboveItsSpeedInAnyDirection) {
  for (const double speed : {1.4, 1.6}) {
    for (const Vec3& direction : {Vec3(0, 0, -1), Vec3(1, 2, 2)}) {
      SpeedTrip trip({.max = 1.5}, 50e-6);
      bool tripped = false;
      for (int ms = 0; ms < 40; ++ms) {
        tripped = trip.tripped(LocalTime(std::chrono::milliseconds(ms)), direction.normalized() * speed * 1e-3 * ms);
      }
      EXPECT_EQ(tripped, speed > 1.5);
    }
  }
}

TEST(SpeedTrip, AfterItForgotTheFirstPositionIsNoMotion) {
  SpeedTrip trip({.max = 1.5}, 0);
  EXPECT_FALSE(trip.tripped(LocalTime(1ms), {0, 0, 0}));
  trip.forget();
  EXPECT_FALSE(trip.tripped(LocalTime(2ms), {1, 0, 0}));
  EXPECT_TRUE(trip.tripped(LocalTime(3ms), {2, 0, 0}));
}

TEST(StepBound, LetsAHandMoveAtItsSpeedAndAnEncoderByOneCountMore) {
  const StepBound bound({.max_speed = 10}, 50e-6);
  EXPECT_FALSE(bound.tripped({0, 0, 0}, {0.01, 0, 0}, 1ms));
  EXPECT_TRUE(bound.tripped({0, 0, 0}, {0.0102, 0, 0}, 1ms));
  EXPECT_FALSE(bound.tripped({0, 0, 0}, {0.0102, 0, 0}, 2ms));
  EXPECT_FALSE(bound.tripped({0, 0, 0}, {49e-6, -49e-6, 49e-6}, 0ms)) << "rounding moves it without time";
  EXPECT_TRUE(bound.tripped({0, 0, 0}, {1e-3, 0, 0}, 0ms));
  EXPECT_TRUE(bound.tripped({0, 0, 0}, {kNaN, 0, 0}, 1ms));
}

TEST(Watchdog, TripsOnlyAfterItsTime) {
  const Watchdog dog({.timeout = 20ms, .ramp = 10ms}, "link_watchdog");
  EXPECT_FALSE(dog.tripped(20ms));
  EXPECT_TRUE(dog.tripped(20ms + 1ns));
  EXPECT_FALSE(dog.tripped(-1s)) << "a sample from the future is not silence";
}

TEST(DeadManSwitch, LooksAtItsOwnButtonOnly) {
  const DeadManSwitch button({.button = 2});
  EXPECT_TRUE(button.held(0b100));
  EXPECT_TRUE(button.held(0xFFFFFFFF));
  EXPECT_FALSE(button.held(0b11011));
}

TEST(Trips, RefuseImpossibleValues) {
  for (const double bad : {0.0, -1.0, kNaN}) {
    EXPECT_THROW(SpeedTrip({.max = bad}, 0), std::invalid_argument);
    EXPECT_THROW(StepBound({.max_speed = bad}, 0), std::invalid_argument);
  }
  EXPECT_THROW(Watchdog({.timeout = 0ms, .ramp = 0ms}, "a"), std::invalid_argument);
  EXPECT_THROW(Watchdog({.timeout = 1ms, .ramp = -1ms}, "a"), std::invalid_argument);
  EXPECT_THROW(DeadManSwitch({.button = 32}), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::trips_test
