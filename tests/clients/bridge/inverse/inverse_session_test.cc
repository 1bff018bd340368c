// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/inverse/inverse_session.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/clients/bridge/world.h"

namespace tendon::bridge::inverse_session_test {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;

/// Uniform in [0, 1). std::uniform_real_distribution may differ between standard libraries.
double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

struct Bridge {
  explicit Bridge(const std::string& scene, BridgedDevice::Config config = {}, const HandleDescription& handle = {})
      : world(scene, {}) {
    world.handle = handle;
    world.open_server();
    config.client.valid_for = InverseSession::kFresh;
    bridged = &world.add_bridged(std::move(config));
    const std::pair<std::string, BridgedDevice*> named("right", bridged);
    devices = inverse_devices({&named, 1});
    world.run(100);
  }

  std::unique_ptr<InverseSession> client() {
    return std::make_unique<InverseSession>(++clients, devices, counts, world.now);
  }
  std::string command(const std::string& commands) const {
    return R"({"inverse3":[{"device_id":")" + devices[0].id + R"(","commands":)" + commands + "}]}";
  }
  std::string force(const Vec3& f, const std::string& name = "vector") const {
    return command(R"({"set_cursor_force":{")" + name + R"(":{"x":)" + std::to_string(f.x()) +
                   ",\"y\":" + std::to_string(f.y()) + ",\"z\":" + std::to_string(f.z()) + "}}}");
  }
  json say(InverseSession& session, const std::string& message) const {
    const std::vector<std::string> replies = session.answer(world.now, {&message, 1});
    EXPECT_EQ(replies.size(), 1U);
    return json::parse(replies.at(0));
  }
  /// The client sends `message` each millisecond. Returns the last reply.
  json run(int ms, InverseSession& session, const std::string& message) {
    json last;
    world.run(ms, [&] {
      session.see(world.now);
      last = say(session, message);
    });
    return last;
  }

