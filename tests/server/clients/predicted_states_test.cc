// SPDX-License-Identifier: Apache-2.0
#include "tests/server/clients/sealed_server.h"

#include <deque>
#include <utility>

namespace tendon::predicted_states_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

const SetStateDeadband kDeadband{.share = 0.1, .floor = 1e-3, .max_silence = milliseconds(20)};

TEST_F(SealedServer, LeavesOutStatesThatAClientCanPredictWhenItAsksForIt) {
  for (const bool asks : {false, true}) {
    ForceClient::Config config{.rate_hz = 500};
    if (asks) config.state_deadband = kDeadband;
    std::uint64_t calls = 0;
    std::uint64_t newest = 0;
    Client a = controller(wall_, "192.0.2.1:4000", config, [&](const DeviceState& hand) {
      EXPECT_GT(hand.tick, newest);
      newest = hand.tick;
      ++calls;
      return push(hand);
    });
    const std::uint64_t unanswerable = stats().unanswerable;
    run(seconds(2), {&a});
    if (asks) {
      EXPECT_LT(a->stats().states, 150U);  // hand at rest: one state in 20
      EXPECT_GT(stats().predicted, 1800U);
    } else {
      EXPECT_GT(a->stats().states, 1900U);
      EXPECT_EQ(stats().predicted, 0U);
    }
    EXPECT_GT(calls, 950U);
    EXPECT_EQ(stats().unanswerable, unanswerable);
    a->stop(now_);
    run(milliseconds(10), {&a});
  }
}

TEST_F(SealedServer, TakesForcesThatAnswerAPredictedStepWhichItWasTooLateToSee) {
  const LocalTime first_step = now_;
  Client a = controller(wall_, "192.0.2.1:4000", {.rate_hz = 1000, .state_deadband = kDeadband});
  run(seconds(1), {&a});
  const std::uint64_t unanswerable = stats().unanswerable;
  const std::uint64_t forces = stats().forces;
  steps_a_turn_ = 5;
  std::deque<std::pair<LocalTime, Datagram>>
      to_server;  // the delay is 10 ms, so the step after the answered one is known
  std::uint64_t unseen = 0;
  for (int i = 0; i < 500; ++i) {
    run(milliseconds(1), {&a}, [&](const Datagram& datagram) {
      if (datagram.from != a.end->self) return true;
      to_server.emplace_back(now_ + milliseconds(10), datagram);
      return false;
    });
    for (; !to_server.empty() && to_server.front().first <= now_; to_server.pop_front()) {
      deliver(a.end->self, to_server.front().second.bytes);
    }
    const RemoteForce* const force = mail().forces[0].take();
    if (force == nullptr) continue;
    // With one step per millisecond, the sampling time is known exactly.
    EXPECT_EQ(force->answers - first_step, milliseconds(force->answers_tick - 1));
    if (force->answers_tick % steps_a_turn_ != 0) ++unseen;
  }
  EXPECT_EQ(stats().unanswerable, unanswerable);
  EXPECT_GT(stats().forces - forces, 450U);
  EXPECT_GT(unseen, 90U);
}

}  // namespace
}  // namespace tendon::predicted_states_test
