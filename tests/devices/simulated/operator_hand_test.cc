// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/operator_hand.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "devices/simulated/simulated_device.h"
#include "tests/devices/device_bench.h"

namespace tendon::operator_hand_test {
namespace {

using namespace std::chrono_literals;

ScriptedMotion still() {
  return ScriptedMotion(ScriptedMotion::RampHold{.from = Vec3::Zero(), .to = Vec3::Zero(), .ramp = 1s, .hold = {}});
}

TEST(OperatorHand, RingsDownAsTheDampedOscillatorOfTheClosedForm) {
  const double m = 0.075 + 0.05;
  const double k = 400;
  const double c = 2;
  SimulatedDevice::Config config;
  config.mass = 0.075;
  config.start_position = Vec3(0.01, 0, 0);
  config.hand = OperatorHand::Config{.stiffness = k, .damping = c, .mass = 0.05, .motion = still()};
  Bench bench(config);
  const double decay = c / (2 * m);
  const double omega = std::sqrt(k / m - decay * decay);
  for (int i = 1; i <= 500; ++i) {
    bench.wait(1ms);
    const double t = 1e-3 * i;
    ASSERT_NEAR(bench.truth().position.x(),
                0.01 * std::exp(-decay * t) * (std::cos(omega * t) + decay / omega * std::sin(omega * t)), 1e-7);
  }
}

TEST(OperatorHand, DragsTheDeviceByItsFrequencyResponse) {
  const double k = 400;
  const double c = 2;
  const double b = 1;
  const double f = 8;
  SimulatedDevice::Config config;
  config.mass = 0.075;
  config.viscous_friction = b;
  config.hand = OperatorHand::Config{
      .stiffness = k,
      .damping = c,
      .mass = 0.05,
      .motion = ScriptedMotion(ScriptedMotion::Sine{.amplitude = 0.01, .frequency = f, .direction = {0, 1, 0}})};
  Bench bench(config);
  using namespace std::complex_literals;
  const std::complex<double> s = 2i * std::numbers::pi * f;
  const std::complex<double> response = (k + c * s) / (k + (b + c) * s + 0.125 * s * s);
  for (int i = 1; i <= 3000; ++i) {
    bench.wait(1ms);
    if (i < 2000) continue;  // startup transient: e^(−12 · 2)
    ASSERT_NEAR(bench.truth().position.y(), 0.01 * (response * std::exp(s * (1e-3 * i))).imag(), 1e-7);
  }
}

TEST(OperatorHand, PressesOnAHeldHandleWithItsSpring) {
  SimulatedDevice::Config config;
  config.mass = 0.075;
  config.coulomb_friction = 100;  // holds the handle
  config.hand = OperatorHand::Config{.stiffness = 400,
                                     .damping = 2,
                                     .mass = 0.05,
                                     .motion = ScriptedMotion(ScriptedMotion::RampHold{
                                         .from = Vec3::Zero(), .to = Vec3(0.01, 0, 0), .ramp = 1s, .hold = {}})};
  Bench bench(config);
  bench.wait(500ms);
  EXPECT_NEAR(bench.truth().hand_force.x(), 400 * 0.005 + 2 * 0.01, 1e-3);
  bench.wait(1s);
  EXPECT_NEAR(bench.truth().hand_force.x(), 4, 1e-12);
  EXPECT_EQ(bench.truth().hand_work, 0);
}

TEST(OperatorHand, StaysBoundedHoweverStiffItIs) {
  for (const double stiffness : {1e4, 1e6, 1e9}) {
    SimulatedDevice::Config config;
    config.mass = 0.02;
    config.hand =
        OperatorHand::Config{.stiffness = stiffness,
                             .damping = 1000,
                             .mass = 0,
                             .motion = ScriptedMotion(ScriptedMotion::Sine{.amplitude = 0.01, .frequency = 2})};
    Bench bench(config);
    for (int i = 0; i < 1000; ++i) {
      bench.push({5, 0, 0}, 1ms);
      ASSERT_LT(bench.truth().position.norm(), 0.0125);
    }
  }
}

TEST(OperatorHand, AHeldForceBendsItBySoManyMillimetres) {
  SimulatedDevice::Config config;
  config.mass = 0.075;
  config.hand = OperatorHand::Config{.stiffness = 400, .damping = 5, .mass = 0.05, .motion = still()};
  Bench bench(config);
  bench.push({0, 0, -2}, 3s);
  EXPECT_NEAR(bench.truth().position.z(), -2.0 / 400, 1e-9);
  EXPECT_NEAR(bench.truth().hand_force.z(), 2, 1e-6);
}

}  // namespace
}  // namespace tendon::operator_hand_test
