// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/chai3d/host.h"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "tests/clients/bridge/world.h"

namespace tendon::bridge::chai3d::host_test {
namespace {

struct Theatre {
  explicit Theatre(const std::string& scene, const std::vector<std::string>& settings = {}, Quat lies = {1, 0, 0, 0},
                   double max_torque = 0)
      : world(scene, settings) {
    world.handle.operator_from_device = lies;
    world.handle.max_torque = max_torque;
    world.kill_server();
    world.open_server();
    hands->devices = 1;
  }

  void run(int milliseconds) {
    world.run(milliseconds, [&] {
      if (asks) {
        asked.at_ns = std::chrono::nanoseconds(world.now.time_since_epoch()).count();
        ++asked.count;
        asked.open = 1;
        hands->device[0].asked.put(asked);
      }
      host.exchange(0, bridged, world.now);
      host.announce();
      hands->device[0].hand.get(hand);
    });
  }

  World world;
  BridgedDevice& bridged = world.add_bridged();
  std::unique_ptr<SharedHands> hands = std::make_unique<SharedHands>();
  Host host{*hands, {}};
  bool asks = false;
  Asked asked;
  HandNow hand;
};

// WoodenHaptics' base frame is x forward, y left, z up. CHAI3D's is x to the user, y right, z up.
const Quat kWooden = quaternion_of(operator_from_device("right=-y up=z user=-x"));
const std::vector<std::string> kDirections = {"[1, 0, 0]", "[0, 1, 0]", "[0, 0, 1]"};
const std::vector<Vec3> kSeen = {Vec3(-1, 0, 0), Vec3(0, -1, 0), Vec3(0, 0, 1)};

TEST(Chai3dHost, AHandThatMovesAlongEachAxisIsSeenOnChai3dsOwn) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Theatre theatre("demo_parts.toml", {"device.hand.motion.direction=" + kDirections[axis]}, kWooden);
    theatre.run(500);
    const Vec3 seen(theatre.hand.position.data());
    EXPECT_GT(seen.dot(kSeen[axis]), 0.010) << axis;
    EXPECT_LT((seen - seen.dot(kSeen[axis]) * kSeen[axis]).norm(), 0.001) << axis;
  }
}

TEST(Chai3dHost, AForceAlongEachOfChai3dsAxesPushesTheRightWay) {
  for (int axis = 0; axis < 3; ++axis) {
    Theatre theatre("demo_parts.toml", {}, kWooden);
    theatre.asks = true;
    theatre.asked.force[static_cast<std::size_t>(axis)] = 1;
    theatre.run(200);
    for (int of_base = 0; of_base < 3; ++of_base) {
      EXPECT_NEAR(theatre.world.step.wanted[of_base], kSeen[static_cast<std::size_t>(of_base)][axis], 1e-9)
          << axis << " → " << of_base;
    }
  }
}

TEST(Chai3dHost, ButtonsAndTheTurnOfTheStylusArrive) {
  Theatre theatre("handle.toml");
  bool turned = false;
  bool pressed = false;
  for (int i = 0; i < 100; ++i) {
    theatre.run(100);
    const double trace = theatre.hand.rotation[0] + theatre.hand.rotation[4] + theatre.hand.rotation[8];
    turned = turned || trace < 2.99;
    pressed = pressed || theatre.hand.buttons != 0;
  }
  EXPECT_TRUE(turned);
  EXPECT_TRUE(pressed);
}

TEST(Chai3dHost, ATorqueGoesToADeviceThatHasMotorsForIt) {
  for (const double most : {0.0, 0.2}) {
    Theatre theatre("peg.toml", {}, {1, 0, 0, 0}, most);
    theatre.asks = true;
    theatre.asked.torque = {0, 0, 0.01};  // about CHAI3D's vertical z axis
    theatre.run(600);
    ASSERT_TRUE(theatre.bridged.state());
    ASSERT_TRUE(theatre.bridged.state()->torque_applied);
    EXPECT_EQ(theatre.bridged.state()->torque_applied->y() > 0.005, most > 0) << "up is y for the operator";
  }
}

TEST(Chai3dHost, AForceThatIsReadLateIsOldAndNotSent) {
  Theatre theatre("demo_parts.toml");
  theatre.run(200);
  theatre.asked = {.at_ns = std::chrono::nanoseconds(theatre.world.now.time_since_epoch()).count(),
                   .count = 1,
                   .open = 1,
                   .force = {0, 0, 0.5}};
  theatre.world.run(60);
  theatre.hands->device[0].asked.put(theatre.asked);
  theatre.run(100);
  EXPECT_EQ(theatre.bridged.owner(), 0U);
  EXPECT_EQ(theatre.bridged.forces(), 0U);
}

TEST(Chai3dHost, CloseLetsTheDeviceGo) {
  Theatre theatre("demo_parts.toml");
  theatre.asks = true;
  theatre.run(200);
  EXPECT_NE(theatre.bridged.owner(), 0U);
  theatre.asks = false;
  ++theatre.asked.count;
  theatre.asked.open = 0;
  theatre.hands->device[0].asked.put(theatre.asked);
  theatre.run(1);
  EXPECT_EQ(theatre.bridged.owner(), 0U);
}

TEST(Chai3dHost, IsReadyWhenEveryDeviceHasToldWhereItIs) {
  Theatre theatre("demo_parts.toml");
  EXPECT_EQ(theatre.hands->ready, 0U);
  theatre.run(100);
  EXPECT_EQ(theatre.hands->ready, 1U);
  EXPECT_EQ(std::string(theatre.hands->device[0].model.data()), "falcon");
  EXPECT_EQ(theatre.hands->device[0].workspace_radius, Host::kWorkspaceRadius) << "the server describes no box";
}

TEST(Chai3dHost, TellsTheAgeOfTheLastPlaceWhenTheServerHasGone) {
  Theatre theatre("demo_parts.toml");
  theatre.run(200);
  const std::int64_t before = theatre.hand.at_ns;
  theatre.world.kill_server();
  theatre.run(12000);
  const std::int64_t gone = theatre.hand.at_ns;
  EXPECT_LE(gone - before, 10'000'000) << "the time of the last state tells its age";
  theatre.world.open_server();
  theatre.run(3000);
  EXPECT_GT(theatre.hand.at_ns, gone + 10'000'000'000);
}

}  // namespace
}  // namespace tendon::bridge::chai3d::host_test
