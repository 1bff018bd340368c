// SPDX-License-Identifier: Apache-2.0
#include "clients/plug/plug.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

#include "tests/clients/plug/world.h"

namespace tendon::plug::plug_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Plug::Program kOld = 1;
constexpr Plug::Program kOther = 2;

Physics pushes_by(double newtons) {
  return [newtons](const DeviceState&) { return Vec3(0, newtons, 0); };
}

std::vector<std::string> sentences_of(Plug& plug) {
  std::vector<std::string> all;
  while (const auto sentence = plug.next_sentence()) all.push_back(*sentence);
  return all;
}

bool one_has(const std::vector<std::string>& sentences, const std::string& words) {
  for (const std::string& one : sentences) {
    if (one.find(words) != std::string::npos) return true;
  }
  return false;
}

TEST(Plug, AProgramThatOnlyReadsGetsEveryStateAndTakesNoChannel) {
  World world("demo_parts.toml");
  Plug& reader = world.add_plug();
  Plug& engine = world.add_plug();
  world.run(100);
  const std::uint64_t before = reader.states();
  world.run(500, [&] { engine.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(0.5)); });
  EXPECT_EQ(reader.states() - before, 500U);
  EXPECT_FALSE(reader.pushes());
  EXPECT_TRUE(engine.pushes());
  EXPECT_NEAR(world.step.applied.y(), 0.5, 1e-9);
}

TEST(Plug, TheStatesGoOnWithoutAHoleWhenItBecomesAController) {
  World world("demo_parts.toml");
  Plug& plug = world.add_plug();
  world.run(100);
  std::uint64_t tick = plug.state()->tick;
  world.run(300, [&] {
    plug.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(0.5));
    EXPECT_LE(plug.state()->tick - tick, 1U);
    tick = plug.state()->tick;
  });
  EXPECT_TRUE(plug.pushes());
  EXPECT_TRUE(plug.description()) << "the workspace is known to a controller too";
  EXPECT_TRUE(plug.handle());
}

TEST(Plug, AForceIsOnTheWireInTheTurnInWhichItWasAskedFor) {
  World world("demo_parts.toml");
  Plug& plug = world.add_plug();
  world.run(100);
  world.run(200, [&] { plug.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(0)); });
  double wanted = 0;
  world.run(100, [&] {
    // The next step of the device uses the force requested at the end of the previous millisecond.
    EXPECT_NEAR(world.step.wanted.y(), wanted, 1e-9);
    wanted += 1e-3;
    plug.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(wanted));
  });
}

TEST(Plug, AForceThatIsTooOldIsNotSentAgainAndTheStagesLetsGo) {
  World world("demo_parts.toml");
  Plug& plug = world.add_plug();
  world.run(100);
  world.run(200, [&] { plug.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(0.5)); });
  world.run(51);
  const std::uint64_t sent = plug.forces();
  EXPECT_TRUE(plug.pushes()) << "the program may come back";
  double last = world.step.applied.y();
  double step = 0;
  world.run(300, [&] {
    step = std::max(step, std::abs(world.step.applied.y() - last));
    last = world.step.applied.y();
  });
  EXPECT_EQ(plug.forces(), sent);
  EXPECT_EQ(last, 0);
  EXPECT_LT(step, 0.05) << "it fades";
}

TEST(Plug, APushIsSentOnceHoweverManyStatesCome) {
  World world("demo_parts.toml");
  Plug& plug = world.add_plug();
  world.run(100);
  const auto push = [&] { plug.push(kOld, world.now, world.now + milliseconds(100), Vec3(0, 0.5, 0)); };
  push();
  world.run(50);
  EXPECT_TRUE(plug.pushes());
  EXPECT_EQ(plug.forces(), 1U) << "it has waited for the channel";
  push();
  world.run(2);
  EXPECT_EQ(plug.forces(), 2U);
  world.run(90);
  EXPECT_EQ(plug.forces(), 2U);
}

TEST(Plug, ReadsWhatStillComesForASessionThatHasEnded) {
  // An unread datagram would wake a sleeping bridge forever.
  World world("demo_parts.toml", {}, 5);
  Plug& plug = world.add_plug();
  world.run(100);
  world.run(1500, [&] { plug.push(kOld, world.now, world.now + milliseconds(100), Vec3(0, 0.5, 0)); });
  EXPECT_LE(world.unread(), 1U) << "the one that has just come";
  world.run(1500);
  EXPECT_LE(world.unread(), 1U) << "the controller has ended, too";
}

TEST(Plug, TheFirstProgramThatAsksOwnsTheDeviceUntilItLeavesOrIsSilent) {
  World world("demo_parts.toml");
  Plug& plug = world.add_plug();
  world.run(100);
  const auto ask = [&](Plug::Program program) {
    return plug.ask(program, world.now, world.now + milliseconds(50), pushes_by(program == kOld ? 0.5 : -0.5));
  };
  EXPECT_EQ(ask(kOld), Plug::Answer::kTaken);
  EXPECT_EQ(ask(kOther), Plug::Answer::kOwned);
  EXPECT_EQ(plug.owner(), kOld);
  EXPECT_EQ(plug.forces_dropped(), 1U);
  plug.release(kOther);
  EXPECT_EQ(plug.owner(), kOld) << "only the owner lets go";
  world.run(100, [&] { ask(kOld); });
  EXPECT_GT(world.step.applied.y(), 0);
  plug.release(kOld);
  EXPECT_EQ(ask(kOther), Plug::Answer::kTaken);
  world.run(200, [&] { ask(kOther); });
  EXPECT_LT(world.step.applied.y(), 0);
  world.run(999);
  EXPECT_EQ(plug.owner(), kOther);
  world.run(2);
  EXPECT_EQ(plug.owner(), 0U);
}

