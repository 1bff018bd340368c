// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include <Eigen/Eigenvalues>

#include "devices/simulated/simulated_device.h"
#include "tests/devices/device_bench.h"

/// The simulator must have the known stability boundaries of a real device with a sampled spring. Otherwise,
/// experiments on a limiter would only test the simulator.

namespace tendon::simulated_device_stability_test {
namespace {

using namespace std::chrono_literals;

SimulatedDevice::Config device(double m, double b) {
  SimulatedDevice::Config config;
  config.mass = m;
  config.viscous_friction = b;
  return config;
}

/// Returns the stability limit of a spring that is sampled and held for T, for a mass with viscous friction and without
/// a hand. This is Jury's criterion for the exact discretization:
///     K_max = b (1 − δ) / (m (1 − δ)/b − T δ),  δ = e^(−bT/m);   about 2b/T (1 + bT/(6m))
double exact_k_max(double m, double b, double t) {
  const double delta = std::exp(-b * t / m);
  return b * (1 - delta) / (m * (1 - delta) / b - t * delta);
}

/// Returns the spectral radius of one period of the closed loop. It is computed from two periods with unit states.
double spectral_radius(double m, double b, double stiffness) {
  Eigen::Matrix2d period;
  for (Eigen::Index i = 0; i < 2; ++i) {
    auto config = device(m, b);
    config.start_position = Vec3(i == 0 ? 1 : 0, 0, 0);
    config.start_velocity = Vec3(i == 1 ? 1 : 0, 0, 0);
    Bench bench(config);
    bench.push(-stiffness * *config.start_position, 1ms);
    period.col(i) << bench.truth().position.x(), bench.truth().velocity.x();
  }
  return period.eigenvalues().cwiseAbs().maxCoeff();
}

TEST(SampledSpring, LosesStabilityAtTheStiffnessOfTheClosedForm) {
  const std::map<double, double> k_max_of_damping = {{0.26, 520.30}, {5, 10112.35}};  // at m = 0.075 kg and 1 kHz
  for (const auto& [b, k_max] : k_max_of_damping) {
    SCOPED_TRACE(b);
    EXPECT_NEAR(exact_k_max(0.075, b, 1e-3), k_max, 0.005);
    double stable = 0.5 * k_max;
    double unstable = 2 * k_max;
    while (unstable - stable > 1e-9 * k_max) {
      const double middle = (stable + unstable) / 2;
      (spectral_radius(0.075, b, middle) < 1 ? stable : unstable) = middle;
    }
    // Error of the 50 µs substeps: 1.4e-6 at 0.26 N·s/m, 2.8e-5 at 5 N·s/m.
    EXPECT_NEAR(stable / exact_k_max(0.075, b, 1e-3), 1, 6e-6 * b);
  }
}

/// The motion in the last half second of 3 s. The worst case is a rest position of the spring on the edge between two
/// counts. With f_c = 0.05 N and a count of 0.2 mm, 2 f_c/Δ = 500 N/m.
double late_speed_on_a_count_edge(double stiffness) {
  const double step = 2e-4;
  auto config = device(0.075, 2);
  config.coulomb_friction = 0.05;
  config.encoder_step = step;
  config.start_velocity = {0.05, 0, 0};
  Bench bench(config);
  Vec3 seen = Vec3::Zero();
  double late = 0;
  for (int i = 0; i < 3000; ++i) {
    seen = bench.push({-stiffness * (seen.x() - step / 2), 0, 0}, 1ms);
    if (i >= 2500) late = std::max(late, bench.truth().velocity.norm());
  }
  return late;
}

TEST(QuantisedSpring, ComesToRestBelowTwiceTheFrictionPerCount) {
  // K ≤ 2 f_c/Δ: Abbott and Okamura, IEEE T-RO 21(5):952, 2005.
  for (const double stiffness : {100.0, 300.0, 450.0, 499.0}) EXPECT_EQ(late_speed_on_a_count_edge(stiffness), 0);
}

TEST(QuantisedSpring, KeepsALimitCycleAboveThatThatGrowsWithTheStiffness) {
  double smaller = 1e-6;
  for (const double stiffness : {520.0, 700.0, 1500.0}) {
    const double speed = late_speed_on_a_count_edge(stiffness);
    EXPECT_GT(speed, smaller) << stiffness;
    smaller = speed;
  }
}

TEST(SampledSpring, BeyondTheViscousBoundOnlySlowMotionIsStable) {
  // v_lim = (4/π) f_c/(K T/2 − b), by the describing function of friction: Diolaiti et al., IEEE T-RO 22(2), 2006.
  const double b = 0.05;
  const double f_c = 0.05;
  const double stiffness = 1000;
  const double v_lim = 4 / std::numbers::pi * f_c / (stiffness * 1e-3 / 2 - b);
  for (const double ratio : {0.9, 1.1}) {
    auto config = device(0.075, b);
    config.coulomb_friction = f_c;
    config.start_velocity = {ratio * v_lim, 0, 0};
    Bench bench(config);
    Vec3 x = Vec3::Zero();
    double late = 0;
    for (int i = 0; i < 4000; ++i) {
      x = bench.push(-stiffness * x, 1ms);
      if (i >= 3500) late = std::max(late, bench.truth().velocity.norm());
    }
    if (ratio < 1) {
      EXPECT_EQ(late, 0);
    } else {
      EXPECT_GT(late, v_lim);
    }
  }
}

}  // namespace
}  // namespace tendon::simulated_device_stability_test
