// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include <Eigen/Eigenvalues>

#include "devices/simulated/simulated_device.h"
#include "tests/devices/device_bench.h"
#include "tests/support/refusal.h"

namespace tendon::structural_mode_test {
namespace {

using namespace std::chrono_literals;

constexpr double kMass = 0.075;
constexpr double kHandle = 0.03;
constexpr double kMotor = kMass - kHandle;

SimulatedDevice::Config ringing(double hz, double zeta) {
  const double omega = 2 * std::numbers::pi * hz;
  const double stiffness = omega * omega / (1 / kMotor + 1 / kHandle);
  SimulatedDevice::Config config;
  config.mass = kMass;
  config.structural_mode = {.handle_mass = kHandle, .stiffness = stiffness, .damping = 2 * zeta * stiffness / omega};
  return config;
}

/// A linear oscillator after a step of the force from rest.
double step_response(double force, double omega, double zeta, double t) {
  const double damped = omega * std::sqrt(1 - zeta * zeta);
  const double ring = std::cos(damped * t) + zeta * omega / damped * std::sin(damped * t);
  return force / (kMotor * omega * omega) * (1 - std::exp(-zeta * omega * t) * ring);
}

TEST(StructuralMode, RingsWithTheFrequencyAndDampingOfTheClosedForm) {
  for (const double hz : {30.0, 100.0, 200.0}) {
    for (const double zeta : {0.01, 0.1, 0.5}) {
      auto config = ringing(hz, zeta);
      const double omega = 2 * std::numbers::pi * hz;
      const double size = 1 / (kMotor * omega * omega);
      double error[2] = {};
      for (const int fine : {0, 1}) {
        config.max_substep = fine == 1 ? 5us : 50us;
        Bench bench(config);
        for (int i = 1; i <= 50; ++i) {
          bench.push({0, 1, 0}, 1ms);
          const double e = bench.truth().deflection.y();
          error[fine] = std::max(error[fine], std::abs(e - step_response(1, omega, zeta, 1e-3 * i)) / size);
        }
      }
      // The relative phase error after 50 ms is (ω h)²/12.
      EXPECT_LT(error[1], omega * 0.05 * std::pow(omega * 5e-6, 2) / 12 * 1.1 + 1e-9) << hz << " Hz, " << zeta;
      EXPECT_NEAR(error[0] / error[1], 100, 5) << "of second order";
    }
  }
}

TEST(StructuralMode, WithoutDampingRingsForEverAtTheHeadersFrequency) {
  const double omega = 2 * std::numbers::pi * 200;
  auto config = ringing(200, 0);
  Bench bench(config);
  const double h = 50e-6;
  const double rings_at = 2 / h * std::atan(omega * h / 2);
  EXPECT_NEAR(rings_at / omega, 1 - 3.3e-4, 1e-5);
  for (int i = 1; i <= 2000; ++i) {
    bench.push({1, 0, 0}, 1ms);
    const double expected = (1 - std::cos(rings_at * 1e-3 * i)) / (kMotor * omega * omega);
    ASSERT_NEAR(bench.truth().deflection.x(), expected, 1e-9 / (kMotor * omega * omega) * i);
  }
}

TEST(StructuralMode, WithTheMotorSideHeldTheHandleRingsOnTheSpringAlone) {
  // Friction holds the motor side while the handle starts at 1 mm/s.
  auto config = ringing(60, 0);
  config.coulomb_friction = 100;
  config.start_velocity = {1e-3, 0, 0};
  config.max_substep = 5us;
  Bench bench(config);
  const double omega = std::sqrt(config.structural_mode->stiffness / kHandle);
  bench.wait(1ms);  // the motor side has stopped
  const double start = -bench.truth().deflection.x();
  const double speed = bench.truth().velocity.x();
  for (int i = 1; i <= 100; ++i) {
    const double seen = bench.wait(1ms).x();
    const double t = 1e-3 * i;
    ASSERT_NEAR(-bench.truth().deflection.x(), start * std::cos(omega * t) + speed / omega * std::sin(omega * t),
                1e-5 * speed / omega);
    ASSERT_LT(std::abs(seen), 1e-8) << "the encoder is on the motor side";
  }
}

TEST(StructuralMode, TheEncoderSeesTheMotorSideAndTheHandIsOnTheOther) {
  // 1 N in a hand of 500 N/m. At rest the structural spring deflects by 1 N / K.
  auto config = ringing(60, 0.1);
  config.viscous_friction = 5;
  config.hand = OperatorHand::Config{.stiffness = 500,
                                     .damping = 5,
                                     .mass = 0.02,
                                     .motion = ScriptedMotion(ScriptedMotion::Sine{.amplitude = 0, .frequency = 1})};
  Bench bench(config);
  bench.device().apply({0, 0, 1});
  const Vec3 seen = bench.wait(3s);
  EXPECT_NEAR(bench.truth().position.z(), 1.0 / 500, 1e-9);
  EXPECT_NEAR(bench.truth().hand_force.z(), -1, 1e-6);
  EXPECT_NEAR(bench.truth().deflection.z(), 1 / config.structural_mode->stiffness, 1e-9);
  EXPECT_EQ(seen, bench.truth().position + bench.truth().deflection);
  config.encoder_step = 1e-4;
  config.start_position = Vec3::Zero();
  Bench counted(config);
  counted.device().apply({0, 0, 1});
  const Vec3 coarse = counted.wait(3s);
  EXPECT_LE(std::abs((coarse - seen).z()), 0.5e-4 * (1 + 1e-9));
}

TEST(StructuralMode, AtAStiffnessBeyondAllTheDeviceIsOneMassAgain) {
  auto config = ringing(60, 0.1);
  config.coulomb_friction = 0.04;
  config.viscous_friction = 0.2;
  config.structural_mode->stiffness = 1e9;
  config.structural_mode->damping = 1e3;
  auto rigid = config;
  rigid.structural_mode.reset();
  Bench soft(config);
  Bench whole(rigid);
  for (int i = 0; i < 500; ++i) {
    const Vec3 force(std::sin(0.05 * i), 0, 0.2);
    soft.push(force, 1ms);
    whole.push(force, 1ms);
    ASSERT_LT((soft.truth().position - whole.truth().position).norm(), 2e-6);
  }
}

TEST(StructuralMode, StoresWhatItHasTakenIn) {
  auto config = ringing(80, 0);
  Bench bench(config);
  Dice dice(4);
  double given = 0;
  double most = 0;
  for (int i = 0; i < 500; ++i) {
    const Vec3 before = bench.truth().position + bench.truth().deflection;
    const Vec3 force = bench.device().apply(random_vector(dice, 5));
    bench.wait(1ms);
    given += force.dot(bench.truth().position + bench.truth().deflection - before);
    ASSERT_NEAR(bench.truth().kinetic_energy + bench.truth().spring_energy, given, 1e-12);
    most = std::max(most, bench.truth().spring_energy);
  }
  EXPECT_GT(most, 1e-4);
}

/// Returns the matrix exponential: scaled by 2⁻¹⁰, a series of 14 terms, squared ten times.
Eigen::MatrixXd exponential(const Eigen::MatrixXd& exponent) {
  const Eigen::MatrixXd small = exponent / 1024;
  Eigen::MatrixXd result = Eigen::MatrixXd::Identity(exponent.rows(), exponent.cols());
  Eigen::MatrixXd term = result;
  for (int i = 1; i < 14; ++i) {
    term = term * small / i;
    result += term;
  }
  for (int i = 0; i < 10; ++i) result = result * result;
  return result;
}

/// Returns the spectral radius of one period of 1 ms. The force of the spring and the damper is sampled at the start of
/// the period and does not change. The states are y, x, ẏ, v and the previous y.
double spectral_radius(const SimulatedDevice::Config& config, double stiffness, double damping) {
  const auto& mode = *config.structural_mode;
  const double b = *config.viscous_friction;
  const double t = 1e-3;
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(5, 5);
  a(0, 2) = a(1, 3) = 1;
  a.row(2) << -mode.stiffness, mode.stiffness, -(b + mode.damping), mode.damping, 1;
  a.row(3) << mode.stiffness, -mode.stiffness, mode.damping, -mode.damping, 0;
  a.row(2) /= kMotor;
  a.row(3) /= kHandle;
  const Eigen::MatrixXd held = exponential(a * t);
  Eigen::MatrixXd period = Eigen::MatrixXd::Zero(5, 5);
  period.topLeftCorner(4, 4) = held.topLeftCorner(4, 4);
  period.block(0, 0, 4, 1) -= (stiffness + damping / t) * held.block(0, 4, 4, 1);
  period.block(0, 4, 4, 1) += damping / t * held.block(0, 4, 4, 1);
  period(4, 0) = 1;
  return period.eigenvalues().cwiseAbs().maxCoeff();
}

/// Returns the smallest value for which `radius` is at least 1.
double boundary(const std::function<double(double)>& radius) {
  double unstable = 1;
  while (radius(unstable) < 1) unstable *= 1.02;
  double stable = unstable / 1.02;
  while (unstable - stable > 1e-9 * stable) {
    const double middle = (stable + unstable) / 2;
    (radius(middle) < 1 ? stable : unstable) = middle;
  }
  return stable;
}

double growth(const SimulatedDevice::Config& config, double stiffness, double damping) {
  Bench bench(config);
  Vec3 before = bench.wait(0ms);
  Vec3 seen = before;
  double early = 0;
  double late = 0;
  for (int i = 0; i < 6000; ++i) {
    const Vec3 force = -stiffness * seen - damping / 1e-3 * (seen - before);
    before = seen;
    seen = bench.push(force, 1ms);
    if (i >= 1000 && i < 2000) early = std::max(early, std::abs(seen.x()));
    if (i >= 5000) late = std::max(late, std::abs(seen.x()));
  }
  return late / early;
}

TEST(StructuralMode, RenderableDampingEndsWhereAnEigenvalueIsOne) {
  // The boundary is 2 m/T = 150 N·s/m without the mode and about 2 (m − m_h)/T = 90 with it. It decreases as the
  // frequency of the mode approaches the sampling rate.
  double before = 2 * kMotor / 1e-3;
  for (const double hz : {60.0, 100.0, 200.0}) {
    auto config = ringing(hz, 0.02);
    config.viscous_friction = 0.26;
    config.start_position = Vec3(1e-3, 0, 0);
    const double most = boundary([&](double damping) { return spectral_radius(config, 200, damping); });
    EXPECT_LT(most, before);
    EXPECT_GT(most, 50);
    before = most;
    EXPECT_LT(growth(config, 200, 0.99 * most), 0.8) << hz;
    EXPECT_GT(growth(config, 200, 1.01 * most), 1.2) << hz;
  }
}

TEST(StructuralMode, TheStiffestSampledSpringIsThatOfTheEigenvalues) {
  for (const double hz : {60.0, 100.0}) {
    auto config = ringing(hz, 0.02);
    config.viscous_friction = 2;
    config.start_position = Vec3(1e-3, 0, 0);
    const double most = boundary([&](double stiffness) { return spectral_radius(config, stiffness, 0); });
    EXPECT_GT(most, 4000) << "2 b/T";
    EXPECT_LT(growth(config, 0.99 * most, 0), 0.9) << hz;
    EXPECT_GT(growth(config, 1.01 * most, 0), 1.1) << hz;
  }
}

TEST(StructuralMode, RefusesWhatIsNoMode) {
  SimulatedDevice::Config good;
  good.mass = 0.1;
  good.structural_mode = {.handle_mass = 0.05, .stiffness = 1, .damping = 0};
  expect_refusals(
      good, Makes<SimulatedDevice>(),
      {
          {"structural_mode.handle_mass = 0.1: expected above 0 kg and below the mass of 0.1 kg",
           [](auto& c) { c.structural_mode->handle_mass = 0.1; }},
          {"structural_mode.handle_mass = 0: expected", [](auto& c) { c.structural_mode->handle_mass = 0; }},
          {"structural_mode.handle_mass = nan: expected", [](auto& c) { c.structural_mode->handle_mass = NAN; }},
          {"structural_mode.stiffness = 0: expected", [](auto& c) { c.structural_mode->stiffness = 0; }},
          {"structural_mode.damping = -1: expected", [](auto& c) { c.structural_mode->damping = -1; }},
      });
}

}  // namespace
}  // namespace tendon::structural_mode_test
