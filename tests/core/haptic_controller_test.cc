// SPDX-License-Identifier: Apache-2.0
#include "core/haptic_controller.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/refusal.h"

namespace tendon::haptic_controller_test {
namespace {

using std::chrono::milliseconds;
constexpr double kInf = std::numeric_limits<double>::infinity();

HapticController::Config config() {
  HapticController::Config c;
  c.limiter.friction = {0.05, 0.26};
  c.limiter.longest_hold = milliseconds(1);
  c.max_force = 8;
  c.max_slew = kInf;
  c.hold.ramp_in = Duration::zero();
  return c;
}

struct Bench {
  explicit Bench(const HapticController::Config& c) : controller(c) {}

  Step move_to(double x, Duration after = milliseconds(1)) {
    now += after;
    const Step step = controller.step({LocalTime(now), Vec3(x, 0, 0), Vec3::Zero()}, applied);
    applied = step.force;
    last = step;
    return step;
  }
  /// Moves from 0 to `steps` · 0.2 mm at 0.2 m/s.
  void move_freely(int steps) {
    for (int i = 0; i <= steps; ++i) move_to(i * 2e-4);
  }
  void want(double force) {
    RemoteForce remote;
    remote.sequence = ++sequence;
    remote.received = LocalTime(now);
    remote.answers = LocalTime(now);
    remote.force = Vec3(force, 0, 0);
    remote.valid_for = milliseconds(500);
    controller.observe(remote);
  }

