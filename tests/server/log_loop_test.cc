// SPDX-License-Identifier: Apache-2.0
#include "server/log_loop.h"

#include <chrono>
#include <string>
#include <vector>

#include "tests/server/scratch_folder.h"
#include "tests/server/servers.h"

namespace tendon::log_loop_test {
namespace {

using std::chrono::milliseconds;

class LogLoopTest : public Servers {
 protected:
  LogLoop& log() { return assembly_->log(); }
  void step(std::size_t number, const std::vector<int>& at_ms) {
    for (const int ms : at_ms) device(number).haptic.step(now_ + milliseconds(ms));
  }
  std::vector<std::string> texts() {
    std::vector<std::string> all;
    for (const auto& notice : log().take_notices()) all.push_back(notice.text);
    return all;
  }
  void record(const testing::ScratchFolder& folder) {
    Scene scene = device_named("left");
    scene.recording = Scene::Recording{.path = folder.path() / "run.mcap"};
    serve({scene});
  }
};
using Texts = std::vector<std::string>;

TEST_F(LogLoopTest, RecordsEveryStepThatWasMadeBeforeItIsClosed) {
  const testing::ScratchFolder folder;
  record(folder);
  for (int i = 0; i < 100; ++i, now_ += milliseconds(1)) device().haptic.step(now_);
  EXPECT_EQ(log().turn(now_, 0), now_ + LogLoop::kPeriod);
  for (int i = 0; i < 50; ++i, now_ += milliseconds(1)) device().haptic.step(now_);
  log().close(now_, 0);
  ASSERT_TRUE(log().recording().has_value());
  EXPECT_EQ(log().recording()->steps, 150U);
  EXPECT_TRUE(log().recording()->complete());
}

TEST_F(LogLoopTest, TellsOnceHowManyStepsAreMissingAndTheObserversToo) {
  serve({device_named("left")});
  mail().steps_lost = 3;
  mail().datagrams_lost = 2;
  log().turn(now_, 7);
  EXPECT_EQ(texts(), Texts{"the log thread is too slow: 3 steps and 2 datagrams are missing"});
  const Health* const health = mail().health.take();
  ASSERT_NE(health, nullptr);
  EXPECT_EQ(health->steps_lost, 3U);
  EXPECT_EQ(health->unsent, 7U);
  log().turn(now_ + milliseconds(20), 7);
  EXPECT_EQ(texts(), Texts{});
}

TEST_F(LogLoopTest, DevicesOfOneThreadAreLateInOneLine) {
  serve({device_named("left"), device_named("right")});
  for (const std::size_t number : {0U, 1U}) step(number, {0, 1, 30, 60});
  log().turn(now_ + LogLoop::kTroublePeriod, 0);
  EXPECT_EQ(texts(), Texts{"left: 2 overruns in the last second, also of 1 other devices on this thread; longest "
                           "interval so far 30000 µs"});
}

TEST_F(LogLoopTest, CloseReportsTroubleThatIsNotDueYet) {
  serve({device_named("left")});
  step(0, {0, 1, 30});
  log().turn(now_ + milliseconds(40), 0);
  EXPECT_EQ(texts(), Texts{});
  log().close(now_ + milliseconds(60), 0);
  EXPECT_EQ(texts(), Texts{"1 overruns in the last second; longest interval so far 29000 µs"});
}

TEST_F(LogLoopTest, DevicesOfTwoThreadsAreLateEachByItself) {
  serve({device_named("left", "[loop]\nperiod_us = 500\n"), device_named("right")});
  step(1, {0, 1, 30});
  log().turn(now_ + LogLoop::kTroublePeriod, 0);
  EXPECT_EQ(texts(), Texts{"right: 1 overruns in the last second; longest interval so far 29000 µs"});
}

TEST_F(LogLoopTest, TheStepsBeforeAFaultAreSavedOnceAndTheFaultIsNamed) {
  const testing::ScratchFolder folder;
  record(folder);
  step(0, {0});
  mail().flight.freeze();
  log().turn(now_ + LogLoop::kTroublePeriod, 0);
  const Texts said = texts();
  ASSERT_EQ(said.size(), 1U);
  EXPECT_TRUE(said[0].starts_with("the steps before the fault are saved in " + folder.path().string())) << said[0];
  EXPECT_FALSE(mail().flight.frozen());
  log().turn(now_ + 2 * LogLoop::kTroublePeriod, 0);
  EXPECT_EQ(texts(), Texts{});
}

}  // namespace
}  // namespace tendon::log_loop_test