  World world;
  BridgedDevice* bridged = nullptr;
  std::vector<InverseDevice> devices;
  InverseCounts counts;
  BridgedDevice::Program clients = 0;
};

Vec3 xyz(const json& v) { return {v.at("x").get<double>(), v.at("y").get<double>(), v.at("z").get<double>()}; }
const json& arm(const json& reply) { return reply.at("inverse3").at(0).at("state"); }
const json& grip(const json& reply) { return reply.at("wireless_verse_grip").at(0).at("state"); }
const json& ours(const json& reply) { return reply.at("tendon").at("devices").at(0); }
const json& refused(const json& reply) { return reply.at("tendon").at("refused"); }

const std::string kProbe = R"({"inverse3":[{"device_id":"0","commands":{"probe_position":{}}}]})";

TEST(InverseSession, SpeaksFirstAndListsAGripEvenWhereNothingMeasuresIt) {
  Bridge bridge("demo_parts.toml");  // the Falcon measures no orientation
  const auto client = bridge.client();
  const json first = json::parse(client->greeting(bridge.world.now));
  EXPECT_EQ(first.at("session_id"), 1);
  EXPECT_EQ(first.at("inverse3").at(0).at("device_id"), bridge.devices[0].id);
  EXPECT_EQ(first.at("inverse3").at(0).at("config").at("type"), "inverse3");
  EXPECT_NEAR(xyz(arm(first).at("cursor_position")).x(), bridge.bridged->state()->position.x(), 1e-12);
  EXPECT_EQ(grip(first).at("orientation"), (json{{"w", 1.0}, {"x", 0.0}, {"y", 0.0}, {"z", 0.0}}));
  EXPECT_EQ(grip(first).at("buttons").at("a"), false);
  EXPECT_EQ(ours(first).at("name"), "right");
}

TEST(InverseSession, HundredThousandMessagesHaveExactlyOneReplyEach) {
  Bridge bridge("demo_parts.toml");
  const auto client = bridge.client();
  std::mt19937_64 random(221);
  const std::vector<std::string> kinds = {bridge.force(Vec3(0, 0.5, 0)), bridge.force(Vec3(0, 0.5, 0), "values"),
                                          kProbe, "nonsense", "{}"};
  std::size_t asked = 0;
  std::size_t answered = 0;
  std::uint64_t tick = 0;
  while (asked < 100000) {
    std::vector<std::string> batch(1 + random() % 64);
    for (std::string& message : batch) message = kinds[random() % kinds.size()];
    const auto replies = client->answer(bridge.world.now, batch);
    asked += batch.size();
    answered += replies.size();
    ASSERT_EQ(replies.size(), batch.size());
    const json last = json::parse(replies.back());
    ASSERT_GE(ours(last).at("tick").get<std::uint64_t>(), tick);
    tick = ours(last).at("tick").get<std::uint64_t>();
    ASSERT_EQ(tick, bridge.bridged->state()->tick) << "no reply is older than the newest state";
    bridge.world.run(1 + static_cast<int>(uniform(random) < 0.02 ? 200 * uniform(random) : 3 * uniform(random)));
  }
  EXPECT_EQ(answered, asked);
  EXPECT_EQ(bridge.counts.messages, asked);
  EXPECT_GT(bridge.counts.skipped, 0U);
}

TEST(InverseSession, OfTooManyMessagesTheOlderAreSkippedAndTheNewestIsTaken) {
  Bridge bridge("demo_parts.toml");
  const auto client = bridge.client();
  const int batch = 64;
  std::uint64_t messages = 0;
  double last = 0;
  bridge.world.run(1000, [&] {
    std::vector<std::string> all;
    for (int i = 0; i < batch; ++i)
      all.push_back(bridge.force(Vec3(0, 0, last = 1e-6 * static_cast<double>(++messages))));
    EXPECT_EQ(client->answer(bridge.world.now, all).size(), all.size());
  });
  const std::uint64_t read = messages - bridge.counts.skipped;
  EXPECT_NEAR(static_cast<double>(read), 4000 + 400, 50) << "4000 a second and what was saved up";
  bridge.world.run(2, [&] { client->see(bridge.world.now); });
  EXPECT_NEAR(bridge.world.step.wanted.y(), last, 1e-6) << "up is the device's y";
}

TEST(InverseSession, ASpinningClientSendsOneForceForEachState) {
  Bridge bridge("demo_parts.toml");
  const auto client = bridge.client();
  bridge.run(300, *client, bridge.force(Vec3(0, 0, 0.3)));
  const std::uint64_t before = bridge.bridged->forces();
  bridge.world.run(500, [&] {
    client->see(bridge.world.now);
    for (int i = 1; i <= 20; ++i) bridge.say(*client, bridge.force(Vec3(0, 0, 0.3 + 0.01 * i)));
  });
  EXPECT_LE(bridge.bridged->forces() - before, 501U);
  EXPECT_GE(bridge.bridged->forces() - before, 499U);
  EXPECT_NE(client->due(), LocalTime::max()) << "the newest one waits";
  bridge.world.run(2, [&] { client->see(bridge.world.now); });
  EXPECT_NEAR(bridge.world.step.wanted.y(), 0.5, 1e-9);
  EXPECT_EQ(client->due(), LocalTime::max());
  const std::uint64_t sent = bridge.bridged->forces();
  bridge.world.run(300, [&] { client->see(bridge.world.now); });
  EXPECT_EQ(bridge.bridged->forces(), sent) << "once";
}

TEST(InverseSession, PositionAndForceAreRightAlongEachAxis) {
  // WoodenHaptics' base frame is x forward, y left, z up. The hand moves along x, the client's y axis.
  HandleDescription handle;
  handle.operator_from_device = quaternion_of(operator_from_device("right=-y up=z user=-x"));
  Bridge bridge("demo_parts.toml", {}, handle);
  const auto client = bridge.client();
  const struct {
    Vec3 of_client;
    Vec3 of_device;
  } pushes[] = {{{1, 0, 0}, {0, -1, 0}}, {{0, 1, 0}, {1, 0, 0}}, {{0, 0, 1}, {0, 0, 1}}};
  for (const auto& push : pushes) {
    const json reply = bridge.run(300, *client, bridge.force(push.of_client));
    EXPECT_TRUE(bridge.world.step.wanted.isApprox(push.of_device, 1e-9)) << push.of_client.transpose();
    const Vec3 applied = bridge.world.step.applied;
    const Vec3 told = xyz(arm(reply).at("current_cursor_force"));
    EXPECT_NEAR(told.dot(push.of_client), applied.dot(push.of_device), 1e-3) << "what is really given out";
    const DeviceState& state = *bridge.bridged->state();
    EXPECT_NEAR(xyz(arm(reply).at("cursor_position")).y(), state.position.x(), 1e-12);
    EXPECT_NEAR(xyz(arm(reply).at("cursor_velocity")).y(), state.velocity.x(), 1e-12);
    EXPECT_NEAR(xyz(arm(reply).at("cursor_position")).z(), state.position.z(), 1e-12);
    EXPECT_EQ(arm(reply).at("control_mode"), "force_control");
  }
}

TEST(InverseSession, ABasisTurnsWhatIsSeenAndWhatIsAskedFor) {
  Bridge bridge("demo_parts.toml");
  const auto client = bridge.client();
  const json reply = bridge.say(*client, R"({"session":{"configure":{"basis":{"permutation":"-XZY"}},
                                             "force_render_full_state":{}}})");
  EXPECT_EQ(reply.at("inverse3").at(0).at("config").at("basis").at("permutation"), "-XZY");
  EXPECT_NEAR(xyz(arm(reply).at("cursor_position")).x(), -bridge.bridged->state()->position.x(), 1e-12);
  // the client's y axis is the service's z axis, which points up
  bridge.run(300, *client, bridge.force(Vec3(0, 0.25, 0)));
  EXPECT_TRUE(bridge.world.step.wanted.isApprox(Vec3(0, 0.25, 0), 1e-9)) << bridge.world.step.wanted.transpose();
  const auto other = bridge.client();
  EXPECT_NEAR(xyz(arm(bridge.say(*other, "{}")).at("cursor_position")).x(), bridge.bridged->state()->position.x(),
              1e-12)
      << "it is one client's own";
}

