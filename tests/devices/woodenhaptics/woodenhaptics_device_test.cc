// SPDX-License-Identifier: Apache-2.0
#include "devices/woodenhaptics/woodenhaptics_device.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <numbers>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "devices/safety/safe_device.h"
#include "tests/devices/model_pipe.h"
#include "tests/devices/woodenhaptics/fake_woodenhaptics.h"

namespace tendon {
namespace {

using State = Device::State;
using Fault = FakeWoodenHaptics::Fault;
using namespace std::chrono_literals;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
const Vec3 kForce(1, -0.5, 1);

/// A cable whose driver's end can be full.
class Cable final : public usb::Pipe {
 public:
  Cable(FakeWoodenHaptics& arm, const LocalTime& now, const bool& full) : pipe_(arm, now), full_(full) {}
  std::uint32_t connection() noexcept override { return pipe_.connection(); }
  bool request(const usb::Request& request) noexcept override { return pipe_.request(request); }
  bool write(std::span<const std::uint8_t> bytes) noexcept override { return !full_ && pipe_.write(bytes); }
  bool settled() const noexcept override { return pipe_.settled(); }
  std::size_t read(std::span<std::uint8_t, usb::kPacketSize> packet) noexcept override { return pipe_.read(packet); }
  void reopen() noexcept override { pipe_.reopen(); }

 private:
  ModelPipe<FakeWoodenHaptics> pipe_;
  const bool& full_;
};

/// A driver, a cable and an arm, one turn of the haptic loop after the other in simulated time.
struct Bench {
  explicit Bench(const FakeWoodenHaptics::Options& options = {}, double max_current = 2)
      : arm(options),
        device({.model = woodenhaptics::find_model(options.model), .max_current = max_current},
               std::make_unique<Cable>(arm, now, full)) {}

  void step(const Vec3& force = Vec3::Zero()) {
    now += 1ms;
    arm.advance(now);
    sample = device.read(now);
    written = device.apply(force);
    lawless = arm.pushes() && !arm.calibrated() ? lawless + 1 : 0;
    most_lawless = std::max(most_lawless, lawless);
    after_zero = arm.pushes() ? 0 : after_zero + 1;
    for (std::size_t motor = 0; motor < 3; ++motor) {
      EXPECT_GE(arm.pulse_width(motor), 0.1);
      EXPECT_LE(arm.pulse_width(motor), 0.9);
    }
  }

  void run(Duration time, const Vec3& force = Vec3::Zero()) {
    for (const LocalTime end = now + time; now < end;) step(force);
  }

  /// At 2 m/s to a place relative to the centre.
  void move_to(const Vec3& place, const Vec3& force = Vec3::Zero()) {
    const Vec3 from = arm.position();
    const int turns = static_cast<int>((place - from).norm() / 0.002) + 1;
    for (int turn = 1; turn <= turns; ++turn) {
      arm.move_to(from + (place - from) * turn / turns);
      step(force);
    }
  }

  /// As the operator does: into the calibration pose, the button, and back to the centre.
  void calibrate(const Vec3& force = Vec3::Zero()) {
    const Vec3 counts = arm.arm().calibration();
    arm.turn_to(counts.cwiseProduct(arm.arm().per_count()));
    run(20ms, force);
    if (device.state() != State::kHomed) arm.press_calibrate();
    run(60ms, force);
    // By turning: straight lines out of a folded arm are faster than a hand.
    const Vec3 from = counts.cwiseProduct(arm.arm().per_count());
    const Vec3 to = arm.arm().angles_at(Vec3::Zero());
    for (int turn = 1; turn <= 100; ++turn) {
      arm.turn_to(from + (to - from) * turn / 100);
      step(force);
    }
  }

  /// Whether it comes to `state`; calibrates where that is the way.
  bool reaches(State state, Duration most, const Vec3& force = Vec3::Zero()) {
    for (const LocalTime end = now + most; now < end && device.state() != state;) {
      step(force);
      if (state == State::kHomed && device.state() == State::kUnhomed) calibrate(force);
    }
    return device.state() == state;
  }

