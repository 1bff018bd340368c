// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/bridge_host.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <stdexcept>
#include <string>

#include "clients/cpp/machine.h"

namespace tendon::bridge::bridge_host_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr LocalTime kStart{seconds(1000)};

TEST(BridgeHost, HasADeviceForEachNameAndOneWithoutNames) {
  BridgeHost two({.server = "127.0.0.1:9", .devices = {"left", "right"}}, kStart);
  ASSERT_EQ(two.size(), 2U);
  EXPECT_EQ(two.name(1), "right");
  EXPECT_EQ(two.descriptors().size(), 4U);
  BridgeHost one({.server = "127.0.0.1:9"}, kStart);
  EXPECT_EQ(one.name(0), "device");
}

TEST(BridgeHost, SaysOnceThatNobodyAnswersHoweverOftenItTries) {
  testing::internal::CaptureStderr();
  {
    BridgeHost host({.server = "127.0.0.1:9", .devices = {"right"}}, kStart);
    for (LocalTime now = kStart; now < kStart + seconds(20); now += milliseconds(10)) host.turn(now);
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "tendon-bridge: right: no answer from 127.0.0.1:9; is tendond running there? Retrying\n");
}

TEST(BridgeHost, WritesALineForEachDeviceOnceASecondWithTheBridgesCounts) {
  const std::array counts = {BridgeHost::Count{"clients", 3}};
  testing::internal::CaptureStdout();
  {
    BridgeHost host({.server = "127.0.0.1:9", .devices = {"left", "right"}, .json = true}, kStart);
    for (LocalTime now = kStart; now <= kStart + seconds(1); now += milliseconds(100)) host.turn(now, counts);
  }
  EXPECT_EQ(testing::internal::GetCapturedStdout(),
            R"({"device":"left","states":0,"forces":0,"dropped":0,"unusable":0,"owner":0,"pushes":false,)"
            R"("round_trip_ms":0.0,"clients":3})"
            "\n"
            R"({"device":"right","states":0,"forces":0,"dropped":0,"unusable":0,"owner":0,"pushes":false,)"
            R"("round_trip_ms":0.0,"clients":3})"
            "\n");
}

TEST(BridgeHost, WakesForAProgramThatHasSomethingToSay) {
  BridgeHost host({.server = "127.0.0.1:9"}, kStart);
  std::array<int, 2> pair{};
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, pair.data()), 0);
  std::array<pollfd, 1> programs = {{{pair[0], POLLIN, 0}}};
  host.wait(programs, kStart, kStart + milliseconds(1));
  EXPECT_EQ(programs[0].revents, 0);
  ASSERT_EQ(::write(pair[1], "x", 1), 1);
  const LocalTime before = read_clock();
  host.wait(programs, kStart, kStart + seconds(5));
  EXPECT_EQ(programs[0].revents, POLLIN);
  EXPECT_LT(read_clock() - before, milliseconds(90)) << "it did not sleep its longest";
  ::close(pair[0]);
  ::close(pair[1]);
}

}  // namespace
}  // namespace tendon::bridge::bridge_host_test
