// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/paper.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

namespace tendon::lab::paper_test {
namespace {

using std::chrono::milliseconds;

const PaperExperiment& experiment(const std::string& name) {
  for (const PaperExperiment& e : paper_experiments()) {
    if (e.name == name) return e;
  }
  throw std::invalid_argument(name);
}

double displayed(const std::string& name, Law law) {
  return paper_row(experiment(name), law).prescribed.operational_stiffness;
}

TEST(Paper, OneFrictionExplainsTheOperationalStiffnessOfAllFiveExperiments) {
  for (const PaperExperiment& e : paper_experiments()) {
    if (!e.k_op) continue;
    const double found = displayed(e.name, Law::kAol);
    EXPECT_GE(found, 0.85 * *e.k_op) << e.name;
    EXPECT_LE(found, 1.15 * e.k_op_most.value_or(*e.k_op)) << e.name;
  }
}

TEST(Paper, WithoutControlEachOfTheFiveIsUnstableAndActive) {
  for (const PaperExperiment& e : paper_experiments()) {
    if (!e.k_op) continue;
    const PaperRow row = paper_row(e, Law::kNone);
    EXPECT_FALSE(row.free.stable) << e.name;
    EXPECT_LT(row.free.least_energy, -0.01) << e.name;
  }
}

TEST(Paper, TheLimiterMakesEachOfTheFiveStable) {
  for (const PaperExperiment& e : paper_experiments()) {
    if (!e.k_op) continue;
    EXPECT_TRUE(paper_row(e, Law::kAol).free.stable) << e.name;
    EXPECT_TRUE(paper_row(e, Law::kAolPlus).free.stable) << e.name;
  }
}

TEST(Paper, AolGivesOutNoEnergyAtExactPositionsAndAolPlusNoneWithCounts) {
  for (const PaperExperiment& e : paper_experiments()) {
    EXPECT_GE(paper_row(e, Law::kAol).prescribed.least_energy, -1e-12) << e.name;
    EXPECT_GE(paper_row(e, Law::kAolPlus).least_energy(), -1e-12) << e.name;
  }
}

TEST(Paper, AolPlusDisplays400AtTheLowRateWhereThePaperHas16) { EXPECT_GE(displayed("D", Law::kAolPlus), 400); }

TEST(Paper, AolPlusWithAModelDisplays500BehindADelayWhereThePaperHas180) {
  EXPECT_GE(displayed("C", Law::kAolPlus), 500);
}

TEST(Paper, AWrongEstimateCannotPushTheHandHarderThanEnergyAllows) {
  const PaperRow none = paper_row(experiment("14"), Law::kNone);
  const PaperRow plus = paper_row(experiment("14"), Law::kAolPlus);
  EXPECT_LT(none.least_energy(), -1e-3);
  EXPECT_GE(plus.least_energy(), -1e-12);
}

// core/PROOFS.md, "Force inside the bound"

struct Composite {
  const char* name;
  Environment environment;
  ScriptedMotion motion;
  double seconds;
};

/// Moves back and forth in front of a wall for 10 s, and then into the wall.
ScriptedMotion wave(const Vec3& direction) {
  ScriptedMotion::Recorded motion;
  motion.direction = direction;
  for (int i = 0; i <= 1400; ++i) {
    const double t = i * 0.01;
    const double x =
        t < 10 ? -0.05 + 0.03 * std::sin(2 * std::numbers::pi * t) : std::min(-0.05 + 0.08 * (t - 10), 0.012);
    motion.samples.push_back({t, x});
  }
  return ScriptedMotion(motion);
}

Environment along(const std::function<double(double t, double x)>& law, const Vec3& direction) {
  return {.force = [law, direction](double t, const Vec3& x) { return Vec3(law(t, x.dot(direction)) * direction); }};
}

std::vector<Composite> composites(const Vec3& direction, const Vec3& motion) {
  const ScriptedMotion sine(ScriptedMotion::Sine{.amplitude = 0.015, .frequency = 0.25, .direction = motion});
  const auto spring = [&](double k) { return along([k](double, double x) { return -k * x; }, direction); };
  Environment late = spring(2000);
  late.delay = milliseconds(300);
  Environment rare = spring(5000);
  rare.period = milliseconds(40);
  return {{"spring 100", spring(100), sine, 8},
          {"spring 500", spring(500), sine, 8},
          {"A", along([](double t, double x) { return -2000 * t * x; }, direction), sine, 8},
          {"C", late, sine, 8},
          {"D", rare, sine, 8},
          {"E", spring(4000), sine, 8},
          {"waving, then a wall", along([](double, double x) { return x > 0 ? -20000 * x : 0.0; }, direction),
           wave(motion), 14}};
}

Outcome feel(const Composite& composite, const Friction& friction, const LimiterConfig& limiter) {
  FreeHand hand = paper_hand(friction);
  hand.hand->motion = composite.motion;
  return outcome(run({.environment = composite.environment,
                      .hand = hand,
                      .limiter = limiter,
                      .estimator = {},
                      .length = from_seconds(composite.seconds),
                      .max_force = kPaperMaxForce}),
                 milliseconds(1));
}

constexpr Friction kDamped{.coulomb = 0.02, .viscous = 0.26};
constexpr Friction kUndamped{.coulomb = 0.04, .viscous = 0.005};

TEST(AolPlus, DisplaysASpringWithoutDampingWherePlainAolShowsATenth) {
  const Composite spring = composites(Vec3::UnitX(), Vec3::UnitX())[1];
  const Outcome plain = feel(spring, kUndamped, {.law = Law::kAol, .friction = kUndamped});
  const Outcome plus = feel(spring, kUndamped, {.friction = kUndamped, .parts = low_friction_parts(kPaperEncoder)});
  EXPECT_NEAR(plain.operational_stiffness, 41, 5);
  EXPECT_GE(plus.operational_stiffness, 475);
}

void expect_quiet(const Vec3& direction, const Vec3& motion) {
  for (const Composite& composite : composites(direction, motion)) {
    for (const Friction& friction : {kDamped, kUndamped}) {
      for (const bool bounded : {false, true}) {
        const auto parts = bounded ? low_friction_parts(kPaperEncoder) : default_parts(kPaperEncoder);
        const Outcome felt = feel(composite, friction, {.friction = friction, .parts = parts});
        const std::string which = std::string(composite.name) + ", b " + std::to_string(friction.viscous) +
                                  (bounded ? ", bounded acceleration" : "");
        // Without damping, a hand that is dragged sideways needs bounded acceleration to be as quiet as the others.
        const bool hard = motion != direction && !bounded && friction.viscous < 0.1;
        EXPECT_LE(felt.late_vibration, hard ? 2.5e-3 : 1.5e-3) << which;
        EXPECT_GE(felt.least_energy, -1e-12) << which;
      }
    }
  }
}

TEST(AolPlus, IsQuietInEveryCompositeRunAlongOneAxis) { expect_quiet(Vec3::UnitX(), Vec3::UnitX()); }
TEST(AolPlus, IsQuietInEveryCompositeRunAcrossTheAxes) {
  const Vec3 direction = Vec3(1, -0.7, 0.4).normalized();
  expect_quiet(direction, direction);
  expect_quiet(direction, Vec3(1, 0.2, 0.6).normalized());  // also dragged sideways
}

TEST(AolPlus, NeverClipsASoftSpring) {
  for (const double stiffness : {20.0, 100.0, 300.0, 500.0, 2 * kDamped.viscous / 1e-3}) {
    Experiment set{.environment = {.force = [stiffness](double, const Vec3& x) { return Vec3(-stiffness * x); }},
                   .hand = paper_motion(kDamped, 0, Vec3(1, -0.7, 0.4).normalized()),
                   .limiter = {.friction = kDamped},
                   .estimator = {},
                   .max_force = 100};
    set.limiter.parts.energy_cap.emplace();
    EXPECT_EQ(outcome(run(set), set.period).limited_share, 0) << stiffness;
  }
}

}  // namespace
}  // namespace tendon::lab::paper_test