  LocalTime now{};
  bool full = false;
  FakeWoodenHaptics arm;
  WoodenHapticsDevice device;
  std::optional<PositionSample> sample;
  Vec3 written = Vec3::Zero();
  int lawless = 0;  ///< turns in a row with current in an arm whose counters mean nothing
  int most_lawless = 0;
  int after_zero = 0;  ///< turns in a row without current
};

TEST(WoodenHapticsDevice, FromThePlugToTheForceItTakesEveryStep) {
  for (const auto& model : woodenhaptics::models()) {
    SCOPED_TRACE(model.name);
    Bench bench({.model = model.name});
    bench.arm.unplug();
    bench.run(100ms, kForce);
    EXPECT_EQ(bench.device.state(), State::kAbsent);
    bench.arm.plug();
    EXPECT_TRUE(bench.reaches(State::kOpening, 100ms, kForce));
    EXPECT_TRUE(bench.reaches(State::kUnhomed, 100ms, kForce));
    bench.run(1s, kForce);
    EXPECT_EQ(bench.device.state(), State::kUnhomed);
    EXPECT_FALSE(bench.sample);
    EXPECT_FALSE(bench.arm.pushes());
    bench.calibrate(kForce);
    EXPECT_EQ(bench.device.state(), State::kHomed);
    EXPECT_EQ(bench.arm.calibrations(), 1);
    EXPECT_EQ(bench.most_lawless, 0);
    bench.run(10ms, kForce);
    ASSERT_TRUE(bench.sample);
    EXPECT_LT(bench.sample->position.norm(), 2 * bench.device.info().position_resolution);
    EXPECT_TRUE(bench.arm.pushes());
    // What one of a wrong sign or scale would not come near; a count of each joint is some thousandths.
    EXPECT_LT((bench.arm.force() - bench.written).norm(), 0.01 * bench.written.norm());
    EXPECT_GT(bench.written.normalized().dot(kForce.normalized()), 0.999);
  }
}

TEST(WoodenHapticsDevice, SaysWhatItIsAndWhenItsFirmwareLetsGo) {
  const Bench bench;
  const DeviceInfo& info = bench.device.info();
  EXPECT_EQ(info.name, "woodenhaptics_v2019");
  EXPECT_EQ(info.max_force, 5);
  EXPECT_EQ(info.watchdog, 500ms);
  // 2π/2000 of a turn, gear 12, the lower link of 245 mm.
  EXPECT_NEAR(info.position_resolution, 2 * std::numbers::pi / 2000 / 12 * 0.245, 1e-9);
  EXPECT_GT(info.force_resolution, 16 * 0.321e-3 / 0.220) << "a mA of the motor of body A alone";
  EXPECT_LT(info.force_resolution, 0.05);
}

TEST(WoodenHapticsDevice, RefusesTooHighCurrentsAndAMissingModel) {
  LocalTime now{};
  FakeWoodenHaptics arm({});
  const auto refuses = [&](const WoodenHapticsDevice::Config& config) {
    EXPECT_THROW(WoodenHapticsDevice(config, std::make_unique<ModelPipe<FakeWoodenHaptics>>(arm, now)),
                 std::invalid_argument);
  };
  const auto* v2019 = woodenhaptics::find_model("woodenhaptics_v2019");
  refuses({});
  refuses({.model = v2019, .max_current = 0});
  refuses({.model = v2019, .max_current = kNan});
  refuses({.model = v2019, .max_current = 3.1});
  WoodenHapticsDevice({.model = woodenhaptics::find_model("woodenhaptics_v2015"), .max_current = 6},
                      std::make_unique<ModelPipe<FakeWoodenHaptics>>(arm, now));
}

// It flashes its lamps, and has room for one report until then.
TEST(WoodenHapticsDevice, ABoardThatIsStillStartingIsAskedOnceAndWaitedFor) {
  Bench bench({.boot = 1s});
  ASSERT_TRUE(bench.reaches(State::kOpening, 100ms));
  bench.run(900ms, kForce);
  EXPECT_EQ(bench.device.state(), State::kOpening);
  EXPECT_LE(bench.arm.most_waiting(), 1);
  EXPECT_TRUE(bench.reaches(State::kUnhomed, 200ms));
  EXPECT_EQ(bench.device.counts()[DeviceCount::kSilences], 0U);
}

TEST(WoodenHapticsDevice, PositionsAreThoseOfTheTipRelativeToTheCentre) {
  Dice dice(1);
  for (const char* model : {"woodenhaptics_v2019", "polhem_v1"}) {
    Bench bench({.model = model});
    ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
    for (int i = 0; i < 200; ++i) {
      const Vec3 to = 0.06 * dice.direction();
      bench.move_to(to);
      bench.run(3ms);
      ASSERT_TRUE(bench.sample);
      ASSERT_EQ(bench.sample->at, bench.now);
      ASSERT_LT((bench.sample->position - to).norm(), 200e-6) << "more than counts can be rounded";
    }
    EXPECT_EQ(bench.device.counts()[DeviceCount::kImplausible], 0U);
  }
}

// 16 bits are one turn of the body: the arm goes round twice and half.
TEST(WoodenHapticsDevice, CountersThatWrapAreFollowed) {
  for (const double turns : {2.5, -2.5}) {
    Bench bench;
    ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
    const Vec3 centre = bench.arm.arm().angles_at(Vec3::Zero());
    const Vec3 angles = centre + Vec3(2 * std::numbers::pi * turns, 0, 0);
    for (double share = 0; share < 1; share += 1e-3) {
      bench.arm.turn_to(centre + share * (angles - centre));
      bench.step();
    }
    bench.arm.turn_to(angles);
    bench.run(3ms);
    ASSERT_EQ(bench.device.state(), State::kHomed);
    ASSERT_TRUE(bench.sample);
    EXPECT_LT((bench.sample->position - bench.arm.position()).norm(), 200e-6);
    EXPECT_LT(bench.sample->position.x(), -0.4) << "behind the column";
  }
}

TEST(WoodenHapticsDevice, TheSwitchAtTheTipIsButton0) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
  bench.run(3ms);
  EXPECT_EQ(bench.sample->buttons, 0U);
  bench.arm.close_switch(true);
  bench.run(3ms);
  EXPECT_EQ(bench.sample->buttons, 1U);
}

// A full-speed bus takes a frame each way, so two reports are under way.
TEST(WoodenHapticsDevice, EveryPeriodOfAMillisecondHasItsSampleAndItsCommand) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
  const int before = bench.arm.obeyed();
  int seen = 0;
  for (int i = 0; i < 1000; ++i) {
    bench.step(kForce);
    seen += bench.sample ? 1 : 0;
  }
  EXPECT_EQ(seen, 1000);
  EXPECT_GE(bench.arm.obeyed() - before, 999);
  EXPECT_EQ(bench.device.counts()[DeviceCount::kUnanswered], 0U);
  EXPECT_LE(bench.arm.most_waiting(), 2);
}

