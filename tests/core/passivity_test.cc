// SPDX-License-Identifier: Apache-2.0
// For every motion of the hand and for every remote force with any delay, the ledger must not be negative, the force
// must be within its bound, and NaN must not reach the device. ctest tests 10 000 seeds (see CMakeLists.txt).
// tests/tools/worlds also includes the network.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "core/haptic_controller.h"
#include "tests/support/any_contact.h"
#include "tests/support/dice.h"

namespace tendon::passivity_test {

void PrintTo(Law law, std::ostream* out) { *out << info(law).name; }

namespace {

struct Outcome {
  double least_energy = 0;
  double worst_shortfall = 0;  // J, difference to the minimum for this hold
  double worst_excess = 0;     // N above the bound
  bool all_finite = true;
};

/// J per second of hold: T (‖F‖ − f_c)₊²/(4b) for T = 1 s.
double worst_per_second(const Vec3& force, const Friction& friction, Law law) {
  const double size = law == Law::kAolPerAxis ? force.cwiseAbs().maxCoeff() : force.norm();
  const double excess = std::max(size - friction.coulomb, 0.0);
  return excess * excess / (4 * friction.viscous);
}

/// Runs 600 steps of a random controller with a random adversary. If `late` is true, one hold in 20 is longer than
/// configured. It can be up to 32 ms.
Outcome run(std::uint64_t seed, Law limiter, bool late = false) {
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
  const double hold_steps = dice.decades(0, 3);  // one force every 1 … 1000 steps
  const double hostility = dice.uniform();

  HapticController controller(config);
  Outcome outcome;
  LocalTime now{};
  Vec3 x = dice.direction() * 0.02;
  Vec3 applied = Vec3::Zero();
  std::uint64_t sequence = 0;
  Step before;
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
          if (dice.chance(0.3)) remote.model->valid_radius = dice.decades(-5, 0);
          if (dice.chance(0.5)) remote.model->contact = any_contact(dice, x);
          remote.topology_changed = dice.chance(0.05);
          break;
        default:
          remote.force = applied.norm() > 0 ? Vec3(applied * 1e3) : dice.direction();
          break;
      }
      controller.observe(remote);
    }

