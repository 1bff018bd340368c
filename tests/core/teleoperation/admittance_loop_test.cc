// SPDX-License-Identifier: Apache-2.0
#include "core/control/admittance_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>

#include "core/control/aol.h"
#include "devices/simulated/profiles.h"
#include "tests/support/dice.h"
#include "tests/support/refusal.h"

namespace tendon::admittance_loop_test {
namespace {

using namespace std::chrono_literals;

constexpr Duration kPeriod = 1ms;
constexpr double kT = 1e-3;
constexpr double kViscous = 20;
constexpr double kCoulomb = 1;

template <int N>
typename AdmittanceLoop<N>::Config tool(double mass, double damping, double proportional, double integral) {
  return {.mass = Vec<N>::Constant(mass),
          .damping = Vec<N>::Constant(damping),
          .proportional = Vec<N>::Constant(proportional),
          .integral = Vec<N>::Constant(integral)};
}

Aol<1, 3> aol() { return Aol<1, 3>({{Friction{.coulomb = kCoulomb, .viscous = kViscous}}, kPeriod}); }

struct Episode {
  double least_energy = 0;     // J, ledger of the applied force
  double least_hand_work = 0;  // J
  double limited_share = 0;
  std::vector<Vec3> hand_force, velocity;
};

struct World {
  AdmittanceLoop<3>::Config tool;
  bool limited = true;
  double wall = 20e3;      // N/m; the wall begins at 15 mm and acts on the tool
  double frequency = 0.5;  // Hz, motion of the hand
  Duration duration = 4s;
  Vec3 direction = Vec3::UnitX();
};

Episode run(const World& world) {
  auto config = admittance_device();
  config.hand =
      OperatorHand::Config{.stiffness = 800,
                           .damping = 10,
                           .mass = 0,
                           .motion = ScriptedMotion(ScriptedMotion::Sine{
                               .amplitude = 0.03, .frequency = world.frequency, .direction = world.direction})};
  SimulatedDevice device(config);
  AdmittanceLoop<3> loop(world.tool);
  auto law = aol();
  Episode result;
  const Vec3 axis = world.direction.normalized();
  const int steps = static_cast<int>(world.duration / kPeriod);
  Vec3 before = Vec3::Zero();
  Vec3 applied = Vec3::Zero();
  double tool_position = 0;
  int limited = 0;
  for (int i = 0; i <= steps; ++i) {
    const auto sample = *device.read(LocalTime(i * kPeriod));
    const Vec3 dx = sample.position - before;
    before = sample.position;
    if (i > 0) {
      const Interval<3> interval{applied, dx, kPeriod};
      law.observe(interval);
      loop.observe(interval);
    }
    const Vec3 environment = -world.wall * std::max(tool_position - 0.015, 0.0) * axis;
    const auto wanted = loop.command({*sample.hand_force, environment, dx / kT});
    tool_position += kT * loop.tool_velocity().dot(axis);
    const auto safe = law.limit(wanted);
    limited += safe.reasons.empty() ? 0 : 1;
    applied = device.apply(world.limited ? safe.force : wanted.force);
    result.least_energy = std::min(result.least_energy, law.energy());
    result.least_hand_work = std::min(result.least_hand_work, device.truth().hand_work);
    result.hand_force.push_back(*sample.hand_force);
    result.velocity.push_back(device.truth().velocity);
  }
  result.limited_share = static_cast<double>(limited) / (steps + 1);
  return result;
}

TEST(AdmittanceLoop, TakesEnergyThatIsNotThereUnlessTheLimiterBoundsIt) {
  for (const Vec3& direction : {Vec3(1, 0, 0), Vec3(1, 2, -2)}) {
    for (const auto& config : {tool<3>(0.3, 2, 400, 4e3), tool<3>(0.3, 2, 1500, 1e4), tool<3>(0.05, 2, 400, 4e3)}) {
      const Episode without = run({.tool = config, .limited = false, .direction = direction});
      const Episode with = run({.tool = config, .direction = direction});
      std::cout << "least energy without the limiter " << without.least_energy << " J, with it " << with.least_energy
                << " J, limited " << 100 * with.limited_share << " % of the steps\n";
      EXPECT_LT(without.least_energy, -5e-3);
      EXPECT_GE(with.least_energy, -1e-12);
      EXPECT_GE(with.least_hand_work, -1e-12);
    }
  }
}

// At the frequency of the hand, by least squares of F = m a + b v after the first second.
struct Felt {
  double mass, damping;
};
Felt felt(const Episode& run) {
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  for (std::size_t i = 1000; i + 1 < run.velocity.size(); ++i) {
    const Eigen::Vector2d row((run.velocity[i + 1].x() - run.velocity[i - 1].x()) / (2 * kT), run.velocity[i].x());
    normal += row * row.transpose();
    right += row * run.hand_force[i].x();
  }
  const Eigen::Vector2d solution = normal.ldlt().solve(right);
  return {solution[0], solution[1]};
}

TEST(AdmittanceLoop, TheHandFeelsTheToolsMassAndDampingWhenFrictionAllowsIt) {
  const Episode own = run({.tool = tool<3>(3, 25, 0, 0), .wall = 0, .frequency = 2, .duration = 6s});
  const Episode heavy = run({.tool = tool<3>(3, 25, 1500, 1e4), .wall = 0, .frequency = 2, .duration = 6s});
  std::cout << "device " << felt(own).mass << " kg, " << felt(own).damping
            << " N s/m; tool of 3 kg, 25 N s/m feels like " << felt(heavy).mass << " kg, " << felt(heavy).damping
            << " N s/m, limited " << 100 * heavy.limited_share << " %\n";
  EXPECT_NEAR(felt(own).mass, 2, 0.1);
  EXPECT_NEAR(felt(heavy).mass, 3, 0.15);
  EXPECT_NEAR(felt(heavy).damping, 25, 1.25);
}

// To accelerate a handle of m = 2 kg like M = 0.3 kg, the motors must supply ½ (m − M) v² in advance. Only energy
// dissipated by the tool's damping can pay for this.
TEST(AdmittanceLoop, AToolLighterThanTheDeviceIsClippedUnlessDampingEarns) {
  const auto light = [](double damping, bool limited) {
    return run(
        {.tool = tool<3>(0.3, damping, 400, 4e3), .limited = limited, .wall = 0, .frequency = 2, .duration = 6s});
  };
  const Episode damped = light(2, true);
  EXPECT_NEAR(felt(damped).mass, 0.3, 0.03);
  EXPECT_LT(damped.limited_share, 0.1);  // at the start

  const Episode without = light(0, false);
  const Episode with = light(0, true);
  std::cout << "tool of 0.3 kg without damping feels like " << felt(without).mass
            << " kg without the limiter (least energy " << without.least_energy << " J), " << felt(with).mass
            << " kg with it, limited " << 100 * with.limited_share << " %\n";
  EXPECT_NEAR(felt(without).mass, 0.3, 0.05);
  EXPECT_NEAR(felt(with).mass, 2, 0.1);
  EXPECT_GT(with.limited_share, 0.9);
}

// Holds the handle fast while the force sensor reads `push`, then `then`. Returns the steps at the bound afterwards.
int steps_at_the_bound(double push, double then) {
  AdmittanceLoop<1> loop(tool<1>(1, 200, 10, 1000));
  constexpr double kBound = 2;
  Vec<1> applied = Vec<1>::Zero();
  const auto step = [&](int i, double force) {
    if (i > 0) loop.observe({applied, Vec<1>::Zero(), kPeriod});
    const double wanted = loop.command({Vec<1>(force), Vec<1>::Zero(), Vec<1>::Zero()}).force[0];
    applied[0] = std::clamp(wanted, -kBound, kBound);
  };
  for (int i = 0; i < 5000; ++i) step(i, push);
  EXPECT_EQ(applied[0], kBound);
  int steps = 0;
  do {
    step(5000, then);
    ++steps;
  } while (applied[0] == kBound && steps < 5000);
  return steps;
}

TEST(AdmittanceLoop, TheForceLeavesItsBoundAsSoonAsTheErrorTurns) {
  // The tool (1 kg, 200 N·s/m) needs 1.4 ms to change its velocity from 0.1 to −0.1 m/s with −40 N.
  EXPECT_LE(steps_at_the_bound(20, -40), 4);
}

TEST(AdmittanceLoop, TheIntegralKeepsNoMoreThanWasAppliedWhenTheBoundShrinks) {
  AdmittanceLoop<1> loop(tool<1>(1, 200, 10, 1000));
  Vec<1> applied = Vec<1>::Zero();
  for (int i = 0; i < 2000; ++i) {
    if (i > 0) loop.observe({applied, Vec<1>::Zero(), kPeriod});
    const double bound = i < 1000 ? 50.0 : 0.5;
    applied[0] = std::clamp(loop.command({Vec<1>(20), Vec<1>::Zero(), Vec<1>::Zero()}).force[0], -bound, bound);
  }
  ASSERT_EQ(applied[0], 0.5);
  // With the handle slightly faster than the tool, the remaining command is the integral term.
  loop.observe({applied, Vec<1>(2e-4), kPeriod});
  const double wanted = loop.command({Vec<1>(20), Vec<1>::Zero(), Vec<1>(0.11)}).force[0];
  EXPECT_LT(wanted, 0.5);
  EXPECT_GT(wanted, -1);
}

TEST(AdmittanceLoop, TheIntegralDoesNotGrowWhileTheForceIsClipped) {
  AdmittanceLoop<1> loop(tool<1>(1, 200, 1000, 1000));
  Vec<1> applied = Vec<1>::Zero();
  for (int i = 0; i < 2000; ++i) {
    if (i > 0) loop.observe({applied, Vec<1>::Zero(), kPeriod});
    applied[0] = std::clamp(loop.command({Vec<1>(20), Vec<1>::Zero(), Vec<1>::Zero()}).force[0], -2.0, 2.0);
  }
  ASSERT_EQ(applied[0], 2);
  // The handle moves with the tool at 0.1 m/s, so the error is zero and the command is the integral term.
  loop.observe({applied, Vec<1>(0.1 * kT), kPeriod});
  EXPECT_NEAR(loop.command({Vec<1>(20), Vec<1>::Zero(), Vec<1>(0.1)}).force[0], 0, 0.1);
}

TEST(AdmittanceLoop, ClippingOneDirectionLeavesTheIntegralOfTheOthersAlone) {
  AdmittanceLoop<3> clipped(tool<3>(1, 10, 10, 1000));
  AdmittanceLoop<3> free(tool<3>(1, 10, 10, 1000));
  Vec3 held = Vec3::Zero();
  Vec3 wanted = Vec3::Zero();
  Vec3 reference = Vec3::Zero();
  for (int i = 0; i < 500; ++i) {
    if (i > 0) {
      clipped.observe({held, Vec3::Zero(), kPeriod});
      free.observe({reference, Vec3::Zero(), kPeriod});
    }
    wanted = clipped.command({Vec3(5, 1, 0), Vec3::Zero(), Vec3::Zero()}).force;
    reference = free.command({Vec3(5, 1, 0), Vec3::Zero(), Vec3::Zero()}).force;
    held = Vec3(std::min(wanted.x(), 1.0), wanted.y(), wanted.z());
  }
  EXPECT_LT(wanted.x(), reference.x() / 5);
  EXPECT_DOUBLE_EQ(wanted.y(), reference.y());
}

TEST(AdmittanceLoop, TheToolAnswersAStepOfForceAsItsEquationSays) {
  auto config = tool<6>(2, 8, 0, 0);
  config.mass << 2, 2, 2, 0.1, 0.1, 0.1;
  AdmittanceLoop<6> loop(config);
  Vec<6> push;
  push << 4, 0, 0, 0, 0, 1;
  for (int i = 0; i <= 250; ++i) {  // the time constant of the first axis
    if (i > 0) loop.observe({Vec<6>::Zero(), Vec<6>::Zero(), kPeriod});
    loop.command({push, Vec<6>::Zero(), Vec<6>::Zero()});
  }
  EXPECT_NEAR(loop.tool_velocity()[0], 0.5 * (1 - std::exp(-1)), 1e-3);
  EXPECT_NEAR(loop.tool_velocity()[5], 0.125, 1e-3);
  EXPECT_EQ(loop.tool_velocity()[1], 0);
}

TEST(AdmittanceLoop, TheToolsSpringBringsItBackToWhereItStarted) {
  auto config = tool<1>(1, 40, 0, 0);
  config.stiffness[0] = 400;
  AdmittanceLoop<1> loop(config);
  double position = 0;
  for (int i = 0; i < 3000; ++i) {
    if (i > 0) loop.observe({Vec<1>::Zero(), Vec<1>::Zero(), kPeriod});
    loop.command({Vec<1>(i < 1000 ? 4.0 : 0.0), Vec<1>::Zero(), Vec<1>::Zero()});
    position += kT * loop.tool_velocity()[0];
    if (i == 999) {
      EXPECT_NEAR(position, 0.01, 1e-5);
    }
  }
  EXPECT_NEAR(position, 0, 1e-6);
}

TEST(AdmittanceLoop, WaitsWhileNobodySeesTheMotion) {
  AdmittanceLoop<1> loop(tool<1>(1, 0, 0, 0));
  for (int i = 0; i < 100; ++i) {
    loop.observe_unseen();
    loop.command({Vec<1>(5), Vec<1>::Zero(), Vec<1>::Zero()});
  }
  EXPECT_EQ(loop.tool_velocity()[0], 0);
}

TEST(AdmittanceLoop, ANonFiniteMeasurementGivesNoForceAndLeavesTheTool) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (int where = 0; where < 3; ++where) {
      AdmittanceLoop<3> loop(tool<3>(1, 1, 100, 1000));
      auto law = aol();
      AdmittanceLoop<3>::Measured measured{Vec3(5, 0, 0), Vec3::Zero(), Vec3::Zero()};
      loop.command(measured);
      loop.observe({Vec3::Zero(), Vec3::Zero(), kPeriod});
      loop.command(measured);
      (where == 0 ? measured.hand_force : where == 1 ? measured.environment : measured.velocity).y() = bad;
      loop.observe({Vec3::Zero(), Vec3::Zero(), kPeriod});
      const auto safe = law.limit(loop.command(measured));
      EXPECT_EQ(safe.force, Vec3::Zero());
      EXPECT_TRUE(safe.reasons.has(Reason::kNotFinite));
      EXPECT_EQ(loop.tool_velocity(), Vec3::Zero());
      loop.observe({Vec3::Zero(), Vec3::Zero(), kPeriod});
      EXPECT_EQ(loop.command({Vec3::Zero(), Vec3::Zero(), Vec3::Zero()}).force, Vec3::Zero());
    }
  }
}

