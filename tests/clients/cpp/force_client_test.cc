// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/force_client.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <set>
#include <stdexcept>
#include <vector>

#include "protocol/limits.h"
#include "tests/clients/cpp/a_and_z.h"
#include "tests/support/refusal.h"

namespace tendon::force_client_test {
namespace {

using a_and_z::answer;
using a_and_z::kFineWeather;
using a_and_z::Server;
using a_and_z::Weather;
using a_and_z::World;
using std::chrono::milliseconds;
using Phase = ForceClient::Phase;
constexpr Duration kSecond = std::chrono::seconds(1);

TEST(ForceClient, ComesInThroughTheRetryThoughAThirdOfAllDatagramsIsLost) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    World world(seed, {.loss = 0.3});
    world.connect({.rate_hz = 100}, answer);
    ASSERT_TRUE(world.run_until(Phase::kOpen, 4 * kSecond)) << "seed " << seed;
    world.run(kSecond);
    EXPECT_EQ(world.a->phase(), Phase::kOpen) << "seed " << seed;
    EXPECT_EQ(world.a->welcome()->device_name, "hand at Z");
    EXPECT_GT(world.z->forces.size(), 40U) << "seed " << seed;
  }
}

TEST(ForceClient, TellsTheServerWhoItIs) {
  World world(1);
  world.connect({.name = "wall"}, answer);
  ASSERT_TRUE(world.run_until(Phase::kOpen, kSecond));
  EXPECT_EQ(world.z->hellos.front().name, "wall");
  EXPECT_EQ(world.z->hellos.front().role, Role::kController);
}

TEST(ForceClient, AnswersEachStateWithItsForceAndNumbersThemWithoutAGap) {
  World world(7, kFineWeather);
  world.connect({}, answer);
  ASSERT_TRUE(world.run_until(Phase::kOpen, kSecond));
  world.run(kSecond);
  EXPECT_NEAR(static_cast<double>(world.z->forces.size()), 1000, 12);
  EXPECT_EQ(world.a->stats().states_skipped, 0U);
  std::uint64_t number = 0;
  for (const auto& [at, command] : world.z->forces) {
    EXPECT_EQ(command.force, Vec3(-100 * Server::position(command.based_on_tick)));
    EXPECT_EQ(command.sequence, ++number);
    EXPECT_FALSE(command.model);
  }
}

TEST(ForceClient, ShowsThePhysicsTheNewestStateOnly) {
  World world(3, {.loss = 0.1, .delay = milliseconds(20), .jitter = milliseconds(15)});
  std::vector<std::uint64_t> seen;
  std::uint64_t behind = 0;
  world.connect({.rate_hz = 20}, [&](const DeviceState& hand) {
    seen.push_back(hand.tick);
    behind = std::max(behind, world.z->tick - hand.tick);
    return answer(hand);
  });
  world.run(5 * kSecond);
  ASSERT_GT(seen.size(), 90U);
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end(), std::less_equal<>())) << "a state came back, or came twice";
  // The newest state is little older than the constant delay. If there were a queue, it would be at least 35 ms older.
  EXPECT_LE(behind, 30U);
  const ForceClient::Stats stats = world.a->stats();
  EXPECT_EQ(stats.states, seen.size() + stats.states_skipped + 1) << "the +1 still waits for its turn";
}

TEST(ForceClient, OfStatesThatArriveTogetherOnlyTheNewestIsComputed) {
  World world(4, kFineWeather);
  int calls = 0;
  world.connect({}, [&](const DeviceState& hand) {
    ++calls;
    return answer(hand);
  });
  ASSERT_TRUE(world.run_until(Phase::kOpen, kSecond));
  world.run(kSecond);
  const ForceClient::Stats before = world.a->stats();
  const int calls_before = calls;
  const LocalTime end = world.now + milliseconds(50);
  for (; world.now < end; world.now += milliseconds(1)) world.z->turn(world.now);
  world.a->turn(world.now);
  EXPECT_EQ(calls, calls_before + 1);
  EXPECT_GT(world.a->stats().states_skipped, before.states_skipped + 40);
}

