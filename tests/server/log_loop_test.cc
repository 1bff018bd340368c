// SPDX-License-Identifier: Apache-2.0
#include "server/log_loop.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "devices/simulated/simulated_device.h"
#include "tests/server/scene/scene_text.h"
#include "tests/server/scratch_folder.h"

namespace tendon::log_loop_test {
namespace {

using std::chrono::milliseconds;

constexpr LocalTime kStart(std::chrono::seconds(1000));

/// A device whose haptic loop is called by the test.
struct Place {
  explicit Place(Scene the_scene)
      : scene(std::move(the_scene)), device(scene.simulated()), haptic(scene.loop, device, *mail) {}

  LogLoop::Watched watched() {
    return {
        .scene = scene, .device = device, .safe = nullptr, .haptic = haptic, .mail = *mail, .not_realtime = refused};
  }

  Scene scene;
  SimulatedDevice device;
  std::unique_ptr<Mailboxes> mail = std::make_unique<Mailboxes>(Mailboxes::Capacities{.steps = 256, .flight = 16});
  HapticLoop haptic;
  std::atomic<bool> refused{false};
};

Scene scene_of(const std::string& name) {
  Scene scene = parse(std::string(kMinimal));
  scene.name = name;
  return scene;
}

std::vector<std::string> texts(LogLoop& log) {
  std::vector<std::string> all;
  for (const auto& notice : log.take_notices()) all.push_back(notice.text);
  return all;
}
using Texts = std::vector<std::string>;

TEST(LogLoop, RecordsEveryStepThatWasMadeBeforeItIsClosed) {
  const testing::ScratchFolder folder;
  Scene scene = scene_of("left");
  scene.recording = Scene::Recording{.path = folder.path() / "run.mcap"};
  Place place(scene);
  LogLoop log({place.watched()}, {place.mail.get()}, kStart);
  LocalTime now = kStart;
  for (int i = 0; i < 100; ++i, now += milliseconds(1)) place.haptic.step(now);
  EXPECT_EQ(log.turn(now, 0), now + LogLoop::kPeriod);
  for (int i = 0; i < 50; ++i, now += milliseconds(1)) place.haptic.step(now);
  log.close(now, 0);
  ASSERT_TRUE(log.recording().has_value());
  EXPECT_EQ(log.recording()->steps, 150U);
  EXPECT_TRUE(log.recording()->complete());
}

TEST(LogLoop, TellsOnceHowManyStepsAreMissingAndTheObserversToo) {
  Place place(scene_of("left"));
  LogLoop log({place.watched()}, {place.mail.get()}, kStart);
  place.mail->steps_lost = 3;
  place.mail->datagrams_lost = 2;
  log.turn(kStart, 7);
  EXPECT_EQ(texts(log), Texts{"the log thread is too slow: 3 steps and 2 datagrams are missing"});
  const Health* const health = place.mail->health.take();
  ASSERT_NE(health, nullptr);
  EXPECT_EQ(health->steps_lost, 3U);
  EXPECT_EQ(health->unsent, 7U);
  log.turn(kStart + milliseconds(20), 7);
  EXPECT_EQ(texts(log), Texts{});
}

TEST(LogLoop, DevicesOfOneThreadAreLateInOneLine) {
  Place left(scene_of("left"));
  Place right(scene_of("right"));
  LogLoop log({left.watched(), right.watched()}, {left.mail.get()}, kStart);
  for (const int ms : {0, 1, 30, 60}) {
    left.haptic.step(kStart + milliseconds(ms));
    right.haptic.step(kStart + milliseconds(ms));
  }
  log.turn(kStart + LogLoop::kTroublePeriod, 0);
  EXPECT_EQ(texts(log), Texts{"left: 2 overruns in the last second, also of 1 other devices on this thread; longest "
                              "interval so far 30000 µs"});
}

TEST(LogLoop, CloseReportsTroubleThatIsNotDueYet) {
  Place place(scene_of("left"));
  LogLoop log({place.watched()}, {place.mail.get()}, kStart);
  for (const int ms : {0, 1, 30}) place.haptic.step(kStart + milliseconds(ms));
  log.turn(kStart + milliseconds(40), 0);
  EXPECT_EQ(texts(log), Texts{});
  log.close(kStart + milliseconds(60), 0);
  EXPECT_EQ(texts(log), Texts{"1 overruns in the last second; longest interval so far 29000 µs"});
}

TEST(LogLoop, DevicesOfTwoThreadsAreLateEachByItself) {
  Place left(scene_of("left"));
  Place right(scene_of("right"));
  LogLoop::Watched second{.scene = right.scene,
                          .device = right.device,
                          .safe = nullptr,
                          .haptic = right.haptic,
                          .mail = *right.mail,
                          .not_realtime = right.refused,
                          .thread = 1};
  LogLoop log({left.watched(), second}, {left.mail.get()}, kStart);
  for (const int ms : {0, 1, 30}) right.haptic.step(kStart + milliseconds(ms));
  log.turn(kStart + LogLoop::kTroublePeriod, 0);
  EXPECT_EQ(texts(log), Texts{"right: 1 overruns in the last second; longest interval so far 29000 µs"});
}

TEST(LogLoop, TheStepsBeforeAFaultAreSavedOnceAndTheFaultIsNamed) {
  const testing::ScratchFolder folder;
  Scene scene = scene_of("left");
  scene.recording = Scene::Recording{.path = folder.path() / "run.mcap"};
  Place place(scene);
  LogLoop log({place.watched()}, {place.mail.get()}, kStart);
  place.haptic.step(kStart);
  place.mail->flight.freeze();
  log.turn(kStart + LogLoop::kTroublePeriod, 0);
  const Texts said = texts(log);
  ASSERT_EQ(said.size(), 1U);
  EXPECT_TRUE(said[0].starts_with("the steps before the fault are saved in " + folder.path().string())) << said[0];
  EXPECT_FALSE(place.mail->flight.frozen());
  log.turn(kStart + 2 * LogLoop::kTroublePeriod, 0);
  EXPECT_EQ(texts(log), Texts{});
}

}  // namespace
}  // namespace tendon::log_loop_test
