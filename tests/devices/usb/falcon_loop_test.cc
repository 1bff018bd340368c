// SPDX-License-Identifier: Apache-2.0
#include "tests/devices/usb/falcon_loop.h"

#include <gtest/gtest.h>

#include <iostream>

#include "tests/realtime/heap_guard.h"

namespace tendon {
namespace {

// Without a limiter: with one, a machine that stands still for periods on end leaves next to nothing of a wall, as it
// should. What is expected holds however late all of it is: nothing here is a time, or a share of them.
TEST(FalconLoop, AWallIsFeltThroughTheRealLibraryWithoutAHeapCallInTheLoop) {
  const HeapGuard guard;
  const auto report = run_falcon_loop(std::chrono::milliseconds(1500), Law::kNone, [&guard] { return guard.calls(); });
  std::cout << report.json() << '\n';
  EXPECT_EQ(report.heap_calls, 0U);
  EXPECT_GT(report.pushed, 0U);  // a wrong sign anywhere pulls
  // A step that waited finds a hand, and with it an arm of each motor, somewhere else; a reply that was given up
  // answers the next question.
  EXPECT_LE(report.at_odds, report.overruns + report.unseen);
}

}  // namespace
}  // namespace tendon