TEST(ForceClient, KeepsItsRate) {
  World world(5, {.loss = 0.05, .delay = milliseconds(10), .jitter = milliseconds(5)});
  std::vector<LocalTime> calls;
  world.connect({.rate_hz = 100}, [&](const DeviceState& hand) {
    calls.push_back(world.now);
    return answer(hand);
  });
  ASSERT_TRUE(world.run_until(Phase::kOpen, 4 * kSecond));
  calls.clear();
  world.run(10 * kSecond);
  EXPECT_GE(calls.size(), 985U);
  EXPECT_LE(calls.size(), 1001U);
}

TEST(ForceClient, NeverCatchesUpWhatItHasMissed) {
  World world(6, kFineWeather);
  std::vector<LocalTime> calls;
  world.connect({.rate_hz = 100}, [&](const DeviceState& hand) {
    calls.push_back(world.now);
    return answer(hand);
  });
  world.run(kSecond);
  world.network().set({.loss = 1});
  world.run(kSecond / 2);
  world.network().set(kFineWeather);
  calls.clear();
  world.run(kSecond);
  EXPECT_LE(calls.size(), 101U);
  for (std::size_t i = 1; i < calls.size(); ++i) EXPECT_GE(calls[i] - calls[i - 1], milliseconds(9));
}

TEST(ForceClient, ALaterAnswerIsSentUnlessANewerStateWasAnswered) {
  World world(24, kFineWeather);
  std::vector<Seen> seen;
  world.connect({}, [&](const DeviceState& hand) {
    seen.push_back({.hand = hand, .session = 1});
    Touch later;
    later.unknown = true;
    return later;
  });
  world.run(kSecond);
  ASSERT_GT(seen.size(), 500U);
  EXPECT_TRUE(world.z->forces.empty());
  const auto give = [&](std::size_t which) {
    const bool sent = world.a->answer(world.now, {.to = seen[which], .touch = answer(seen[which].hand)});
    world.run(milliseconds(20));
    return sent;
  };
  EXPECT_TRUE(give(100));
  EXPECT_TRUE(give(300));
  EXPECT_FALSE(give(200)) << "an older motion";
  EXPECT_TRUE(give(300)) << "the same one again";
  Touch unknown;
  unknown.unknown = true;
  EXPECT_FALSE(world.a->answer(world.now, {.to = seen[400], .touch = unknown}));
  ASSERT_EQ(world.z->forces.size(), 3U);
  EXPECT_EQ(world.z->forces.back().second.based_on_tick, seen[300].hand.tick);
  EXPECT_EQ(world.z->forces.back().second.force, answer(seen[300].hand));
}

TEST(ForceClient, ALaterAnswerToAStateOfAnotherSessionIsNotSent) {
  World world(25, kFineWeather);
  std::optional<Seen> newest;
  world.connect({}, [&](const DeviceState& hand) {
    newest = Seen{.hand = hand, .session = world.a ? world.a->stats().sessions : 1};
    Touch later;
    later.unknown = true;
    return later;
  });
  world.run(kSecond);
  const Seen old = *newest;
  ASSERT_EQ(old.session, 1U);
  world.restart_server();
  EXPECT_FALSE(world.a->answer(world.now, {.to = Seen{}, .touch = Vec3(1, 0, 0)}));
  world.run(4 * kSecond);
  ASSERT_EQ(world.a->stats().sessions, 2U);
  EXPECT_FALSE(world.a->answer(world.now, {.to = old, .touch = Vec3(1, 0, 0)}));
  EXPECT_TRUE(world.a->answer(world.now, {.to = *newest, .touch = Vec3(1, 0, 0)}));
  world.a->give_lease();
  EXPECT_FALSE(world.a->answer(world.now, {.to = *newest, .touch = Vec3(1, 0, 0)})) << "another may hold the channel";
}

