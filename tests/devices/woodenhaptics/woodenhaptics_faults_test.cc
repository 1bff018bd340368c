// SPDX-License-Identifier: Apache-2.0
#include "devices/woodenhaptics/woodenhaptics_device.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

#include "tests/devices/woodenhaptics/woodenhaptics_bench.h"

namespace tendon::woodenhaptics_faults_test {
namespace {

using State = Device::State;
using Fault = FakeWoodenHaptics::Fault;
using Bench = WoodenHapticsBench;
using namespace std::chrono_literals;

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

/// These faults cost reports, but they do not stop the device. One corrupted report in three is not harmless, because a
/// byte may signal the button, which invalidates the calibration. On a real bus, USB rejects such reports because of
/// their checksum.
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
      // The arm accepts no commands, so only its watchdog can end the force.
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

    bench.arm.set_fault(Fault::kNone);
    bench.run(2s);  // the fault may have pressed the button
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
    for (const double bad : {kNan, HUGE_VAL}) {
      SCOPED_TRACE(static_cast<int>(place));
      Bench bench(options_for(place));
      go_to(bench, place);
      bench.run(3ms, Vec3(0, bad, 0));
      EXPECT_FALSE(bench.arm.pushes());
      EXPECT_EQ(bench.written, Vec3::Zero());
    }
  }
}

}  // namespace
}  // namespace tendon::woodenhaptics_faults_test
