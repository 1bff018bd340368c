// SPDX-License-Identifier: Apache-2.0
// Reconstruction by the device loop between an engine's answers, in virtual time.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/tools/lab/experiments/experiment.h"

namespace tendon::lab::reconstruction_test {
namespace {

/// Into a sphere at x > 0 (Hertz: force ∝ depth^3/2, slightly larger while loading) with two slow oscillations and a
/// tremor.
struct Press {
  static constexpr double kStiffness = 4.0 / 3 * 12539 * 0.1;  // N/m^1.5, for a radius of 10 mm

  static double depth(double t) {
    const double turn = 2 * std::numbers::pi * t;
    return -3e-3 * std::cos(0.8 * turn) + 1.5e-3 * std::sin(2.3 * turn) + 2e-5 * std::sin(9 * turn);
  }
  static double speed(double t) { return (depth(t + 1e-6) - depth(t - 1e-6)) / 2e-6; }
  static Vec3 force(double t, const Vec3& x) {
    return -kStiffness * std::pow(std::max(0.0, x.x()), 1.5) * (1 + speed(t)) * Vec3::UnitX();
  }
  static Mat3 stiffness(double t, const Vec3& x) {
    return 1.5 * kStiffness * std::sqrt(std::max(0.0, x.x())) * (1 + speed(t)) * Vec3::UnitX() *
           Vec3::UnitX().transpose();
  }
};

/// At x = 0, optionally with a table of forces in 0.32 mm steps into the object.
Contact surface(double t, const Vec3& x, bool with_table) {
  Contact contact{.normal = -Vec3::UnitX(), .gap = -x.x()};
  if (!with_table) return contact;
  ForceTable& table = contact.table.emplace(ForceTable{.first = contact.gap, .step = 0.32e-3, .size = 16});
  for (std::size_t i = 0; i < table.size; ++i) {
    const double depth = table.first + static_cast<double>(i) * table.step;
    table.force[i] = contact.normal.dot(Press::force(t, x - depth * contact.normal));
  }
  return contact;
}

enum class Sent { kForce, kForceAndStiffness, kAndSurface, kAndTable };

/// rms error over rms of the true force. The time of an answer is a period plus `late_ms`.
double error(double rate_hz, double late_ms, Sent sent) {
  Experiment set;
  set.environment = {
      .force = Press::force, .period = from_seconds(1 / rate_hz), .delay = from_seconds(1 / rate_hz + 1e-3 * late_ms)};
  if (sent != Sent::kForce) set.environment.stiffness = Press::stiffness;
  if (sent == Sent::kAndSurface || sent == Sent::kAndTable) {
    const bool with_table = sent == Sent::kAndTable;
    set.environment.surface = [with_table](double t, const Vec3& x) { return surface(t, x, with_table); };
  }
  set.hand = PrescribedMotion{.position = [](double t) { return Vec3(Press::depth(t), 0, 0); }, .friction = {}};
  set.limiter = {.law = Law::kNone, .friction = {.coulomb = 0, .viscous = 1}};
  set.max_force = 1e3;
  set.length = std::chrono::seconds(10);
  const Outcome result = outcome(run(set), set.period);
  return result.force_error / result.true_force;
}

TEST(Reconstruction, At100HzAnd5MsLateTheStiffnessBringsItWithin2_5Percent) {
  const double held = error(100, 5, Sent::kForce);
  EXPECT_NEAR(held, 0.175, 0.03);
  EXPECT_LT(error(100, 5, Sent::kForceAndStiffness), 0.025);
}

TEST(Reconstruction, At30HzAnd20MsLateOneStiffnessIsNotEnough) {
  EXPECT_NEAR(error(30, 20, Sent::kForce), 0.585, 0.08);
  const double followed = error(30, 20, Sent::kForceAndStiffness);
  EXPECT_LT(followed, 0.3);
  EXPECT_GT(followed, 0.07);
}

TEST(Reconstruction, At30HzAnd20MsLateTheTableBringsItWithin3Percent) {
  EXPECT_LT(error(30, 20, Sent::kAndSurface), 0.9 * error(30, 20, Sent::kForceAndStiffness));
  EXPECT_LT(error(30, 20, Sent::kAndTable), 0.03);
  EXPECT_LT(error(100, 5, Sent::kAndTable), 0.01);
}

}  // namespace
}  // namespace tendon::lab::reconstruction_test
