// SPDX-License-Identifier: Apache-2.0
#include "devices/safety/safe_device.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

#include "tests/support/dice.h"

namespace tendon {
namespace {

using namespace std::chrono_literals;
using By = SafeDevice::Arming::By;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Does and says what the test wants, and keeps what it was told.
struct Puppet final : Device {
  DeviceInfo about{.name = "puppet", .max_force = 10, .position_resolution = 50e-6, .watchdog = {}};
  State stage = State::kHomed;
  Vec3 position = Vec3::Zero();
  std::uint32_t buttons = 0;
  bool answers = true;
  Duration age{};  ///< of the samples
  Vec3 told = Vec3::Constant(kNaN);

  const DeviceInfo& info() const noexcept override { return about; }
  State state() const noexcept override { return stage; }
  std::optional<PositionSample> read(LocalTime now) noexcept override {
    if (!answers) return std::nullopt;
    PositionSample sample{now - age, position};
    sample.buttons = buttons;
    return sample;
  }
  Vec3 apply(const Vec3& force) noexcept override { return told = force; }
};

/// A safe device around a puppet, and the loop that steps it at 1 kHz.
struct Rig {
  explicit Rig(const SafeDevice::Config& config = {}) : safe(config, puppet) {}

  /// One step; returns the force applied.
  Vec3 step(const Vec3& asked = Vec3::Zero()) {
    now += 1ms;
    seen = safe.read(now).has_value();
    return safe.apply(asked);
  }
  Vec3 steps(int count, const Vec3& asked = Vec3::Zero()) {
    Vec3 last = Vec3::Zero();
    for (int i = 0; i < count; ++i) last = step(asked);
    return last;
  }
  /// The whole way, by the operator's request.
  void arm() {
    steps(60);
    safe.arm();
    step();
    ASSERT_EQ(safe.status().state, SafetyState::kArmed);
  }
  SafetyState state() const { return safe.status().state; }
  SafetyFault fault() const { return safe.status().last_fault; }

  Puppet puppet;
  SafeDevice safe;
  LocalTime now{1s};
  bool seen = false;
};

const Vec3 kPush(3, 0, -4);

TEST(SafeDevice, GivesNoForceUntilItIsArmedByRequest) {
  Rig rig;
  EXPECT_EQ(rig.steps(3000, kPush), Vec3::Zero());
  EXPECT_EQ(rig.puppet.told, Vec3::Zero());
  EXPECT_EQ(rig.state(), SafetyState::kHomed);
  rig.arm();
  EXPECT_EQ(rig.step(kPush), kPush);
}

TEST(SafeDevice, WithNothingListedGivesEveryForceToTheLastBitOnceArmed) {
  Rig rig;
  rig.arm();
  Dice dice(1);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 asked = dice.direction() * dice.decades(-3, 2);
    ASSERT_EQ(rig.step(asked), asked);
    ASSERT_EQ(rig.puppet.told, asked);
  }
}

TEST(SafeDevice, PassesOnEveryReadingAsItIs) {
  Rig rig;
  rig.puppet.position = {1e-3, 2e-3, 3e-3};
  rig.puppet.buttons = 5;
  rig.puppet.age = 300us;
  const auto sample = rig.safe.read(rig.now);
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->position, rig.puppet.position);
  EXPECT_EQ(sample->at, rig.now - 300us);
  EXPECT_EQ(sample->buttons, 5U);
}

