// SPDX-License-Identifier: Apache-2.0
#include "core/control/virtual_coupling.h"

#include <complex>
#include <numbers>

#include "tests/core/control/adversary.h"

namespace tendon::virtual_coupling_test {
namespace {

using std::chrono::milliseconds;

constexpr Friction kFriction{0.05, 0.26};

TEST(VirtualCoupling, AtRestTheHandFeelsBothSpringsInSeries) {
  VirtualCoupling<3> law({kFriction, milliseconds(1), 400, 0.05});
  Mat3 stiffness = Mat3::Zero();
  stiffness.diagonal() << 800, 0, 1e9;
  const Vec3 x(5e-3, 2e-3, -1e-3);
  Vec3 force = Vec3::Zero();
  for (int step = 0; step < 200; ++step) {
    law.observe({force, Vec3::Zero(), milliseconds(1)});
    force = law.limit({Vec3(-stiffness * x), stiffness}).force;
  }
  EXPECT_NEAR(force.x(), -x.x() * 400 * 800 / 1200, 1e-12);
  EXPECT_NEAR(force.y(), 0, 1e-12);
  EXPECT_NEAR(force.z(), -x.z() * 400, 1e-6);
}

TEST(VirtualCoupling, AnEnvironmentThatSendsNoStiffnessComesThroughUnchanged) {
  VirtualCoupling<3> law({kFriction, milliseconds(1), 400, 0});
  EXPECT_NEAR((law.limit({Vec3(100, -3, 2)}).force - Vec3(100, -3, 2)).norm(), 0, 1e-12);
}

TEST(VirtualCoupling, ANegativeStiffnessDoesNotMakeTheToolUnstable) {
  VirtualCoupling<1> law({kFriction, milliseconds(1), 400, 0.05});
  const double damped = law.limit({Vec<1>(-1.0), Mat<1>(-450.0)}).force[0];
  EXPECT_GE(damped, -1 - 1e-12);
  EXPECT_LE(damped, 0);
}

template <int N>
int broken(double share_of_damping, int seeds, const Walls& walls) {
  return broken_by_static_worlds<N>(
      [&](Friction friction, Duration hold, double) {
        const double damping = share_of_damping * friction.viscous;
        return VirtualCoupling<N>({friction, hold, colgate_coupling(friction.viscous, hold, damping), damping});
      },
      seeds, walls);
}

TEST(VirtualCoupling, WithinColgatesRuleNoAdversaryDrawsEnergy) {
  for (const Walls walls : {Walls{1, 0.4}, Walls{3, 1}}) {
    EXPECT_EQ(broken<1>(0, 200, walls), 0);
    EXPECT_EQ(broken<1>(0.4, 200, walls), 0);
    EXPECT_EQ(broken<3>(0, 200, walls), 0);
    EXPECT_EQ(broken<3>(0.4, 200, walls), 0);
    EXPECT_EQ(broken<6>(0.9, 50, walls), 0);
  }
}

// At the surface, the demand reports a stiff world while the tool, which lags or leads the hand, is outside of it.
TEST(VirtualCoupling, AWorldStifferForTheHandThanForTheToolGivesEnergy) {
  const Friction friction{0, 0.26};
  VirtualCoupling<1> law({friction, milliseconds(1), 520});
  Vec<1> force(0);
  double x = -1e-5;
  for (int step = 0; step < 200; ++step) {
    const double dx = step % 2 == 0 ? 2e-5 : -2e-5;
    law.observe({force, Vec<1>(dx), milliseconds(1)});
    x += dx;
    const double wall = x > 0 ? 10000 : 0;
    force = law.limit({Vec<1>(-100 * (x - 0.01) - wall * x), Mat<1>(100 + wall)}).force;
  }
  EXPECT_LT(law.energy(), -1e-4);
}

// This is the motion for which the rule is tight.
double energy_of_shaking_a_rigid_wall(double share_of_damping, double excess) {
  const Friction friction{0, 0.26};
  const double damping = share_of_damping * friction.viscous;
  VirtualCoupling<1> law(
      {friction, milliseconds(1), excess * colgate_coupling(friction.viscous, milliseconds(1), damping), damping});
  Vec<1> force(0);
  double x = 0;
  for (int step = 0; step < 200; ++step) {
    const double dx = step % 2 == 0 ? 1e-3 : -1e-3;
    law.observe({force, Vec<1>(dx), milliseconds(1)});
    x += dx;
    force = law.limit({Vec<1>(-1e9 * x), Mat<1>(1e9)}).force;
  }
  return law.energy();
}

TEST(VirtualCoupling, FivePercentAboveColgatesRuleShakingAWallDrawsEnergy) {
  for (const double share : {0.0, 0.3, 0.8}) {
    EXPECT_GT(energy_of_shaking_a_rigid_wall(share, 1.0), -1e-8) << share;
    EXPECT_LT(energy_of_shaking_a_rigid_wall(share, 1.05), -1e-7) << share;
  }
}

TEST(CouplingDesign, ColgatesRule) {
  EXPECT_DOUBLE_EQ(colgate_coupling(0.26, milliseconds(1), 0), 520);
  EXPECT_DOUBLE_EQ(colgate_coupling(0.26, milliseconds(2), -0.06), 200);
  EXPECT_EQ(colgate_coupling(0.26, milliseconds(1), 0.3), 0);
  EXPECT_THROW(colgate_coupling(-1, milliseconds(1), 0), std::invalid_argument);
  EXPECT_THROW(colgate_coupling(1, Duration::zero(), 0), std::invalid_argument);
}

// The minimum of 2 Re h11 Re h22 − |h12 h21| − Re(h12 h21) for Adams & Hannaford's matrix.
double llewellyn(double mass, double viscous, double stiffness, double damping) {
  constexpr double kPeriod = 1e-3;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 1; i < 4000; ++i) {
    const std::complex<double> z = std::polar(1.0, std::numbers::pi * i / 4000);
    const std::complex<double> h11 = mass * 2.0 / kPeriod * (z - 1.0) / (z + 1.0) + viscous;
    const std::complex<double> coupling = damping + stiffness * kPeriod * z / (z - 1.0);
    const std::complex<double> h12 = 0.5 * (1.0 + 1.0 / z);
    const double h22 = (1.0 / coupling).real();
    least = std::min(least, (2 * h11.real() * h22 - std::abs(h12) + h12.real()) / std::abs(h12));
  }
  return least;
}

TEST(CouplingDesign, TheTwoPortRuleIsLlewellynsOnTheEdgeWhateverTheMass) {
  EXPECT_NEAR(two_port_coupling(0.26, milliseconds(1), 0.26), 2426, 3);
  for (const double viscous : {0.05, 0.26, 1.0}) {
    for (const double ratio : {0.1, 0.5, 1.0, 2.0, 4.0}) {
      const double damping = ratio * viscous;
      const double stiffness = two_port_coupling(viscous, milliseconds(1), damping);
      for (const double mass : {0.03, 0.075, 1.0}) {
        EXPECT_GE(llewellyn(mass, viscous, 0.999 * stiffness, damping), 0) << viscous << " " << ratio;
        EXPECT_LT(llewellyn(mass, viscous, 1.001 * stiffness, damping), 0) << viscous << " " << ratio;
      }
    }
  }
  EXPECT_EQ(two_port_coupling(0.26, milliseconds(1), 3), 0);
  EXPECT_EQ(two_port_coupling(0, milliseconds(1), 0), 0);
  EXPECT_THROW(two_port_coupling(0.26, milliseconds(1), -0.1), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::virtual_coupling_test
