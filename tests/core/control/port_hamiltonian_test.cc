// SPDX-License-Identifier: Apache-2.0
#include "core/control/port_hamiltonian.h"

#include <numbers>
#include <vector>

#include "core/control/unlimited.h"
#include "tests/core/control/adversary.h"
#include "tests/core/control/press.h"

namespace tendon::port_hamiltonian_test {
namespace {

using std::chrono::milliseconds;

constexpr Friction kFriction{0.05, 0.26};

// Returns the depth (m) of a hand that is pressed into a wall at 0 and released again, with tremor.
double depth(int step) {
  const double t = step * 1e-3;
  return std::abs(8e-3 * std::sin(3 * t) + 2e-3 * std::sin(17 * t) + 1e-4 * std::sin(190 * t));
}

TEST(PortHamiltonian, APlainSpringsLedgerIsPotentialMinusLeapsPlusFriction) {
  Unlimited<1> spring({kFriction});
  constexpr double kStiffness = 1500;
  double x = 0;
  double leaps = 0;
  double friction = 0;
  for (int step = 1; step < 5000; ++step) {
    const double dx = depth(step) - x;
    spring.observe({Vec<1>(-kStiffness * x), Vec<1>(dx), milliseconds(1)});
    x += dx;
    leaps += kStiffness * dx * dx / 2;
    friction += kFriction.coulomb * std::abs(dx) + kFriction.viscous * dx * dx / 1e-3;
    ASSERT_NEAR(spring.energy(), kStiffness * x * x / 2 - leaps + friction, 1e-12);
  }
}

TEST(PortHamiltonian, TheStateLagsBehindThePositionByWhatTheLeapsCost) {
  constexpr double kStiffness = 1500;
  PortHamiltonian<1> law({kFriction, kStiffness});
  Vec<1> force(0);
  double x = 0;
  double work = 0;
  double least_work = 0;
  std::vector<double> ratios;
  for (int step = 1; step < 20000; ++step) {
    const double dx = depth(step) - x;
    law.observe({force, Vec<1>(dx), milliseconds(1)});
    work -= force[0] * dx;
    least_work = std::min(least_work, work);
    x += dx;
    force = law.limit({Vec<1>(-kStiffness * x), Mat<1>(kStiffness)}).force;
    if (x > 1e-3) ratios.push_back(-force[0] / kStiffness / x);
    ASSERT_LE(-force[0], kStiffness * x * (1 + 1e-12));
  }
  std::sort(ratios.begin(), ratios.end());
  EXPECT_GT(ratios[ratios.size() / 2], 0.9);
  EXPECT_GT(least_work, -1e-5);  // J, for the environment without friction; the spring exchanges 75 mJ
}

// The storage must never be negative, and it must be at most the received energy plus the debt.
TEST(PortHamiltonian, HoldsNoMoreThanHasGoneInAndWhatItHasBookedAsDebt) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    Dice dice(seed);
    PortHamiltonian<3> law({kFriction, dice.decades(1, 5)});
    World<3> world = hostile_world<3>(dice);
    Vec3 force = Vec3::Zero();
    Vec3 x = Vec3::Zero();
    double gone_in = 0;
    double turnover = 1;
    for (int step = 0; step < 300; ++step) {
      const Vec3 dx = dice.chance(0.3) ? worst_motion<3>(force, kFriction, milliseconds(1))
                                       : Vec3(dice.direction() * dice.decades(-6, -2.5));
      law.observe({force, dx, milliseconds(1)});
      gone_in -= force.dot(dx);
      turnover += std::abs(force.dot(dx)) + law.debt();
      x += dx;
      force = law.limit(world(x)).force;
      ASSERT_GE(law.stored(), 0);
      ASSERT_GE(law.debt(), 0);
      ASSERT_GE(gone_in, law.stored() - law.debt() - 1e-12 * turnover) << "seed " << seed << " step " << step;
    }
  }
}

// Hides the hostile stiffness of the demand, so the law uses its configured stiffness.
template <int N>
class WithItsOwnStiffness {
 public:
  WithItsOwnStiffness(Friction friction, double stiffness) : law_({friction, stiffness}) {}
  void observe(const Interval<N>& interval) noexcept { law_.observe(interval); }
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept { law_.observe_unseen(applied, at_most); }
  LimitedForce<N> limit(const Demand<N>& demand) noexcept { return law_.limit({demand.force, Mat<N>::Zero()}); }
  double energy() const noexcept { return law_.energy(); }

 private:
  PortHamiltonian<N> law_;
};

template <int N>
int broken(double excess, int seeds) {
  return broken_by_hostile_worlds<N>(
      [&](Friction friction, Duration hold) {
        return WithItsOwnStiffness<N>(friction, excess * 2 * friction.viscous / seconds(hold));
      },
      seeds);
}

TEST(PortHamiltonian, UpToTwoBOverTNoAdversaryDrawsEnergy) {
  EXPECT_EQ(broken<1>(1, 400), 0);
  EXPECT_EQ(broken<3>(1, 400), 0);
  EXPECT_EQ(broken<6>(1, 100), 0);
}

// Moving by d into the contact from rest and then out by the worst motion gains b d²/T (1 − (K T/2b)²).
TEST(PortHamiltonian, FivePercentAboveTwoBOverTTheFirstLeapCanBeCashedIn) {
  const auto energy = [](double excess) {
    const Friction friction{0, 0.26};
    PortHamiltonian<1> law({friction, excess * 520});
    law.observe({Vec<1>(0.0), Vec<1>(1e-3), milliseconds(1)});
    const Vec<1> force = law.limit({Vec<1>(-100.0)}).force;
    law.observe({force, worst_motion<1>(force, friction, milliseconds(1)), milliseconds(1)});
    return law.energy();
  };
  EXPECT_GE(energy(1), -1e-15);
  EXPECT_NEAR(energy(1.05), 0.26 * 1e-3 * (1 - 1.05 * 1.05), 1e-9);
}

TEST(PortHamiltonian, ShowsWallsSofterThanTheyAreAndCreepsInVeryStiffOnes) {
  const auto displayed = [](double wall) { return press(PortHamiltonian<1>({kPressFriction, wall}), wall); };
  EXPECT_NEAR(displayed(800).stiffness, 782, 20);
  EXPECT_NEAR(displayed(3000).stiffness, 2709, 100);
  const Press stiffest = displayed(20000);
  EXPECT_LT(stiffest.stiffness, 2000);
  EXPECT_LT(stiffest.unrest, 0.15);
  EXPECT_GT(stiffest.least_work, -1e-3);
}

}  // namespace
}  // namespace tendon::port_hamiltonian_test