TEST(AdmittanceLoop, SaysWhatIsWrongWithItsConfiguration) {
  expect_refusals(tool<1>(1, 1, 1, 1), Makes<AdmittanceLoop<1>>(),
                  {
                      {"mass = 0", [](auto& c) { c.mass[0] = 0; }},
                      {"integral = -1", [](auto& c) { c.integral[0] = -1; }},
                      {"damping", [](auto& c) { c.damping[0] = std::numeric_limits<double>::quiet_NaN(); }},
                  });
}

// The adversary moves the 2 kg handle with at most `a_max`: speeds up, is pushed by the motors at constant speed, and
// stops. Returns the minimum work of the hand, exactly. The bound is f_c + 2 √(b (E + credit) / T).
double least_hand_work(bool credit, double a_max) {
  constexpr double kMass = 2;
  const OutputBound bound = OutputBound::of({.coulomb = kCoulomb, .viscous = kViscous}, kPeriod);
  EnergyLedger ledger({.coulomb = kCoulomb, .viscous = kViscous});
  const int ramp = 100;
  const int cruise = 20;
  double v = 0;
  double work = 0;
  double least = 0;
  double last_dx = 0;
  for (int i = 0; i < 2 * ramp + cruise; ++i) {
    const double a = i < ramp ? a_max : i < ramp + cruise ? 0.0 : -a_max;
    const double sure = std::max(std::abs(last_dx) / kT - a_max * kT, 0.0);
    const double lent = credit ? kMass / 2 * sure * sure : 0.0;
    // No force during acceleration, so that the motion stores kinetic energy only.
    const bool push = i >= ramp;
    const double force = push ? bound.largest(ledger.energy() + lent) : 0.0;
    const double dx = v * kT + a * kT * kT / 2;
    const double v_squared = v * v * kT + v * a * kT * kT + a * a * kT * kT * kT / 3;  // ∫ v² dt
    const double after = v + a * kT;
    work += kMass / 2 * (after * after - v * v) - force * dx + kCoulomb * std::abs(dx) + kViscous * v_squared;
    v = after;
    last_dx = dx;
    ledger.observe(Vec<1>(force), Vec<1>(dx), kPeriod);
    least = std::min(least, work);
  }
  return least;
}

TEST(AdmittanceLoop, LendingOnTheKineticEnergyIsNotPassive) {
  const double lent = least_hand_work(true, 10);
  std::cout << "hand work with credit for the kinetic energy: " << lent << " J, without " << least_hand_work(false, 10)
            << " J\n";
  EXPECT_LT(lent, -0.1);
  EXPECT_GE(least_hand_work(false, 10), 0);
}

}  // namespace
}  // namespace tendon::admittance_loop_test
