// SPDX-License-Identifier: Apache-2.0
#include "devices/falcon/falcon_device.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>

#include "tests/devices/driver_bench.h"
#include "tests/devices/falcon/fake_falcon.h"
#include "tests/devices/falcon/fake_firmware.h"
#include "tests/devices/model_pipe.h"

namespace tendon::falcon_device_test {
namespace {

using State = Device::State;
using Fault = FakeFalcon::Fault;
using namespace std::chrono_literals;

struct Bench : DriverBench<Bench> {
  explicit Bench(const FakeFalcon::Options& options = {}, std::vector<std::uint8_t> firmware = fake_firmware(4096))
      : falcon(options),
        device({.firmware = std::move(firmware)}, std::make_unique<ModelPipe<FakeFalcon>>(falcon, now)) {}

  void step(const Vec3& force = Vec3::Zero()) {
    now += 1ms;
    drive(device, force);
    look(falcon.pushes(), falcon.running() && falcon.homed());
  }

  void home(const Vec3& /*force*/) { falcon.pull_through(); }

  /// Moves at 2 m/s to a position relative to the center.
  void move_to(const Vec3& place) {
    const Vec3 from = grip;
    const int turns = static_cast<int>((place - from).norm() / 0.002) + 1;
    for (int turn = 1; turn <= turns; ++turn) {
      grip = from + (place - from) * turn / turns;
      falcon.move_to(falcon::kCentre + grip);
      step();
    }
  }

