// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "protocol/session.h"
#include "tests/protocol/examples.h"
#include "tests/protocol/world.h"

namespace tendon::session_network_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::minutes;
using std::chrono::seconds;

/// If 50 % of all datagrams are lost for half an hour, there are two seconds without any datagram.
Session::Config patient() {
  Session::Config config;
  config.timeout = seconds(60);
  return config;
}

/// A requests the rates 1, 2, 3 … as soon as possible. The answer of Z contains the rate as the detail.
struct Conversation {
  explicit Conversation(World& the_world) : world(the_world) {
    world.on_z = [this](const Session::Event& event) {
      if (const auto* arrived = std::get_if<Session::RequestArrived>(&event)) {
        const std::uint32_t hz = std::get<SetStateRate>(arrived->request).hz;
        heard.push_back(hz);
        world.z.answer(arrived->id, hz % 3 == 0 ? Code::kDenied : Code::kOk, std::to_string(hz));
      }
    };
    world.on_a = [this](const Session::Event& event) {
      if (const auto* answered = std::get_if<Session::RequestAnswered>(&event)) {
        EXPECT_EQ(answered->detail, std::to_string(answered->id));
        EXPECT_EQ(answered->code, answered->id % 3 == 0 ? Code::kDenied : Code::kOk);
        answers.push_back(answered->id);
      }
    };
  }
  void ask() {
    while (asked < kRequests && world.a.request(SetStateRate{.hz = asked + 1})) ++asked;
  }

  static constexpr std::uint32_t kRequests = 200;
  World& world;
  std::uint32_t asked = 0;
  std::vector<std::uint32_t> heard;
  std::vector<std::uint32_t> answers;
};

TEST(SessionOverABadNetwork, EveryRequestArrivesOnceAndInOrderAndIsAnswered) {
  std::vector<std::uint32_t> all(Conversation::kRequests);
  for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i + 1;

  for (const double loss : {0.0, 0.05, 0.2, 0.5}) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      const Weather weather{.delay = milliseconds(30), .jitter = milliseconds(60), .loss = loss, .duplicate = 0.2};
      World world(weather, seed, patient());
      Conversation talk(world);
      world.run(minutes(3), [&] { talk.ask(); });
      EXPECT_EQ(talk.heard, all) << "loss " << loss << " seed " << seed;
      EXPECT_EQ(talk.answers, all) << "loss " << loss << " seed " << seed;
      EXPECT_EQ(world.a.stats().invalid + world.z.stats().invalid, 0U);
      EXPECT_EQ(world.a.stats().malformed + world.z.stats().malformed, 0U);
    }
  }
}

TEST(SessionOverABadNetwork, TheNewestStateAndForceWin) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    World world({.delay = milliseconds(20), .jitter = milliseconds(30), .loss = 0.3, .duplicate = 0.1}, seed);
    std::uint64_t newest_tick = 0;
    std::uint64_t newest_sequence = 0;
    world.on_a = [&](const Session::Event& event) {
      if (const auto* arrived = std::get_if<Session::StateArrived>(&event)) {
        EXPECT_GT(arrived->state.tick, newest_tick);
        newest_tick = arrived->state.tick;
      }
    };
    world.on_z = [&](const Session::Event& event) {
      if (const auto* arrived = std::get_if<Session::ForceArrived>(&event)) {
        EXPECT_GT(arrived->command.sequence, newest_sequence);
        newest_sequence = arrived->command.sequence;
      }
    };
    world.wake = world.now;
    std::uint64_t n = 0;
    world.run(seconds(5), [&] {
      if (world.now < world.wake) return;
      world.wake += milliseconds(1);
      DeviceState state = examples::state();
      ForceCommand force = examples::force();
      state.tick = force.sequence = ++n;
      world.z.send(state);
      world.a.send(force);
    });
    EXPECT_GT(newest_tick, 4900U);
    EXPECT_GT(newest_sequence, 4900U);
    EXPECT_GT(world.a.stats().stale, 0U);
    EXPECT_GT(world.a.stats().duplicated, 0U);
    EXPECT_GT(world.a.stats().reordered, 0U);
    EXPECT_NEAR(static_cast<double>(world.a.stats().lost), 0.3 * 5000, 150);
  }
}

TEST(SessionOverAPerfectNetwork, TheRoundTripIsExactWhateverTheClocks) {
  const Duration there = milliseconds(7) + Duration{123};
  const Duration back = milliseconds(11) + Duration{456};
  World world(perfect(there), perfect(back), 1, {});
  world.run(seconds(10));
  EXPECT_EQ(world.a.stats().round_trip, there + back);
  EXPECT_EQ(world.z.stats().round_trip, there + back);
  EXPECT_EQ(world.a.stats().smoothed_round_trip, there + back);
  EXPECT_LE(world.a.stats().round_trip_variation, Duration{4});  // rounding error of the division
  EXPECT_EQ(world.a.stats().lost, 0U);
}

TEST(SessionOverAPerfectNetwork, BothEndsSendKeepAlivesAtTheirRate) {
  World world(perfect(milliseconds(10)));
  world.run(seconds(10));
  EXPECT_TRUE(world.a.open() && world.z.open());
  EXPECT_EQ(world.a.stats().datagrams_sent, 201U);  // at 0, 50 … 10 000 ms
}

TEST(SessionOverAPerfectNetwork, ARequestAnsweredInTimeIsSentOnce) {
  World world(perfect(milliseconds(40)));
  world.run(seconds(3));  // this is enough to measure the round trip
  bool answered = false;
  world.on_z = [&](const Session::Event& event) {
    world.z.answer(std::get<Session::RequestArrived>(event).id, Code::kOk, "");
  };
  world.on_a = [&](const Session::Event&) { answered = true; };
  const std::uint64_t before = world.a.stats().datagrams_sent;
  world.a.request(Rearm{});
  world.run(milliseconds(90));
  EXPECT_TRUE(answered);
  EXPECT_LE(world.a.stats().datagrams_sent - before, 2U);  // the request and one keep-alive
}

TEST(SessionOverABadNetwork, AnOutageShorterThanTheTimeoutIsSurvived) {
  World world({}, 4);
  Conversation talk(world);
  world.a_to_z.weather().loss = world.z_to_a.weather().loss = 1;
  world.run(milliseconds(1900), [&] { talk.ask(); });
  world.a_to_z.weather().loss = world.z_to_a.weather().loss = 0;
  world.run(seconds(20), [&] { talk.ask(); });
  EXPECT_EQ(talk.answers.size(), Conversation::kRequests);
}

}  // namespace
}  // namespace tendon::session_network_test