TEST(WoodenHapticsDevice, WhatIsReturnedIsWhatTheMotorsGive) {
  Dice dice(2);
  for (const double max_current : {2.0, 0.5}) {
    Bench bench({}, max_current);
    ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
    for (int i = 0; i < 200; ++i) {
      bench.move_to(0.06 * dice.direction());
      const Vec3 wanted = dice.within(0.5, 40) * dice.direction();
      bench.run(5ms, wanted);
      ASSERT_TRUE(bench.sample);
      ASSERT_LT((bench.written - bench.arm.force()).norm(), 0.01 * bench.written.norm() + 1e-3);
      ASSERT_LE(bench.written.norm(), wanted.norm() + bench.device.info().force_resolution);
      ASSERT_GT(bench.written.normalized().dot(wanted.normalized()), 0.99);
      for (std::size_t motor = 0; motor < 3; ++motor) {
        ASSERT_LE(std::abs(bench.arm.pulse_width(motor) - 0.5), 0.4 * max_current / 3 + 1e-9);
      }
    }
  }
}

TEST(WoodenHapticsDevice, AForceThatIsNoNumberIsNoneAtEveryPlace) {
  Bench bench;
  bench.run(30ms, Vec3::Constant(kNan));
  ASSERT_TRUE(bench.reaches(State::kHomed, 1s, Vec3::Constant(kNan)));
  EXPECT_EQ(bench.most_lawless, 0);
  for (const double bad : {kNan, std::numeric_limits<double>::infinity()}) {
    bench.run(10ms, kForce);
    ASSERT_TRUE(bench.arm.pushes());
    bench.run(3ms, Vec3(bad, 0, 0));
    EXPECT_FALSE(bench.arm.pushes());
    EXPECT_EQ(bench.written, Vec3::Zero());
  }
}