TEST(Plug, GivesTheChannelBackWhenNoProgramAsksForASecond) {
  World world("demo_parts.toml");
  Plug& plug = world.add_plug();
  Plug& other = world.add_plug();
  world.run(100);
  world.run(100, [&] {
    plug.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(0.5));
    other.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(-0.5));
  });
  EXPECT_TRUE(plug.pushes());
  EXPECT_TRUE(one_has(sentences_of(plug), "uses the forces of a program"));
  EXPECT_FALSE(other.pushes());
  EXPECT_TRUE(other.state()) << "it looks on meanwhile";
  EXPECT_TRUE(one_has(sentences_of(other), "uses no forces: "));
  world.run(4000, [&] { other.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(-0.5)); });
  EXPECT_FALSE(plug.pushes());
  EXPECT_TRUE(plug.state());
  EXPECT_TRUE(one_has(sentences_of(plug), "no program requests one"));
  EXPECT_TRUE(other.pushes());
  EXPECT_LT(world.step.applied.y(), 0);
}

TEST(Plug, SaysOnceWhyAForceIsNotSent) {
  World world("demo_parts.toml");
  Plug& plug = world.add_plug();
  world.run(100);
  const auto push = [&] { plug.push(kOld, world.now, world.now + milliseconds(100), Vec3(0, 1e13, 0)); };
  world.run(200, push);
  EXPECT_GT(plug.forces_unusable(), 1U);
  EXPECT_TRUE(one_has(sentences_of(plug), "the force exceeds 1e12 N"));
  world.run(200, push);
  EXPECT_FALSE(one_has(sentences_of(plug), "the force exceeds 1e12 N"));
}

TEST(Plug, ThatObservesSendsNothing) {
  World world("demo_parts.toml");
  Plug& plug = world.add_plug({.observe = true});
  world.run(200, [&] {
    EXPECT_EQ(plug.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(1)), Plug::Answer::kObserving);
  });
  EXPECT_TRUE(plug.state());
  EXPECT_EQ(plug.forces(), 0U);
  EXPECT_EQ(world.step.wanted.y(), 0);
}

TEST(Plug, FindsAServerThatComesBackAndPushesAgain) {
  World world("demo_parts.toml");
  Plug& plug = world.add_plug();
  const auto ask = [&] { plug.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(0.5)); };
  world.run(300, ask);
  EXPECT_TRUE(one_has(sentences_of(plug), "connected to "));
  world.kill_server();
  bool said = false;
  world.run(15000, [&] {
    ask();
    said = said || one_has(sentences_of(plug), "lost 127.0.0.1:47100");
  });
  EXPECT_TRUE(said);
  EXPECT_TRUE(plug.lost());
  EXPECT_FALSE(plug.state()) << "no old position is shown as the present one";
  world.open_server();
  world.run(5000, ask);
  EXPECT_TRUE(plug.state());
  EXPECT_TRUE(plug.pushes());
  EXPECT_NEAR(world.step.applied.y(), 0.5, 1e-9);
  EXPECT_TRUE(one_has(sentences_of(plug), "connected to "));
}

TEST(Plug, AStallOf200MsFadesTheForceAndEndsWithoutASecondHandshake) {
  World world("demo_parts.toml");
  Plug& plug = world.add_plug();
  const auto ask = [&] { plug.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(0.5)); };
  world.run(500, ask);
  const std::uint64_t sent = plug.forces();
  world.connected = false;
  world.run(200, ask);
  EXPECT_LT(world.step.applied.y(), 0.3);
  world.connected = true;
  world.run(300, ask);
  EXPECT_NEAR(world.step.applied.y(), 0.5, 1e-9);
  EXPECT_GT(plug.forces(), sent);
  EXPECT_FALSE(one_has(sentences_of(plug), "lost"));
}

TEST(Plug, SaysOnceWhenItDoesNotKnowHowTheDeviceLies) {
  World unknown("demo_parts.toml");
  Plug& plug = unknown.add_plug();
  unknown.run(200);
  EXPECT_TRUE(one_has(sentences_of(plug), "has an unknown orientation"));
  unknown.run(200, [&] { plug.push(kOld, unknown.now, unknown.now + milliseconds(50), Vec3(0, 0, 0)); });
  EXPECT_FALSE(one_has(sentences_of(plug), "has an unknown orientation"));

  World known("demo_parts.toml");
  known.handle.operator_from_device = Quat{};
  known.kill_server();
  known.open_server();
  Plug& told = known.add_plug();
  known.run(200);
  EXPECT_FALSE(one_has(sentences_of(told), "has an unknown orientation"));
}

TEST(Plug, SaysByeToTheServerAndIsSilentAfterwards) {
  World world("demo_parts.toml");
  Plug& plug = world.add_plug();
  world.run(200, [&] { plug.ask(kOld, world.now, world.now + milliseconds(50), pushes_by(0.5)); });
  plug.stop(world.now);
  EXPECT_EQ(plug.turn(world.now), LocalTime::max());
  EXPECT_FALSE(plug.pushes());
  EXPECT_TRUE(plug.lost());
  EXPECT_EQ(plug.phase(), ForceClient::Phase::kStopped);
  EXPECT_FALSE(plug.state());
}

}  // namespace
}  // namespace tendon::plug::plug_test
