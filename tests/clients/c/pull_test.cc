// SPDX-License-Identifier: Apache-2.0
// libtendon.so.1 with a server on a thread of this test.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "clients/c/sized.h"
#include "clients/c/tendon.h"
#include "clients/cpp/machine.h"
#include "tests/clients/cpp/server_thread.h"

namespace tendon::pull_test {
namespace {

using a_and_z::ServerThread;
using Closing = std::unique_ptr<tendon_client, decltype(&tendon_close)>;

constexpr std::int64_t kMillisecond = 1'000'000;
constexpr std::int64_t kPatience = 20'000 * kMillisecond;  // machines pause

template <class Struct>
Struct sized() {
  Struct one{};
  one.size = sizeof one;
  return one;
}

struct Opened {
  Closing client;
  std::string why;
};

Opened try_open(const tendon_config* config) {
  char why[300] = "not set";
  tendon_client* const client = tendon_open(config, why, sizeof why);
  return {Closing(client, &tendon_close), why};
}

/// Fails if the server does not answer. `change` may change the config.
template <class Change>
Closing open(const Address& server, Change change) {
  const std::string name = to_string(server);
  auto config = sized<tendon_config>();
  config.server = name.c_str();
  config.open_timeout_ns = kPatience;
  change(config);
  Opened opened = try_open(&config);
  EXPECT_NE(opened.client, nullptr) << opened.why;
  return std::move(opened.client);
}
Closing open(const Address& server) {
  return open(server, [](tendon_config&) {});
}

tendon_state wait(const Closing& client) {
  auto state = sized<tendon_state>();
  EXPECT_EQ(tendon_wait(client.get(), &state, kPatience), TENDON_OK) << tendon_why(client.get());
  return state;
}

tendon_force answer_to(const tendon_state& state) {
  auto force = sized<tendon_force>();
  force.tick = state.tick;
  force.force[0] = -100 * state.position[0];
  return force;
}

TEST(CAbi, EachStateIsReturnedOnceAndItsForceNamesIt) {
  ServerThread server;
  const Closing client = open(server.address());
  std::uint64_t before = 0;
  std::vector<std::uint64_t> ticks;
  for (int i = 0; i < 50; ++i) {
    const tendon_state state = wait(client);
    EXPECT_GT(state.tick, before);
    EXPECT_EQ(state.size, sizeof state);
    EXPECT_EQ(state.has, 0U);
    const Vec3 expected = a_and_z::Server::position(state.tick);
    EXPECT_EQ(Vec3(state.position[0], state.position[1], state.position[2]), expected);
    before = state.tick;
    ticks.push_back(before);
    const tendon_force force = answer_to(state);
    EXPECT_EQ(tendon_send(client.get(), &force), TENDON_OK) << tendon_why(client.get());
  }
  auto counts = sized<tendon_counts>();
  EXPECT_EQ(tendon_count(client.get(), &counts), TENDON_OK);
  EXPECT_EQ(counts.forces, 50U);
  EXPECT_GE(counts.states, 50U);
  EXPECT_EQ(counts.connected, 1U);
  EXPECT_EQ(counts.holds, 1U);
  EXPECT_EQ(counts.sessions, 1U);
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  server.with([&](a_and_z::Server& z, LocalTime) {
    ASSERT_FALSE(z.forces.empty());
    for (const auto& [at, command] : z.forces) {
      EXPECT_NE(std::ranges::find(ticks, command.based_on_tick), ticks.end());
      EXPECT_EQ(command.force.x(), -100 * a_and_z::Server::position(command.based_on_tick).x());
    }
    EXPECT_EQ(z.forces.back().second.based_on_tick, before);
  });
}

TEST(CAbi, AllPartsOfAForceArrive) {
  ServerThread server;
  server.with([](a_and_z::Server& z, LocalTime) {
    z.turning = Turning{.orientation = {.w = 0, .x = 1, .y = 0, .z = 0}, .angular_velocity = Vec3(1, 2, 3)};
  });
  const Closing client = open(server.address());
  const tendon_state state = wait(client);
  EXPECT_EQ(state.has, static_cast<std::uint32_t>(TENDON_STATE_TURNING));
  EXPECT_EQ(state.orientation[1], 1);
  EXPECT_EQ(state.angular_velocity[2], 3);
  tendon_force force = answer_to(state);
  force.has = 255;
  for (int i = 0; i < 9; ++i) force.stiffness[i] = i + 1;
  force.valid_radius = 0.5;
  force.normal[1] = 1;
  force.gap = -0.25;
  force.torque[2] = 4;
  for (int i = 0; i < 9; ++i) force.angular_stiffness[i] = 10 + i;
  force.grip_force = 5;
  force.valid_for_ns = 33 * kMillisecond;
  EXPECT_EQ(tendon_send(client.get(), &force), TENDON_OK) << tendon_why(client.get());
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  server.with([](a_and_z::Server& z, LocalTime) {
    ASSERT_FALSE(z.forces.empty());
    const ForceCommand& command = z.forces.back().second;
    EXPECT_EQ(command.model->stiffness(0, 1), 2) << "row by row";
    EXPECT_EQ(command.model->stiffness(2, 0), 7);
    EXPECT_EQ(command.model->valid_radius, 0.5);
    EXPECT_EQ(command.model->contact->normal, Vec3::UnitY());
    EXPECT_EQ(command.model->contact->gap, -0.25);
    EXPECT_EQ(command.torque->torque.z(), 4);
    EXPECT_EQ(command.torque->model->stiffness(1, 0), 13);
    EXPECT_EQ(command.grip_force, 5);
    EXPECT_EQ(command.valid_for, std::chrono::milliseconds(33));
    EXPECT_TRUE(command.topology_changed);
  });
}

TEST(CAbi, APressIsNotLostBetweenTwoWaits) {
  ServerThread server;
  const Closing client = open(server.address());
  wait(client);
  server.with([](a_and_z::Server& z, LocalTime) { z.press_every = 100; });
  int pressed = 0;
  std::uint64_t first = 0;
  std::uint64_t last = 0;
  for (int i = 0; i < 20; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(25));
    const tendon_state state = wait(client);
    if (first == 0) first = state.tick;
    last = state.tick;
    pressed += state.buttons == 2 ? 1 : 0;
    // Sending receives states, too.
    const tendon_force force = answer_to(state);
    for (int j = 0; j < 3; ++j) EXPECT_EQ(tendon_send(client.get(), &force), TENDON_OK) << tendon_why(client.get());
  }
  EXPECT_GE(pressed, static_cast<int>((last - first) / 100)) << "one for each 100 ticks, in more than 100 ticks";
  auto counts = sized<tendon_counts>();
  tendon_count(client.get(), &counts);
  EXPECT_GE(counts.states_skipped, (last - first) / 2);
}

TEST(CAbi, AWaitEndsAtItsTimeout) {
  ServerThread server;
  const Closing client = open(server.address(), [](tendon_config& config) { config.rate_hz = 2; });
  wait(client);
  auto state = sized<tendon_state>();
  EXPECT_EQ(tendon_wait(client.get(), &state, 0), TENDON_TIMEOUT);
  const LocalTime before = read_clock();
  EXPECT_EQ(tendon_wait(client.get(), &state, 30 * kMillisecond), TENDON_TIMEOUT);
  const Duration took = read_clock() - before;
  EXPECT_GE(took, std::chrono::milliseconds(30));
  EXPECT_LT(took, std::chrono::milliseconds(400)) << "at 2 Hz, the next state would be due after 500 ms";
  EXPECT_STREQ(tendon_why(client.get()), "nothing has happened within the timeout");
  EXPECT_EQ(tendon_wait(client.get(), &state, -1), TENDON_OK) << "a negative timeout does not end";
}

TEST(CAbi, APollingClientReceivesTheSameStates) {
  ServerThread server;
  const Closing client = open(server.address(), [](tendon_config& config) { config.flags = TENDON_POLL; });
  for (int i = 0; i < 20; ++i) {
    const tendon_state state = wait(client);
    const tendon_force force = answer_to(state);
    EXPECT_EQ(tendon_send(client.get(), &force), TENDON_OK);
  }
  EXPECT_GE(server.forces(), 15U);
}

TEST(CAbi, AnObserverReceivesStatesAndSendsNoForces) {
  ServerThread server;
  const Closing client = open(server.address(), [](tendon_config& config) { config.flags = TENDON_OBSERVE; });
  const tendon_force force = answer_to(wait(client));
  EXPECT_EQ(tendon_send(client.get(), &force), TENDON_BAD);
  EXPECT_STREQ(tendon_why(client.get()), "an observer cannot send forces");
  server.with([](a_and_z::Server& z, LocalTime) { EXPECT_EQ(z.hellos.back().role, Role::kObserver); });
}

TEST(CAbi, AClientSaysOnceThatItsSessionHasEndedAndReconnects) {
  auto server = std::make_unique<ServerThread>();
  const Address address = server->address();
  const Closing client = open(address);
  tendon_force old = answer_to(wait(client));
  while (old.tick < 1000) old = answer_to(wait(client));
  server->with([](a_and_z::Server& z, LocalTime now) { z.say_bye(now, Code::kShutdown); });
  auto state = sized<tendon_state>();
  int result = TENDON_OK;
  while (result == TENDON_OK) result = tendon_wait(client.get(), &state, kPatience);
  EXPECT_EQ(result, TENDON_LOST);
  EXPECT_EQ(tendon_why(client.get()), "lost " + to_string(address) + ": Z closes");
  EXPECT_EQ(tendon_send(client.get(), &old), TENDON_LOST);
  server.reset();
  EXPECT_EQ(tendon_wait(client.get(), &state, kMillisecond), TENDON_LOST) << "still no session";
  ServerThread again(address);
  result = TENDON_LOST;
  for (int i = 0; i < 1000 && result != TENDON_OK; ++i) result = tendon_wait(client.get(), &state, 20 * kMillisecond);
  EXPECT_EQ(result, TENDON_OK) << tendon_why(client.get());
  EXPECT_EQ(tendon_send(client.get(), &old), TENDON_LOST) << "it answers a state of the first session";
  const tendon_force force = answer_to(state);
  EXPECT_EQ(tendon_send(client.get(), &force), TENDON_OK) << tendon_why(client.get());
  auto counts = sized<tendon_counts>();
  tendon_count(client.get(), &counts);
  EXPECT_EQ(counts.sessions, 2U);
}

TEST(CAbi, AReplacedClientIsToldThatThisIsFinal) {
  ServerThread server;
  const Closing client = open(server.address());
  wait(client);
  server.with([](a_and_z::Server& z, LocalTime now) { z.say_bye(now, Code::kReplaced); });
  auto state = sized<tendon_state>();
  int result = TENDON_OK;
  while (result == TENDON_OK) result = tendon_wait(client.get(), &state, kPatience);
  EXPECT_EQ(result, TENDON_ENDED);
  EXPECT_EQ(tendon_why(client.get()), to_string(server.address()) + " has ended the session: Z closes");
  EXPECT_EQ(tendon_wait(client.get(), &state, 0), TENDON_ENDED);
}

TEST(CAbi, OpeningSaysWhyItFails) {
  ServerThread server;
  server.with([](a_and_z::Server& z, LocalTime) {
    z.refusal = Refused{.code = Code::kDenied, .detail = "not\x1b you", .version_min = 1, .version_max = 1};
  });
  const std::string name = to_string(server.address());
  auto config = sized<tendon_config>();
  config.server = name.c_str();
  EXPECT_EQ(try_open(&config).why, name + " refused the connection: not\\x1b you");
  server.with([](a_and_z::Server& z, LocalTime) { z.refusal->code = Code::kBusy; });
  config.open_timeout_ns = 300 * kMillisecond;
  EXPECT_EQ(try_open(&config).why, name + " refused the connection: not\\x1b you");
  config.server = "127.0.0.1:9";
  config.open_timeout_ns = 2500 * kMillisecond;
  EXPECT_EQ(try_open(&config).why, "no answer from 127.0.0.1:9; is tendond running there?");
  config.open_timeout_ns = -1;
  EXPECT_NE(try_open(&config).client, nullptr) << "the server may start later";
}

TEST(CAbi, AWrongConfigIsRefusedWithTheNameOfItsMember) {
  const auto why = [](auto change) {
    auto config = sized<tendon_config>();
    config.server = "127.0.0.1:9";
    config.open_timeout_ns = 1;
    change(config);
    const Opened opened = try_open(&config);
    EXPECT_EQ(opened.client, nullptr);
    return opened.why;
  };
  EXPECT_EQ(try_open(nullptr).why, "config = NULL: expected a struct");
  EXPECT_EQ(why([](tendon_config& c) { c.size = 0; }), "config.size = 0: expected sizeof, 80 or more");
  EXPECT_EQ(why([](tendon_config& c) { c.size = 1U << 31U; }), "config.size = 2147483648: expected sizeof, 80 or more");
  EXPECT_EQ(why([](tendon_config& c) { c.flags = 9; }),
            "config.flags = 9: bits 8 are not known by this library (TENDON_ABI 1)");
  EXPECT_EQ(why([](tendon_config& c) { c.reserved = 1; }), "config.reserved: expected 0");
  EXPECT_EQ(why([](tendon_config& c) { c.server = nullptr; }), "config.server = NULL: expected \"HOST:PORT\"");
  EXPECT_NE(why([](tendon_config& c) { c.server = "nonsense"; }).find("nonsense"), std::string::npos);
  EXPECT_NE(why([](tendon_config& c) { c.key_file = "/nowhere.key"; }).find("/nowhere.key"), std::string::npos);
  EXPECT_NE(why([](tendon_config& c) { c.rate_hz = -1; }).find("rate_hz = -1: expected"), std::string::npos);
  EXPECT_NE(why([](tendon_config& c) { c.valid_for_ns = 11'000 * kMillisecond; }).find("valid_for_s = 11"),
            std::string::npos);
  const std::string long_name(65, 'x');
  EXPECT_NE(why([&](tendon_config& c) { c.name = long_name.c_str(); }).find("name.size = 65"), std::string::npos);
  auto config = sized<tendon_config>();
  char small[8];
  EXPECT_EQ(tendon_open(&config, small, sizeof small), nullptr);
  EXPECT_STREQ(small, "config.");
  EXPECT_EQ(tendon_open(&config, nullptr, 0), nullptr);
}

TEST(CAbi, AWrongForceIsRefusedAndNotSent) {
  ServerThread server;
  const Closing client = open(server.address());
  const tendon_state state = wait(client);
  const auto why = [&](auto change) {
    tendon_force force = answer_to(state);
    change(force);
    EXPECT_EQ(tendon_send(client.get(), &force), TENDON_BAD);
    return std::string(tendon_why(client.get()));
  };
  EXPECT_EQ(why([](tendon_force& f) { f.size = 40; }), "force.size = 40: expected sizeof, 264 or more");
  EXPECT_EQ(why([](tendon_force& f) { f.size = 4097; }), "force.size = 4097: expected sizeof, 264 or more");
  EXPECT_EQ(why([](tendon_force& f) { f.has = 256; }),
            "force.has = 256: bits 256 are not known by this library (TENDON_ABI 1)");
  EXPECT_EQ(why([](tendon_force& f) { f.tick += 1000; }),
            "force.tick = " + std::to_string(state.tick + 1000) + ": expected the tick of one of the last 32 states");
  EXPECT_EQ(why([](tendon_force& f) { f.force[1] = std::nan(""); }),
            "force: the force is not finite (NaN or infinity)");
  EXPECT_EQ(why([](tendon_force& f) { f.force[1] = 1e13; }), "force: the force exceeds 1e12 N");
  EXPECT_NE(why([](tendon_force& f) {
              f.has = TENDON_FORCE_STIFFNESS;
              f.stiffness[4] = std::numeric_limits<double>::infinity();
            }).find("stiffness"),
            std::string::npos);
  EXPECT_EQ(tendon_send(client.get(), nullptr), TENDON_BAD);
  EXPECT_EQ(tendon_send(nullptr, nullptr), TENDON_BAD);
  const tendon_force newer = answer_to(wait(client));
  EXPECT_EQ(tendon_send(client.get(), &newer), TENDON_OK);
  EXPECT_EQ(why([](tendon_force&) {}), "force.tick = " + std::to_string(state.tick) + ": a newer state was answered");
  EXPECT_LE(server.forces(), 1U);
}

TEST(CAbi, OtherWrongArgumentsAreRefused) {
  ServerThread server;
  const Closing client = open(server.address());
  auto state = sized<tendon_state>();
  state.size = 8;
  state.tick = 77;
  EXPECT_EQ(tendon_wait(client.get(), &state, kPatience), TENDON_BAD);
  EXPECT_STREQ(tendon_why(client.get()), "state.size = 8: expected sizeof, 232 or more");
  EXPECT_EQ(state.tick, 77U) << "nothing was written";
  EXPECT_EQ(tendon_wait(client.get(), nullptr, 0), TENDON_BAD);
  EXPECT_EQ(tendon_wait(nullptr, &state, 0), TENDON_BAD);
  EXPECT_STREQ(tendon_why(nullptr), "client = NULL");
  auto order = sized<tendon_order>();
  EXPECT_EQ(tendon_request(client.get(), &order, 0), TENDON_BAD);
  EXPECT_STREQ(tendon_why(client.get()), "order.what = 0: expected TENDON_REARM or another");
  order.what = TENDON_SET_SCALE;
  EXPECT_EQ(tendon_request(client.get(), &order, kPatience), TENDON_BAD) << "a scale of 0";
  auto description = sized<tendon_description>();
  description.size = 10;
  EXPECT_EQ(tendon_describe(client.get(), &description, 0), TENDON_BAD);
  auto counts = sized<tendon_counts>();
  counts.size = 0;
  EXPECT_EQ(tendon_count(client.get(), &counts), TENDON_BAD);
  tendon_close(nullptr);
}

TEST(CAbi, RequestsWaitForTheirAnswers) {
  ServerThread server;
  const Closing client = open(server.address());
  wait(client);
  auto order = sized<tendon_order>();
  order.what = TENDON_DISARM;
  EXPECT_EQ(tendon_request(client.get(), &order, kPatience), TENDON_OK) << tendon_why(client.get());
  order.what = TENDON_SET_SCALE;
  order.value[0] = 2;
  order.value[1] = 0.5;
  EXPECT_EQ(tendon_request(client.get(), &order, kPatience), TENDON_OK) << tendon_why(client.get());
  server.with([](a_and_z::Server& z, LocalTime) {
    ASSERT_EQ(z.requests.size(), 2U);
    EXPECT_TRUE(std::holds_alternative<Disarm>(z.requests[0]));
    EXPECT_EQ(std::get<SetScale>(z.requests[1]).force_scale, 0.5);
    z.fields.reset();
    z.lease_answers = {Code::kBusy};
  });
  order.what = TENDON_GIVE;
  EXPECT_EQ(tendon_request(client.get(), &order, kPatience), TENDON_OK) << tendon_why(client.get());
  auto state = sized<tendon_state>();
  int result = TENDON_OK;  // for the states that have arrived before
  while (result == TENDON_OK) result = tendon_wait(client.get(), &state, 20 * kMillisecond);
  EXPECT_EQ(result, TENDON_BUSY);
  order.what = TENDON_TAKE;
  EXPECT_EQ(tendon_request(client.get(), &order, 100 * kMillisecond), TENDON_BUSY) << tendon_why(client.get());
  EXPECT_EQ(tendon_request(client.get(), &order, kPatience), TENDON_OK) << tendon_why(client.get());
  const tendon_force force = answer_to(wait(client));
  EXPECT_EQ(tendon_send(client.get(), &force), TENDON_OK);
  auto description = sized<tendon_description>();
  EXPECT_EQ(tendon_describe(client.get(), &description, 20 * kMillisecond), TENDON_TIMEOUT) << "Z does not describe";
}

TEST(CAbi, ALargerStructIsFilledAsFarAsTheLibraryKnows) {
  ServerThread server;
  const Closing client = open(server.address());
  struct {
    tendon_state known{};
    double later = 7;
  } newer;
  newer.known.size = sizeof newer;
  EXPECT_EQ(tendon_wait(client.get(), &newer.known, kPatience), TENDON_OK);
  EXPECT_EQ(newer.known.size, sizeof(tendon_state)) << "what was filled";
  EXPECT_EQ(newer.later, 7);
  EXPECT_EQ(tendon_wait(client.get(), &newer.known, kPatience), TENDON_OK);
}

TEST(CAbi, TheFirstSizesAreTheSizesOfThisHeaderUntilItGrows) {
  EXPECT_LE(first_size(static_cast<tendon_config*>(nullptr)), sizeof(tendon_config));
  EXPECT_LE(first_size(static_cast<tendon_state*>(nullptr)), sizeof(tendon_state));
  EXPECT_EQ(TENDON_ABI, tendon_abi());
  EXPECT_EQ(sizeof(tendon_config), 80U);
  EXPECT_EQ(sizeof(tendon_state), 232U);
  EXPECT_EQ(sizeof(tendon_force), 264U);
  EXPECT_EQ(sizeof(tendon_order), 24U);
  EXPECT_EQ(sizeof(tendon_description), 264U);
  EXPECT_EQ(sizeof(tendon_counts), 80U);
}

}  // namespace
}  // namespace tendon::pull_test