TEST(SafeDevice, IsNotArmedWhileAnythingSpeaksAgainstIt) {
  const auto still_unarmed = [](const char* why, const SafeDevice::Config& config, const auto& disturb) {
    Rig rig(config);
    for (int i = 0; i < 500; ++i) {
      if (i > 20) rig.safe.arm();
      const Vec3 asked = disturb(rig, i);
      EXPECT_EQ(rig.step(asked), Vec3::Zero()) << why;
    }
    EXPECT_NE(rig.state(), SafetyState::kArmed) << why;
    EXPECT_EQ(rig.safe.status().faults, 0U) << why << ": there was no force to take away";
  };
  still_unarmed("the handle moves", {}, [](Rig& rig, int) -> Vec3 {
    rig.puppet.position.x() += 30e-6;  // 0.03 m/s
    return Vec3::Zero();
  });
  still_unarmed("a force is asked for", {}, [](Rig&, int) { return Vec3(0, 0.11, 0); });
  still_unarmed("what is asked for is no number", {}, [](Rig&, int) { return Vec3(0, kNaN, 0); });
  still_unarmed("it is not homed", {}, [](Rig& rig, int) -> Vec3 {
    rig.puppet.stage = Device::State::kUnhomed;
    return Vec3::Zero();
  });
  still_unarmed("it is silent", {}, [](Rig& rig, int) -> Vec3 {
    rig.puppet.answers = false;
    return Vec3::Zero();
  });
  still_unarmed("of every 40 readings 11 in a row are missing", {}, [](Rig& rig, int i) -> Vec3 {
    rig.puppet.answers = i % 40 > 10;
    return Vec3::Zero();
  });
  SafeDevice::Config link;
  link.link_watchdog = Watchdog::Config{.timeout = 20ms, .ramp = 10ms};
  still_unarmed("what it says is old", link, [](Rig& rig, int) -> Vec3 {
    rig.puppet.age = 21ms;
    return Vec3::Zero();
  });
  SafeDevice::Config button;
  button.dead_man = DeadManSwitch::Config{.button = 2};
  still_unarmed("the dead man's button is not held", button, [](Rig& rig, int) -> Vec3 {
    rig.puppet.buttons = 0b1011;
    return Vec3::Zero();
  });
}

TEST(SafeDevice, BelievesThatTheHandleRestsOnlyWhenItHasStayedForAWhile) {
  for (const double speed : {0.0, 0.015, 0.025}) {
    Rig rig;
    int steps = 0;
    while (rig.state() != SafetyState::kArmed && steps < 3000) {
      rig.puppet.position.y() += speed * 1e-3;
      rig.step();
      rig.safe.arm();
      ++steps;
    }
    EXPECT_EQ(steps, speed < 0.02 ? 51 : 3000) << speed;
  }
}

TEST(SafeDevice, ForgetsARequestThatWasNotGrantedInTime) {
  for (const int late : {999, 1001}) {
    Rig rig;
    rig.steps(60);
    rig.safe.arm();
    rig.steps(late, kPush);  // in the way
    rig.steps(10);
    EXPECT_EQ(rig.state() == SafetyState::kArmed, late < 1000) << late;
  }
}

TEST(SafeDevice, ArmedAtTheStartIsArmedByItselfOnceAndNeverAgain) {
  SafeDevice::Config config;
  config.arming.by = By::kStart;
  Rig rig(config);
  rig.steps(5000, kPush);
  EXPECT_EQ(rig.state(), SafetyState::kHomed) << "a force is in the way";
  rig.step();
  EXPECT_EQ(rig.state(), SafetyState::kArmed);
  EXPECT_EQ(rig.step(kPush), kPush);
  rig.step(Vec3::Constant(kNaN));
  rig.steps(5000);
  EXPECT_EQ(rig.state(), SafetyState::kFault);
  rig.safe.arm();
  rig.step();
  EXPECT_EQ(rig.state(), SafetyState::kArmed);
  EXPECT_EQ(rig.safe.times_armed(), 2U);
}

SafeDevice::Config by_button() {
  SafeDevice::Config config;
  config.arming.by = By::kDeadMan;
  config.dead_man = DeadManSwitch::Config{.button = 2};
  return config;
}

TEST(DeadMan, WhoHoldsTheButtonHasForcesAndWhoLetsGoHasNoneAtOnce) {
  Rig rig(by_button());
  rig.steps(60);
  rig.safe.arm();  // nobody arms what others hold
  rig.steps(60);
  ASSERT_EQ(rig.state(), SafetyState::kHomed);
  for (int press = 0; press < 3; ++press) {
    rig.puppet.buttons = 4;
    rig.step();
    ASSERT_EQ(rig.state(), SafetyState::kArmed);
    EXPECT_EQ(rig.step(kPush), kPush);
    rig.puppet.buttons = 0;
    EXPECT_EQ(rig.step(kPush), Vec3::Zero());
    EXPECT_EQ(rig.state(), SafetyState::kHomed);
    EXPECT_EQ(rig.steps(100, kPush), Vec3::Zero());
  }
  EXPECT_EQ(rig.safe.status().faults, 0U);
}

