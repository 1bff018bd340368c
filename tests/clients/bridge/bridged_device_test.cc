// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/bridged_device.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

#include "tests/clients/bridge/world.h"

namespace tendon::bridge::bridged_device_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr BridgedDevice::Program kOld = 1;
constexpr BridgedDevice::Program kOther = 2;

Physics pushes_by(double newtons) {
  return [newtons](const DeviceState&) { return Vec3(0, newtons, 0); };
}

std::vector<std::string> sentences_of(BridgedDevice& bridged) {
  std::vector<std::string> all;
  while (const auto sentence = bridged.next_sentence()) all.push_back(*sentence);
  return all;
}

bool one_has(const std::vector<std::string>& sentences, const std::string& words) {
  for (const std::string& one : sentences) {
    if (one.find(words) != std::string::npos) return true;
  }
  return false;
}

TEST(Bridged, AProgramThatOnlyReadsGetsEveryStateAndTakesNoChannel) {
  World world("demo_parts.toml");
  BridgedDevice& reader = world.add_bridged();
  BridgedDevice& engine = world.add_bridged();
  world.run(100);
  const std::uint64_t before = reader.states();
  world.run(500, [&] { engine.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(0.5)); });
  EXPECT_EQ(reader.states() - before, 500U);
  EXPECT_FALSE(reader.pushes());
  EXPECT_TRUE(engine.pushes());
  EXPECT_NEAR(world.step.applied.y(), 0.5, 1e-9);
}

TEST(Bridged, TheStatesGoOnWithoutAHoleWhenItBecomesAController) {
  World world("demo_parts.toml");
  BridgedDevice& bridged = world.add_bridged();
  world.run(100);
  std::uint64_t tick = bridged.state()->tick;
  world.run(300, [&] {
    bridged.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(0.5));
    EXPECT_LE(bridged.state()->tick - tick, 1U);
    tick = bridged.state()->tick;
  });
  EXPECT_TRUE(bridged.pushes());
  EXPECT_TRUE(bridged.description()) << "the workspace is known to a controller too";
  EXPECT_TRUE(bridged.handle());
}

TEST(Bridged, AForceIsOnTheWireInTheTurnInWhichItWasAskedFor) {
  World world("demo_parts.toml");
  BridgedDevice& bridged = world.add_bridged();
  world.run(100);
  world.run(200, [&] { bridged.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(0)); });
  double wanted = 0;
  world.run(100, [&] {
    EXPECT_NEAR(world.step.wanted.y(), wanted, 1e-9);
    wanted += 1e-3;
    bridged.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(wanted));
  });
}

TEST(Bridged, AForceThatIsTooOldIsNotSentAgainAndTheStagesLetsGo) {
  World world("demo_parts.toml");
  BridgedDevice& bridged = world.add_bridged();
  world.run(100);
  world.run(200, [&] { bridged.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(0.5)); });
  world.run(51);
  const std::uint64_t sent = bridged.forces();
  EXPECT_TRUE(bridged.pushes()) << "the program may come back";
  double last = world.step.applied.y();
  double step = 0;
  world.run(300, [&] {
    step = std::max(step, std::abs(world.step.applied.y() - last));
    last = world.step.applied.y();
  });
  EXPECT_EQ(bridged.forces(), sent);
  EXPECT_EQ(last, 0);
  EXPECT_LT(step, 0.05) << "it fades";
}

TEST(Bridged, APushIsSentOnceHoweverManyStatesCome) {
  World world("demo_parts.toml");
  BridgedDevice& bridged = world.add_bridged();
  world.run(100);
  const auto push = [&] { bridged.push(kOld, world.now, world.now + milliseconds(100), Vec3(0, 0.5, 0)); };
  push();
  world.run(50);
  EXPECT_TRUE(bridged.pushes());
  EXPECT_EQ(bridged.forces(), 1U) << "it has waited for the channel";
  push();
  world.run(2);
  EXPECT_EQ(bridged.forces(), 2U);
  world.run(90);
  EXPECT_EQ(bridged.forces(), 2U);
}

TEST(Bridged, ReadsWhatStillComesForASessionThatHasEnded) {
  // An unread datagram would wake a sleeping bridge forever.
  World world("demo_parts.toml", {}, 5);
  BridgedDevice& bridged = world.add_bridged();
  world.run(100);
  world.run(1500, [&] { bridged.push(kOld, world.now, world.now + milliseconds(100), Vec3(0, 0.5, 0)); });
  EXPECT_LE(world.unread(), 1U) << "the one that has just come";
  world.run(1500);
  EXPECT_LE(world.unread(), 1U) << "the controller has ended, too";
}

TEST(Bridged, TheFirstProgramThatAsksOwnsTheDeviceUntilItLeavesOrIsSilent) {
  World world("demo_parts.toml");
  BridgedDevice& bridged = world.add_bridged();
  world.run(100);
  const auto ask = [&](BridgedDevice::Program program) {
    return bridged.ask(program, world.now, world.now + milliseconds(50), pushes_by(program == kOld ? 0.5 : -0.5));
  };
  EXPECT_EQ(ask(kOld), BridgedDevice::Answer::kTaken);
  EXPECT_EQ(ask(kOther), BridgedDevice::Answer::kOwned);
  EXPECT_EQ(bridged.owner(), kOld);
  EXPECT_EQ(bridged.forces_dropped(), 1U);
  bridged.release(kOther);
  EXPECT_EQ(bridged.owner(), kOld) << "only the owner lets go";
  world.run(100, [&] { ask(kOld); });
  EXPECT_GT(world.step.applied.y(), 0);
  bridged.release(kOld);
  EXPECT_EQ(ask(kOther), BridgedDevice::Answer::kTaken);
  world.run(200, [&] { ask(kOther); });
  EXPECT_LT(world.step.applied.y(), 0);
  world.run(999);
  EXPECT_EQ(bridged.owner(), kOther);
  world.run(2);
  EXPECT_EQ(bridged.owner(), 0U);
}