TEST(ForceClient, AForceIsValidForThreePeriodsAndAtLeastTwentyMilliseconds) {
  const auto valid_ms = [](const ForceClient::Config& config, int state_hz = 1000) {
    World world(10, kFineWeather);
    world.z->state_hz = state_hz;
    world.connect(config, answer);
    world.run(2 * kSecond);
    return 1e3 * seconds(world.z->forces.back().second.valid_for);
  };
  constexpr double kOneTick = 3;
  EXPECT_NEAR(valid_ms({.rate_hz = 100}), 30, kOneTick);
  EXPECT_EQ(valid_ms({.rate_hz = 1000}), 20);
  EXPECT_NEAR(valid_ms({.rate_hz = 2}), 1500, kOneTick);
  EXPECT_EQ(valid_ms({.rate_hz = 0}), 20);
  EXPECT_EQ(valid_ms({.rate_hz = 0}, 50), 60);
  EXPECT_EQ(valid_ms({.rate_hz = 100}, 50), 60) << "no forces between the states";
  EXPECT_EQ(valid_ms({.rate_hz = 0}, 2), 300) << "a gap is not a period";
  EXPECT_EQ(valid_ms({.rate_hz = 100, .valid_for = milliseconds(7)}), 7);
}

/// Applies `change` to the answers of the engine. Returns the last force after one second.
ForceCommand last_force(World& world, ForceClient::Config config, const std::function<void(Touch&)>& change) {
  config.rate_hz = 100;
  world.connect(config, [&](const DeviceState& hand) {
    Touch touch = answer(hand);
    change(touch);
    return touch;
  });
  world.run(kSecond);
  EXPECT_FALSE(world.z->forces.empty());
  return world.z->forces.empty() ? ForceCommand{} : world.z->forces.back().second;
}

TEST(ForceClient, AnAnswerThatSaysHowLongItIsValidIsBelieved) {
  World world(10, kFineWeather);
  const auto change = [](Touch& touch) { touch.valid_for = milliseconds(55); };
  EXPECT_EQ(last_force(world, {.valid_for = milliseconds(7)}, change).valid_for, milliseconds(55));
}

TEST(ForceClient, TheStiffnessIsThatAtThePositionTheForceWasComputedFor) {
  World world(11);
  const Mat3 stiffness = Vec3(100, 100, 100).asDiagonal();
  const ForceCommand command = last_force(world, {}, [&](Touch& touch) { touch.stiffness = stiffness; });
  ASSERT_TRUE(command.model);
  EXPECT_EQ(command.model->at, Server::position(command.based_on_tick));
  EXPECT_EQ(command.model->stiffness, stiffness);
}

TEST(ForceClient, AllThatTheEngineKnowsTravels) {
  World world(11);
  const ForceCommand command = last_force(world, {}, [](Touch& touch) {
    touch.valid_radius = 0.003;
    touch.contact = Contact{.normal = Vec3::UnitZ(),
                            .gap = -0.001,
                            .table = ForceTable{.first = -0.001, .step = 0.001, .size = 3, .force = {0, 1, 3}}};
    touch.topology_changed = true;
    touch.error = 0.02;
  });
  ASSERT_TRUE(command.model && command.model->contact && command.model->contact->table);
  EXPECT_EQ(command.model->stiffness, Mat3::Zero());
  EXPECT_EQ(command.model->valid_radius, 0.003);
  EXPECT_EQ(command.model->contact->normal, Vec3::UnitZ());
  EXPECT_EQ(command.model->contact->gap, -0.001);
  EXPECT_EQ(command.model->contact->table->size, 3U);
  EXPECT_EQ(command.model->contact->table->force[2], 3);
  EXPECT_TRUE(command.topology_changed);
  EXPECT_EQ(command.error, 0.02);
}

TEST(ForceClient, TheWaysAreNamedOnceAndEachForceSaysWhichOneItWas) {
  World world(11);
  EXPECT_EQ(last_force(world, {.ways = {"tabulated", "near"}}, [](Touch& touch) { touch.way = 2; }).way, 2U);
  EXPECT_EQ(world.z->hellos.at(0).ways, (std::vector<std::string>{"tabulated", "near"}));
  EXPECT_EQ(std::ranges::count(world.z->hellos.at(0).features, kFeatureWays), 1);
  EXPECT_EQ(world.a->stats().left_out, "");
}

TEST(ForceClient, AWayWithoutANameIsLeftOutAndTheForceIsSent) {
  World world(11);
  EXPECT_EQ(last_force(world, {.ways = {"near"}}, [](Touch& touch) { touch.way = 2; }).way, 0U);
  EXPECT_EQ(world.a->stats().left_out, "the solver path: its number is not in Config::ways");
}