TEST(DeadMan, AButtonThatIsStuckFromTheStartArmsNothing) {
  Rig rig(by_button());
  rig.puppet.buttons = 4;
  rig.steps(100);
  EXPECT_EQ(rig.state(), SafetyState::kHomed);
}

TEST(DeadMan, AfterAFaultTheButtonHasToBePressedAgain) {
  Rig rig(by_button());
  rig.steps(60);
  rig.puppet.buttons = 4;
  rig.step();
  rig.step(Vec3::Constant(kNaN));
  rig.steps(100);
  EXPECT_EQ(rig.state(), SafetyState::kFault);
  rig.puppet.buttons = 0;
  rig.step();
  rig.puppet.buttons = 4;
  rig.step();
  EXPECT_EQ(rig.state(), SafetyState::kArmed);
}

TEST(DeadMan, ThePressHoldsUntilTheHandIsStill) {
  Rig rig(by_button());
  for (int i = 0; i < 3000; ++i) {
    rig.puppet.position.x() += 50e-6;
    rig.puppet.buttons = i < 60 ? 0 : 4;
    rig.step();
  }
  EXPECT_EQ(rig.state(), SafetyState::kHomed);
  rig.steps(60);
  EXPECT_EQ(rig.state(), SafetyState::kArmed);
}

TEST(SafeDevice, AForceThatIsNoNumberIsZeroAndAFaultThatStays) {
  for (const double bad : {kNaN, std::numeric_limits<double>::infinity()}) {
    Rig rig;
    rig.arm();
    rig.step(kPush);
    EXPECT_EQ(rig.step({1, bad, 0}), Vec3::Zero());
    EXPECT_EQ(rig.fault(), SafetyFault::kForceNotFinite);
    EXPECT_EQ(rig.steps(5000, kPush), Vec3::Zero());
    rig.arm();
    EXPECT_EQ(rig.step(kPush), kPush);
    EXPECT_EQ(rig.fault(), SafetyFault::kForceNotFinite) << "it is still said what was last";
  }
}

TEST(SafeDevice, AHandleThatFliesIsLetGoForGoodAlsoWhenItRestsAgain) {
  SafeDevice::Config config;
  config.speed_trip = SpeedTrip::Config{.max = 1};
  Rig rig(config);
  rig.arm();
  for (int i = 0; i < 50; ++i) {
    rig.puppet.position.y() += 0.9e-3;
    ASSERT_EQ(rig.step(kPush), kPush);
  }
  Vec3 applied = kPush;
  for (int i = 0; i < 17; ++i) {  // the estimate's window, at most
    rig.puppet.position.y() += 1.2e-3;
    applied = rig.step(kPush);
  }
  EXPECT_EQ(applied, Vec3::Zero());
  EXPECT_EQ(rig.fault(), SafetyFault::kTooFast);
  EXPECT_EQ(rig.steps(5000, kPush), Vec3::Zero());
  EXPECT_EQ(rig.state(), SafetyState::kFault);
}

TEST(SafeDevice, AfterEachArmingForcesAreRampedIn) {
  SafeDevice::Config config;
  config.ramp_in = RampIn::Config{.time = 100ms};
  Rig rig(config);
  for (int time = 0; time < 2; ++time) {
    rig.arm();
    for (int ms = 1; ms <= 120; ++ms) {
      const double share = std::min(1.0, ms / 100.0);
      ASSERT_NEAR((rig.step(kPush) - share * kPush).norm(), 0, 1e-12) << ms;
    }
    rig.step(Vec3::Constant(kNaN));
  }
}

TEST(SafeDevice, ASilentDeviceFallsToZeroWithinTheWatchdogsRamp) {
  SafeDevice::Config config;
  config.link_watchdog = Watchdog::Config{.timeout = 20ms, .ramp = 10ms};
  Rig rig(config);
  rig.arm();
  rig.step(kPush);
  rig.puppet.answers = false;
  EXPECT_EQ(rig.steps(20, kPush), kPush);
  for (int ms = 0; ms < 10; ++ms) {
    ASSERT_NEAR((rig.step(kPush) - kPush * (1 - ms / 10.0)).norm(), 0, 1e-12);
    ASSERT_EQ(rig.state(), SafetyState::kArmed);
  }
  EXPECT_EQ(rig.step(kPush), Vec3::Zero());
  EXPECT_EQ(rig.state(), SafetyState::kFault);
  EXPECT_EQ(rig.fault(), SafetyFault::kDeviceSilent);
  rig.puppet.answers = true;
  EXPECT_EQ(rig.steps(5000, kPush), Vec3::Zero());
  EXPECT_EQ(rig.safe.status().faults, 1U);
}