TEST(Bridged, GivesTheChannelBackWhenNoProgramAsksForASecond) {
  World world("demo_parts.toml");
  BridgedDevice& bridged = world.add_bridged();
  BridgedDevice& other = world.add_bridged();
  world.run(100);
  world.run(100, [&] {
    bridged.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(0.5));
    other.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(-0.5));
  });
  EXPECT_TRUE(bridged.pushes());
  EXPECT_TRUE(one_has(sentences_of(bridged), "uses the forces of a program"));
  EXPECT_FALSE(other.pushes());
  EXPECT_TRUE(other.state()) << "it looks on meanwhile";
  EXPECT_TRUE(one_has(sentences_of(other), "uses no forces: "));
  world.run(4000, [&] { other.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(-0.5)); });
  EXPECT_FALSE(bridged.pushes());
  EXPECT_TRUE(bridged.state());
  EXPECT_TRUE(one_has(sentences_of(bridged), "no program requests one"));
  EXPECT_TRUE(other.pushes());
  EXPECT_LT(world.step.applied.y(), 0);
}

TEST(Bridged, SaysOnceWhyAForceIsNotSent) {
  World world("demo_parts.toml");
  BridgedDevice& bridged = world.add_bridged();
  world.run(100);
  const auto push = [&] { bridged.push(kOld, world.now, world.now + milliseconds(100), Vec3(0, 1e13, 0)); };
  world.run(200, push);
  EXPECT_GT(bridged.forces_unusable(), 1U);
  EXPECT_TRUE(one_has(sentences_of(bridged), "the force exceeds 1e12 N"));
  world.run(200, push);
  EXPECT_FALSE(one_has(sentences_of(bridged), "the force exceeds 1e12 N"));
}

TEST(Bridged, ThatObservesSendsNothing) {
  World world("demo_parts.toml");
  BridgedDevice& bridged = world.add_bridged({.observe = true});
  world.run(200, [&] {
    EXPECT_EQ(bridged.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(1)),
              BridgedDevice::Answer::kObserving);
  });
  EXPECT_TRUE(bridged.state());
  EXPECT_EQ(bridged.forces(), 0U);
  EXPECT_EQ(world.step.wanted.y(), 0);
}

TEST(Bridged, FindsAServerThatComesBackAndPushesAgain) {
  World world("demo_parts.toml");
  BridgedDevice& bridged = world.add_bridged();
  const auto ask = [&] { bridged.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(0.5)); };
  world.run(300, ask);
  EXPECT_TRUE(one_has(sentences_of(bridged), "connected to "));
  world.kill_server();
  bool said = false;
  world.run(15000, [&] {
    ask();
    said = said || one_has(sentences_of(bridged), "lost 127.0.0.1:47100");
  });
  EXPECT_TRUE(said);
  EXPECT_TRUE(bridged.lost());
  EXPECT_FALSE(bridged.state()) << "no old position is shown as the present one";
  world.open_server();
  world.run(5000, ask);
  EXPECT_TRUE(bridged.state());
  EXPECT_TRUE(bridged.pushes());
  EXPECT_NEAR(world.step.applied.y(), 0.5, 1e-9);
  EXPECT_TRUE(one_has(sentences_of(bridged), "connected to "));
}

TEST(Bridged, AStallOf200MsFadesTheForceAndEndsWithoutASecondHandshake) {
  World world("demo_parts.toml");
  BridgedDevice& bridged = world.add_bridged();
  const auto ask = [&] { bridged.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(0.5)); };
  world.run(500, ask);
  const std::uint64_t sent = bridged.forces();
  world.connected = false;
  world.run(200, ask);
  EXPECT_LT(world.step.applied.y(), 0.3);
  world.connected = true;
  world.run(300, ask);
  EXPECT_NEAR(world.step.applied.y(), 0.5, 1e-9);
  EXPECT_GT(bridged.forces(), sent);
  EXPECT_FALSE(one_has(sentences_of(bridged), "lost"));
}

TEST(Bridged, SaysOnceWhenItDoesNotKnowHowTheDeviceLies) {
  World unknown("demo_parts.toml");
  BridgedDevice& bridged = unknown.add_bridged();
  unknown.run(200);
  EXPECT_TRUE(one_has(sentences_of(bridged), "has an unknown orientation"));
  unknown.run(200, [&] { bridged.push(kOld, unknown.now, unknown.now + milliseconds(50), Vec3(0, 0, 0)); });
  EXPECT_FALSE(one_has(sentences_of(bridged), "has an unknown orientation"));

  World known("demo_parts.toml");
  known.handle.operator_from_device = Quat{};
  known.kill_server();
  known.open_server();
  BridgedDevice& told = known.add_bridged();
  known.run(200);
  EXPECT_FALSE(one_has(sentences_of(told), "has an unknown orientation"));
}

TEST(Bridged, SaysByeToTheServerAndIsSilentAfterwards) {
  World world("demo_parts.toml");
  BridgedDevice& bridged = world.add_bridged();
  world.run(200, [&] { bridged.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(0.5)); });
  bridged.stop(world.now);
  EXPECT_EQ(bridged.turn(world.now), LocalTime::max());
  EXPECT_FALSE(bridged.pushes());
  EXPECT_TRUE(bridged.lost());
  EXPECT_EQ(bridged.phase(), ForceClient::Phase::kStopped);
  EXPECT_FALSE(bridged.state());
}

}  // namespace
}  // namespace tendon::bridge::bridged_device_test