TEST(ForceClient, SendsNoStiffnessAndNoWayToAServerThatDoesNotKnowThem) {
  World world(11);
  world.z->features = false;
  last_force(world, {.ways = {"near"}}, [](Touch& touch) {
    touch.way = 1;
    touch.stiffness = Mat3::Identity();
  });
  for (const auto& [at, command] : world.z->forces) {
    EXPECT_EQ(command.way, 0U);
    EXPECT_FALSE(command.model);
  }
}

TEST(ForceClient, WhatIsNotSentTakesNoNumber) {
  World world(12, kFineWeather);
  std::uint64_t calls = 0;
  last_force(world, {}, [&](Touch& touch) {
    if (++calls % 2 == 0) touch.force.y() = std::numeric_limits<double>::quiet_NaN();
  });
  const ForceClient::Stats stats = world.a->stats();
  EXPECT_EQ(stats.forces + stats.forces_unusable, calls);
  EXPECT_NEAR(static_cast<double>(stats.forces), static_cast<double>(calls) / 2, 1);
  EXPECT_EQ(world.z->forces.back().second.sequence, world.z->forces.size());
}

TEST(ForceClient, SaysWhyAnAnswerIsNotSent) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  const auto reason = [](const Touch& touch) {
    World world(28, kFineWeather);
    world.connect({.rate_hz = 100}, [&](const DeviceState&) { return touch; });
    world.run(kSecond);
    EXPECT_GT(world.a->stats().forces_unusable, 50U);
    EXPECT_TRUE(world.z->forces.empty());
    return world.a->stats().unusable;
  };
  EXPECT_EQ(reason(Vec3(0, kNan, 0)), "the force is not finite (NaN or infinity)");
  EXPECT_EQ(reason(Vec3(0, 0, -2e12)), "the force exceeds 1e12 N");
  Touch stiff = Vec3(1, 0, 0);
  stiff.stiffness = Mat3::Constant(kInf);
  Touch twisted = Vec3(1, 0, 0);
  twisted.torque = Vec3(kNan, 0, 0);
  EXPECT_EQ(reason(twisted), "the torque is not finite (NaN or infinity)");
  twisted.torque = Vec3(2e12, 0, 0);
  EXPECT_EQ(reason(twisted), "the torque exceeds 1e12 N·m");
  Touch gripped = Vec3(1, 0, 0);
  gripped.grip_force = -kInf;
  EXPECT_EQ(reason(gripped), "the grip force is not finite, or exceeds 1e12 N");
  EXPECT_EQ(reason(stiff), "its stiffness, radius, contact or error is not finite, or out of the bounds in WIRE.md");
}

TEST(ForceClient, ADeadbandLeavesOutForcesThatFeelAlikeInTime) {
  World world(29, kFineWeather);
  std::uint64_t calls = 0;
  world.connect({.deadband = Deadband::force()}, [&](const DeviceState&) {
    return Touch(Vec3(3 + std::sin(static_cast<double>(++calls) / 200), 0, 0));
  });
  world.run(5 * kSecond);
  const ForceClient::Stats stats = world.a->stats();
  EXPECT_EQ(stats.forces + stats.forces_alike, calls);
  EXPECT_LT(stats.forces, calls / 10);
  const auto& forces = world.z->forces;
  for (std::size_t i = 1; i < forces.size(); ++i) {
    EXPECT_LT(forces[i].first - forces[i - 1].first, forces[i - 1].second.valid_for) << i;
  }
}

TEST(ForceClient, AnObserverSeesTheHandAndTheLinkAndSendsNoForce) {
  World world(13, kFineWeather);
  int calls = 0;
  Duration round_trip{};
  world.connect({.rate_hz = 10}, [&](const DeviceState& hand, const LinkStats& link) {
    ++calls;
    EXPECT_EQ(hand.position, Server::position(hand.tick));
    round_trip = link.smoothed_round_trip;
  });
  world.run(5 * kSecond);
  EXPECT_EQ(world.z->hellos.front().role, Role::kObserver);
  EXPECT_NEAR(calls, 50, 2);
  EXPECT_NEAR(seconds(round_trip), 0.010, 0.001);
  EXPECT_TRUE(world.z->forces.empty());
  EXPECT_EQ(world.a->phase(), Phase::kOpen) << "keep-alives hold the session";
}

