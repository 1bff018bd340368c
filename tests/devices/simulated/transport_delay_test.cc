// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/stability/stability_boundary.h"
#include "devices/simulated/simulated_device.h"
#include "tests/devices/device_bench.h"
#include "tests/support/refusal.h"

namespace tendon::transport_delay_test {
namespace {

using namespace std::chrono_literals;

SimulatedDevice::Config free_mass(std::optional<Duration> sample, std::optional<Duration> force) {
  SimulatedDevice::Config config;
  config.mass = 0.1;
  config.sample_delay = sample;
  config.force_delay = force;
  return config;
}

TEST(TransportDelay, ASampleIsThatOfTheInstantThatItSays) {
  // The position shows when the sample was taken. The intervals must not be multiples of the delay.
  for (const Duration delay : {Duration(1ms), Duration(1'700us), Duration(333'333ns), Duration(100ms)}) {
    auto config = free_mass(delay, std::nullopt);
    config.start_velocity = {1, 0, 0};
    SimulatedDevice device(config);
    LocalTime now(5s);
    const LocalTime began = now - delay;
    for (int i = 0; i < 200; ++i, now += 731us) {
      const auto sample = device.read(now);
      ASSERT_EQ(sample->at, now - delay);
      ASSERT_NEAR(sample->position.x(), seconds(sample->at - began), 1e-12);
      ASSERT_EQ(sample->position, device.truth().position);
    }
  }
}

TEST(TransportDelay, AForceActsFromItsDelayUntilTheDelayOfTheNext) {
  // The impulse is 2 N · 1 ms for every delay. The position shows the time at which the force was applied.
  for (const Duration delay : {Duration(1ns), Duration(999'999ns), Duration(300us), Duration(1ms), Duration(1'700us),
                               Duration(2ms), Duration(12'345'678ns)}) {
    Bench bench(free_mass(std::nullopt, delay));
    bench.push({2, 0, 0}, 1ms);
    for (int i = 0; i < 30; ++i) bench.push(Vec3::Zero(), 1ms);
    EXPECT_NEAR(bench.truth().velocity.x(), 0.02, 1e-14);
    // x = v (t − delay − half of the push duration)
    EXPECT_NEAR(bench.truth().position.x(), 0.02 * (31e-3 - seconds(delay) - 0.5e-3), 1e-14) << delay.count();
  }
}

TEST(TransportDelay, UntilTheFirstForceHasArrivedThereIsNone) {
  Bench bench(free_mass(std::nullopt, 5ms));
  EXPECT_EQ(bench.device().apply({1, 0, 0}), Vec3(1, 0, 0)) << "what is returned is what is under way";
  for (int i = 0; i < 5; ++i) EXPECT_EQ(bench.push({1, 0, 0}, 1ms), Vec3::Zero());
  EXPECT_GT(bench.push({1, 0, 0}, 1ms).x(), 0);
}

TEST(TransportDelay, ALoopFeelsOnlyTheSumOfBothDelays) {
  const auto seen = [](Duration sample, Duration force) {
    auto config = free_mass(sample > 0ms ? std::optional(sample) : std::nullopt,
                            force > 0ms ? std::optional(force) : std::nullopt);
    config.viscous_friction = 1;
    config.start_position = Vec3(0.01, 0, 0);
    Bench bench(config);
    std::vector<double> path;
    Vec3 x = *config.start_position;
    for (int i = 0; i < 300; ++i) {
      x = bench.push(-100 * x, 1ms);
      path.push_back(x.x());
    }
    return path;
  };
  const auto ahead = seen(1'300us, 0ms);
  EXPECT_EQ(ahead, seen(0ms, 1'300us));
  EXPECT_EQ(ahead, seen(600us, 700us));
  EXPECT_NE(ahead, seen(600us, 699us));
}

TEST(TransportDelay, WithoutAForceNothingIsDifferentToTheLastBitButTheStamps) {
  SimulatedDevice::Config config;
  config.mass = 0.1;
  config.coulomb_friction = 0.02;
  config.hand = OperatorHand::Config{.stiffness = 300,
                                     .damping = 2,
                                     .mass = 0.05,
                                     .motion = ScriptedMotion(ScriptedMotion::Sine{.amplitude = 0.02, .frequency = 1})};
  auto late = config;
  late.sample_delay = 2ms;
  late.force_delay = 1ms;
  Bench a(config);
  Bench z(late);
  Dice dice(5);
  for (int i = 0; i < 1000; ++i) {
    const Duration interval(static_cast<Duration::rep>(dice.within(0.3e6, 2e6)));
    ASSERT_EQ(a.wait(interval), z.wait(interval));
    ASSERT_EQ(a.truth().hand_work, z.truth().hand_work);
  }
}

TEST(TransportDelay, ShiftsASampledSpringsStabilityAsTheClosedForm) {
  // The delay is a number of whole periods. See core/stability for the exact boundary.
  for (const int late : {1, 2, 5}) {
    SampledSpring spring{.mass = 0.075, .viscous = 0.26, .period = 1ms, .delay_samples = late};
    const double boundary = largest_stable_stiffness(spring);
    for (const bool of_samples : {false, true}) {
      auto config = of_samples ? free_mass(late * 1ms, std::nullopt) : free_mass(std::nullopt, late * 1ms);
      config.mass = spring.mass;
      config.viscous_friction = spring.viscous;
      config.start_velocity = {0.1, 0, 0};
      for (const double ratio : {0.99, 1.01}) {
        Bench bench(config);
        Vec3 x = Vec3::Zero();
        double early = 0;
        double late_speed = 0;
        for (int i = 0; i < 10'000; ++i) {
          x = bench.push(-ratio * boundary * x, 1ms);
          if (i < 1000) early = std::max(early, bench.truth().velocity.norm());
          if (i >= 9000) late_speed = std::max(late_speed, bench.truth().velocity.norm());
        }
        if (ratio < 1) {
          EXPECT_LT(late_speed, 0.95 * early) << late;
        } else {
          EXPECT_GT(late_speed, 1.05 * early) << late;
        }
      }
    }
  }
}

TEST(TransportDelay, EnergyIsBalancedByForcesThatHaveArrived) {
  // A spring with a delay of two periods generates energy without friction, and an account of the returned forces
  // misses the time at which they act.
  auto config = free_mass(1ms, 1ms);
  config.start_position = Vec3(0.01, 0, 0);
  Bench bench(config);
  std::vector<Vec3> forces(2, Vec3::Zero());
  Vec3 x = *config.start_position;
  double given = 0;
  double by_returned = 0;
  for (int i = 0; i < 500; ++i) {
    forces.push_back(bench.device().apply(-200 * x));
    const Vec3 before = bench.truth().position;
    x = bench.wait(1ms);
    const Vec3 dx = bench.truth().position - before;
    given += forces[forces.size() - 3].dot(dx);
    by_returned += forces.back().dot(dx);
    ASSERT_NEAR(given, bench.truth().kinetic_energy, 1e-9 * (1 + given)) << i;
  }
  EXPECT_GT(bench.truth().kinetic_energy + 100 * bench.truth().position.squaredNorm(), 2 * 100 * 0.01 * 0.01)
      << "the delay has made energy";
  EXPECT_GT(std::abs(by_returned - given), 1e-3);
}

TEST(TransportDelay, TheWatchdogCountsTheForcesThatArrive) {
  auto config = free_mass(std::nullopt, 3ms);
  config.watchdog = 5ms;
  Bench bench(config);
  bench.device().apply({1, 0, 0});
  int fired = 0;
  for (int i = 0; i < 20; ++i) {
    bench.wait(1ms);
    fired += bench.truth().watchdog_fired ? 1 : 0;
  }
  EXPECT_EQ(fired, 1);
  EXPECT_NEAR(bench.truth().velocity.x(), 5e-3 / 0.1, 1e-15) << "from 3 ms to 8 ms";
}

TEST(TransportDelay, HasRoomForAllForcesOfTheFastestLoop) {
  // This tests the longest delays, a period of 100 µs, and a different force in each period.
  Bench bench(free_mass(100ms, 100ms));
  double sum = 0;
  for (int i = 0; i < 5000; ++i) {
    const double force = (i % 7) - 3.0;
    bench.push({force, 0, 0}, 100us);
    if (i < 5000 - 2000) sum += force;
    if (i == 1000) bench.push({9, 0, 0}, 0ms);  // replaced by the next force at the same time
  }
  EXPECT_NEAR(bench.truth().velocity.x(), sum * 1e-4 / 0.1, 1e-12);
}

TEST(TransportDelay, OfALoopThatIsFasterThanThatTheNewestForceStillArrives) {
  Bench bench(free_mass(std::nullopt, 1ms));
  for (int i = 0; i < 2000; ++i) bench.push({1, 0, 0}, 1us);
  bench.push({-1, 0, 0}, 1us);
  const double before = bench.truth().velocity.x();
  bench.wait(2ms);
  bench.wait(1ms);
  const double after = bench.truth().velocity.x();
  bench.wait(1ms);
  EXPECT_GT(before, 0);
  EXPECT_NEAR(bench.truth().velocity.x() - after, -0.01, 1e-12);
}

TEST(TransportDelay, RefusesADelayThatIsNone) {
  expect_refusals(free_mass(1ms, 1ms), Makes<SimulatedDevice>(),
                  {
                      {"sample_delay = 0: expected above 0 s, at most 0.1 s", [](auto& c) { c.sample_delay = 0ms; }},
                      {"sample_delay = -0.001: expected", [](auto& c) { c.sample_delay = -1ms; }},
                      {"force_delay = 0.101: expected", [](auto& c) { c.force_delay = 101ms; }},
                  });
}

}  // namespace
}  // namespace tendon::transport_delay_test