TEST(WoodenHapticsDevice, ZeroDoesNotWaitForAnAnswer) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
  bench.run(20ms, kForce);
  bench.arm.set_fault(Fault::kSilent);
  bench.run(4ms, kForce);  // two reports are under way, and will never be answered
  ASSERT_TRUE(bench.arm.pushes());
  bench.step();
  EXPECT_EQ(bench.written, Vec3::Zero());
  bench.step();  // the frame that brings it
  EXPECT_FALSE(bench.arm.pushes());
}

// --- Calibration
// ------------------------------------------------------------------------------------------------------

TEST(WoodenHapticsDevice, WithoutTheButtonItIsNeverHomed) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(State::kUnhomed, 200ms, kForce));
  bench.run(5s, kForce);
  EXPECT_EQ(bench.device.state(), State::kUnhomed);
  EXPECT_EQ(bench.arm.calibrations(), 0);
  EXPECT_EQ(bench.most_lawless, 0);
  EXPECT_GT(bench.arm.obeyed(), 4900) << "and its watchdog is fed with zeros";
}

TEST(WoodenHapticsDevice, OneReportOfAPressedButtonIsNotEnough) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(State::kUnhomed, 200ms, kForce));
  bench.run(10ms, kForce);
  bench.arm.press_calibrate();
  bench.run(8ms, kForce);
  EXPECT_EQ(bench.arm.calibrations(), 0);
  bench.run(8ms, kForce);
  EXPECT_EQ(bench.arm.calibrations(), 1);
  EXPECT_EQ(bench.device.state(), State::kUnhomed) << "nor is one that has the counters";
  bench.run(20ms, kForce);
  EXPECT_EQ(bench.device.state(), State::kHomed);
  EXPECT_EQ(bench.arm.calibrations(), 1);
}

TEST(WoodenHapticsDevice, TheButtonEndsTheForceAtOnceAndCalibratesAnew) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
  bench.run(20ms, kForce);
  ASSERT_TRUE(bench.arm.pushes());
  bench.most_lawless = 0;
  bench.arm.press_calibrate();
  bench.run(4ms, kForce);
  EXPECT_FALSE(bench.arm.pushes());
  EXPECT_EQ(bench.device.state(), State::kUnhomed);
  EXPECT_LE(bench.most_lawless, 3) << "a frame for the report, one for the answer";
}

TEST(WoodenHapticsDevice, CountersNotSetAsToldAreNoCalibration) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(State::kUnhomed, 200ms));
  bench.arm.press_calibrate();
  for (int i = 0; i < 100 && bench.arm.calibrations() == 0; ++i) bench.step();
  bench.arm.set_fault(Fault::kJumps);
  bench.run(100ms, kForce);
  EXPECT_EQ(bench.device.state(), State::kUnhomed);
  EXPECT_EQ(bench.device.counts()[DeviceCount::kFailedSetups], 1U);
  EXPECT_FALSE(bench.arm.pushes());
  bench.arm.set_fault(Fault::kNone);
  bench.run(100ms, kForce);
  EXPECT_EQ(bench.device.state(), State::kUnhomed) << "until the button is pressed again";
  EXPECT_TRUE(bench.reaches(State::kHomed, 1s));
}

// Found by tests/fuzz: whoever does not answer has not asked again.
TEST(WoodenHapticsDevice, TheCountersAreNotSetAgainUnlessItIsAskedForAgain) {
  int until_set = 0;
  for (const bool silent : {false, true}) {
    Bench bench;
    ASSERT_TRUE(bench.reaches(State::kUnhomed, 200ms));
    bench.arm.press_calibrate();
    if (!silent) {
      for (; until_set < 100 && bench.arm.calibrations() == 0; ++until_set) bench.step();
      ASSERT_EQ(bench.arm.calibrations(), 1);
      continue;
    }
    for (int i = 1; i < until_set; ++i) bench.step();
    ASSERT_EQ(bench.arm.calibrations(), 0) << "command 1 is on the bus";
    bench.arm.set_fault(Fault::kSilent);  // the last that is heard of it is the request
    bench.run(90ms);
    EXPECT_EQ(bench.arm.calibrations(), 1);
  }
}