TEST(SafeDevice, ADeviceThatRepeatsItsLastWordIsSilentToo) {
  SafeDevice::Config config;
  config.link_watchdog = Watchdog::Config{.timeout = 20ms, .ramp = 0ms};
  Rig rig(config);
  rig.arm();
  for (int ms = 1; ms <= 20; ++ms) {
    rig.puppet.age += 1ms;
    ASSERT_EQ(rig.step(kPush), kPush);
  }
  rig.puppet.age += 1ms;
  EXPECT_EQ(rig.step(kPush), Vec3::Zero());
}

TEST(SafeDevice, AWorldThatStoodStillIsNotGoneOnWith) {
  SafeDevice::Config config;
  config.command_watchdog = Watchdog::Config{.timeout = 30ms, .ramp = 10ms};
  Rig rig(config);
  rig.arm();
  rig.step(kPush);
  rig.now += 29ms;
  EXPECT_EQ(rig.step(kPush), kPush);
  rig.now += 30ms;
  EXPECT_EQ(rig.step(kPush), kPush) << "the ramp begins here";
  EXPECT_NEAR(rig.steps(5, kPush).norm(), 2.5, 1e-12);
  EXPECT_EQ(rig.steps(5, kPush), Vec3::Zero());
  EXPECT_EQ(rig.fault(), SafetyFault::kCommandSilent);
}

TEST(SafeDevice, AnUnpluggedDeviceNeedsHomingAndArmingAgain) {
  Rig rig;
  rig.arm();
  rig.step(kPush);
  rig.puppet.stage = Device::State::kAbsent;
  EXPECT_EQ(rig.step(kPush), Vec3::Zero());
  EXPECT_EQ(rig.fault(), SafetyFault::kDeviceLost);
  for (const auto stage : {Device::State::kOpening, Device::State::kFirmware, Device::State::kUnhomed}) {
    rig.puppet.stage = stage;
    rig.safe.arm();
    EXPECT_EQ(rig.steps(50), Vec3::Zero());
    EXPECT_FALSE(rig.seen) << "positions without an origin are none";
  }
  rig.puppet.stage = Device::State::kHomed;
  EXPECT_EQ(rig.steps(5000, kPush), Vec3::Zero());
  EXPECT_EQ(rig.state(), SafetyState::kFault);
  rig.arm();
  EXPECT_EQ(rig.step(kPush), kPush);
}

TEST(SafeDevice, APositionThatJumpsIsNotSeenAndThoseAfterItAre) {
  SafeDevice::Config config;
  config.step_bound = StepBound::Config{.max_speed = 10};
  Rig rig(config);
  rig.arm();
  rig.puppet.position.x() = 0.2;  // 65536 counts of a wrapped encoder
  EXPECT_EQ(rig.step(kPush), Vec3::Zero());
  EXPECT_FALSE(rig.seen);
  EXPECT_EQ(rig.fault(), SafetyFault::kPositionJumped);
  rig.step();
  EXPECT_TRUE(rig.seen);
  rig.arm();
  EXPECT_EQ(rig.step(kPush), kPush) << "the jump is no speed";
}

TEST(SafeDevice, APositionThatIsNoNumberIsNotSeen) {
  Rig rig;
  rig.arm();
  rig.puppet.position.z() = kNaN;
  EXPECT_EQ(rig.step(kPush), Vec3::Zero());
  EXPECT_FALSE(rig.seen);
  EXPECT_EQ(rig.fault(), SafetyFault::kPositionNotFinite);
}

TEST(SafeDevice, SaysTheForceLimitAsItsOwn) {
  SafeDevice::Config config;
  config.force_limit = ForceLimit::Config{.max = 4};
  EXPECT_EQ(Rig(config).safe.info().max_force, 4);
  config.force_limit->max = 40;
  EXPECT_EQ(Rig(config).safe.info().max_force, 10) << "the device's";
}

