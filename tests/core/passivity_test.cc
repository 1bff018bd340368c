// SPDX-License-Identifier: Apache-2.0
//
// The promise of the whole project at the level of the control law: whatever the hand does, whatever the
// remote environment asks for and however late, the ledger never is negative, no force is above its
// bound, and nothing that is not a number reaches the device. ctest asks RapidCheck for 10 000 seeds (see
// CMakeLists.txt). Worlds with a network are in tests/simulation.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>
#include <limits>
#include <ostream>

#include "core/haptic_controller.h"
#include "tests/support/dice.h"

namespace tendon {

void PrintTo(Law limiter, std::ostream* out) { *out << (limiter == Law::kAol ? "joint form" : "per-axis form"); }

namespace {

struct Outcome {
  double least_energy = 0;
  double worst_excess = 0;  // N above the bound
  bool all_finite = true;
};

// One run of 600 steps of a random controller against a random adversary. `bound_scale` above 1 is the
// sabotage that must be found out: the force applied is allowed to exceed the bound by so much.
Outcome run(std::uint64_t seed, Law limiter, double bound_scale) {
  Dice dice(seed);
  HapticController::Config config;
  config.limiter.law = limiter;
  config.limiter.friction = {dice.chance(0.3) ? 0.0 : dice.decades(-3, -0.3), dice.decades(-2.5, 0.3)};
  config.limiter.longest_hold = std::chrono::microseconds(2000);
  config.max_force = dice.decades(0, 2);
  config.max_slew = dice.chance(0.5) ? std::numeric_limits<double>::infinity() : dice.decades(2, 5);
  config.hold.ramp_in = dice.chance(0.5) ? Duration::zero() : std::chrono::milliseconds(50);
  const double device_clamp =
      dice.chance(0.5) ? std::numeric_limits<double>::infinity() : config.max_force * dice.uniform();
  const double stiffness = dice.decades(1, 5);
  const double hold_steps = dice.decades(0, 3);  // a force for every 1 … 1000 steps
  const double hostility = dice.uniform();

  HapticController controller(config);
  Outcome outcome;
  LocalTime now{};
  Vec3 x = dice.direction() * 0.02;
  Vec3 applied = Vec3::Zero();
  std::uint64_t sequence = 0;
  for (int i = 0; i < 600; ++i) {
    if (dice.chance(1 / hold_steps)) {
      RemoteForce remote;
      remote.sequence = ++sequence;
      remote.received = now;
      remote.valid_for = std::chrono::milliseconds(static_cast<int>(dice.within(1, 400)));
      switch (static_cast<int>(dice.within(0, 7))) {
        case 0:
          remote.force = -stiffness * x;
          break;
        case 1:
          remote.force = dice.direction() * 1e6;
          break;
        case 2:
          remote.force = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
          break;
        case 3:
          remote.force = Vec3(0, std::numeric_limits<double>::infinity(), 0);
          break;
        case 4:
          remote.force = dice.direction() * dice.decades(-3, 3);
          break;
        case 5:
          remote.force = -stiffness * x;
          remote.model = LocalModel{x, Mat3::Identity() * stiffness};
          break;
        default:
          remote.force = applied.norm() > 0 ? Vec3(applied * 1e3) : dice.direction();
          break;
      }
      controller.observe(remote);
    }

    const Duration held(static_cast<std::int64_t>(dice.within(500'000, 2'000'000)));
    now += held;
    const double force = applied.norm();
    if (dice.chance(hostility)) {  // the worst motion there is, eq. (7): it follows the force
      for (int axis = 0; axis < 3; ++axis) {
        const double size = limiter == Law::kAolPerAxis ? std::abs(applied[axis]) : force;
        if (size <= config.limiter.friction.coulomb) continue;
        x[axis] += applied[axis] / size * seconds(held) * (size - config.limiter.friction.coulomb) /
                   (2 * config.limiter.friction.viscous);
      }
    } else {
      x += dice.direction() * dice.decades(-7, -2);
    }
    Step step = controller.step({now, x, Vec3::Zero()}, applied);
    outcome.all_finite = outcome.all_finite && step.force.allFinite() && std::isfinite(step.energy);
    outcome.least_energy = std::min(outcome.least_energy, step.energy);
    const double size = limiter == Law::kAolPerAxis ? step.force.cwiseAbs().maxCoeff() : step.force.norm();
    outcome.worst_excess = std::max(outcome.worst_excess, size - step.permitted * (1 + 1e-12));
    applied = step.force;
    if (step.reasons.has(Reason::kEnergy)) applied *= bound_scale;
    if (applied.norm() > device_clamp) applied *= device_clamp / applied.norm();
  }
  return outcome;
}

class Passivity : public testing::TestWithParam<Law> {};

TEST_P(Passivity, NoHandNoForceAndNoTimingMakesTheLedgerNegative) {
  const auto limiter = GetParam();
  EXPECT_TRUE(rc::check([limiter] {
    const auto seed = *rc::gen::arbitrary<std::uint64_t>();
    const Outcome outcome = run(seed, limiter, 1.0);
    RC_ASSERT(outcome.least_energy >= -1e-9);
    RC_ASSERT(outcome.worst_excess <= 0.0);
    RC_ASSERT(outcome.all_finite);
  }));
}

// That the property above can fail: the same adversaries, the bound 1 % too high.
TEST_P(Passivity, TheSamePropertyFailsWhenTheBoundIsOnePercentTooHigh) {
  int broken = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    if (run(seed, GetParam(), 1.01).least_energy < -1e-9) ++broken;
  }
  EXPECT_GT(broken, 20);
}

INSTANTIATE_TEST_SUITE_P(Forms, Passivity, testing::Values(Law::kAol, Law::kAolPerAxis),
                         [](const auto& form) { return form.param == Law::kAol ? "Joint" : "PerAxis"; });

}  // namespace
}  // namespace tendon
