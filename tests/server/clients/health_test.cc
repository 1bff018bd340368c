// SPDX-License-Identifier: Apache-2.0
#include "server/clients/health.h"

#include <gtest/gtest.h>

#include <memory>
#include <numeric>
#include <stdexcept>

#include "devices/simulated/profiles.h"
#include "devices/simulated/simulated_device.h"
#include "server/haptic_loop.h"

namespace tendon::health_test {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

std::uint64_t sum(const LatenessHistogram& lateness) {
  return std::accumulate(lateness.begin(), lateness.end(), std::uint64_t{0});
}

/// A loop at 1 kHz. The test decides when the thread wakes up.
class Loop {
 public:
  Loop() : loop_({.period = milliseconds(1), .control = control()}, device_, *mail_) {}

  void step(Duration late) { due_ = loop_.step(due_ + late); }
  Health counted() const { return loop_.health(); }

 private:
  static HapticController::Config control() {
    HapticController::Config control;
    control.limiter.friction = {0.3, 0.8};
    control.limiter.longest_hold = milliseconds(2);
    control.max_force = 8;
    control.max_slew = 1000;
    return control;
  }
  static SimulatedDevice::Config still() {
    SimulatedDevice::Config config = find_device_profile("falcon")->device();
    config.hand = OperatorHand::Config{
        .stiffness = 300, .damping = 20, .mass = 0.05, .motion = ScriptedMotion(ScriptedMotion::Sine{})};
    return config;
  }
  SimulatedDevice device_{still()};
  std::unique_ptr<Mailboxes> mail_ = std::make_unique<Mailboxes>();
  HapticLoop loop_;
  LocalTime due_{std::chrono::seconds(1)};
};

TEST(HealthMeter, CountsEachStepInTheBucketOfItsLateness) {
  Loop loop;
  for (int i = 0; i < 50; ++i) loop.step(Duration{0});
  for (int i = 0; i < 30; ++i) loop.step(microseconds(60));
  for (int i = 0; i < 5; ++i) loop.step(microseconds(600));
  const Health counted = loop.counted();
  EXPECT_EQ(counted.lateness[0], 50U);
  EXPECT_EQ(counted.lateness[6], 30U);
  EXPECT_EQ(counted.lateness[10], 5U);
  EXPECT_EQ(sum(counted.lateness), 85U);
  EXPECT_EQ(counted.steps, 85U);
  EXPECT_EQ(counted.missed, 0U);
  EXPECT_EQ(counted.overruns, 0U);
}

TEST(HealthMeter, APeriodWithoutAStepIsMissedAndTheStepAfterAnOverrun) {
  Loop loop;
  for (int i = 0; i < 10; ++i) loop.step(Duration{0});
  loop.step(microseconds(999));  // late but within its period
  EXPECT_EQ(loop.counted().missed, 0U);
  loop.step(microseconds(5000));  // skips five periods
  loop.step(Duration{0});
  EXPECT_EQ(loop.counted().missed, 5U);
  EXPECT_EQ(loop.counted().lateness[13], 1U);
  EXPECT_EQ(loop.counted().overruns, 1U);
}

TEST(HealthMeter, CountsStepsThatNobodyHasTaken) {
  Loop loop;
  for (int i = 0; i < 20'000; ++i) loop.step(Duration{0});  // exceeds the ring of steps
  EXPECT_EQ(loop.counted().steps, 20'000U);
  EXPECT_EQ(loop.counted().missed, 0U);
}

TEST(HealthMeter, ABrokenAccelerationBoundDegradesTheDeviceInThatReportOnly) {
  HealthMeter meter(milliseconds(1));
  StepRecord step;
  meter.observe(step);
  const Health before = meter.counted();
  step.tick = 1;
  step.reasons |= Reason::kAcceleration;
  meter.observe(step);
  const Health broken = meter.counted();
  EXPECT_EQ(broken.broken_assumptions, 1U);
  EXPECT_EQ(report(before, broken).degraded, "acceleration too high");
  EXPECT_EQ(report(broken, broken).degraded, "");
}

TEST(HealthMeter, CountsStepsInWhichTheDeviceWasNotSeen) {
  HealthMeter meter(milliseconds(1));
  StepRecord step;
  step.tick = 1;
  step.reasons = Reason::kUnseen;
  meter.observe(step);
  EXPECT_EQ(meter.counted().unseen, 1U);
}

TEST(HealthMeter, WantsAPeriod) { EXPECT_THROW(HealthMeter(Duration{0}), std::invalid_argument); }

TEST(Health, IsToldAsWhatHasHappenedBetween) {
  Health before;
  before.at = LocalTime(std::chrono::seconds(5));
  before.steps = 100;
  before.lateness[3] = 100;
  before.missed = before.overruns = before.unseen = 1;
  Health now = before;
  now.at += milliseconds(1200);
  now.steps += 1190;
  now.lateness[3] += 1180;
  now.lateness[23] += 10;
  now.missed += 10;
  now.overruns += 2;
  now.unseen += 3;
  now.safety = Safety::kArmed;
  now.fault = "words";
  const DeviceReport told = report(before, now);
  EXPECT_EQ(told.until, PeerTime(std::chrono::milliseconds(6200)));
  EXPECT_EQ(told.span, milliseconds(1200));
  EXPECT_EQ(told.steps, 1190U);
  EXPECT_EQ(told.lateness[3], 1180U);
  EXPECT_EQ(told.lateness[23], 10U);
  EXPECT_EQ(told.missed, 10U);
  EXPECT_EQ(told.overruns, 2U);
  EXPECT_EQ(told.unseen, 3U);
  EXPECT_EQ(told.safety, Safety::kArmed);
  EXPECT_EQ(told.fault, "words");
  EXPECT_EQ(told.degraded, "");
}

TEST(Health, WhatWasNotSentOrRecordedDegradesItsOwnReportOnly) {
  const std::pair<std::uint64_t Health::*, const char*> cases[] = {{&Health::unsent, "unsent datagrams"},
                                                                   {&Health::steps_lost, "the log thread is too slow"}};
  for (const auto& [count, words] : cases) {
    Health before;
    before.*count = 3;
    Health now = before;
    now.*count = 4;
    EXPECT_EQ(report(before, now).degraded, words);
    EXPECT_EQ(report(now, now).degraded, "");
  }
}

TEST(Health, SaysAllThatTheServerDoesLessOfWithinTheBoundOfAText) {
  Health now;
  now.not_realtime = now.recording_ended = true;
  now.steps_lost = 1;
  now.broken_assumptions = 1;
  now.unsent = 1;
  now.device.values[static_cast<std::size_t>(DeviceCount::kSilences)] = 1;  // counter with the longest text
  const std::string degraded = report({}, now).degraded;
  EXPECT_EQ(degraded,
            "no real time; the log thread is too slow; recording has stopped; unsent datagrams; acceleration too high; "
            "device is silent");
  EXPECT_LE(degraded.size(), limits::kMaxDetail);
}

// DeviceCounters.HaveNamesOfTheirOwnAndWordsThatFitIntoAReport covers the texts of the other counters.
TEST(Health, EachCounterOfADriverThatMeansTroubleDegradesItsDevice) {
  for (const DeviceCounter& row : kDeviceCounters) {
    Health before;
    before.device.values[static_cast<std::size_t>(row.count)] = 3;
    Health now = before;
    EXPECT_EQ(report(before, now).degraded, "") << row.name;
    now.device.values[static_cast<std::size_t>(row.count)] = 4;
    EXPECT_EQ(report(before, now).degraded, row.degraded) << row.name;
  }
}

TEST(Health, OfSeveralCountersOfADriverTheWorstIsTold) {
  Health now;
  for (std::uint64_t& value : now.device.values) value = 1;
  EXPECT_EQ(report({}, now).degraded, "set-up fails");
}

}  // namespace
}  // namespace tendon::health_test
