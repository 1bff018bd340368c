// SPDX-License-Identifier: Apache-2.0
#include "core/control/reference_energy.h"

#include <Eigen/LU>

#include "tests/core/control/adversary.h"

namespace tendon::reference_energy_test {
namespace {

using std::chrono::milliseconds;

constexpr Friction kFriction{0.05, 0.26};

TEST(ReferenceEnergyController, TheReferenceIsWhatASpringHoldsAtThatForce) {
  const ReferenceEnergyController<3> law({kFriction, 500, 20});
  const Vec3 force(1, -2, 3);
  EXPECT_DOUBLE_EQ(law.reference({force}), force.squaredNorm() / 1000);
  Mat3 stiffness;
  stiffness << 800, 100, 0, 100, 400, 50, 0, 50, 200;
  EXPECT_NEAR(law.reference({force, stiffness}), 0.5 * force.dot(stiffness.inverse() * force), 1e-15);
  const Vec3 normal = Vec3(1, 2, -2) / 3;
  EXPECT_NEAR(law.reference({Vec3(-4 * normal), Mat3(1000 * normal * normal.transpose())}), 16 / 2000.0, 1e-15);
}

TEST(ReferenceEnergyController, DampsUpToTheReferenceAndNotOnlyUpToZero) {
  ReferenceEnergyController<1> law({kFriction, 1000, 1e6});
  law.observe({Vec<1>(-1.0), Vec<1>(1e-3), milliseconds(1)});     // 1 mJ received
  EXPECT_EQ(law.limit({Vec<1>(-1.0)}).force[0], -1);              // 2 mJ predicted ≥ 0.5 mJ
  law.observe({Vec<1>(-1.0), Vec<1>(-0.7e-3), milliseconds(1)});  // 0.3 mJ left, reference 0.5 mJ
  const LimitedForce<1> limited = law.limit({Vec<1>(-1.0)});
  EXPECT_NEAR(law.observed() - limited.force[0] * -0.7e-3, 0.5e-3, 1e-15);
  EXPECT_TRUE(limited.reasons.has(Reason::kEnergy));
}

}  // namespace
}  // namespace tendon::reference_energy_test
