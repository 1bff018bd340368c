// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/simulated_device.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Geometry>

#include "tests/devices/device_bench.h"
#include "tests/support/refusal.h"

namespace tendon::simulated_device_test {
namespace {

using namespace std::chrono_literals;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

SimulatedDevice::Config bare(double mass = 0.075) {
  SimulatedDevice::Config config;
  config.mass = mass;
  return config;
}

OperatorHand::Config waving_hand(const Vec3& direction = Vec3::UnitX()) {
  return {.stiffness = 400,
          .damping = 2,
          .mass = 0.05,
          .motion = ScriptedMotion(ScriptedMotion::Sine{.amplitude = 0.02, .frequency = 1.5, .direction = direction})};
}

TEST(SimulatedDevice, TheFirstReadOnlySetsTheInstantZero) {
  auto config = bare();
  config.start_velocity = {1, 0, 0};
  SimulatedDevice device(config);
  const auto first = device.read(LocalTime(5h));
  ASSERT_TRUE(first);
  EXPECT_EQ(first->at, LocalTime(5h));
  EXPECT_EQ(first->position, Vec3::Zero());
  EXPECT_NEAR(device.read(LocalTime(5h + 100ms))->position.x(), 0.1, 1e-13);
}

TEST(SimulatedDevice, TimeThatGoesBackwardsMovesNothing) {
  auto config = bare();
  config.start_velocity = {1, 0, 0};
  SimulatedDevice device(config);
  device.read(LocalTime(1s));
  device.read(LocalTime(2s));
  EXPECT_NEAR(device.read(LocalTime(500ms))->position.x(), 1, 1e-11);
  EXPECT_NEAR(device.read(LocalTime(2s))->position.x(), 1, 1e-11);
  EXPECT_NEAR(device.read(LocalTime(3s))->position.x(), 2, 1e-11);
}

TEST(SimulatedDevice, LivesThroughNoMoreOfAGapThanTheLongestItAllows) {
  auto config = bare();
  config.start_velocity = {1, 0, 0};
  Bench bench(config);
  bench.wait(1h);
  EXPECT_NEAR(bench.truth().position.x(), seconds(SimulatedDevice::kMaxGap), 1e-9);
}

TEST(SimulatedDevice, DoesNotDependOnHowOftenItIsRead) {
  auto config = bare();
  config.coulomb_friction = 0.04;
  config.viscous_friction = 0.1;
  config.hand = waving_hand();
  Bench often(config);
  Bench seldom(config);
  for (int i = 0; i < 100; ++i) {
    seldom.wait(10ms);
    for (int j = 0; j < 10; ++j) often.wait(1ms);
    ASSERT_LT((often.truth().position - seldom.truth().position).norm(), 1e-12);
  }
}

TEST(SimulatedDevice, AHandThatHasLetGoPushesNoMoreAndTakesItsMassWithIt) {
  auto config = bare();
  config.hand = waving_hand();
  config.lets_go_after = 33'333us;  // this is between two reads and within a substep
  Bench often(config);
  Bench seldom(config);
  auto holding = config;
  holding.lets_go_after.reset();
  Bench held(holding);
  for (int i = 0; i < 100; ++i) {
    held.wait(1ms);
    often.wait(1ms);
    if (i % 10 == 9) seldom.wait(10ms);
    if (i == 32) {
      ASSERT_EQ(often.truth().position, held.truth().position) << "it held on until then";
    }
    if (i == 50) often.device().apply(Vec3(0, 1, 0));
    if (i == 50) seldom.device().apply(Vec3(0, 1, 0));
  }
  EXPECT_LT((often.truth().position - seldom.truth().position).norm(), 1.1e-3) << "a force that came 1 ms apart";
  EXPECT_EQ(often.truth().hand_force, Vec3::Zero());
  EXPECT_NEAR(often.truth().velocity.y(), 0.049 / 0.075, 1e-9) << "the mass of the device alone";
  EXPECT_GT(often.truth().velocity.x(), 0.05) << "it goes on as it was";
  EXPECT_NEAR(often.truth().kinetic_energy, often.truth().velocity.squaredNorm() * 0.075 / 2, 1e-12);
}

TEST(ViscousFriction, LetsTheVelocityFallAsTheExponentialOfTheClosedForm) {
  const double m = 0.075;
  const double b = 0.26;
  const Vec3 v0(0.3, -0.4, 0.1);
  auto config = bare(m);
  config.viscous_friction = b;
  config.start_velocity = v0;
  Bench bench(config);
  for (int i = 1; i <= 100; ++i) {
    bench.wait(10ms);
    const double left = std::exp(-b * 0.01 * i / m);
    ASSERT_LT((bench.truth().velocity - v0 * left).norm(), 1e-8);
    ASSERT_LT((bench.truth().position - v0 * (m / b * (1 - left))).norm(), 1e-8);
  }
}

TEST(CoulombFriction, HoldsWhatPushesWithLessInAnyDirection) {
  auto config = bare();
  config.coulomb_friction = 0.04;
  Dice dice(1);
  for (int i = 0; i < 100; ++i) {
    Bench bench(config);
    bench.push(random_vector(dice, 1).normalized() * 0.04 * dice.within(0, 0.9999), 100ms);
    ASSERT_EQ(bench.truth().position, Vec3::Zero());
    ASSERT_EQ(bench.truth().velocity, Vec3::Zero());
  }
}

TEST(CoulombFriction, LetsOnlyWhatIsAboveItAccelerate) {
  auto config = bare(0.075);
  config.coulomb_friction = 0.04;
  Bench bench(config);
  const Vec3 direction = Vec3(1, 2, -2) / 3;
  bench.push(0.05 * direction, 500ms);
  const double acceleration = (0.05 - 0.04) / 0.075;
  EXPECT_LT((bench.truth().velocity - direction * acceleration * 0.5).norm(), 1e-12);
  EXPECT_LT((bench.truth().position - direction * acceleration * 0.125).norm(), 1e-12);
}

TEST(CoulombFriction, StopsAfterTheClosedFormsSlidingDistanceAndRests) {
  const double m = 0.075;
  const double f_c = 0.04;
  const Vec3 direction = Vec3(2, -1, 2) / 3;
  auto config = bare(m);
  config.coulomb_friction = f_c;
  config.start_velocity = 0.2 * direction;
  Bench bench(config);

  const Duration stops = from_seconds(m * 0.2 / f_c);
  bench.wait(stops - 1ms);
  EXPECT_NEAR(bench.truth().velocity.norm(), f_c / m * 1e-3, 1e-9);
  bench.wait(2ms);
  const Vec3 rest = bench.truth().position;
  EXPECT_LT((rest - direction * (m * 0.2 * 0.2 / (2 * f_c))).norm(), 1e-9);
  EXPECT_EQ(bench.truth().velocity, Vec3::Zero());
  bench.wait(1s);
  EXPECT_EQ(bench.truth().position, rest);
  EXPECT_EQ(bench.truth().velocity, Vec3::Zero());
}

TEST(CoulombFriction, HoldsAgainstAForceThatBrakedTheDeviceToAStop) {
  auto config = bare();
  config.coulomb_friction = 0.04;
  config.start_velocity = {0.1, 0, 0};
  Bench bench(config);
  bench.push({-0.039, 0, 0}, 2s);
  const Vec3 rest = bench.truth().position;
  EXPECT_NEAR(rest.x(), 0.075 * 0.01 / (2 * 0.079), 1e-9);
  EXPECT_EQ(bench.truth().velocity, Vec3::Zero());
  bench.wait(1s);
  EXPECT_EQ(bench.truth().position, rest);
}

TEST(CoulombFriction, TurnsRoundWithoutAPauseUnderAForceThatItCannotHold) {
  // The handle is stopped by F + f_c, and then its motion is reversed by F − f_c. For the rest of the 50 µs substep in
  // which this happens, friction may have the wrong sign. If the handle stopped for that long, this would cost 3 mm/s.
  const double m = 0.075;
  const double error = 2 * 0.04 / m * seconds(SimulatedDevice::Config{}.max_substep);
  for (const double v0 : {0.1, 0.1003, 0.1011, 0.1017, 0.1026}) {
    auto config = bare(m);
    config.coulomb_friction = 0.04;
    config.start_velocity = {v0, 0, 0};
    Bench bench(config);
    bench.push({-5, 0, 0}, 10ms);
    const double back = 10e-3 - m * v0 / 5.04;
    EXPECT_NEAR(bench.truth().velocity.x(), -4.96 / m * back, error);
    EXPECT_NEAR(bench.truth().position.x(), m * v0 * v0 / (2 * 5.04) - 4.96 / (2 * m) * back * back, error * 10e-3);
  }
}

TEST(CoulombFriction, OpposesTheVelocityAlongACurvedPath) {
  // A lateral force while sliding, compared to Runge-Kutta for m dv/dt = F − f_c v/|v| in steps of 1 µs.
  const double m = 0.075;
  const double f_c = 0.04;
  const Vec3 force(0, 0.1, 0.05);
  auto config = bare(m);
  config.coulomb_friction = f_c;
  config.start_velocity = {0.3, 0, 0};
  Bench bench(config);
  bench.push(force, 200ms);

  const auto acceleration = [&](const Vec3& v) { return Vec3((force - f_c * v.normalized()) / m); };
  const double h = 1e-6;
  Vec3 v = config.start_velocity;
  for (int i = 0; i < 200'000; ++i) {
    const Vec3 k1 = acceleration(v);
    const Vec3 k2 = acceleration(v + h / 2 * k1);
    const Vec3 k3 = acceleration(v + h / 2 * k2);
    const Vec3 k4 = acceleration(v + h * k3);
    v += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  EXPECT_LT((bench.truth().velocity - v).norm(), 1e-8);
}

TEST(SimulatedDevice, DoesNotKnowWhichWayTheFrameIsTurned) {
  const Mat3 turn = Eigen::AngleAxisd(1.1, Vec3(1, -2, 3).normalized()).toRotationMatrix();
  const auto config = [](const Mat3& frame) {
    auto c = bare();
    c.viscous_friction = 0.1;
    c.coulomb_friction = 0.04;
    c.max_force = 1;
    c.amplifier_bandwidth = 300;
    c.start_velocity = frame * Vec3(0.1, 0.2, -0.1);
    c.hand = waving_hand(frame * Vec3::UnitX());
    return c;
  };
  Bench straight(config(Mat3::Identity()));
  Bench turned(config(turn));
  Dice dice(7);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 force = random_vector(dice, 1.2);
    straight.push(force, 1ms);
    turned.push(turn * force, 1ms);
    ASSERT_LT((turn * straight.truth().position - turned.truth().position).norm(), 1e-12);
    ASSERT_LT((turn * straight.truth().velocity - turned.truth().velocity).norm(), 1e-12);
  }
}

TEST(Encoder, SaysTheCentreOfTheCountSoTheTruthIsWithinHalfACount) {
  const double step = 30e-6;
  auto config = bare();
  config.encoder_step = step;
  config.hand = waving_hand(Vec3(1, 0.3, -0.7));
  Bench bench(config);
  EXPECT_EQ(bench.wait(Duration(0)), Vec3::Zero()) << "the origin is the centre of a count";
  for (int i = 0; i < 1000; ++i) {
    const Vec3 seen = bench.wait(1ms);
    ASSERT_LE((seen - bench.truth().position).lpNorm<Eigen::Infinity>(), step / 2 * (1 + 1e-9));
    const Vec3 counts = seen / step;
    ASSERT_LT((counts - counts.array().round().matrix()).norm(), 1e-9);
  }
}

TEST(Encoder, HasCountsOfOneWidthAlsoAroundTheOrigin) {
  auto config = bare();
  config.encoder_step = 1e-3;
  config.start_velocity = {1, 0, 0};
  config.start_position = Vec3(-3.5e-3, 0, 0);
  Bench bench(config);
  bench.wait(5us);  // moves off the edge between two counts
  for (int count = -3; count <= 3; ++count) {
    for (int i = 0; i < 10; ++i) {
      ASSERT_NEAR(bench.wait(i == 0 ? 0us : 100us).x(), count * 1e-3, 1e-12);
    }
    bench.wait(100us);
  }
}

TEST(Saturation, KeepsTheDirectionAndReturnsTheForceReallyHeld) {
  auto config = bare();
  config.max_force = 3.3;
  Bench bench(config);
  for (const Vec3& wanted : {Vec3(10, -20, 5), Vec3(1e6, 1, 0), Vec3(1e300, -1e300, 1e299),
                             Vec3(1.7e308, 1.7e308, 1.7e308), Vec3(2, 2, 2)}) {
    const Vec3 held = bench.device().apply(wanted);
    EXPECT_NEAR(held.norm(), 3.3, 1e-14);
    EXPECT_LT((held.normalized() - (wanted / wanted.lpNorm<Eigen::Infinity>()).normalized()).norm(), 1e-15);
    const Vec3 before = bench.truth().velocity;
    bench.wait(1ms);
    EXPECT_LT((bench.truth().velocity - before - held * (1e-3 / 0.075)).norm(), 1e-12);
  }
}

TEST(Saturation, LeavesASmallerForceAsItIsToTheLastBit) {
  auto config = bare();
  config.max_force = 3.3;
  Bench bench(config);
  Dice dice(3);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 force = random_vector(dice, 1.9);
    ASSERT_EQ(bench.device().apply(force), force);
  }
  EXPECT_EQ(bench.device().apply(Vec3::Zero()), Vec3::Zero());
}

TEST(SimulatedDevice, DropsTheForceItHeldWhenTheNextIsNotANumber) {
  for (const bool saturates : {false, true}) {
    for (const double bad : {kNan, kInf, -kInf}) {
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        auto config = bare();
        if (saturates) config.max_force = 8.5;
        Bench bench(config);
        bench.push({1, 0, 0}, 1ms);
        const Vec3 before = bench.truth().velocity;
        Vec3 force(1, 1, 1);
        force[axis] = bad;
        EXPECT_EQ(bench.device().apply(force), Vec3::Zero());
        bench.wait(1s);
        EXPECT_EQ(bench.truth().velocity, before);
      }
    }
  }
}

