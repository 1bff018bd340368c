// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/resource.h>

#include <chrono>
#include <cstdint>

#include "clients/cpp/machine.h"
#include "clients/cpp/run.h"
#include "tests/clients/cpp/server_thread.h"

namespace tendon::sleeps_test {
namespace {

using std::chrono::milliseconds;
using Server = a_and_z::ServerThread;

/// Returns the number of voluntary context switches of this thread, which does not include preemption.
std::uint64_t sleeps() {
  rusage usage{};
  ::getrusage(RUSAGE_THREAD, &usage);
  return static_cast<std::uint64_t>(usage.ru_nvcsw);
}

Options wall_at(const Server& server) {
  Options options;
  options.server = to_string(server.address());
  options.client.name = "wall";
  options.duration = milliseconds(600);
  return options;
}

Vec3 push(const DeviceState& hand) { return -100 * hand.position; }

TEST(Sleeps, AClientSleepsOnceForEachStateThatItAnswers) {
  Server server;
  const Options options = wall_at(server);
  const std::uint64_t before = sleeps();
  ASSERT_EQ(run(options, push), 0);
  const std::uint64_t slept = sleeps() - before;
  const std::uint64_t forces = server.forces();
  ASSERT_GT(forces, 20U);
  constexpr std::uint64_t kOthers = 60;
  EXPECT_LE(slept, forces + kOthers) << "a sleep between a state and its force would double them";
}

TEST(Sleeps, ABusyClientNeverSleepsAndStillEndsInTime) {
  Server server;
  Options options = wall_at(server);
  options.busy = true;
  const std::uint64_t before = sleeps();
  ASSERT_EQ(run(options, push), 0);
  const std::uint64_t slept = sleeps() - before;
  ASSERT_GT(server.forces(), 20U);
  EXPECT_LE(slept, 10U) << "none for a state: these are of the start and the end";
}

TEST(Sleeps, ABusyClientHasItsTimersServed) {
  Options options;
  options.client.name = "wall";
  options.server = "127.0.0.1:9";
  options.client.patience = options.client.retry_min = options.client.retry_max = milliseconds(5);
  options.duration = milliseconds(200);
  options.busy = true;
  options.silence = milliseconds(10);
  int silences = 0;
  options.on_silence = [&](LocalTime /*now*/) { ++silences; };
  const std::uint64_t before = sleeps();
  EXPECT_EQ(run(options, push), 1);
  EXPECT_LE(sleeps() - before, 10U);
  EXPECT_GE(silences, 2);
}

TEST(Sleeps, TheThreadHasItsTimerSlackBackAfterwards) {
  const int before = ::prctl(PR_GET_TIMERSLACK, 0UL, 0UL, 0UL, 0UL);
  ASSERT_GT(before, 1);
  {
    const Punctual punctual;
    EXPECT_EQ(::prctl(PR_GET_TIMERSLACK, 0UL, 0UL, 0UL, 0UL), 1);
  }
  EXPECT_EQ(::prctl(PR_GET_TIMERSLACK, 0UL, 0UL, 0UL, 0UL), before);
}

}  // namespace
}  // namespace tendon::sleeps_test