// Nobody knows what became of its counters meanwhile.
TEST(WoodenHapticsDevice, ABoardThatWasCalibratedBeforeIsNotBelievedToBe) {
  for (const bool own_supply : {false, true}) {
    Bench bench({.own_supply = own_supply});
    ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
    bench.run(20ms, kForce);
    bench.arm.unplug();
    bench.arm.plug();  // between two turns
    bench.step(kForce);
    EXPECT_EQ(bench.device.state(), State::kAbsent);
    EXPECT_FALSE(bench.sample);
    EXPECT_EQ(bench.written, Vec3::Zero());
    EXPECT_TRUE(bench.reaches(State::kUnhomed, 200ms, kForce));
    bench.run(1s, kForce);
    EXPECT_EQ(bench.device.state(), State::kUnhomed);
    EXPECT_FALSE(bench.arm.pushes());
    EXPECT_TRUE(bench.reaches(State::kHomed, 1s, kForce));
    bench.run(10ms, kForce);
    EXPECT_TRUE(bench.arm.pushes());
  }
}

// --- The firmware's watchdog
// ------------------------------------------------------------------------------------------

// Of the model, which is the firmware step by step: no code of the driver is alive here.
TEST(WoodenHapticsDevice, WhenTheHostIsDeadTheFirmwareLetsGoHalfASecondLater) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
  bench.run(20ms, kForce);
  ASSERT_TRUE(bench.arm.pushes());
  bench.arm.lose_host();
  const LocalTime dead = bench.now;
  while (bench.arm.pushes() && bench.now - dead < 1s) bench.arm.advance(bench.now += 1ms);
  EXPECT_GE(bench.now - dead, 497ms) << "nothing else ended it";
  EXPECT_LE(bench.now - dead, 501ms);
  EXPECT_FALSE(bench.arm.amplifiers_on());
}

TEST(WoodenHapticsDevice, WithTheCableOutASelfPoweredBoardLetsGo) {
  Bench bench({.own_supply = true});
  ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
  bench.run(20ms, kForce);
  bench.arm.unplug();
  bench.run(400ms, kForce);
  EXPECT_TRUE(bench.arm.pushes());
  EXPECT_EQ(bench.written, Vec3::Zero()) << "as far as the driver can tell";
  bench.run(101ms, kForce);
  EXPECT_FALSE(bench.arm.pushes());
}

TEST(WoodenHapticsDevice, ItsAmplifiersAreOffUntilTheFirstReport) {
  Bench bench;
  bench.arm.advance(bench.now += 1s);
  EXPECT_FALSE(bench.arm.amplifiers_on());
  ASSERT_TRUE(bench.reaches(State::kUnhomed, 200ms));
  EXPECT_TRUE(bench.arm.amplifiers_on());
  EXPECT_FALSE(bench.arm.pushes());
}

TEST(WoodenHapticsDevice, ReportsOfAnotherLengthDoNotFeedTheWatchdog) {
  LocalTime now{};
  FakeWoodenHaptics arm({});
  arm.advance(now);
  const std::vector<std::uint8_t> pushes{100, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  arm.write(now, pushes);
  for (int i = 0; i < 10; ++i) arm.advance(now += 1ms);
  EXPECT_TRUE(arm.pushes());
  for (int i = 0; i < 495; ++i) {
    arm.write(now, std::vector<std::uint8_t>(i % 2 == 0 ? 64 : 15, 0));
    arm.take_in(now += 1ms);
  }
  EXPECT_FALSE(arm.pushes());
}

// The ledger counts the force that `apply` returns.
TEST(WoodenHapticsDevice, AfterAPauseBeyondTheWatchdogTheOldForceIsOver) {
  for (const Duration pause : {Duration(300ms), Duration(700ms)}) {
    Bench bench;
    ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
    bench.run(20ms, kForce);
    bench.now += pause;
    bench.full = true;  // nothing new can be written
    bench.step(kForce);
    ASSERT_EQ(bench.device.state(), State::kHomed);
    EXPECT_EQ(bench.arm.pushes(), pause < 500ms);
    EXPECT_EQ(bench.written != Vec3::Zero(), pause < 500ms);
    bench.full = false;
    bench.run(3ms, kForce);
    EXPECT_TRUE(bench.arm.pushes());
  }
}

TEST(WoodenHapticsDevice, ALoopThatStoodStillTakesUpWhereItWas) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
  bench.run(20ms, kForce);
  bench.now += 300ms;
  bench.step(kForce);
  EXPECT_EQ(bench.device.state(), State::kHomed);
  EXPECT_TRUE(bench.sample);
  EXPECT_EQ(bench.device.counts()[DeviceCount::kSilences], 0U);
}

