// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "core/stability/coulomb_boundary.h"
#include "core/stability/passivity_boundary.h"
#include "core/stability/stability_boundary.h"
#include "devices/simulated/simulated_device.h"

/// Stable below and unstable above the boundaries of the closed forms.

namespace tendon::simulated_boundary_test {
namespace {

using namespace std::chrono_literals;

struct Swing {
  double early = 0;  ///< m/s, largest speed in the first tenth
  double late = 0;   ///< m/s, largest speed in the last tenth
};

/// Starts at the spring's rest position on the edge between two counts, the worst case. `speed` is in m/s.
Swing let_swing(const SampledSpring& spring, double speed, Duration span) {
  SimulatedDevice::Config config;
  config.mass = spring.mass;
  if (spring.viscous > 0) config.viscous_friction = spring.viscous;
  if (spring.coulomb > 0) config.coulomb_friction = spring.coulomb;
  if (spring.encoder_step > 0) config.encoder_step = spring.encoder_step;
  config.start_velocity = {speed, 0, 0};
  SimulatedDevice device(config);

  const double rest = spring.encoder_step / 2;
  const double t = seconds(spring.period);
  LocalTime now{};
  double before = device.read(now)->position.x();
  std::deque<double> under_way(static_cast<std::size_t>(spring.delay_samples), 0.0);
  const auto steps = span / spring.period;
  Swing swing;
  for (Duration::rep i = 0; i < steps; ++i) {
    const double x = device.read(now)->position.x();
    under_way.push_back(-spring.stiffness * (x - rest) - spring.damping * (x - before) / t);
    before = x;
    device.apply({under_way.front(), 0, 0});
    under_way.pop_front();
    now += spring.period;
    device.read(now);
    const double here = device.truth().velocity.norm();
    if (i < steps / 10) swing.early = std::max(swing.early, here);
    if (i >= steps - steps / 10) swing.late = std::max(swing.late, here);
  }
  return swing;
}

struct Loop {
  double damping;
  int delay;
};
class SampledSpringSimulated : public ::testing::TestWithParam<Loop> {};

TEST_P(SampledSpringSimulated, Dies1PercentBelowTheBoundaryGrows1PercentAbove) {
  SampledSpring spring{
      .mass = 0.075, .viscous = 0.26, .damping = GetParam().damping, .period = 1ms, .delay_samples = GetParam().delay};
  const double boundary = largest_stable_stiffness(spring);
  spring.stiffness = 0.99 * boundary;
  const Swing below = let_swing(spring, 0.1, 10s);
  EXPECT_LT(below.late, 0.95 * below.early);
  spring.stiffness = 1.01 * boundary;
  const Swing above = let_swing(spring, 0.1, 10s);
  EXPECT_GT(above.late, 1.05 * above.early);
}

INSTANTIATE_TEST_SUITE_P(WithAndWithoutDelay, SampledSpringSimulated,
                         ::testing::Values(Loop{0, 0}, Loop{0, 1}, Loop{0, 5}, Loop{0, 20}, Loop{2, 0}, Loop{2, 2},
                                           Loop{5, 20}));

class SwingingWithCoulombFriction : public ::testing::TestWithParam<int> {};

TEST_P(SwingingWithCoulombFriction, DiesOutBelowTheSpeedLimitAndGrowsAboveIt) {
  const SampledSpring spring{
      .mass = 0.075, .viscous = 0.05, .coulomb = 0.05, .stiffness = 1000, .period = 1ms, .delay_samples = GetParam()};
  const double limit = diolaiti(spring).speed_limit;
  const double v_c = limit * 3.14159265 / 4;
  const Swing slow = let_swing(spring, 1.2 * v_c, 2s);
  EXPECT_LT(slow.late, 0.9 * slow.early);
  const Swing fast = let_swing(spring, 1.5 * v_c, 2s);
  EXPECT_GT(fast.late, 1.1 * fast.early);
}

INSTANTIATE_TEST_SUITE_P(WithAndWithoutDelay, SwingingWithCoulombFriction, ::testing::Values(0, 1));

TEST(DiolaitiSimulated, EachRegionDoesWhatItsNameSays) {
  SampledSpring spring{
      .mass = 0.075, .viscous = 2, .coulomb = 0.05, .stiffness = 450, .period = 1ms, .encoder_step = 2e-4};
  ASSERT_DOUBLE_EQ(abbott_okamura_stiffness(spring), 500);
  ASSERT_EQ(diolaiti(spring).region, DiolaitiRegion::kPassive);
  EXPECT_EQ(let_swing(spring, 0.05, 3s).late, 0);

  double smaller = 0;
  for (const double stiffness : {520.0, 700.0, 1500.0}) {
    spring.stiffness = stiffness;
    ASSERT_EQ(diolaiti(spring).region, DiolaitiRegion::kLimitCycle);
    const Swing swing = let_swing(spring, 0.05, 3s);
    EXPECT_GT(swing.late, smaller);
    // This is a limit cycle of about one count at the frequency of the spring. It does not grow.
    EXPECT_LT(swing.late, spring.encoder_step * std::sqrt(stiffness / spring.mass));
    smaller = swing.late;
  }
}

TEST(PassiveStiffness, IsWhatRemainsStableForAHandOfAnyMass) {
  SampledSpring spring{.mass = 5, .viscous = 0.26, .period = 1ms, .delay_samples = 1};
  const double boundary = largest_passive_stiffness(spring);
  EXPECT_NEAR(largest_stable_stiffness(spring) / boundary, 1, 1e-3);
  for (const double mass : {0.02, 0.075, 0.5, 5.0}) {
    spring.mass = mass;
    spring.stiffness = 0.999 * boundary;
    EXPECT_LT(spectral_radius(spring), 1) << mass;
  }
}

}  // namespace
}  // namespace tendon::simulated_boundary_test
