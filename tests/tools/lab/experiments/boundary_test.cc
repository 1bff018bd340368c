// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/boundary.h"

#include <gtest/gtest.h>

#include "core/stability/stability_boundary.h"

namespace tendon::lab::boundary_test {
namespace {

TEST(Boundary, SimulationAndEigenvaluesAgreeWithAndWithoutDelay) {
  for (const int delay : {0, 2, 10}) {
    const SampledSpring spring{
        .mass = 0.075, .viscous = 0.26, .period = std::chrono::milliseconds(1), .delay_samples = delay};
    const double exact = largest_stable_stiffness(spring);
    EXPECT_NEAR(simulated_stiffness_limit(spring), exact, 0.02 * exact) << delay;
  }
}

}  // namespace
}  // namespace tendon::lab::boundary_test