TEST(ForceClient, AnOperatorSendsNoForceAndHearsTheAnswerToItsOrder) {
  World world(13, kFineWeather);
  int calls = 0;
  world.connect({.operates = true}, [&](const DeviceState&, const LinkStats&) { ++calls; });
  EXPECT_FALSE(world.a->disarm()) << "there is no session to ask in";
  world.run(kSecond);
  EXPECT_EQ(world.z->hellos.front().role, Role::kController);
  EXPECT_TRUE(world.a->holds());
  EXPECT_GT(calls, 900);
  EXPECT_FALSE(world.a->order_answer());
  ASSERT_TRUE(world.a->disarm());
  world.run(kSecond);
  ASSERT_TRUE(world.a->order_answer());
  EXPECT_EQ(world.a->order_answer()->code, Code::kOk);
  ASSERT_TRUE(world.a->rearm());
  EXPECT_FALSE(world.a->order_answer()) << "that was the one before";
  world.run(kSecond);
  EXPECT_TRUE(world.a->order_answer());
  ASSERT_TRUE(world.a->engage() && world.a->disengage() && world.a->set_scale(0.5, 2) && world.a->set_share(3, 0.25));
  EXPECT_FALSE(world.a->set_scale(0.0099, 1) || world.a->set_scale(1, 100.1) || world.a->set_share(8, 0.25) ||
               world.a->set_share(3, 1.001));
  world.run(kSecond);
  ASSERT_EQ(world.z->requests.size(), 6U);
  EXPECT_EQ(std::get<SetScale>(world.z->requests[4]).position_scale, 0.5);
  EXPECT_EQ(std::get<SetScale>(world.z->requests[4]).force_scale, 2);
  EXPECT_EQ(std::get<SetShare>(world.z->requests[5]).channel, 3U);
  EXPECT_EQ(std::get<SetShare>(world.z->requests[5]).share, 0.25);
  EXPECT_TRUE(std::holds_alternative<Engage>(world.z->requests[2]));
  EXPECT_TRUE(std::holds_alternative<Disengage>(world.z->requests[3]));
  EXPECT_TRUE(std::holds_alternative<Disarm>(world.z->requests[0]));
  EXPECT_TRUE(std::holds_alternative<Rearm>(world.z->requests[1]));
  EXPECT_TRUE(world.z->forces.empty());
  World other(13);
  EXPECT_THROW(other.connect({.diagnostics = true, .operates = true}, [](const DeviceState&, const LinkStats&) {}),
               std::invalid_argument);
}

TEST(ForceClient, RefusesAnImpossibleConfigurationByFieldValueAndExpectation) {
  const auto complaint = [](const ForceClient::Config& config) {
    World world(27);
    return thrown_by([&] { world.connect(config, answer); });
  };
  EXPECT_EQ(complaint({}), "");
  EXPECT_EQ(complaint({.name = std::string(65, 'x')}), "name.size = 65: expected at most 64 bytes");
  EXPECT_EQ(complaint({.device = std::string(25, 'x')}), "device.size = 25: expected at most 24 bytes");
  EXPECT_EQ(complaint({.ways = std::vector<std::string>(9, "x")}), "ways.size = 9: expected at most 8 names");
  EXPECT_EQ(complaint({.ways = {"near", ""}}), "ways[1].size = 0: expected at least 1 byte");
  EXPECT_EQ(complaint({.ways = {std::string(25, 'x')}}), "ways[0].size = 25: expected at most 24 bytes");
  EXPECT_EQ(complaint({.ways = {"near", "linear", "near"}}), "ways[2] = \"near\": expected unique names");
  EXPECT_EQ(complaint({.rate_hz = -1}), "rate_hz = -1: expected 0, or 0.001 to 100000");
  EXPECT_EQ(complaint({.rate_hz = 1e-300}), "rate_hz = 1e-300: expected 0, or 0.001 to 100000");
  EXPECT_EQ(complaint({.rate_hz = std::nan("")}), "rate_hz = nan: expected 0, or 0.001 to 100000");
  EXPECT_EQ(complaint({.state_hz = 2'000'000}), "state_hz = 2e+06: expected 0 to 1000000");
  EXPECT_EQ(complaint({.valid_for = 11 * kSecond}), "valid_for_s = 11: expected 0 to 10");
  EXPECT_EQ(complaint({.deadband = Deadband::Config{.share = 2}}), "deadband.share = 2: expected 0 to 1");
  EXPECT_EQ(complaint({.state_deadband = SetStateDeadband{.share = 0.6, .max_silence = milliseconds(20)}}),
            "state_deadband.share: expected 0 to 0.5");
  EXPECT_EQ(complaint({.patience = Duration::zero()}), "patience_s = 0: expected a finite number above 0");
  EXPECT_EQ(complaint({.retry_min = Duration::zero()}), "retry_min_s = 0: expected a finite number above 0");
  EXPECT_EQ(complaint({.retry_max = milliseconds(1)}), "retry_max_s = 0.001: expected at least retry_min_s");
  EXPECT_EQ(complaint({.max_datagrams = 0}), "max_datagrams = 0: expected 1 or more");
}