  Step last;
  HapticController controller;
  Vec3 applied = Vec3::Zero();
  Duration now{};
  std::uint64_t sequence = 0;
};

TEST(HapticController, TheFirstForceIsNoMoreThanFriction) {
  Bench bench(config());
  bench.want(-5);
  bench.move_to(0);
  const Step step = bench.move_to(0);
  EXPECT_DOUBLE_EQ(step.force.x(), -0.05);
  EXPECT_TRUE(step.reasons.has(Reason::kEnergy));
}

TEST(HapticController, TheLedgerCountsTheForceAppliedNotTheForceWanted) {
  Bench wanted_and_got(config());
  Bench clamped(config());
  for (Bench* bench : {&wanted_and_got, &clamped}) {
    bench->move_to(0);
    for (int i = 1; i <= 50; ++i) bench->move_to(i * 1e-4);
    bench->want(-0.5);
    bench->move_to(51e-4);
  }
  clamped.applied *= 0.5;  // saturation of the device
  const double before = clamped.last.energy;
  const double full = wanted_and_got.move_to(56e-4).energy - before;
  const double half = clamped.move_to(56e-4).energy - before;
  EXPECT_NEAR(full - half, 0.25 * 5e-4, 1e-15);  // 0.5 N against 0.25 N over 0.5 mm
}

TEST(HapticController, TheBoundTakesTheLongestHoldTheLedgerTheActualOne) {
  HapticController::Config c = config();
  c.limiter.longest_hold = milliseconds(2);
  Bench bench(c);
  bench.move_to(0);
  const Step step = bench.move_to(1e-3, milliseconds(1));
  EXPECT_DOUBLE_EQ(step.energy, 0.05 * 1e-3 + 0.26 * 1e-6 / 1e-3);
  EXPECT_DOUBLE_EQ(step.permitted, 0.05 + 2 * std::sqrt(0.26 * step.energy / 2e-3));
}

TEST(HapticController, AnOverrunIsBookedAsItWasAndFlagged) {
  Bench bench(config());
  bench.move_to(0);
  const Step step = bench.move_to(1e-3, milliseconds(5));
  EXPECT_TRUE(step.reasons.has(Reason::kOverrun));
  EXPECT_FALSE(step.reasons.has(Reason::kWatchdog));
  EXPECT_DOUBLE_EQ(step.energy, 0.05 * 1e-3 + 0.26 * 1e-6 / 5e-3);
}

// The account holds some energy, and during the pause the hand follows the force, which is the worst case.
Step after_a_pause(Bench& bench, Duration pause) {
  bench.move_freely(100);
  bench.want(-6);
  const Step before = bench.move_to(0.02);
  const double follows = seconds(pause) * (before.force.norm() - 0.05) / (2 * 0.26);
  return bench.move_to(0.02 - follows, pause);
}

TEST(HapticController, AfterAnOverrunTheLedgerNeverFallsAndRecovers) {
  Bench bench(config());
  const Step overrun = after_a_pause(bench, milliseconds(30));
  ASSERT_LT(overrun.energy, -1e-3);
  ASSERT_TRUE(overrun.reasons.has(Reason::kOverrun));
  double before = overrun.energy;
  double x = overrun.hand.position.x();
  int steps = 0;
  while (before < 0) {
    x += (steps % 40 < 20 ? 1 : -1) * 1e-3;
    bench.want(-6);
    const Step step = bench.move_to(x);
    ASSERT_GE(step.energy, before);
    if (step.energy < 0) {
      ASSERT_LE(step.force.norm(), 0.05 * (1 + 1e-12));
    }
    before = step.energy;
    ASSERT_LT(++steps, 100000);
  }
}

TEST(HapticController, TheSecondHoldAsLongAsALateOneTakesNothing) {
  Bench bench(config());
  const Step first = after_a_pause(bench, std::chrono::microseconds(2230));
  // The deficit is (T_act − T)(‖F‖ − f_c)²/(4b): the force has spent the whole account.
  EXPECT_NEAR(first.energy, -1.23e-3 * std::pow(first.was_applied.norm() - 0.05, 2) / (4 * 0.26), 1e-12);
  EXPECT_EQ(first.longest_hold, Duration(2787500)) << "2.23 ms and a quarter more";
  double x = bench.last.hand.position.x();
  while (bench.last.energy < 1e-3) bench.move_to(x += 2e-4);
  bench.want(-6);
  const Step before = bench.move_to(x);
  ASSERT_GT(before.longest_hold, std::chrono::microseconds(2500));
  const double follows = 2.5e-3 * (before.force.norm() - 0.05) / (2 * 0.26);
  const Step second = bench.move_to(x - follows, std::chrono::microseconds(2500));
  EXPECT_TRUE(second.reasons.has(Reason::kOverrun)) << "beyond what the scene says";
  EXPECT_GE(second.energy, 0);
}

TEST(HapticController, TheIntervalAfterAnUnseenStepIsBookedAtItsWorst) {
  Bench bench(config());
  bench.move_freely(100);
  bench.want(-6);
  const Step before = bench.move_to(0.02);
  bench.now += milliseconds(1);
  const Step unseen = bench.controller.step_unseen(LocalTime(bench.now), bench.applied);
  ASSERT_EQ(unseen.force, Vec3::Zero());
  // The command is zero, but the device will hold the previous force for one more interval.
  bench.applied = before.force;
  const Step seen = bench.move_to(0.02);
  EXPECT_NEAR(seen.energy, unseen.energy - 1e-3 * std::pow(before.force.norm() - 0.05, 2) / (4 * 0.26), 1e-12);
}

TEST(HapticController, ADamperNeverLiftsTheForceAboveTheLargest) {
  HapticController::Config c = config();
  c.limiter.parts.bounded_acceleration = {.most = {1000}};
  c.limiter.parts.shaping = {.stiffness = {5000}};
  c.limiter.parts.damper = {.viscous = {500}, .contact = {0.1}};
  c.max_force = 2;
  c.max_slew = std::numeric_limits<double>::infinity();
  Bench bench(c);
  RemoteForce push;
  push.sequence = 1;
  push.force = Vec3(-50, 0, 0);
  push.valid_for = std::chrono::seconds(100);
  bench.controller.observe(push);
  bool damped = false;
  double most = 0;
  for (int n = 0; n < 400; ++n) {
    const Step step = bench.move_to(0.02 + 1e-4 * n + 5e-4 * (n % 40 < 20 ? n % 20 : 20 - n % 20));
    damped = damped || step.reasons.has(Reason::kDamped);
    most = std::max(most, step.force.norm());
  }
  EXPECT_TRUE(damped);
  EXPECT_NEAR(most, 2, 1e-12);
}

TEST(HapticController, ABrokenAssumptionIsInTheStepThatSawIt) {
  HapticController::Config c = config();
  c.limiter.parts.bounded_acceleration = {.most = {100}};
  c.limiter.parts.shaping = {.stiffness = {1000}};
  Bench bench(c);
  bench.move_to(0);
  EXPECT_FALSE(bench.move_to(1e-5).reasons.has(Reason::kAcceleration));
  EXPECT_FALSE(bench.move_to(2e-5).reasons.has(Reason::kAcceleration));
  EXPECT_TRUE(bench.move_to(4e-4).reasons.has(Reason::kAcceleration));
  EXPECT_FALSE(bench.move_to(7.8e-4).reasons.has(Reason::kAcceleration));
}

TEST(HapticController, APauseBeyondTheWatchdogIsChargedTheWorstNoMore) {
  HapticController::Config c = config();
  c.watchdog = milliseconds(5);
  Bench bench(c);
  bench.move_freely(100);
  bench.want(-6);
  const Step before = bench.move_to(0.02);
  const Step after = bench.move_to(0.07, milliseconds(60));  // if there is no force, a long motion must not be credited
  EXPECT_TRUE(after.reasons.has(Reason::kWatchdog));
  EXPECT_NEAR(after.energy, before.energy - 5e-3 * std::pow(before.force.norm() - 0.05, 2) / (4 * 0.26), 1e-12);
}

TEST(HapticController, LongestHoldEqualToWatchdogKeepsLedgerNonnegative) {
  HapticController::Config c = config();
  c.watchdog = milliseconds(5);
  c.limiter.longest_hold = milliseconds(5);
  for (const int pause : {1, 4, 5, 6, 20, 60, 500}) {
    Bench bench(c);
    EXPECT_GE(after_a_pause(bench, milliseconds(pause)).energy, -1e-12) << pause << " ms";
  }
}

TEST(HapticController, NotANumberForceIsRefusedAndTheOneBeforeGoesOn) {
  Bench bench(config());
  bench.move_freely(100);
  bench.want(-0.5);
  const double before = bench.move_to(0.02).force.x();
  bench.want(std::nan(""));
  EXPECT_EQ(bench.move_to(0.02).force.x(), before);
}

TEST(HapticController, ANanPositionZeroesForceFreezesLedgerLatchesFault) {
  Bench bench(config());
  bench.move_freely(100);
  bench.want(-0.5);
  bench.move_to(0.02);
  const double energy = bench.last.energy;
  const Step blind = bench.move_to(std::nan(""));
  EXPECT_EQ(blind.force, Vec3::Zero());
  EXPECT_LE(blind.energy, energy);
  EXPECT_TRUE(std::isfinite(blind.energy));
  EXPECT_EQ(bench.controller.fault(), HapticController::Fault::kPositionNotFinite);
  const Step seen = bench.move_to(0.02);
  EXPECT_EQ(seen.force, Vec3::Zero());
  EXPECT_EQ(seen.mode, Mode::kFault);
  EXPECT_LE(seen.energy, energy);
}

TEST(HapticController, AnImpossiblePositionIsAFaultAndEarnsNothing) {
  HapticController::Config c = config();
  c.max_speed = 10;
  Bench bench(c);
  bench.move_freely(100);
  bench.want(-0.5);
  bench.move_to(0.02 + 0.0099);
  ASSERT_EQ(bench.controller.fault(), HapticController::Fault::kNone);
  const double energy = bench.last.energy;
  const Step jump = bench.move_to(0.0299 + 0.0101);
  EXPECT_EQ(bench.controller.fault(), HapticController::Fault::kPositionJumped);
  EXPECT_EQ(jump.force, Vec3::Zero());
  EXPECT_LE(jump.energy, energy);
  const Step there = bench.move_to(0.04);
  EXPECT_EQ(there.mode, Mode::kFault);
  EXPECT_LE(there.energy, energy);
}

TEST(HapticController, AFaultIsLeftOnlyByRearmAndForcesAreRampedInAgain) {
  HapticController::Config c = config();
  c.hold.ramp_in = milliseconds(100);
  Bench bench(c);
  bench.move_to(std::nan(""));
  bench.want(-1);
  EXPECT_EQ(bench.move_to(0).mode, Mode::kFault);
  bench.controller.rearm();
  EXPECT_EQ(bench.move_to(0).mode, Mode::kIdle);
  bench.want(-1);
  const Step step = bench.move_to(0);
  EXPECT_EQ(step.mode, Mode::kActive);
  EXPECT_TRUE(step.reasons.has(Reason::kRampIn));
}

TEST(HapticController, DisarmedItGivesNoForceAtOnceUntilRearmed) {
  HapticController::Config c = config();
  c.limiter.law = Law::kNone;
  c.max_slew = 100;
  c.hold.ramp_in = milliseconds(100);
  Bench bench(c);
  for (int i = 0; i < 300; ++i) bench.want(-5), bench.move_to(0);
  ASSERT_EQ(bench.applied.x(), -5);
  bench.controller.disarm();
  for (int i = 0; i < 300; ++i) {
    bench.want(-5);
    const Step step = i % 3 == 0 ? bench.controller.step_unseen(LocalTime(bench.now += milliseconds(1)), bench.applied)
                                 : bench.move_to(0);
    ASSERT_EQ(step.force, Vec3::Zero()) << i;
    ASSERT_TRUE(step.reasons.has(Reason::kDisarmed));
    ASSERT_FALSE(step.reasons.has(Reason::kFault));
    bench.applied = step.force;
  }
  EXPECT_EQ(bench.controller.fault(), HapticController::Fault::kNone);
  bench.controller.rearm();
  EXPECT_EQ(bench.move_to(0).force, Vec3::Zero()) << "the force of before is not gone on with";
  bench.want(-5);
  const Step again = bench.move_to(0);
  EXPECT_TRUE(again.reasons.has(Reason::kRampIn));
  EXPECT_FALSE(again.reasons.has(Reason::kDisarmed));
  for (int i = 0; i < 150; ++i) bench.want(-5), bench.move_to(0);
  EXPECT_EQ(bench.applied.x(), -5);
}

TEST(HapticController, ALawThatBrakesByItselfGivesNoForceEitherWhileDisarmed) {
  HapticController::Config c = config();
  c.limiter.law = Law::kPassivityController;
  const auto push = [](Bench& bench, int i) {  // an engine that generates energy
    bench.want(5);
    return bench.move_to(i * 1e-4).force.x();
  };
  Bench armed(c);
  Bench disarmed(c);
  for (int i = 0; i < 100; ++i) push(armed, i), push(disarmed, i);
  disarmed.controller.disarm();
  int braking = 0;
  for (int i = 100; i < 200; ++i) {
    armed.want(0);
    braking += armed.move_to(i * 1e-4).force.x() < 0 ? 1 : 0;
    ASSERT_EQ(push(disarmed, i), 0);
  }
  EXPECT_GT(braking, 0) << "without that this shows nothing";
}

TEST(HapticController, ToDisarmIsNoFaultAndClearsNone) {
  Bench bench(config());
  bench.move_to(std::nan(""));
  bench.controller.disarm();
  const Step step = bench.move_to(0);
  EXPECT_EQ(step.mode, Mode::kFault);
  EXPECT_TRUE(step.reasons.has(Reason::kFault));
  EXPECT_TRUE(step.reasons.has(Reason::kDisarmed));
}

TEST(HapticController, ASilentDeviceGetsZeroForceAndFaultsAfter20Misses) {
  Bench bench(config());
  bench.move_to(0);
  for (int i = 1; i <= 20; ++i) {
    EXPECT_EQ(bench.controller.fault(), HapticController::Fault::kNone);
    bench.now += milliseconds(1);
    const Step step = bench.controller.step_unseen(LocalTime(bench.now), bench.applied);
    EXPECT_EQ(step.force, Vec3::Zero());
    EXPECT_TRUE(step.reasons.has(Reason::kUnseen));
    bench.applied = step.force;
  }
  EXPECT_EQ(bench.controller.fault(), HapticController::Fault::kDeviceSilent);
}

TEST(HapticController, WhenTimeGoesBackTheForceStaysAsItIs) {
  HapticController::Config c = config();
  c.max_slew = 500;
  Bench bench(c);
  bench.move_freely(400);
  bench.want(-2);
  bench.move_to(0.08);
  bench.move_to(0.08);
  const double before = bench.applied.x();
  ASSERT_LT(before, -0.5);
  EXPECT_EQ(bench.move_to(0.08, -milliseconds(1)).force.x(), before);
  EXPECT_EQ(bench.move_to(0.08, Duration::zero()).force.x(), before);
}

TEST(HapticController, TheForceNeverGrowsFasterThanTheSlewLimit) {
  HapticController::Config c = config();
  c.max_slew = 500;
  Bench bench(c);
  bench.move_freely(400);
  bench.want(-2);
  double before = bench.applied.x();
  for (int i = 0; i < 20; ++i) {
    const Step step = bench.move_to(0.08);
    EXPECT_LE(std::abs(step.force.x() - before), 0.5 + 1e-12);
    if (std::abs(step.force.x() + 2) > 1e-9 && !step.reasons.has(Reason::kEnergy)) {
      EXPECT_TRUE(step.reasons.has(Reason::kSlew));
    }
    before = step.force.x();
  }
  EXPECT_NEAR(before, -2, 1e-12);
}

TEST(HapticController, APauseDoesNotLetTheForceJump) {
  HapticController::Config c = config();
  c.max_slew = 500;
  Bench bench(c);
  bench.move_freely(400);
  bench.want(-4);
  EXPECT_LE(bench.move_to(0.08, milliseconds(60)).force.norm(), 0.5 + 1e-12);
}

TEST(HapticController, StaysWithinTheDevicesForceAndSaysSo) {
  HapticController::Config c = config();
  c.max_force = 2;
  Bench bench(c);
  bench.move_freely(400);
  bench.want(-100);
  const Step step = bench.move_to(0.08);
  EXPECT_DOUBLE_EQ(step.force.norm(), 2);
  EXPECT_TRUE(step.reasons.has(Reason::kMaxForce));
  EXPECT_FALSE(step.reasons.has(Reason::kEnergy));
}

TEST(HapticController, ATorqueForADeviceWithoutAnOrientationChangesNothing) {
  HapticController controller(config());
  RemoteForce remote;
  remote.sequence = 1;
  remote.valid_for = milliseconds(500);
  remote.torque.emplace().torque = Vec3(0, 0, 0.01);
  controller.observe(remote);
  EXPECT_TRUE(controller.step({LocalTime(milliseconds(1)), Vec3::Zero(), Vec3::Zero()}, Vec3::Zero()).reasons.empty());
}

TEST(HapticController, NamesTheBoundThatDecidedAndNotTheLooserOnes) {
  HapticController::Config c = config();
  c.max_force = 2;
  c.max_slew = 100;
  Bench bench(c);
  bench.move_to(0);
  bench.want(-100);
  const Step step = bench.move_to(1e-6);
  EXPECT_TRUE(step.reasons.has(Reason::kEnergy));  // 0.06 N; the slew limit allows 0.1 N and the device 2 N
  EXPECT_FALSE(step.reasons.has(Reason::kSlew));
  EXPECT_FALSE(step.reasons.has(Reason::kMaxForce));
}

TEST(HapticController, WithoutALimiterTheLedgerIsStillKept) {
  HapticController::Config c = config();
  c.limiter.law = Law::kNone;
  Bench bench(c);
  bench.move_to(0);
  bench.want(-4);
  bench.move_to(0);
  const Step step = bench.move_to(-1e-3);
  EXPECT_LT(step.energy, 0);
  EXPECT_EQ(step.permitted, kInf);
}

TEST(HapticController, InOneDimensionThePerAxisAndTheJointFormAreTheSame) {
  HapticController::Config joint = config();
  HapticController::Config axes = config();
  axes.limiter.law = Law::kAolPerAxis;
  Bench a(joint);
  Bench z(axes);
  for (int i = 0; i < 1000; ++i) {
    const double x = 0.01 * std::sin(i * 0.01);
    if (i % 10 == 0) {
      a.want(-3000 * x);
      z.want(-3000 * x);
    }
    EXPECT_NEAR(a.move_to(x).force.x(), z.move_to(x).force.x(), 1e-12);
  }
}

TEST(HapticController, ReportsTheAgeOfTheWholeLoop) {
  Bench bench(config());
  RemoteForce remote;
  remote.sequence = 9;
  remote.answers = LocalTime(milliseconds(10));
  remote.received = LocalTime(milliseconds(50));
  remote.valid_for = milliseconds(100);
  remote.error = 0.25;
  bench.controller.observe(remote);
  bench.now = milliseconds(59);
  const Step step = bench.move_to(0);
  EXPECT_EQ(step.force_sequence, 9U);
  EXPECT_EQ(step.force_age, milliseconds(10));
  EXPECT_EQ(step.loop_age, milliseconds(50));
  EXPECT_EQ(step.force_error, 0.25);
}

TEST(HapticController, RefusesImpossibleLimits) {
  expect_refusals(config(), Makes<HapticController>(),
                  {
                      {"max_force = 0", [](auto& c) { c.max_force = 0; }},
                      {"max_slew = -1", [](auto& c) { c.max_slew = -1; }},
                      {"longest_hold = 0", [](auto& c) { c.limiter.longest_hold = Duration::zero(); }},
                      {"viscous = -1", [](auto& c) { c.limiter.friction.viscous = -1; }},
                  });
}

HapticController::Config tool_config() {
  HapticController::Config c = config();
  c.limiter.law = Law::kNone;
  c.admittance = AdmittanceLoop<3>::Config{.mass = Vec3::Constant(2), .proportional = Vec3::Constant(100)};
  return c;
}

TEST(HapticController, AnAdmittanceDevicePushesTheHandleAfterTheTool) {
  HapticController controller(tool_config());
  controller.step({LocalTime(milliseconds(1)), Vec3::Zero(), Vec3::Zero()}, Vec3::Zero(), Vec3::Zero());
  const Vec3 push(3, 0, 0);
  const Step step = controller.step({LocalTime(milliseconds(2)), Vec3::Zero(), Vec3::Zero()}, Vec3::Zero(), push);
  // If the tool is accelerated by a force of 3 N for 1 ms, its speed is 1.5 mm/s, and the handle is at rest.
  EXPECT_NEAR(step.force.x(), 100 * 3 * 1e-3 / 2, 1e-9);
  EXPECT_EQ(step.hand_force, push);
}

TEST(HapticController, OfAdmittanceTypeTheRemoteForceActsOnTheTool) {
  HapticController controller(tool_config());
  RemoteForce wall;
  wall.sequence = 1;
  wall.force = Vec3(-4, 0, 0);
  wall.valid_for = milliseconds(50);
  controller.observe(wall);
  controller.step({LocalTime(milliseconds(1)), Vec3::Zero(), Vec3::Zero()}, Vec3::Zero(), Vec3::Zero());
  const Step step =
      controller.step({LocalTime(milliseconds(2)), Vec3::Zero(), Vec3::Zero()}, Vec3::Zero(), Vec3(4, 0, 0));
  EXPECT_EQ(step.wanted.x(), -4);
  EXPECT_NEAR(step.force.x(), 0, 1e-12);
}

TEST(HapticController, AnAdmittanceDeviceGivesNoForceWithoutMeasurement) {
  HapticController controller(tool_config());
  controller.step({LocalTime(milliseconds(1)), Vec3::Zero(), Vec3::Zero()}, Vec3::Zero(), Vec3(3, 0, 0));
  const Step step = controller.step({LocalTime(milliseconds(2)), Vec3::Zero(), Vec3::Zero()}, Vec3::Zero());
  EXPECT_EQ(step.force, Vec3::Zero());
  EXPECT_TRUE(step.reasons.has(Reason::kNotFinite));
}

TEST(FrictionMap, TheLeastOfTheNearestPlaceAndOfAllWithinReachHolds) {
  const FrictionMap map({.places = {{Vec3(0, 0, 0), {.coulomb = 0.3, .viscous = 0.1}},
                                    {Vec3(0.1, 0, 0), {.coulomb = 0.2, .viscous = 0.4}}},
                         .reach = 0.06});
  EXPECT_EQ(map.at(Vec3(0.01, 0, 0)).coulomb, 0.3);
  EXPECT_EQ(map.at(Vec3(0.05, 0, 0)).coulomb, 0.2);  // the larger value of both cells
  EXPECT_EQ(map.at(Vec3(0.05, 0, 0)).viscous, 0.1);
  EXPECT_EQ(map.at(Vec3(0.09, 0, 0)).viscous, 0.4);
  EXPECT_EQ(map.at(Vec3(5, 0, 0)).coulomb, 0.2);  // outside of all cells, the nearest one is used
  EXPECT_THROW(FrictionMap({.places = {}, .reach = 0}), std::invalid_argument);
}

TEST(HapticController, WhereFrictionIsLessTheFirstForceIsLessAtOnce) {
  HapticController::Config c = config();
  c.limiter.friction = {.coulomb = 0.3, .viscous = 0.26};
  c.limiter.parts.adaptive_friction.emplace();
  c.friction_map = FrictionMap::Config{.places = {{Vec3(0, 0, 0), {.coulomb = 0.3, .viscous = 0.26}},
                                                  {Vec3(0.1, 0, 0), {.coulomb = 0.05, .viscous = 0.26}}},
                                       .reach = 0.03};
  const auto permitted_at = [&c](double x) {
    HapticController controller(c);
    return controller.step({LocalTime(milliseconds(1)), Vec3(x, 0, 0), Vec3::Zero()}, Vec3::Zero()).permitted;
  };
  EXPECT_EQ(permitted_at(0), 0.3);
  EXPECT_EQ(permitted_at(0.1), 0.05);
  c.limiter.parts.adaptive_friction.reset();
  EXPECT_THROW(HapticController{c}, std::invalid_argument);
}

}  // namespace
}  // namespace tendon::haptic_controller_test