TEST(InverseSession, OrientationButtonsGripAndTorquePassBothWays) {
  HandleDescription handle;
  handle.orientation_measured = true;
  handle.max_torque = 0.2;
  handle.gripper_open = 0.5;
  handle.max_gripper_force = 3;
  Bridge bridge("handle.toml", {}, handle);
  const auto client = bridge.client();
  const std::string all = bridge.command(
      R"({"set_cursor_force":{"vector":{"x":0,"y":0,"z":0.1}},
          "tendon":{"torque_nm":{"x":0.01,"y":0.02,"z":0.03},"grip_force_n":0.4}})");
  json reply = bridge.run(900, *client, all);
  EXPECT_EQ(grip(reply).at("buttons").at("a"), false);
  EXPECT_EQ(refused(reply), json::array());
  // The service's y axis points forward (the operator's −z), its z axis points up (the operator's y).
  EXPECT_TRUE(bridge.world.step.handle->turn->wanted.isApprox(Vec3(0.01, 0.03, -0.02), 1e-9));
  EXPECT_NEAR(bridge.world.step.handle->grip->wanted, 0.4, 1e-9);
  EXPECT_TRUE(bridge.world.step.wanted.isApprox(Vec3(0, 0.1, 0), 1e-9));
  const DeviceState& state = *bridge.bridged->state();
  const Quat q = state.turning->orientation;
  const json& told = grip(reply).at("orientation");
  const Vec3 axis(told.at("x").get<double>(), told.at("y").get<double>(), told.at("z").get<double>());
  const double sign = told.at("w").get<double>() * q.w < 0 ? -1 : 1;
  EXPECT_TRUE((sign * axis).isApprox(Vec3(q.x, -q.z, q.y), 1e-9));
  EXPECT_GT(axis.norm(), 0.05) << "it has turned";
  EXPECT_TRUE(
      xyz(ours(reply).at("torque_nm"))
          .isApprox(Vec3(state.torque_applied->x(), -state.torque_applied->z(), state.torque_applied->y()), 1e-9));
  EXPECT_EQ(ours(reply).at("grip_rad"), state.grip->opening);
  EXPECT_EQ(ours(reply).at("grip_force_n"), *state.grip_applied);
  reply = bridge.run(200, *client, all);  // the button is pressed from 1000 to 1300 ms
  EXPECT_EQ(grip(reply).at("buttons").at("a"), true);
  EXPECT_EQ(grip(reply).at("buttons").at("button_0"), true);
  EXPECT_EQ(grip(reply).at("buttons").at("b"), false);
}