/// The time stamp of a datagram is after the beginning of the turn, as for real sockets.
class LateLink : public Link {
 public:
  explicit LateLink(Link& link) : link_(link) {}
  void send(const Address& to, std::span<const std::byte> datagram) override { link_.send(to, datagram); }
  std::size_t receive(Address& from, std::span<std::byte> buffer) override { return link_.receive(from, buffer); }
  LocalTime present(LocalTime now) const override { return now + std::chrono::microseconds(34); }

 private:
  Link& link_;
};

TEST(ForceClient, AForceLeavesAtOnceThoughItsStateIsReadAfterTheTurnBegan) {
  World world(11, Weather{.loss = 0, .delay = milliseconds(5), .jitter = Duration::zero()});
  LateLink late(world.a_port);
  std::vector<LocalTime> computed;
  const Physics physics = [&](const DeviceState&) {
    computed.push_back(world.now);
    return Vec3(1, 0, 0);
  };
  world.a.emplace(late, a_and_z::z_address, ForceClient::Config{}, physics, world.now);
  world.run(milliseconds(500));
  ASSERT_GT(world.z->forces.size(), 300U);
  for (std::size_t i = 0; i < world.z->forces.size(); ++i) {
    EXPECT_EQ(world.z->forces[i].first - computed[i], milliseconds(5)) << i;
  }
}

TEST(ForceClient, AForceLeavesInTheTurnThatHasComputedIt) {
  World world(12, kFineWeather);
  int computed = 0;
  world.connect({}, [&](const DeviceState& hand) {
    ++computed;
    return answer(hand);
  });
  ASSERT_TRUE(world.run_until(Phase::kOpen, kSecond));
  world.run(kSecond);
  int answers = 0;
  for (int i = 0; i < 1000; ++i) {
    world.now += milliseconds(1);
    world.z->turn(world.now);
    const int sent_before = world.a_port.sent;
    const int computed_before = computed;
    const LocalTime next = world.a->turn(world.now);
    answers += computed - computed_before;
    EXPECT_EQ(world.a_port.sent - sent_before, computed - computed_before) << i;
    EXPECT_GT(next, world.now) << "a further turn at once would have nothing to do";
  }
  EXPECT_GT(answers, 900);
}

class ClockedLink : public Link {
 public:
  ClockedLink(Link& link, const LocalTime& clock) : link_(link), clock_(clock) {}
  void send(const Address& to, std::span<const std::byte> datagram) override { link_.send(to, datagram); }
  std::size_t receive(Address& from, std::span<std::byte> buffer) override { return link_.receive(from, buffer); }
  LocalTime present(LocalTime now) const override { return std::max(now, clock_); }

 private:
  Link& link_;
  const LocalTime& clock_;
};

TEST(ForceClient, ASlowEngineIsNoDelayOfTheNetwork) {
  World world(13, kFineWeather);
  ClockedLink link(world.a_port, world.now);
  const Physics slow = [&](const DeviceState&) {
    world.now += milliseconds(3);
    return Vec3(1, 0, 0);
  };
  world.a.emplace(link, a_and_z::z_address, ForceClient::Config{.rate_hz = 10}, slow, world.now);
  world.run(2 * kSecond);
  ASSERT_GT(world.z->forces.size(), 15U);
  EXPECT_EQ(world.z->link_stats().smoothed_round_trip, milliseconds(10)) << "there and back, without the engine";
}

}  // namespace
}  // namespace tendon::force_client_test
