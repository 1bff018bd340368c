// SPDX-License-Identifier: Apache-2.0
#include "tests/server/guests/sealed_server.h"

#include <deque>
#include <utility>

namespace tendon::foretold_states_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST_F(SealedServer, LeavesOutStatesThatAClientCanForetellWhenItAsksForIt) {
  for (const bool asks : {false, true}) {
    Client a{std::make_unique<End>(wire_, parse_address("192.0.2.1:4000")), nullptr};
    ForceClient::Config config = config_of(wall_, ++seed_);
    config.rate_hz = 500;
    if (asks) config.state_deadband = SetStateDeadband{.share = 0.1, .floor = 1e-3, .max_silence = milliseconds(20)};
    std::uint64_t calls = 0;
    std::uint64_t newest = 0;
    a.client = std::make_unique<ForceClient>(
        *a.end, server_.self, config,
        [&](const DeviceState& hand) {
          EXPECT_GT(hand.tick, newest);
          newest = hand.tick;
          ++calls;
          return Touch(Vec3(1, 0, 0));
        },
        now_);
    const std::uint64_t unanswerable = loop_->stats().unanswerable;
    run(seconds(2), {&a});
    if (asks) {
      EXPECT_LT(a.client->stats().states, 150U);  // hand at rest: one state in 20
      EXPECT_GT(loop_->stats().foretold, 1800U);
    } else {
      EXPECT_GT(a.client->stats().states, 1900U);
      EXPECT_EQ(loop_->stats().foretold, 0U);
    }
    EXPECT_GT(calls, 950U);
    EXPECT_EQ(loop_->stats().unanswerable, unanswerable);
    a.client->stop(now_);
    run(milliseconds(10), {&a});
  }
}

TEST_F(SealedServer, TakesForcesThatAnswerAForetoldStepWhichItWasTooLateToSee) {
  Client a{std::make_unique<End>(wire_, parse_address("192.0.2.1:4000")), nullptr};
  ForceClient::Config config = config_of(wall_, ++seed_);
  config.rate_hz = 1000;
  config.state_deadband = SetStateDeadband{.share = 0.1, .floor = 1e-3, .max_silence = milliseconds(20)};
  const LocalTime first_step = now_;
  a.client = std::make_unique<ForceClient>(
      *a.end, server_.self, config, [](const DeviceState&) { return Touch(Vec3(1, 0, 0)); }, now_);
  run(seconds(1), {&a});
  const std::uint64_t unanswerable = loop_->stats().unanswerable;
  const std::uint64_t forces = loop_->stats().forces;
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
    const RemoteForce* const force = mail_->forces[0].take();
    if (force == nullptr) continue;
    // With one step per millisecond, the sampling time is known exactly.
    EXPECT_EQ(force->answers - first_step, milliseconds(force->answers_tick - 1));
    if (force->answers_tick % steps_a_turn_ != 0) ++unseen;
  }
  EXPECT_EQ(loop_->stats().unanswerable, unanswerable);
  EXPECT_GT(loop_->stats().forces - forces, 450U);
  EXPECT_GT(unseen, 90U);  // of the states that were the newest ones in their turn
}

}  // namespace
}  // namespace tendon::foretold_states_test