TEST(InverseSession, APressBetweenTwoRepliesIsInTheNextOneAndInNoLaterOne) {
  Bridge bridge("handle.toml");
  const auto client = bridge.client();
  const auto held = [&] { return grip(bridge.say(*client, kProbe)).at("buttons").at("a").get<bool>(); };
  bridge.world.run(1800, [&] { client->see(bridge.world.now); });
  EXPECT_TRUE(held());
  EXPECT_FALSE(held());
  bridge.world.run(500, [&] { client->see(bridge.world.now); });
  EXPECT_TRUE(held());
  EXPECT_FALSE(held());
}

TEST(InverseSession, ATorqueForADeviceThatCannotTurnIsRefusedInASentence) {
  Bridge bridge("demo_parts.toml");
  const auto client = bridge.client();
  const json reply = bridge.say(*client, bridge.command(R"({"tendon":{"torque_nm":{"x":0,"y":0,"z":1}}})"));
  ASSERT_EQ(refused(reply).size(), 1U);
  EXPECT_EQ(refused(reply)[0], "right: the device has no motors for rotation");
}

TEST(InverseSession, AForceIsValidFor100MsAndOtherMessagesDoNotKeepItAlive) {
  Bridge bridge("demo_parts.toml");
  const auto client = bridge.client();
  bridge.run(300, *client, bridge.force(Vec3(0, 0, 0.5)));
  bridge.world.run(100);
  EXPECT_NEAR(bridge.world.step.applied.y(), 0.5, 1e-6) << "a client at 10 Hz is not let go between two messages";
  bridge.run(400, *client, kProbe);
  EXPECT_EQ(bridge.world.step.applied.y(), 0);
  bridge.run(300, *client, bridge.force(Vec3(0, 0, 0.5)));
  bridge.run(400, *client, "nonsense");
  EXPECT_EQ(bridge.world.step.applied.y(), 0);
}

TEST(InverseSession, ASecondClientThatAsksForAForceIsToldAndTheFirstKeepsIt) {
  Bridge bridge("demo_parts.toml");
  const auto first = bridge.client();
  auto second = bridge.client();
  json told;
  bridge.world.run(300, [&] {
    EXPECT_EQ(refused(bridge.say(*first, bridge.force(Vec3(0, 0, 0.5)))), json::array());
    told = bridge.say(*second, bridge.force(Vec3(0, 0, -0.5)));
    ASSERT_EQ(refused(told).size(), 1U);
  });
  EXPECT_NE(refused(told)[0].get<std::string>().find("another client controls the force"), std::string::npos);
  EXPECT_EQ(ours(told).at("tick"), bridge.bridged->state()->tick) << "it is answered all the same";
  EXPECT_GT(bridge.world.step.applied.y(), 0);
  second.reset();
  EXPECT_EQ(bridge.bridged->owner(), 1U) << "only the owner lets go";
}

