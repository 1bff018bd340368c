// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/floor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/base/portable_math.h"
#include "core/ledger/energy_ledger.h"
#include "core/ledger/output_bound.h"
#include "tests/support/refusal.h"
#include "tests/tools/lab/experiments/paper.h"
#include "tests/tools/lab/experiments/situations.h"

namespace tendon::lab::floor_test {
namespace {

constexpr Friction kDamped{.coulomb = 0.02, .viscous = 0.26};

/// ± 4 mm at 0.5 Hz.
FloorProblem spring(double stiffness, const Friction& friction = kDamped) {
  FloorProblem problem{.friction = friction, .period = std::chrono::milliseconds(1), .max_force = 8.5};
  const auto place = [](int k) { return 0.004 * portable::sin(2 * 3.14159265358979 * 0.5 * k * 1e-3); };
  for (int k = 0; k < 2000; ++k) {
    problem.dx.push_back(place(k + 1) - place(k));
    problem.truth.push_back(-stiffness * place(k));
  }
  return problem;
}

TEST(Floor, ASpringThatFrictionPaysForHasNone) {
  // 500 N/m is below 2b/T = 520.
  const Floor floor = floor_of(spring(500), Passive::kWhateverComes);
  EXPECT_LT(floor.error, 0.005);
  EXPECT_LE(floor.at_least, floor.error);
}

TEST(Floor, AStifferOneHasWhatItIsAboveThatLessWhatForesightSaves) {
  // 1 − 2b/(TK) = 48 % at 1000 N/m and 74 % at 2000.
  const double soft = floor_of(spring(1000), Passive::kWhateverComes).error;
  const double hard = floor_of(spring(2000), Passive::kWhateverComes).error;
  EXPECT_GT(soft, 0.25);
  EXPECT_LT(soft, 0.48);
  EXPECT_GT(hard, soft);
  EXPECT_LT(hard, 0.74);
  EXPECT_LT(floor_of(spring(2000), Passive::kAccelerating).error, 0.1) << "a bound on acceleration pays for it";
  EXPECT_LT(floor_of(spring(2000), Passive::kOnThisMotion).error, 0.005) << "passivity itself costs nothing";
}

TEST(Floor, IsKnownToATenthOfAPoint) {
  for (const Passive sense : {Passive::kOnThisMotion, Passive::kWhateverComes, Passive::kAccelerating}) {
    const Floor floor = floor_of(spring(3000), sense);
    EXPECT_LT(floor.error * floor.error - floor.at_least * floor.at_least, 1e-6);
  }
}

TEST(Floor, ItsForcesAreSafeInItsOwnSense) {
  const FloorProblem problem = spring(2000);
  const Floor floor = floor_of(problem, Passive::kWhateverComes);
  const OutputBound bound = OutputBound::of(problem.friction, problem.period);
  EnergyLedger ledger(problem.friction);
  double least = 1e-6;
  for (std::size_t k = 0; k < floor.force.size(); ++k) {
    const double account = 1e-6 + ledger.energy();
    least = std::min(least, account - bound.at(std::abs(floor.force[k])));
    ledger.observe<1>(Vec<1>(floor.force[k]), Vec<1>(problem.dx[k]), problem.period);
  }
  EXPECT_GE(least, -1e-12);
}

TEST(Floor, NoLawIsBelowTheFloorOfItsOwnMotion) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    auto trial = draw_situation("grid", seed);
    auto& hand = std::get<FreeHand>(trial->experiment.hand);
    hand.encoder_step.reset();  // laws without a robust ledger do not guarantee anything with encoder counts
    Experiment set = trial->experiment;
    set.limiter.law = Law::kAol;
    const auto record = run(set);
    const auto felt = outcome(record, set.period);
    const auto floor = floor_of(record, set.limiter.friction, set.period, set.max_force, Passive::kWhateverComes);
    ASSERT_TRUE(floor);
    EXPECT_GE(felt.force_error / felt.true_force, *floor - 0.002) << "seed " << seed;
  }
}

TEST(Floor, RefusesWhatHasNone) {
  const auto complaint = [](const FloorProblem& problem) {
    return thrown_by([&] { floor_of(problem, Passive::kOnThisMotion); });
  };
  FloorProblem problem = spring(500);
  problem.truth.pop_back();
  EXPECT_NE(complaint(problem).find("got 1999 and 2000"), std::string::npos);
  problem = spring(0);
  EXPECT_NE(complaint(problem).find("truth"), std::string::npos);
}

}  // namespace
}  // namespace tendon::lab::floor_test
