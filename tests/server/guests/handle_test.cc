// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocol/wire/codec.h"
#include "tests/server/guests/sealed_server.h"

namespace tendon::handle_test {
namespace {

using std::chrono::milliseconds;

/// This is a device with four buttons and axes. The observer receives one of 20 states.
class Handle : public SealedServer {
 protected:
  Handle() {
    NetworkLoop::Config config;
    config.keys = {wall_, screen_};
    config.devices = {{.about = {.name = "left", .model = "device", .loop_hz = 1000, .channels = {{.name = "main"}}},
                       .handle = {.operator_from_device = Quat{.w = 0.5, .x = -0.5, .y = 0.5, .z = 0.5},
                                  .buttons = {"right", "forward", "centre", "left"}}}};
    restart(config);
  }

  Client slow_observer(std::vector<std::uint32_t>& seen, std::optional<SetStateDeadband> deadband = {}) {
    Client client{std::make_unique<End>(wire_, parse_address("192.0.2.2:4000")), nullptr};
    ForceClient::Config config = config_of(screen_, ++seed_);
    if (deadband) {
      config.state_deadband = deadband;
    } else {
      config.state_hz = 50;
    }
    client.client = std::make_unique<ForceClient>(
        *client.end, server_.self, config,
        [&seen](const DeviceState& state, const LinkStats&) { seen.push_back(state.buttons); }, now_);
    return client;
  }

  /// Runs for `ms` with a foreign observer that names `features`, and calls `see` with each state.
  template <class See>
  void for_each_state_seen(const std::vector<std::string>& features, int ms, const See& see) {
    End end(wire_, parse_address("127.0.0.1:4000"));
    ClientHandshake handshake({.hello = {.role = Role::kObserver, .name = "foreign", .features = features}}, now_);
    std::optional<Session> session;
    std::array<std::byte, kMaxDatagram> buffer;
    const auto say = [&](auto& mine) {
      while (const std::size_t size = mine.next_datagram(now_, buffer)) {
        deliver(end.self, Bytes(buffer.begin(), buffer.begin() + static_cast<int>(size)));
      }
    };
    for (int i = 0; i < ms; ++i) {
      session ? say(*session) : say(handshake);
      run(milliseconds(1), {});
      count_ = 0;
      for (const Datagram& datagram : std::exchange(wire_, {})) {
        session ? void(session->receive(now_, datagram.bytes)) : handshake.receive(now_, datagram.bytes);
      }
      if (!session && handshake.outcome()) {
        const auto& accepted = std::get<ClientHandshake::Accepted>(*handshake.outcome());
        EXPECT_EQ(accepted.welcome.features, features);
        session.emplace(Session::Config{.connection_id = accepted.connection_id}, now_);
      }
      while (const auto* const event = session ? session->next_event() : nullptr) {
        if (const auto* seen = std::get_if<Session::StateArrived>(event)) see(seen->state);
      }
    }
  }
};

TEST_F(Handle, APressBetweenTwoStatesIsInTheNextOneAndThenOver) {
  std::vector<std::uint32_t> seen;
  Client b = slow_observer(seen);
  run(milliseconds(505), {&b});
  for (int i = 0; i < 5; ++i) {
    seen.clear();
    buttons_ = 0b1000;
    run(milliseconds(3), {&b});
    buttons_ = 0;
    run(milliseconds(60), {&b});
    ASSERT_GE(seen.size(), 2U);
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 0b1000U), 1) << i;
    EXPECT_EQ(seen.back(), 0U);
  }
}

TEST_F(Handle, AChangeOfButtonsPassesADeadbandAtOnce) {
  std::vector<std::uint32_t> seen;
  Client b = slow_observer(seen, SetStateDeadband{.share = 0.1, .floor = 1e-3, .max_silence = milliseconds(20)});
  run(milliseconds(505), {&b});
  for (const std::uint32_t buttons : {1U, 3U, 0U}) {
    buttons_ = buttons;
    run(milliseconds(3), {&b});
    ASSERT_FALSE(seen.empty());
    EXPECT_EQ(seen.back(), buttons);
  }
}