TEST(SafeDevice, HeatIsThatOfTheForceReallyHeld) {
  SafeDevice::Config config;
  config.heat_limit = HeatLimit::Config{.peak = 8, .continuous = 2, .time_constant = 1s};
  config.force_limit = ForceLimit::Config{.max = 2};
  Rig rig(config);
  rig.arm();
  EXPECT_NEAR(rig.steps(20'000, {9, 0, 0}).norm(), 2, 1e-12) << "2 N are borne for ever, whatever is asked";
  config.force_limit.reset();
  Rig warm(config);
  warm.arm();
  EXPECT_NEAR(warm.steps(10, {8, 0, 0}).norm(), 8, 1e-12);
  EXPECT_LT(warm.steps(20'000, {8, 0, 0}).norm(), 2.01);
  warm.steps(20'000);
  EXPECT_NEAR(warm.step({8, 0, 0}).norm(), 8, 1e-6) << "cool again";
}

TEST(SafeDevice, RefusesImpossibleValuesNamingTheField) {
  const auto refused = [](const char* field, const auto& change) {
    SafeDevice::Config config;
    change(config);
    Puppet puppet;
    try {
      const SafeDevice device(config, puppet);
      ADD_FAILURE() << field << " was taken";
    } catch (const std::invalid_argument& problem) {
      EXPECT_NE(std::string(problem.what()).find(field), std::string::npos) << problem.what();
    }
  };
  refused("arming.rest_speed", [](auto& config) { config.arming.rest_speed = 0; });
  refused("arming.rest_force", [](auto& config) { config.arming.rest_force = kNaN; });
  refused("arming.patience", [](auto& config) { config.arming.patience = {}; });
  refused("dead_man", [](auto& config) { config.arming.by = By::kDeadMan; });
  refused("link_watchdog.timeout", [](auto& config) { config.link_watchdog.emplace(); });
  refused("command_watchdog.timeout", [](auto& config) { config.command_watchdog.emplace(); });
  refused("speed_trip.max", [](auto& config) { config.speed_trip.emplace(); });
}

// --- Every fault in every state ----------------------------------------------------------------------------

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
      for (int i = 0; i < 1200; ++i) {  // longer than a request to arm is open
        ASSERT_EQ(rig.step(kPush), Vec3::Zero());
        ASSERT_EQ(rig.puppet.told, Vec3::Zero());
      }
      // … also when the way to it were free: nobody has asked for it again.
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
  EXPECT_EQ(latched.size(), 7U);
}

// --- The operator disarms ----------------------------------------------------------------------------------

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
      const bool fault = before.faults > 0;  // at fault already, or on its way there

      for (int i = 0; i < times; ++i) rig.safe.disarm();
      const SafetyState expected = fault                                 ? SafetyState::kFault
                                   : before.state == SafetyState::kArmed ? SafetyState::kHomed
                                                                         : before.state;
      EXPECT_EQ(rig.state(), expected) << to_string(rig.state());
      for (int i = 0; i < 1200; ++i) {
        ASSERT_EQ(rig.step(kPush), Vec3::Zero());
        ASSERT_EQ(rig.puppet.told, Vec3::Zero());
      }
      // Neither rest nor the button, nor a plug: nobody has asked for it.
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

TEST(DeadMan, AfterADisarmTheButtonArmsOnlyOnceArmedAndPressedAnew) {
  Rig rig(by_button());
  rig.steps(60);
  const auto press = [&rig] {
    rig.puppet.buttons = 0;
    rig.steps(10);
    rig.puppet.buttons = 4;
    rig.steps(60);
  };
  press();
  ASSERT_EQ(rig.state(), SafetyState::kArmed);
  rig.safe.disarm();
  EXPECT_EQ(rig.step(kPush), Vec3::Zero());
  press();
  EXPECT_EQ(rig.state(), SafetyState::kHomed);
  rig.safe.arm();
  rig.steps(100);
  EXPECT_EQ(rig.state(), SafetyState::kHomed) << "a button that is held was pressed for something else";
  press();
  EXPECT_EQ(rig.state(), SafetyState::kArmed);
}

// --- Any sequence ------------------------------------------------------------------------------------------

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
    // Never longer, never turned, and no component larger.
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
}  // namespace tendon
