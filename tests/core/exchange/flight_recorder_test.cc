// SPDX-License-Identifier: Apache-2.0
#include "core/exchange/flight_recorder.h"

#include <gtest/gtest.h>

namespace tendon::flight_recorder_test {
namespace {

TEST(FlightRecorder, KeepsTheLastValuesOldestFirst) {
  FlightRecorder<int> recorder(4);
  recorder.record(1);
  recorder.record(2);
  EXPECT_EQ(recorder.size(), 2U);
  EXPECT_EQ(recorder[0], 1);
  for (int i = 3; i <= 9; ++i) recorder.record(i);
  ASSERT_EQ(recorder.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(recorder[i], static_cast<int>(6 + i));
}

TEST(FlightRecorder, AFaultFreezesWhatLedToIt) {
  FlightRecorder<int> recorder(4);
  for (int i = 1; i <= 6; ++i) recorder.record(i);
  recorder.freeze();
  recorder.record(99);
  EXPECT_EQ(recorder[3], 6);
  recorder.thaw();
  EXPECT_EQ(recorder.size(), 0U);
  recorder.record(7);
  EXPECT_EQ(recorder[0], 7);
}

}  // namespace
}  // namespace tendon::flight_recorder_test