TEST_F(Handle, IsDescribedToAClientOfOurs) {
  Client a = controller(wall_, "192.0.2.1:4000");
  run(milliseconds(500), {&a});
  const auto& about = a.client->handle();
  ASSERT_TRUE(about.has_value());
  EXPECT_EQ(about->operator_from_device, (Quat{.w = 0.5, .x = -0.5, .y = 0.5, .z = 0.5}));
  EXPECT_EQ(about->buttons, (std::vector<std::string>{"right", "forward", "centre", "left"}));
}

TEST_F(Handle, AForceOfTheHandThatNoFrameCarriesCostsNoState) {
  DeviceState seen;
  Client b{std::make_unique<End>(wire_, parse_address("192.0.2.2:4000")), nullptr};
  b.client = std::make_unique<ForceClient>(
      *b.end, server_.self, config_of(screen_, ++seed_),
      [&seen](const DeviceState& state, const LinkStats&) { seen = state; }, now_);
  look_.hand_force = Vec3(1, 2, 3);
  run(milliseconds(500), {&b});
  EXPECT_EQ(seen.hand_force, look_.hand_force);
  const std::uint64_t before = seen.tick;
  look_.hand_force->x() = std::numeric_limits<double>::quiet_NaN();
  run(milliseconds(100), {&b});
  EXPECT_GT(seen.tick, before + 50);
  EXPECT_EQ(seen.hand_force, std::nullopt);
}

TEST_F(Handle, TorqueAndGripForceReachTheLoopOfTheDevice) {
  look_.turning = Turning{.orientation = {.w = 0.6, .x = 0.8, .y = 0, .z = 0}};
  Client a{std::make_unique<End>(wire_, parse_address("192.0.2.1:4000")), nullptr};
  a.client = std::make_unique<ForceClient>(
      *a.end, server_.self, config_of(wall_, ++seed_),
      [](const DeviceState&) {
        Touch touch = Vec3(1, 0, 0);
        touch.torque = Vec3(0, 0, 0.1);
        touch.angular_stiffness = 0.2 * Mat3::Identity();
        touch.grip_force = -1.5;
        return touch;
      },
      now_);
  run(milliseconds(500), {&a});
  const RemoteForce* const force = mail_->forces[0].take();
  ASSERT_NE(force, nullptr);
  ASSERT_TRUE(force->torque && force->torque->model);
  EXPECT_EQ(force->torque->torque, Vec3(0, 0, 0.1));
  EXPECT_EQ(force->torque->model->at, look_.turning->orientation);
  EXPECT_EQ(force->torque->model->stiffness, Mat3(0.2 * Mat3::Identity()));
  EXPECT_EQ(force->grip_force, -1.5);
}

TEST_F(Handle, TorqueAndGripOfAClientWithoutTheFeatureAreIgnoredAndCounted) {
  for (const bool names : {false, true}) {
    restart({});
    if (names) foreign_.features.emplace_back(kFeatureHandle);
    run_foreign(milliseconds(500), [](ForceCommand& force) {
      force.torque.emplace().torque = Vec3(0, 0, 0.05);
      force.grip_force = 0.5;
    });
    const RemoteForce* const force = mail_->forces[0].take();
    ASSERT_NE(force, nullptr);
    EXPECT_EQ(force->force, Vec3(1, 0, 0)) << "the rest of it is rendered";
    EXPECT_EQ(force->torque.has_value(), names);
    EXPECT_EQ(force->grip_force.has_value(), names);
    EXPECT_EQ(loop_->stats().denied > 100, !names);
  }
}