TEST(Amplifier, FollowsAStepAsAFirstOrderLag) {
  const double m = 0.075;
  const double tau = 1 / (2 * std::numbers::pi * 300);
  auto config = bare(m);
  config.amplifier_bandwidth = 300;
  Bench bench(config);
  EXPECT_EQ(bench.device().apply({2, 0, 0}), Vec3(2, 0, 0)) << "what is returned is what was written, before the lag";
  for (int i = 1; i <= 50; ++i) {
    bench.wait(100us);
    const double t = 1e-4 * i;
    // The impulse is exact. The force is the mean value over the last 50 µs.
    ASSERT_NEAR(bench.truth().velocity.x(), 2 / m * (t - tau * (1 - std::exp(-t / tau))), 1e-13);
    ASSERT_NEAR(bench.truth().device_force.x(), 2 * (1 - std::exp(-(t - 25e-6) / tau)), 2e-3);
  }
}

TEST(Watchdog, TakesTheForceAwayAfterExactlyItsTime) {
  auto config = bare(0.075);
  config.watchdog = 5ms;
  // The intervals are shorter than the watchdog, equal to it, or much longer. The impulse is always force × 5 ms.
  for (const Duration interval : {Duration(5ms), Duration(1700us), Duration(333'333), Duration(1s)}) {
    Bench bench(config);
    bench.device().apply({0.3, -0.6, 0.6});
    int fired = 0;
    for (Duration waited{}; waited < 20ms; waited += interval) {
      bench.wait(interval);
      fired += bench.truth().watchdog_fired ? 1 : 0;
    }
    EXPECT_LT((bench.truth().velocity - Vec3(0.3, -0.6, 0.6) * (5e-3 / 0.075)).norm(), 1e-15);
    EXPECT_EQ(fired, 1);
  }
}

TEST(Watchdog, StaysQuietAsLongAsForcesComeInTime) {
  auto config = bare(0.075);
  config.watchdog = 5ms;
  Bench bench(config);
  for (int i = 0; i < 100; ++i) {
    bench.push({0.1, 0, 0}, 5ms);
    ASSERT_FALSE(bench.truth().watchdog_fired);
  }
  EXPECT_NEAR(bench.truth().velocity.x(), 0.1 * 0.5 / 0.075, 1e-12);
}

TEST(Watchdog, LetsTheNextForceThroughAgain) {
  auto config = bare(0.075);
  config.watchdog = 5ms;
  Bench bench(config);
  bench.push({1, 0, 0}, 100ms);
  const double before = bench.truth().velocity.x();
  bench.push({1, 0, 0}, 3ms);
  EXPECT_NEAR(bench.truth().velocity.x() - before, 3e-3 / 0.075, 1e-14);
  EXPECT_FALSE(bench.truth().watchdog_fired);
}

TEST(SimulatedDevice, WithoutAnyEffectIsNewtonsSecondLawAndNothingElse) {
  const double m = 0.075;
  Bench bench(bare(m));
  Dice dice(11);
  Vec3 x = Vec3::Zero();
  Vec3 v = Vec3::Zero();
  for (int i = 0; i < 1000; ++i) {
    const Vec3 force = random_vector(dice, 5);
    bench.push(force, 1ms);
    x += v * 1e-3 + force * (1e-6 / (2 * m));
    v += force * (1e-3 / m);
    ASSERT_LT((bench.truth().position - x).norm(), 1e-12 * (1 + x.norm()));
    ASSERT_LT((bench.truth().velocity - v).norm(), 1e-12 * (1 + v.norm()));
  }
}

TEST(SimulatedDevice, TakesTheSamePathToTheLastBitWithEffectsThatNeverBite) {
  auto plain = bare();
  plain.viscous_friction = 0.1;
  plain.coulomb_friction = 0.04;
  plain.hand = waving_hand(Vec3(1, 1, 0));
  auto listed = plain;
  listed.max_force = 1e9;
  listed.watchdog = 1h;
  listed.force_sensor.emplace();
  listed.button_after = 1h;
  listed.encoder_step = 1e-3;  // changes only the measurement
  Bench a(plain);
  Bench z(listed);
  Dice dice(5);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 force = random_vector(dice, 5);
    const Duration interval(static_cast<Duration::rep>(dice.within(0.3e6, 2e6)));
    a.push(force, interval);
    z.push(force, interval);
    ASSERT_EQ(a.truth().position, z.truth().position);
    ASSERT_EQ(a.truth().velocity, z.truth().velocity);
    ASSERT_EQ(a.truth().hand_work, z.truth().hand_work);
  }
}

TEST(SimulatedDevice, MeasuresTheForceOfTheHandWhenItHasASensorForIt) {
  auto config = bare();
  config.hand = waving_hand(Vec3(1, 2, 0));
  EXPECT_FALSE(SimulatedDevice(config).read(LocalTime(0s))->hand_force);
  config.force_sensor.emplace();
  SimulatedDevice exact(config);
  config.force_sensor->resolution = 0.25;
  SimulatedDevice coarse(config);
  double largest = 0;
  for (int i = 0; i < 1000; ++i) {
    const LocalTime now(i * 1ms);
    const auto sample = exact.read(now);
    ASSERT_EQ(*sample->hand_force, exact.truth().hand_force);
    const Vec3 counts = *coarse.read(now)->hand_force / 0.25;
    ASSERT_EQ(counts, counts.array().round().matrix());
    ASSERT_LE((counts * 0.25 - *sample->hand_force).lpNorm<Eigen::Infinity>(), 0.125);
    largest = std::max(largest, sample->hand_force->norm());
  }
  EXPECT_GT(largest, 0.5);
}

TEST(SimulatedDevice, AHandThatPushesAlongTheAxisIsMeasuredWithThatSign) {
  auto config = bare();
  config.force_sensor.emplace();
  config.start_position = Vec3::Zero();
  config.hand = OperatorHand::Config{.stiffness = 100,
                                     .damping = 0,
                                     .mass = 0,
                                     .motion = ScriptedMotion(ScriptedMotion::RampHold{
                                         .from = {0.01, 0, 0}, .to = {0.01, 0, 0}, .ramp = 1s, .hold = std::nullopt})};
  SimulatedDevice device(config);
  device.read(LocalTime(0s));
  EXPECT_NEAR(device.read(LocalTime(50us))->hand_force->x(), 1, 1e-3);
}

TEST(AllEffects, RepeatThemselvesToTheLastBit) {
  for (const bool in_joints : {false, true}) {
    auto config = bare();
    config.viscous_friction = 0.01;
    if (in_joints) {
      config.joint_friction = {.mechanism = Mechanism::Falcon{}, .coulomb = Vec3(0.002, 0.003, 0.004)};
    } else {
      config.coulomb_friction = 0.04;
    }
    config.structural_mode = {.handle_mass = 0.03, .stiffness = 3000, .damping = 0.1};
    config.sample_delay = 1ms;
    config.force_delay = 700us;
    config.encoder_step = 30e-6;
    config.max_force = 8.5;
    config.amplifier_bandwidth = 400;
    config.watchdog = 5ms;
    config.hand = waving_hand();
    Bench a(config);
    Bench z(config);
    Dice dice(13);
    for (int i = 0; i < 400; ++i) {
      const Vec3 force = random_vector(dice, 12);
      const Duration interval(static_cast<Duration::rep>(dice.within(0.1e6, 8e6)));
      ASSERT_EQ(a.push(force, interval), z.push(force, interval));
      ASSERT_EQ(a.truth().position, z.truth().position);
      ASSERT_TRUE(a.truth().position.allFinite());
    }
  }
}

TEST(SimulatedDevice, SaysWhatItCanDo) {
  auto config = bare();
  EXPECT_EQ(SimulatedDevice(config).info().max_force, kInf);
  EXPECT_EQ(SimulatedDevice(config).info().position_resolution, 0);
  EXPECT_EQ(SimulatedDevice(config).info().watchdog, Duration(0));
  config.name = "phantom";
  config.max_force = 8.5;
  config.encoder_step = 30e-6;
  config.watchdog = 5ms;
  const SimulatedDevice device(config);
  EXPECT_EQ(device.info().name, "phantom");
  EXPECT_EQ(device.info().max_force, 8.5);
  EXPECT_EQ(device.info().position_resolution, 30e-6);
  EXPECT_EQ(device.info().watchdog, Duration(5ms));
}

TEST(SimulatedDevice, StartsWhereTheHandStartsUnlessToldOtherwise) {
  auto config = bare();
  config.hand = OperatorHand::Config{
      .stiffness = 400,
      .damping = 2,
      .mass = 0.05,
      .motion = ScriptedMotion(ScriptedMotion::Sine{.amplitude = 0, .frequency = 1, .centre = {0.1, 0.2, 0.3}})};
  EXPECT_EQ(Bench(config).wait(1s), Vec3(0.1, 0.2, 0.3));
  config.start_position = Vec3(1, 0, 0);
  EXPECT_EQ(Bench(config).truth().position, Vec3(1, 0, 0));
}

TEST(SimulatedDevice, RefusesImpossibleValuesAndNamesTheField) {
  auto good = bare();
  good.hand = waving_hand();
  expect_refusals(
      good, Makes<SimulatedDevice>(),
      {
          {"mass = 0: expected a number above 0 kg", [](auto& c) { c.mass = 0; }},
          {"mass = -0.075: expected a number above 0 kg", [](auto& c) { c.mass = -0.075; }},
          {"mass = nan: expected a number above 0 kg", [](auto& c) { c.mass = kNan; }},
          {"mass = inf: expected a number above 0 kg", [](auto& c) { c.mass = kInf; }},
          {"viscous_friction = -1: expected", [](auto& c) { c.viscous_friction = -1; }},
          {"coulomb_friction = 0: expected a number above 0 (omit it to", [](auto& c) { c.coulomb_friction = 0; }},
          {"coulomb_friction = 0.4: expected none in addition to joint_friction",
           [](auto& c) {
             c.coulomb_friction = 0.4;
             c.joint_friction = {.mechanism = Mechanism::Falcon{}, .coulomb = Vec3(1, 1, 1)};
           }},
          {"encoder_step = nan: expected", [](auto& c) { c.encoder_step = kNan; }},
          {"force_sensor.resolution = 0", [](auto& c) { c.force_sensor.emplace().resolution = 0; }},
          {"max_force = -8.5: expected", [](auto& c) { c.max_force = -8.5; }},
          {"amplifier_bandwidth = inf: expected", [](auto& c) { c.amplifier_bandwidth = kInf; }},
          {"watchdog = 0: expected a duration above 0 s", [](auto& c) { c.watchdog = Duration(0); }},
          {"start_position.y = nan: expected a finite number", [](auto& c) { c.start_position = Vec3(0, kNan, 0); }},
          {"start_velocity.z = inf: expected a finite number", [](auto& c) { c.start_velocity.z() = kInf; }},
          {"hand.lets_go_after = -1: expected 0 s or more", [](auto& c) { c.lets_go_after = -1s; }},
          {"hand.lets_go_after = 1: expected 0 s or more, for a device with a hand",
           [](auto& c) {
             c.hand.reset();
             c.lets_go_after = 1s;
           }},
          {"hand.stiffness = 0: expected", [](auto& c) { c.hand->stiffness = 0; }},
          {"hand.damping = -1: expected 0 N·s/m or more", [](auto& c) { c.hand->damping = -1; }},
          {"hand.mass = -0.1: expected 0 kg or more", [](auto& c) { c.hand->mass = -0.1; }},
      });
}

}  // namespace
}  // namespace tendon::simulated_device_test
