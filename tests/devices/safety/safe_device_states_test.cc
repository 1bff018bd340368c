// SPDX-License-Identifier: Apache-2.0
#include "devices/safety/safe_device.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "core/base/rotation.h"
#include "tests/devices/safety/safety_rig.h"
#include "tests/support/dice.h"

namespace tendon::safe_device_states_test {
namespace {

using namespace std::chrono_literals;
using By = SafeDevice::Arming::By;

constexpr Duration kRamp = 10ms;

SafeDevice::Config everything() {
  SafeDevice::Config config;
  config.growth_limit = GrowthLimit::Config{.rate = 2000};
  config.force_limit = ForceLimit::Config{.max = 8};
  config.heat_limit = HeatLimit::Config{.peak = 8, .continuous = 2, .time_constant = 5s};
  config.workspace =
      Workspace::Config{.centre = Vec3::Zero(), .shape = Workspace::Sphere{.radius = 0.05}, .margin = 0.01};
  config.ramp_in = RampIn::Config{.time = 5ms};
  config.speed_trip = SpeedTrip::Config{.max = 1};
  config.step_bound = StepBound::Config{.max_speed = 10};
  config.command_watchdog = Watchdog::Config{.timeout = 30ms, .ramp = kRamp};
  config.link_watchdog = Watchdog::Config{.timeout = 20ms, .ramp = kRamp};
  config.dead_man = DeadManSwitch::Config{.button = 0};
  config.torque_limit = ForceLimit::Config{.max = 0.2};
  config.torque_growth_limit = GrowthLimit::Config{.rate = 50};
  config.turn_trip = TurnTrip::Config{.max = 20};
  config.grip_limit = ForceLimit::Config{.max = 5};
  config.grip_growth_limit = GrowthLimit::Config{.rate = 500};
  return config;
}

struct Situation {
  const char* name;
  void (*reach)(Rig&);
};

const std::array kSituations = {
    Situation{"absent", [](Rig& rig) { rig.puppet.stage = Device::State::kAbsent; }},
    Situation{"opening", [](Rig& rig) { rig.puppet.stage = Device::State::kOpening; }},
    Situation{"firmware", [](Rig& rig) { rig.puppet.stage = Device::State::kFirmware; }},
    Situation{"unhomed", [](Rig& rig) { rig.puppet.stage = Device::State::kUnhomed; }},
    Situation{"homed", [](Rig&) {}},
    Situation{"homed, asked to arm", [](Rig& rig) { rig.safe.arm(); }},
    Situation{"armed", [](Rig& rig) { rig.arm(), rig.steps(20, kPush); }},
    Situation{"armed a moment ago", [](Rig& rig) { rig.arm(), rig.step(kPush); }},
    Situation{"on its way to zero",
              [](Rig& rig) {
                rig.arm(), rig.steps(20, kPush);
                rig.puppet.answers = false;
                rig.steps(24, kPush);
                rig.puppet.answers = true;
              }},
    Situation{"at fault", [](Rig& rig) { rig.arm(), rig.step(Vec3::Constant(kNaN)); }},
};

struct Trouble {
  const char* name;
  SafetyFault fault;
  void (*cause)(Rig&);
};

const std::array kTroubles = {
    Trouble{"a force that is no number", SafetyFault::kForceNotFinite,
            [](Rig& rig) {
              rig.step({0, kNaN, 0});
            }},
    Trouble{"an infinite force", SafetyFault::kForceNotFinite,
            [](Rig& rig) {
              rig.step({std::numeric_limits<double>::infinity(), 0, 0});
            }},
    Trouble{"a position that is no number", SafetyFault::kPositionNotFinite,
            [](Rig& rig) {
              rig.puppet.position.x() = kNaN;
              rig.step(kPush);
              rig.puppet.position.x() = 0;
            }},
    Trouble{"a torque that is no number", SafetyFault::kForceNotFinite,
            [](Rig& rig) {
              rig.step_all({.force = kPush, .torque = {0, 0, kNaN}});
            }},
    Trouble{"a grip that is no number", SafetyFault::kForceNotFinite,
            [](Rig& rig) { rig.step_all({.force = kPush, .grip = kNaN}); }},
    Trouble{"an orientation that is no rotation", SafetyFault::kNoRotation,
            [](Rig& rig) {
              rig.puppet.orientation = Quat{0.5, 0, 0, 0};
              rig.step(kPush);
              rig.puppet.orientation.reset();
            }},
    Trouble{"a spin", SafetyFault::kTurnsTooFast,
            [](Rig& rig) {
              for (int i = 0; i < 20; ++i) {
                rig.puppet.orientation = rotation_by({0, 0.05 * i, 0});
                rig.step(kPush);
              }
              rig.puppet.orientation.reset();
            }},
    Trouble{"a jump", SafetyFault::kPositionJumped,
            [](Rig& rig) {
              rig.puppet.position.x() += 0.03;
              rig.step(kPush);
            }},
    Trouble{"a throw", SafetyFault::kTooFast,
            [](Rig& rig) {
              for (int i = 0; i < 20; ++i) {
                rig.puppet.position.x() += 2e-3;
                rig.step(kPush);
              }
            }},
    Trouble{"a pause", SafetyFault::kCommandSilent,
            [](Rig& rig) {
              rig.now += 50ms;
              rig.step(kPush);
            }},
    Trouble{"silence", SafetyFault::kDeviceSilent,
            [](Rig& rig) {
              rig.puppet.answers = false;
              rig.steps(21, kPush);
              rig.puppet.answers = true;
            }},
    Trouble{"the plug is pulled", SafetyFault::kDeviceLost,
            [](Rig& rig) {
              rig.puppet.stage = Device::State::kAbsent;
              rig.step(kPush);
            }},
    Trouble{"the origin is lost", SafetyFault::kDeviceLost,
            [](Rig& rig) {
              rig.puppet.stage = Device::State::kUnhomed;
              rig.step(kPush);
              rig.puppet.stage = Device::State::kHomed;
            }},
    Trouble{"the dead man lets go", SafetyFault::kNone,
            [](Rig& rig) {
              rig.puppet.buttons = 0;
              rig.step(kPush);
              rig.puppet.buttons = 1;
            }},
};

TEST(SafeDevice, EveryFaultInEveryStateEndsInZeroForce) {
  std::set<SafetyFault> latched;
  for (const Situation& situation : kSituations) {
    for (const Trouble& trouble : kTroubles) {
      SCOPED_TRACE(std::string(situation.name) + ", then " + trouble.name);
      Rig rig(everything());
      rig.steps(60);
      rig.puppet.buttons = 1;
      rig.steps(60);
      situation.reach(rig);
      const SafeDevice::Status before = rig.safe.status();
      const bool stopping = std::string_view(situation.name) == "on its way to zero";

      trouble.cause(rig);
      rig.steps(static_cast<int>(kRamp / 1ms), kPush);
      const SafeDevice::Status after = rig.safe.status();
      for (int i = 0; i < 1200; ++i) {  // a request to arm must have expired by this time
        ASSERT_EQ(rig.step(kPush), Vec3::Zero());
        ASSERT_EQ(rig.puppet.told, Vec3::Zero());
      }
      // The path is now clear, but this must not arm the device either, because there was no new request.
      rig.steps(2000);
      EXPECT_EQ(rig.steps(50, kPush), Vec3::Zero());
      EXPECT_NE(rig.state(), SafetyState::kArmed);

      if (before.state == SafetyState::kArmed && !stopping && trouble.fault != SafetyFault::kNone) {
        EXPECT_EQ(after.state, SafetyState::kFault);
        EXPECT_EQ(after.last_fault, trouble.fault) << to_string(after.last_fault);
        EXPECT_EQ(after.faults, before.faults + 1);
        latched.insert(after.last_fault);
      } else {
        EXPECT_EQ(after.faults, before.faults) << "nothing to take away, or the first fault is the one that counts";
      }
    }
  }
  EXPECT_EQ(latched.size(), 9U);
}

TEST(SafeDevice, DisarmedInAnyStateItGivesNoForceUntilTheOperatorArms) {
  for (const Situation& situation : kSituations) {
    for (const int times : {1, 3}) {
      SCOPED_TRACE(std::string(situation.name) + ", disarmed " + std::to_string(times) + " times");
      Rig rig(everything());
      rig.puppet.buttons = 1;
      rig.steps(60);
      situation.reach(rig);
      rig.step(kPush);
      const SafeDevice::Status before = rig.safe.status();
      const bool fault = before.faults > 0;  // faulted, or about to be

      for (int i = 0; i < times; ++i) rig.safe.disarm();
      const SafetyState expected = fault                                 ? SafetyState::kFault
                                   : before.state == SafetyState::kArmed ? SafetyState::kHomed
                                                                         : before.state;
      EXPECT_EQ(rig.state(), expected) << to_string(rig.state());
      for (int i = 0; i < 1200; ++i) {
        ASSERT_EQ(rig.step(kPush), Vec3::Zero());
        ASSERT_EQ(rig.puppet.told, Vec3::Zero());
      }
      // Without a request, the device must not be armed by rest, by the button, or by plugging it in again.
      for (const Device::State stage : {Device::State::kAbsent, Device::State::kHomed}) {
        rig.puppet.stage = stage;
        rig.steps(200);
        rig.puppet.buttons = 0;
        rig.steps(10);
        rig.puppet.buttons = 1;
        rig.steps(200);
      }
      EXPECT_EQ(rig.state(), fault ? SafetyState::kFault : SafetyState::kHomed);
      EXPECT_EQ(rig.safe.times_armed(), before.state == SafetyState::kArmed || fault ? 1U : 0U);
      EXPECT_EQ(rig.safe.status().faults, before.faults) << "to disarm is no fault";
      rig.arm();
      EXPECT_NE(rig.steps(20, kPush), Vec3::Zero());
    }
  }
}

TEST(SafeDevice, WhatIsToBeArmedAtTheStartIsNotWhenDisarmedBefore) {
  SafeDevice::Config config;
  config.arming.by = By::kStart;
  Rig rig(config);
  rig.step();
  rig.safe.disarm();
  rig.steps(3000);
  EXPECT_EQ(rig.state(), SafetyState::kHomed);
  rig.safe.arm();
  rig.step();
  EXPECT_EQ(rig.state(), SafetyState::kArmed);
}

struct Seen {
  int armed_steps = 0;
  int nonzero = 0;
  int reduced = 0;
  std::set<SafetyFault> faults;
};

void live(std::uint64_t seed, Seen& seen) {
  Dice dice(seed);
  SafeDevice::Config config = everything();
  const auto maybe = [&dice](auto& part) {
    if (dice.chance(0.4)) part.reset();
  };
  maybe(config.growth_limit), maybe(config.force_limit), maybe(config.heat_limit), maybe(config.workspace);
  maybe(config.ramp_in), maybe(config.speed_trip), maybe(config.step_bound);
  maybe(config.command_watchdog), maybe(config.link_watchdog), maybe(config.dead_man);
  config.arming.by = dice.chance(0.5) ? By::kStart : By::kRequest;
  if (config.dead_man && dice.chance(0.5)) config.arming.by = By::kDeadMan;

  Rig rig(config);
  Vec3 velocity = Vec3::Zero();
  double size = 0;
  bool disarmed = false;
  for (int i = 0; i < 600; ++i) {
    if (dice.chance(0.01))
      velocity = dice.chance(0.6) ? Vec3(Vec3::Zero()) : Vec3(dice.direction() * dice.decades(-3, 0.3));
    if (dice.chance(0.02)) size = dice.chance(0.4) ? 0 : dice.decades(-2, 2);
    if (dice.chance(0.02)) rig.puppet.buttons = static_cast<std::uint32_t>(dice.chance(0.8));
    if (dice.chance(0.004)) rig.puppet.stage = static_cast<Device::State>(dice.bits() % 5);
    if (dice.chance(0.03)) rig.puppet.stage = Device::State::kHomed;
    if (dice.chance(0.01)) rig.puppet.answers = !rig.puppet.answers || dice.chance(0.5);
    if (dice.chance(0.03)) rig.safe.arm(), disarmed = false;
    if (dice.chance(0.003)) rig.safe.disarm(), disarmed = true;
    if (dice.chance(0.005)) rig.now += dice.milliseconds(0, 100);
    if (dice.chance(0.1)) rig.puppet.age = dice.milliseconds(0, 3);
    rig.puppet.position += velocity * 1e-3;
    const Vec3 here = rig.puppet.position;
    if (dice.chance(0.002)) rig.puppet.position.y() = kNaN;
    if (dice.chance(0.002)) rig.puppet.position.z() += 0.1;

    Vec3 asked = dice.direction() * size;
    if (dice.chance(0.002)) asked[static_cast<Eigen::Index>(dice.bits() % 3)] = dice.chance(0.5) ? kNaN : 1 / 0.0;
    const Vec3 applied = rig.step(asked);
    if (!rig.puppet.position.allFinite()) rig.puppet.position = here;

    ASSERT_EQ(applied, rig.puppet.told);
    const SafeDevice::Status status = rig.safe.status();
    seen.faults.insert(status.last_fault);
    if (applied != Vec3::Zero()) {
      ++seen.nonzero;
      ASSERT_EQ(status.state, SafetyState::kArmed);
      ASSERT_FALSE(disarmed);
      ASSERT_EQ(rig.puppet.stage, Device::State::kHomed);
      ASSERT_TRUE(asked.allFinite());
      if (config.dead_man) {
        ASSERT_TRUE(!rig.seen || rig.puppet.buttons == 1);
      }
      if (config.force_limit) {
        ASSERT_LE(applied.norm(), config.force_limit->max + 1e-12);
      }
    }
    if (!asked.allFinite()) {
      ASSERT_EQ(applied, Vec3::Zero());
      continue;
    }
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_LE(std::abs(applied[axis]), std::abs(asked[axis]));
      ASSERT_GE(applied[axis] * asked[axis], 0);
    }
    ASSERT_NEAR(applied.cross(asked).norm(), 0, 1e-9 * asked.squaredNorm());
    seen.armed_steps += status.state == SafetyState::kArmed ? 1 : 0;
    seen.reduced += applied != Vec3::Zero() && applied != asked ? 1 : 0;
  }
}

TEST(SafeDevice, NoForceIsEverRaisedOrTurnedAndNoneIsOutsideArmed) {
  Seen seen;
  for (std::uint64_t seed = 1; seed <= 500; ++seed) {
    SCOPED_TRACE(seed);
    live(seed, seen);
    if (HasFatalFailure()) return;
  }
  EXPECT_GT(seen.armed_steps, 40'000);
  EXPECT_GT(seen.nonzero, 8'000);
  EXPECT_GT(seen.reduced, 4'000);
  EXPECT_EQ(seen.faults.size(), 8U) << "each of them, and none";
}

}  // namespace
}  // namespace tendon::safe_device_states_test