TEST(WoodenHapticsDevice, AMomentaryEncoderJumpCostsOnlySamples) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
  bench.run(20ms, kForce);
  bench.arm.set_fault(Fault::kJumps);
  bench.run(2ms, kForce);  // takes the reports from before
  const DeviceCounts before = bench.device.counts();
  bench.run(4ms, kForce);
  EXPECT_EQ(bench.device.counts()[DeviceCount::kAnswers], before[DeviceCount::kAnswers]);
  EXPECT_EQ(bench.device.counts()[DeviceCount::kImplausible], before[DeviceCount::kImplausible] + 4);
  EXPECT_FALSE(bench.sample);
  bench.arm.set_fault(Fault::kNone);
  bench.run(3ms, kForce);
  ASSERT_TRUE(bench.sample);
  EXPECT_LT(bench.sample->position.norm(), 200e-6);
  EXPECT_TRUE(bench.arm.pushes());
}

TEST(WoodenHapticsDevice, ASafeDeviceIsHomedAndArmedAgainAfterAReplug) {
  Bench bench;
  SafeDevice safe({}, bench.device);
  const auto run = [&](Duration time, const Vec3& force) {
    for (const LocalTime end = bench.now + time; bench.now < end;) {
      bench.arm.advance(bench.now += 1ms);
      safe.read(bench.now);
      safe.apply(force);
      ASSERT_TRUE(!bench.arm.pushes() || safe.status().state == SafetyState::kArmed);
    }
  };
  for (int plugged = 0; plugged < 2; ++plugged) {
    run(200ms, Vec3::Zero());
    ASSERT_EQ(safe.state(), State::kUnhomed);
    safe.arm();
    run(200ms, Vec3::Zero());
    EXPECT_NE(safe.status().state, SafetyState::kArmed) << "not homed";
    bench.arm.turn_to(bench.arm.arm().calibration().cwiseProduct(bench.arm.arm().per_count()));
    bench.arm.press_calibrate();
    run(2s, kForce);
    EXPECT_EQ(safe.state(), State::kHomed);
    EXPECT_FALSE(bench.arm.pushes()) << "homed, and not armed";
    safe.arm();
    run(200ms, Vec3::Zero());
    ASSERT_EQ(safe.status().state, SafetyState::kArmed);
    run(200ms, kForce);
    EXPECT_TRUE(bench.arm.pushes());
    bench.arm.unplug();
    bench.arm.plug();
    run(1ms, kForce);
    EXPECT_EQ(safe.status().state, SafetyState::kFault);
    EXPECT_EQ(safe.status().last_fault, SafetyFault::kDeviceLost);
  }
}

// --- Every fault at every state
// ---------------------------------------------------------------------------------------

enum class Place { kBooting, kOpening, kUnhomed, kCalibrating, kSetting, kHomed, kPushing };
constexpr std::array kPlaces = {Place::kBooting, Place::kOpening, Place::kUnhomed, Place::kCalibrating,
                                Place::kSetting, Place::kHomed,   Place::kPushing};

FakeWoodenHaptics::Options options_for(Place place) { return {.boot = place == Place::kBooting ? 1s : 0s}; }

void go_to(Bench& bench, Place place) {
  if (place <= Place::kOpening) {
    ASSERT_TRUE(bench.reaches(State::kOpening, 100ms, kForce));
    return;
  }
  if (place >= Place::kHomed) {
    ASSERT_TRUE(bench.reaches(State::kHomed, 1s));
    bench.run(20ms, place == Place::kPushing ? kForce : Vec3::Zero());
    ASSERT_EQ(bench.arm.pushes(), place == Place::kPushing);
    return;
  }
  ASSERT_TRUE(bench.reaches(State::kUnhomed, 200ms, kForce));
  bench.run(20ms, kForce);
  if (place == Place::kUnhomed) return;
  bench.arm.press_calibrate();
  bench.run(5ms, kForce);
  for (int i = 0; i < 100 && place == Place::kSetting && bench.arm.calibrations() == 0; ++i) bench.step(kForce);
  ASSERT_EQ(bench.device.state(), State::kUnhomed);
}

class WoodenHapticsFault : public testing::TestWithParam<Fault> {};

/// Those that cost reports and not the device. A wrong byte in one of three reports may say that the button was
/// pressed, which costs the home: USB's own checksum makes it none that is seen.
bool is_harmless(Fault fault) { return fault == Fault::kDropsSome || fault == Fault::kBabbles; }