TEST(InverseSession, AForceOfZeroClaimsNothingAndCountsFromTheOwner) {
  Bridge bridge("demo_parts.toml");
  const auto reader = bridge.client();
  const auto engine = bridge.client();
  bridge.run(300, *reader, bridge.force(Vec3::Zero(), "values"));
  EXPECT_EQ(bridge.bridged->owner(), 0U) << "tutorials send zeros to be answered";
  EXPECT_FALSE(bridge.bridged->pushes());
  bridge.world.run(300, [&] {
    EXPECT_EQ(refused(bridge.say(*engine, bridge.force(Vec3(0, 0, 0.5)))), json::array());
    EXPECT_EQ(refused(bridge.say(*reader, bridge.force(Vec3::Zero()))), json::array());
  });
  EXPECT_NEAR(bridge.world.step.applied.y(), 0.5, 1e-6);
  bridge.run(3000, *engine, bridge.force(Vec3::Zero()));
  EXPECT_EQ(bridge.bridged->owner(), 2U) << "a hand in free space for 3 s is still the engine's";
  EXPECT_EQ(bridge.world.step.wanted.y(), 0);
}

TEST(InverseSession, AStallIsSeenAsTheAgeOfTheState) {
  Bridge bridge("demo_parts.toml");
  const auto client = bridge.client();
  const std::string force = bridge.force(Vec3(0, 0, 0.5));
  bridge.run(500, *client, force);
  bridge.world.connected = false;
  json reply = bridge.run(200, *client, force);
  EXPECT_NEAR(ours(reply).at("state_age_ms").get<double>(), 200, 3);
  bridge.world.connected = true;
  reply = bridge.run(300, *client, force);
  EXPECT_LT(ours(reply).at("state_age_ms").get<double>(), 2);
}

TEST(InverseSession, ThatOnlyLooksOnSaysSo) {
  Bridge bridge("demo_parts.toml", {.observe = true});
  const auto client = bridge.client();
  const json reply = bridge.run(300, *client, bridge.force(Vec3(0, 0, 0.5)));
  ASSERT_EQ(refused(reply).size(), 1U);
  EXPECT_EQ(bridge.world.step.wanted.y(), 0);
}

TEST(InverseSession, AnUnknownDeviceIsRefusedInASentence) {
  Bridge bridge("demo_parts.toml");
  const auto client = bridge.client();
  const json reply = bridge.say(*client, kProbe);
  ASSERT_EQ(refused(reply).size(), 1U);
  EXPECT_EQ(refused(reply)[0].get<std::string>().rfind("device_id: ", 0), 0U);
}

TEST(InverseSession, TheLimiterIsSeenInOurOwnWords) {
  Bridge bridge("demo_parts.toml");
  const auto client = bridge.client();
  const json reply = bridge.run(500, *client, bridge.force(Vec3(0, 0, 9)));
  const json& told = ours(reply);
  EXPECT_EQ(told.at("tick"), bridge.bridged->state()->tick);
  EXPECT_EQ(told.at("energy_j"), bridge.bridged->state()->energy);
  EXPECT_EQ(told.at("permitted_force_n"), bridge.bridged->state()->permitted_force);
  EXPECT_NE(told.at("reasons").get<std::string>().find("energy"), std::string::npos);
  EXPECT_LE(told.at("force_age_ms").get<double>(), 2);
  EXPECT_LT(xyz(arm(reply).at("current_cursor_force")).z(), 9);
}

TEST(InverseSession, DevicesOfOneNameHaveIdsOfTheirOwn) {
  Bridge bridge("demo_parts.toml");
  const std::vector<std::pair<std::string, BridgedDevice*>> twins(3, {"right", bridge.bridged});
  const auto devices = inverse_devices(twins);
  std::vector<std::string> ids;
  for (const InverseDevice& device : devices) {
    ids.push_back(device.id);
    ids.push_back(device.grip_id);
  }
  std::ranges::sort(ids);
  EXPECT_EQ(std::ranges::adjacent_find(ids), ids.end());
}

}  // namespace
}  // namespace tendon::bridge::inverse_session_test