TEST_F(Handle, IsSeenOnlyByThoseThatNamedTheFeature) {
  for (const bool names : {false, true}) {
    restart({});
    buttons_ = 1;
    look_.turning = Turning{.orientation = {.w = 0.6, .x = 0.8, .y = 0, .z = 0}, .angular_velocity = Vec3(0, 1, 0)};
    look_.torque_applied = Vec3(0, 0, 0.1);
    look_.grip = Grip{.opening = 0.2, .velocity = 0.3};
    look_.grip_applied = 1.5;
    look_.hand_force = Vec3(1, 2, 3);
    std::vector<std::string> features;
    if (names) features.emplace_back(kFeatureHandle);
    std::size_t states = 0;
    for_each_state_seen(features, 300, [&](const DeviceState& seen) {
      ++states;
      EXPECT_EQ(seen.buttons, names ? 1U : 0U);
      EXPECT_EQ(seen.turning, names ? look_.turning : std::nullopt);
      EXPECT_EQ(seen.torque_applied, names ? look_.torque_applied : std::nullopt);
      EXPECT_EQ(seen.grip, names ? look_.grip : std::nullopt);
      EXPECT_EQ(seen.grip_applied, names ? look_.grip_applied : std::nullopt);
      EXPECT_EQ(seen.hand_force, names ? look_.hand_force : std::nullopt);
    });
    EXPECT_GT(states, 100U);
  }
}

TEST_F(Handle, ColumnsAreSentOnlyToThoseThatNamedTheFeature) {
  for (const bool names : {false, true}) {
    restart({});
    look_.velocity = Vec3(0.1, 0.2, 0.3);
    DeviceState rounded = look_;
    round_to_columns(rounded);
    ASSERT_NE(rounded.velocity, look_.velocity);
    std::vector<std::string> features;
    if (names) features.emplace_back(kFeatureStateColumns);
    std::size_t states = 0;
    for_each_state_seen(features, 100, [&](const DeviceState& seen) {
      ++states;
      EXPECT_EQ(seen.position, look_.position);
      EXPECT_EQ(seen.velocity, names ? rounded.velocity : look_.velocity);
    });
    EXPECT_GT(states, 50U);
  }
}

/// Clients with the feature `joints` receive the joints and their names. For other clients, the size of the states is
/// the same as before.
TEST_F(Handle, JointsAreToldToThoseThatNamedTheFeature) {
  for (const bool asks : {false, true}) {
    NetworkLoop::Config config;
    config.keys = {wall_, screen_};
    config.devices = {{.about = {.name = "left", .model = "device", .loop_hz = 1000, .channels = {{.name = "main"}}},
                       .handle = {.buttons = {"right"}, .joints = {"upper", "lower"}}}};
    restart(config);
    look_.joints = Joints{.count = 2, .angle = {0.5, -0.25}, .velocity = {0.125, 2}};
    DeviceState seen;
    Client b{std::make_unique<End>(wire_, parse_address("192.0.2.2:4000")), nullptr};
    ForceClient::Config observer = config_of(screen_, ++seed_);
    observer.joints = asks;
    b.client = std::make_unique<ForceClient>(
        *b.end, server_.self, observer, [&seen](const DeviceState& state, const LinkStats&) { seen = state; }, now_);
    run(milliseconds(500), {&b});
    EXPECT_GT(seen.tick, 100U);
    EXPECT_EQ(seen.joints, asks ? look_.joints : std::nullopt);
    ASSERT_TRUE(b.client->handle().has_value());
    EXPECT_EQ(b.client->handle()->joints, asks ? config.devices[0].handle.joints : std::vector<std::string>{});

    const std::uint64_t before = seen.tick;
    look_.joints->velocity[1] = std::numeric_limits<double>::infinity();  // in a singular pose
    run(milliseconds(100), {&b});
    EXPECT_GT(seen.tick, before + 50) << "a number that no frame carries costs no state";
    EXPECT_EQ(seen.joints, std::nullopt);
  }
}

}  // namespace
}  // namespace tendon::handle_test