  FakeFalcon falcon;
  FalconDevice device;
  Vec3 grip = Vec3::Zero();
};

const Vec3 kForce(1, -2, 2);

FakeFalcon::Options without_firmware() { return {.has_firmware = false, .firmware_bytes = 4096}; }

TEST(FalconDevice, FromThePlugToTheForceItTakesEveryStep) {
  Bench bench(without_firmware());
  bench.falcon.unplug();
  bench.run(100ms, kForce);
  EXPECT_EQ(bench.device.state(), State::kAbsent);
  bench.falcon.plug();
  EXPECT_TRUE(bench.reaches(State::kOpening, 100ms, kForce));
  EXPECT_TRUE(bench.reaches(State::kFirmware, 1s, kForce));
  EXPECT_TRUE(bench.reaches(State::kOpening, 2s, kForce));  // the loader waits for an answer of the firmware
  EXPECT_TRUE(bench.reaches(State::kUnhomed, 1s, kForce));
  EXPECT_EQ(bench.falcon.image(), fake_firmware(4096));
  bench.run(5s, kForce);
  EXPECT_EQ(bench.device.state(), State::kUnhomed);
  EXPECT_FALSE(bench.sample);
  EXPECT_GT(bench.falcon.commands(), 1000) << "it is asked, and given no force: its origin is not where it will be";
  EXPECT_EQ(bench.falcon.lamps(), falcon::kRed);
  bench.falcon.pull_through();
  EXPECT_TRUE(bench.reaches(State::kHomed, 100ms, kForce));
  EXPECT_EQ(bench.most_lawless, 0);
  bench.run(10ms, kForce);
  EXPECT_TRUE(bench.sample);
  EXPECT_EQ(bench.falcon.lamps(), falcon::kGreen);
  EXPECT_NEAR((bench.falcon.force() - kForce).norm(), 0, 0.02);
  EXPECT_NEAR((bench.written - bench.falcon.force()).norm(), 0, 1e-3);  // the driver knows the position to half a count
}

TEST(FalconDevice, ItsRingShowsAClientsColourButNeverRedAloneWhileReady) {
  Bench bench({.has_firmware = true});
  bench.falcon.plug();
  ASSERT_TRUE(bench.reaches(State::kUnhomed, 1s, kForce));
  const auto shows = [&](const OutputSetting& setting) {
    bench.device.set_output({}, 0, setting);
    bench.run(10ms, kForce);
    return bench.falcon.lamps();
  };
  EXPECT_EQ(shows(LampColour{0x0000FF}), falcon::kRed) << "it is not ready";
  bench.falcon.pull_through();
  ASSERT_TRUE(bench.reaches(State::kHomed, 100ms, kForce));
  bench.run(10ms, kForce);
  EXPECT_EQ(bench.falcon.lamps(), falcon::kBlue);
  EXPECT_EQ(shows(LampColour{0x80FF7F}), falcon::kRed | falcon::kGreen) << "from half its strength";
  EXPECT_EQ(shows(LampColour{0xFF0000}), falcon::kGreen);
  EXPECT_EQ(shows(LampColour{0xFFFFFF}), falcon::kRed | falcon::kGreen | falcon::kBlue);
  EXPECT_EQ(shows(Vibration{.amplitude = 1}), falcon::kRed | falcon::kGreen | falcon::kBlue) << "it cannot";
  EXPECT_EQ(shows(LampColour{0}), falcon::kGreen);
}

TEST(FalconDevice, OneThatHasItsFirmwareIsNotGivenItAgain) {
  Bench bench({.has_firmware = true});
  EXPECT_TRUE(bench.reaches(State::kUnhomed, 200ms));
  EXPECT_TRUE(bench.falcon.image().empty());
  EXPECT_EQ(bench.falcon.latency_ms(), 1);
}

TEST(FalconDevice, WithoutFirmwareItWaitsAndLooksAgain) {
  Bench bench(without_firmware(), {});
  EXPECT_TRUE(bench.reaches(State::kFirmware, 1s));
  bench.run(1s, kForce);
  EXPECT_EQ(bench.device.state(), State::kFirmware);
  EXPECT_TRUE(bench.falcon.image().empty());
  EXPECT_EQ(bench.falcon.commands(), 0);
  EXPECT_TRUE(bench.reaches(State::kOpening, 3s)) << "somebody else may have loaded it";
}

TEST(FalconDevice, PositionsAreThoseOfTheGripRelativeToTheCentre) {
  Dice dice(1);
  Bench bench({.has_firmware = true, .is_homed = true});
  ASSERT_TRUE(bench.reaches(State::kHomed, 200ms));
  for (int i = 0; i < 500; ++i) {
    const Vec3 to = 0.045 * dice.direction();
    bench.move_to(to);
    bench.run(2ms);
    ASSERT_TRUE(bench.sample);
    ASSERT_EQ(bench.sample->at, bench.now);
    ASSERT_LT((bench.sample->position - to).norm(), 150e-6) << "more than counts can be rounded";
  }
  EXPECT_EQ(bench.device.counts()[DeviceCount::kImplausible], 0U);
  EXPECT_EQ(bench.device.counts()[DeviceCount::kUnreachable], 0U);
}

TEST(FalconDevice, JointsAreTheThighsOfItsPose) {
  Dice dice(2);
  Bench bench({.has_firmware = true, .is_homed = true});
  ASSERT_EQ(bench.device.info().joints, (std::vector<std::string>{"thigh 1", "thigh 2", "thigh 3"}));
  EXPECT_EQ(bench.device.joints({}), Joints{}) << "not known yet";
  ASSERT_TRUE(bench.reaches(State::kHomed, 200ms));
  for (int i = 0; i < 100; ++i) {
    bench.move_to(0.045 * dice.direction());
    bench.run(2ms);
    ASSERT_TRUE(bench.sample);
    const auto pose = falcon::pose_at(falcon::kCentre + bench.sample->position);
    const Vec3 velocity = 0.2 * dice.direction();
    const Vec3 speeds = pose->jacobian * velocity;
    const Joints joints = bench.device.joints({.velocity = velocity});
    ASSERT_EQ(joints.count, 3U);
    for (std::size_t leg = 0; leg < 3; ++leg) {
      ASSERT_NEAR(joints.angle[leg], pose->angles[static_cast<Eigen::Index>(leg)], 1e-6);
      ASSERT_NEAR(joints.velocity[leg], speeds[static_cast<Eigen::Index>(leg)], 1e-5);
    }
  }
}

TEST(FalconDevice, ButtonsComeWithThePosition) {
  Bench bench({.has_firmware = true, .is_homed = true});
  ASSERT_TRUE(bench.reaches(State::kHomed, 200ms));
  bench.falcon.press(5);
  bench.run(3ms);
  ASSERT_TRUE(bench.sample);
  EXPECT_EQ(bench.sample->buttons, 5U);
}

// The event character makes the chip send each reply. Otherwise the latency timer (1 ms) may delay every second one.
TEST(FalconDevice, EveryPeriodOfAMillisecondHasItsSample) {
  for (const bool flush : {true, false}) {
    Bench bench({.has_firmware = true, .is_homed = true, .knows_flush_character = flush});
    ASSERT_TRUE(bench.reaches(State::kHomed, 200ms));
    int seen = 0;
    for (int i = 0; i < 1000; ++i) {
      bench.step(kForce);
      seen += bench.sample ? 1 : 0;
    }
    EXPECT_GE(seen, flush ? 1000 : 500);
    EXPECT_EQ(bench.device.counts()[DeviceCount::kUnanswered], 0U);
  }
}

TEST(FalconDevice, WhatIsReturnedIsWhatTheMotorsGive) {
  Dice dice(2);
  Bench bench({.has_firmware = true, .is_homed = true});
  ASSERT_TRUE(bench.reaches(State::kHomed, 200ms));
  for (int i = 0; i < 300; ++i) {
    bench.move_to(0.045 * dice.direction());
    const Vec3 wanted = dice.within(0, 40) * dice.direction();
    bench.run(5ms, wanted);
    ASSERT_TRUE(bench.sample);
    // The force can be wrong by a few thousandths, because the position is only known to one count.
    ASSERT_LT((bench.written - bench.falcon.force()).norm(), 0.01 * bench.written.norm() + 1e-3);
    ASSERT_LE(bench.written.norm(), wanted.norm() + 0.005);  // each torque is rounded separately
    ASSERT_GT(bench.written.normalized().dot(wanted.normalized()), 0.99);
  }
}

TEST(FalconDevice, OneReplyThatSaysHomedIsNotEnough) {
  Bench bench({.has_firmware = true});
  ASSERT_TRUE(bench.reaches(State::kUnhomed, 200ms, kForce));
  bench.falcon.pull_through();
  bench.run(5ms, kForce);
  EXPECT_EQ(bench.device.state(), State::kUnhomed);
  EXPECT_FALSE(bench.falcon.pushes());
  bench.run(20ms, kForce);
  EXPECT_EQ(bench.device.state(), State::kHomed);
  EXPECT_TRUE(bench.falcon.pushes());
}

TEST(FalconDevice, ZeroDoesNotWaitForAReply) {
  Bench bench({.has_firmware = true, .is_homed = true, .thinking = 4ms});  // every reply is late
  ASSERT_TRUE(bench.reaches(State::kHomed, 500ms));
  for (int i = 0; i < 20; ++i) {
    bench.run(9ms + i * 1ms, kForce);
    ASSERT_TRUE(bench.falcon.pushes());
    bench.step(Vec3::Zero());
    ASSERT_FALSE(bench.falcon.pushes());
    ASSERT_EQ(bench.written, Vec3::Zero());
  }
}

TEST(FalconDevice, ASlowReplyLeavesTheForceThatIsHeld) {
  Bench bench({.has_firmware = true, .is_homed = true, .thinking = 3ms});
  ASSERT_TRUE(bench.reaches(State::kHomed, 500ms));
  bench.run(20ms, kForce);
  const int before = bench.falcon.commands();
  for (int i = 0; i < 60; ++i) {
    bench.step((1 + i % 3) * kForce);
    ASSERT_NEAR((bench.written - bench.falcon.force()).norm(), 0, 1e-3);
  }
  EXPECT_LE(bench.falcon.commands() - before, 60 / 3) << "one request is under way at a time";
}

TEST(FalconDevice, AfterTheCableWasOutItTakesEveryStepAgain) {
  for (const bool own_supply : {false, true}) {
    Bench bench({.has_firmware = true, .is_homed = true, .firmware_bytes = 4096, .own_supply = own_supply});
    ASSERT_TRUE(bench.reaches(State::kHomed, 200ms));
    bench.run(20ms, kForce);
    ASSERT_TRUE(bench.falcon.pushes());
    bench.falcon.unplug();
    bench.step(kForce);
    EXPECT_EQ(bench.device.state(), State::kAbsent);
    EXPECT_FALSE(bench.sample);
    EXPECT_EQ(bench.written, Vec3::Zero());
    bench.run(1s, kForce);
    const int before = bench.falcon.commands();
    bench.falcon.plug();
    EXPECT_TRUE(bench.reaches(State::kOpening, 100ms, kForce));
    if (own_supply) {
      // The Falcon still pushes because it has not received a command. The force is set to zero by the first command.
      while (bench.falcon.commands() == before) bench.step(kForce);
      EXPECT_FALSE(bench.falcon.pushes());
    } else {
      EXPECT_TRUE(bench.reaches(State::kFirmware, 1s, kForce));
    }
    EXPECT_TRUE(bench.reaches(State::kUnhomed, 2s, kForce));
    EXPECT_FALSE(bench.falcon.pushes());
    EXPECT_TRUE(bench.reaches(State::kHomed, 1s, kForce));
    bench.run(10ms, kForce);
    EXPECT_TRUE(bench.falcon.pushes());
  }
}

TEST(FalconDevice, ACableThatWasOutForAMomentIsNoticed) {
  Bench bench({.has_firmware = true, .is_homed = true, .own_supply = true});
  ASSERT_TRUE(bench.reaches(State::kHomed, 200ms));
  bench.falcon.unplug();
  bench.falcon.plug();  // between two periods
  bench.step(kForce);
  EXPECT_EQ(bench.device.state(), State::kAbsent);
  EXPECT_TRUE(bench.reaches(State::kHomed, 1s, kForce));
}

TEST(FalconDevice, ALoopThatWasStoppedTakesUpWhereItWas) {
  Bench bench({.has_firmware = true, .is_homed = true});
  ASSERT_TRUE(bench.reaches(State::kHomed, 200ms));
  bench.run(20ms, kForce);
  bench.now += 300ms;
  bench.step(kForce);
  EXPECT_EQ(bench.device.state(), State::kHomed);
  EXPECT_TRUE(bench.sample);
  EXPECT_EQ(bench.device.counts()[DeviceCount::kSilences], 0U);
}

TEST(FalconDevice, AMomentaryEncoderJumpCostsOnlySamples) {
  Bench bench({.has_firmware = true, .is_homed = true});
  ASSERT_TRUE(bench.reaches(State::kHomed, 200ms));
  bench.run(20ms, kForce);
  bench.falcon.set_fault(Fault::kJumps);
  bench.run(1ms, kForce);  // receives the reply to an earlier command
  const auto replies = bench.device.counts()[DeviceCount::kAnswers];
  bench.run(4ms, kForce);
  EXPECT_EQ(bench.device.counts()[DeviceCount::kAnswers], replies);
  EXPECT_EQ(bench.device.counts()[DeviceCount::kImplausible], 4U);
  EXPECT_FALSE(bench.sample);
  bench.falcon.set_fault(Fault::kNone);
  bench.run(2ms, kForce);
  EXPECT_TRUE(bench.sample);
  EXPECT_TRUE(bench.falcon.pushes());
}

// The encoders have lost counts, so the origin has moved and positions would be wrong.
TEST(FalconDevice, AMovedOriginIsNotBelievedUntilHomedAnew) {
  for (const bool with_firmware : {false, true}) {
    Bench bench({.has_firmware = true, .is_homed = true, .firmware_bytes = 4096, .own_supply = true},
                with_firmware ? fake_firmware(4096) : std::vector<std::uint8_t>{});
    ASSERT_TRUE(bench.reaches(State::kHomed, 200ms));
    bench.run(20ms, kForce);
    bench.falcon.set_fault(Fault::kJumps);
    bench.run(200ms, kForce);
    EXPECT_EQ(bench.device.counts()[DeviceCount::kLostCounts], 1U);
    if (with_firmware) {
      EXPECT_EQ(bench.device.state(), State::kFirmware) << "which sets it back";
    } else {
      bench.run(2s, kForce);
      bench.falcon.unplug();  // the origin is still wrong, because the supply of the motors is still on
      bench.run(50ms, kForce);
      bench.falcon.plug();
      bench.run(2s, kForce);
      EXPECT_EQ(bench.device.state(), State::kUnhomed);
      EXPECT_TRUE(bench.falcon.homed());
      EXPECT_FALSE(bench.falcon.pushes());
      bench.falcon.set_fault(Fault::kLosesHome);  // power cycled by the user
    }
    bench.falcon.set_fault(Fault::kNone);
    bench.run(100ms, kForce);
    EXPECT_FALSE(bench.falcon.pushes());
    EXPECT_TRUE(bench.reaches(State::kHomed, 3s, kForce));
    bench.run(20ms, kForce);
    EXPECT_TRUE(bench.falcon.pushes());
  }
}

TEST(FalconDevice, ASafeDeviceIsHomedAndArmedAgainAfterAReplug) {
  Bench bench({.has_firmware = true, .firmware_bytes = 4096});
  expect_homing_and_arming_after_a_replug(
      bench, bench.falcon, [&] { bench.falcon.pull_through(); }, [](LocalTime) {});
}

enum class Place { kOpening, kReset, kGreeting, kSending, kUnhomed, kHomed, kPushing };
constexpr std::array kPlaces = {Place::kOpening, Place::kReset, Place::kGreeting, Place::kSending,
                                Place::kUnhomed, Place::kHomed, Place::kPushing};

FakeFalcon::Options options_for(Place place, bool own_supply) {
  const bool loads = place == Place::kReset || place == Place::kGreeting || place == Place::kSending;
  return {.has_firmware = !loads,
          .is_homed = place == Place::kHomed || place == Place::kPushing,
          .firmware_bytes = 4096,
          .own_supply = own_supply};
}

void go_to(Bench& bench, Place place) {
  switch (place) {
    case Place::kOpening:
      ASSERT_TRUE(bench.reaches(State::kOpening, 100ms, kForce));
      break;
    case Place::kReset:
    case Place::kGreeting:
    case Place::kSending:
      ASSERT_TRUE(bench.reaches(State::kFirmware, 1s, kForce));
      bench.run(place == Place::kReset ? 3ms : place == Place::kGreeting ? 20ms : 200ms, kForce);
      ASSERT_EQ(bench.device.state(), State::kFirmware);
      break;
    case Place::kUnhomed:
      ASSERT_TRUE(bench.reaches(State::kUnhomed, 200ms, kForce));
      break;
    case Place::kHomed:
    case Place::kPushing:
      ASSERT_TRUE(bench.reaches(State::kHomed, 200ms));
      bench.run(20ms, place == Place::kPushing ? kForce : Vec3::Zero());
      ASSERT_EQ(bench.falcon.pushes(), place == Place::kPushing);
      break;
  }
}

class FalconFault : public testing::TestWithParam<Fault> {};

bool is_harmless(Fault fault) {
  return fault == Fault::kDropsSome || fault == Fault::kGarblesSome || fault == Fault::kSplits ||
         fault == Fault::kBabbles;
}

TEST_P(FalconFault, EndsInZeroForceAtEveryState) {
  const Fault fault = GetParam();
  for (const Place place : kPlaces) {
    SCOPED_TRACE(static_cast<int>(place));
    Bench bench(options_for(place, false));
    go_to(bench, place);
    ASSERT_EQ(bench.most_lawless, 0);

    bench.falcon.set_fault(fault);
    bench.run(1s, kForce);
    if (!is_harmless(fault) && fault != Fault::kStalls) {
      EXPECT_GE(bench.after_zero, 1000 - 15) << "torque later than 15 ms after the fault";
      EXPECT_EQ(bench.written, Vec3::Zero());
      EXPECT_LE(bench.most_lawless, 15);
    } else if (is_harmless(fault)) {
      EXPECT_EQ(bench.most_lawless, 0);
      if (place == Place::kPushing) {
        EXPECT_TRUE(bench.falcon.pushes()) << "this fault costs samples, not the device";
        EXPECT_EQ(bench.device.state(), State::kHomed);
      }
    } else {
      // The device accepts no commands, so the driver cannot end its force.
      EXPECT_NE(bench.device.state(), State::kHomed);
      EXPECT_EQ(bench.written, Vec3::Zero());
    }

    bench.falcon.set_fault(Fault::kNone);
    bench.most_lawless = bench.lawless = 0;
    EXPECT_TRUE(bench.reaches(State::kHomed, 15s, kForce));
    bench.run(20ms, kForce);
    EXPECT_TRUE(bench.falcon.pushes());
    EXPECT_EQ(bench.most_lawless, 0);
  }
}

std::string name_of(const testing::TestParamInfo<Fault>& info) {
  constexpr std::array kNames = {"None",      "Silent",        "DropsSome",  "GarblesSome", "GarblesAll",
                                 "CutsAll",   "Splits",        "Babbles",    "BabblesOnly", "Jumps",
                                 "LosesHome", "LosesFirmware", "OutOfReach", "Stalls"};
  return kNames[static_cast<std::size_t>(info.param)];
}

INSTANTIATE_TEST_SUITE_P(Each, FalconFault, testing::ValuesIn(FakeFalcon::kFaults), name_of);

TEST(FalconDevice, UnpluggedAtAnyStateItIsAbsentAtOnce) {
  for (const Place place : kPlaces) {
    SCOPED_TRACE(static_cast<int>(place));
    Bench bench(options_for(place, false));
    go_to(bench, place);
    bench.falcon.unplug();
    bench.step(kForce);
    EXPECT_EQ(bench.device.state(), State::kAbsent);
    EXPECT_EQ(bench.written, Vec3::Zero());
    bench.run(50ms, kForce);
    bench.falcon.plug();
    EXPECT_TRUE(bench.reaches(State::kHomed, 15s, kForce));
    EXPECT_EQ(bench.most_lawless, 0);
  }
}

}  // namespace
}  // namespace tendon::falcon_device_test