TEST_P(WoodenHapticsFault, EndsInZeroForceAtEveryState) {
  const Fault fault = GetParam();
  for (const Place place : kPlaces) {
    SCOPED_TRACE(static_cast<int>(place));
    Bench bench(options_for(place));
    go_to(bench, place);
    ASSERT_EQ(bench.most_lawless, 0);

    const int obeyed = bench.arm.obeyed();
    bench.arm.set_fault(fault);
    bench.run(1s, kForce);
    if (is_harmless(fault)) {
      EXPECT_EQ(bench.most_lawless, 0);
      if (place == Place::kPushing) {
        EXPECT_TRUE(bench.arm.pushes()) << "this fault costs samples, not the device";
        EXPECT_EQ(bench.device.state(), State::kHomed);
      }
    } else if (fault == Fault::kGarblesSome) {
      EXPECT_EQ(bench.most_lawless, 0);
    } else if (fault == Fault::kStalls || fault == Fault::kHangs) {
      // It takes nothing any more: what it holds is its watchdog's to end.
      EXPECT_LE(bench.arm.obeyed(), obeyed + 1);
      EXPECT_GE(bench.after_zero, 1000 - 502);
      EXPECT_NE(bench.device.state(), State::kHomed);
      EXPECT_EQ(bench.written, Vec3::Zero());
    } else if (fault == Fault::kCalibrates && place >= Place::kCalibrating) {
      EXPECT_LE(bench.most_lawless, 3) << "until it has been calibrated anew, as whoever pressed it wanted";
    } else if (fault != Fault::kCalibrates) {
      EXPECT_GE(bench.after_zero, 1000 - 15) << "current later than 15 ms after the fault";
      EXPECT_EQ(bench.written, Vec3::Zero());
      EXPECT_LE(bench.most_lawless, 15);
    }

    // Once the trouble is over it comes back, calibrated anew, and never pushes on the way.
    bench.arm.set_fault(Fault::kNone);
    bench.run(2s);  // a button that was pressed before is pressed
    bench.most_lawless = bench.lawless = 0;
    EXPECT_TRUE(bench.reaches(State::kHomed, 5s, kForce));
    bench.move_to(Vec3::Zero());
    bench.run(20ms, kForce);
    EXPECT_TRUE(bench.arm.pushes());
    EXPECT_EQ(bench.most_lawless, 0);
  }
}

std::string name_of(const testing::TestParamInfo<Fault>& info) {
  constexpr std::array kNames = {"None",       "Silent",  "Hangs",      "DropsSome", "GarblesSome",
                                 "GarblesAll", "CutsAll", "PadsAll",    "Babbles",   "BabblesOnly",
                                 "Jumps",      "Forgets", "Calibrates", "Stalls"};
  return kNames[static_cast<std::size_t>(info.param)];
}

INSTANTIATE_TEST_SUITE_P(Each, WoodenHapticsFault, testing::ValuesIn(FakeWoodenHaptics::kFaults), name_of);

TEST(WoodenHapticsDevice, UnpluggedItIsAbsentAtOnceAndNanChangesNothing) {
  for (const Place place : kPlaces) {
    for (const Vec3& force : {kForce, Vec3(kNan, 0, 0)}) {
      SCOPED_TRACE(static_cast<int>(place));
      Bench bench(options_for(place));
      go_to(bench, place);
      bench.arm.unplug();
      bench.step(force);
      EXPECT_EQ(bench.device.state(), State::kAbsent);
      EXPECT_EQ(bench.written, Vec3::Zero());
      bench.run(50ms, force);
      bench.arm.plug();
      EXPECT_TRUE(bench.reaches(State::kHomed, 5s, force));
      EXPECT_EQ(bench.most_lawless, 0);
    }
  }
}

TEST(WoodenHapticsDevice, AForceThatIsNoNumberIsNoneAtEveryState) {
  for (const Place place : kPlaces) {
    SCOPED_TRACE(static_cast<int>(place));
    Bench bench(options_for(place));
    go_to(bench, place);
    bench.run(3ms, Vec3(0, kNan, 0));
    EXPECT_FALSE(bench.arm.pushes());
    EXPECT_EQ(bench.written, Vec3::Zero());
  }
}

}  // namespace
}  // namespace tendon