    Duration held(static_cast<std::int64_t>(dice.within(500'000, 2'000'000)));
    if (late && dice.chance(0.05)) held = from_seconds(2e-3 * dice.decades(0, 1.2));
    now += held;
    const double force = applied.norm();
    if (dice.chance(hostility)) {  // worst motion, eq. (7)
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
    const double beyond = i > 0 ? std::max(0.0, seconds(held - before.longest_hold)) : 0.0;
    const double may_leave =
        std::min(before.energy, 0.0) - beyond * worst_per_second(applied, config.limiter.friction, limiter);
    outcome.worst_shortfall = std::max(outcome.worst_shortfall, may_leave - step.energy);
    before = step;
    const double size = limiter == Law::kAolPerAxis ? step.force.cwiseAbs().maxCoeff() : step.force.norm();
    outcome.worst_excess = std::max(outcome.worst_excess, size - step.permitted * (1 + 1e-12));
    applied = step.force;
    if (applied.norm() > device_clamp) applied *= device_clamp / applied.norm();
  }
  return outcome;
}

class Passivity : public ::testing::TestWithParam<Law> {};

TEST_P(Passivity, NoHandNoForceAndNoTimingMakesTheLedgerNegative) {
  const auto limiter = GetParam();
  EXPECT_TRUE(rc::check([limiter] {
    const auto seed = *rc::gen::arbitrary<std::uint64_t>();
    const Outcome outcome = run(seed, limiter);
    RC_ASSERT(outcome.least_energy >= -1e-9);
    RC_ASSERT(outcome.worst_excess <= 0.0);
    RC_ASSERT(outcome.all_finite);
  }));
}

TEST_P(Passivity, AHoldBeyondTheBoundTakesNoMoreThanIsSaid) {
  const auto limiter = GetParam();
  EXPECT_TRUE(rc::check([limiter] {
    const auto seed = *rc::gen::arbitrary<std::uint64_t>();
    const Outcome outcome = run(seed, limiter, true);
    RC_ASSERT(outcome.worst_shortfall <= 1e-9);
    RC_ASSERT(outcome.worst_excess <= 0.0);
    RC_ASSERT(outcome.all_finite);
  }));
}

// A searching adversary. It uses hill climbing over the genes of hand and environment to maximize the extracted energy
// relative to the ledger's peak.
struct Gene {
  double follow = 0;           // factor on the worst motion of eq. (7)
  Vec3 move = Vec3::Zero();    // m, added motion
  Vec3 wanted = Vec3::Zero();  // N
  double late = 1;             // previous hold / configured hold
};

class Search {
 public:
  Search(Law law, double bound_scale, std::uint64_t seed, bool late = false)
      : law_(law), bound_scale_(bound_scale), late_(late), dice_(seed) {}

  /// Returns the lowest objective relative to the ledger's peak. If the value is negative, the energy was less than
  /// zero, or less than the minimum for a late hold.
  double worst() {
    double worst = 0;
    for (int start = 0; start < 20; ++start) {
      std::vector<Gene> genes(kSteps);
      for (Gene& gene : genes) gene = random_gene();
      double best = objective(genes);
      for (int climb = 0; climb < 200; ++climb) {
        std::vector<Gene> next = genes;
        for (int i = 0; i < 3; ++i) next[static_cast<std::size_t>(dice_.within(0, kSteps))] = random_gene();
        if (dice_.chance(0.3)) {  // the same gene is used in the next step
          const auto from = static_cast<std::size_t>(dice_.within(0, kSteps - 1));
          next[from + 1] = next[from];
        }
        const double found = objective(next);
        if (found <= best) {
          best = found;
          genes = std::move(next);
        }
      }
      worst = std::min(worst, best);
    }
    return worst;
  }

 private:
  static constexpr std::size_t kSteps = 30;
  static constexpr double kViscous = 0.26;

  Gene random_gene() {
    Gene gene{.follow = dice_.chance(0.5) ? 1 : dice_.within(-2, 2),
              .move = dice_.chance(0.5) ? Vec3(Vec3::Zero()) : Vec3(dice_.direction() * dice_.decades(-6, -3)),
              .wanted = dice_.chance(0.2) ? Vec3(Vec3::Zero()) : Vec3(dice_.direction() * dice_.decades(-1, 6))};
    if (late_ && dice_.chance(0.3)) gene.late = dice_.within(0.5, 3);
    return gene;
  }

  double objective(const std::vector<Gene>& genes) const {
    // The Coulomb friction is zero, because laws that ignore it would otherwise have a margin.
    const Friction friction{0, kViscous};
    Limiter limiter({.law = law_, .friction = friction, .longest_hold = std::chrono::milliseconds(1)});
    const bool per_axis = law_ == Law::kAolPerAxis;
    Vec3 energy = Vec3::Zero();
    double least = 0;
    double most = 1e-12;
    Vec3 applied = Vec3::Zero();
    for (const Gene& gene : genes) {
      const Duration bound = limiter.longest_hold();
      const Duration held = from_seconds(seconds(bound) * gene.late);
      const double beyond = std::max(0.0, seconds(held - bound));
      const Vec3 dx = gene.move + gene.follow * seconds(held) / (2 * kViscous) * applied;
      Vec3 income = kViscous / seconds(held) * dx.cwiseAbs2() - applied.cwiseProduct(dx);
      Vec3 worst = beyond / (4 * kViscous) * applied.cwiseAbs2();
      if (!per_axis) {
        income = Vec3(income.sum(), 0, 0);
        worst = Vec3(worst.sum(), 0, 0);
      }
      const Vec3 may_leave = energy.cwiseMin(0.0) - worst;
      energy += income;
      least = std::min(least, (energy - may_leave).minCoeff());
      most = std::max(most, energy.sum());
      limiter.observe({.applied = applied, .dx = dx, .held = held});
      const LimitedForce<3> limited = limiter.limit({.force = gene.wanted});
      applied = limited.force * (limited.reasons.has(Reason::kEnergy) ? bound_scale_ : 1.0);
    }
    return least / most;
  }

  Law law_;
  double bound_scale_;
  bool late_;
  Dice dice_;
};

TEST_P(Passivity, ASearchForTheMotionThatBreaksItFindsNone) {
  EXPECT_GE(Search(GetParam(), 1.0, 2009).worst(), -1e-12);
}

TEST_P(Passivity, TheSameSearchFindsOneWhenTheBoundIsOnePercentTooHigh) {
  EXPECT_LT(Search(GetParam(), 1.01, 2009).worst(), -1e-4);
}

TEST_P(Passivity, ASearchWithLateHoldsFindsNoneEither) {
  EXPECT_GE(Search(GetParam(), 1.0, 2009, true).worst(), -1e-12);
}

TEST_P(Passivity, TheSearchWithLateHoldsFindsABoundOnePercentTooHigh) {
  EXPECT_LT(Search(GetParam(), 1.01, 2009, true).worst(), -1e-4);
}

std::vector<Law> passive_laws() {
  std::vector<Law> passive;
  for (const LawInfo& law : laws()) {
    if (law.passive) passive.push_back(law.law);
  }
  return passive;
}

std::string name_for_test(const ::testing::TestParamInfo<Law>& law) {
  std::string name;  // GoogleTest accepts only letters and digits
  for (const char c : info(law.param).name) name += c == '-' ? "_" : c == '+' ? "Plus" : std::string(1, c);
  return name;
}

INSTANTIATE_TEST_SUITE_P(Laws, Passivity, ::testing::ValuesIn(passive_laws()), name_for_test);

}  // namespace
}  // namespace tendon::passivity_test
