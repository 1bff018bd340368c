// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/material.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <limits>
#include <stdexcept>

#include "tests/support/dice.h"

namespace tendon::softbody::material_test {
namespace {

constexpr Law kLaws[] = {Law::kLinear, Law::kCorotational, Law::kStVenantKirchhoff, Law::kNeoHookean};
constexpr Material kSoft{.young = 1e4, .poisson = 0.45};

Mat3 drawn(Dice& dice, double spread) {
  Mat3 f = Mat3::Identity();
  for (double& entry : f.reshaped()) entry += dice.within(-spread, spread);
  return f;
}

TEST(Materials, StressIsTheSlopeOfTheEnergyAndTheTangentThatOfTheStress) {
  Dice dice(1);
  for (const Law law : kLaws) {
    for (int i = 0; i < 50; ++i) {
      const Mat3 f = drawn(dice, 0.4);
      // the polar rotation is discontinuous there, and so is the corotational stress
      if (f.determinant() < 0.2) continue;
      const Mat3 along = drawn(dice, 1) - Mat3::Identity();
      const double h = 1e-5;
      const Stress plus = stress(law, f + h * along, kSoft.mu(), kSoft.lambda());
      const Stress minus = stress(law, f - h * along, kSoft.mu(), kSoft.lambda());
      const Mat3 p = stress(law, f, kSoft.mu(), kSoft.lambda()).piola;
      EXPECT_NEAR((plus.energy - minus.energy) / (2 * h), p.cwiseProduct(along).sum(), 1e-3);
      const Mat9 a = tangent(law, f, kSoft.mu(), kSoft.lambda());
      const Eigen::Matrix<double, 9, 1> change = a * along.reshaped();
      const Mat3 measured = (plus.piola - minus.piola) / (2 * h);
      EXPECT_LT((change - measured.reshaped()).norm(), 1e-6 * a.norm()) << static_cast<int>(law);
      EXPECT_LT((a - a.transpose()).norm(), 1e-9 * a.norm());
    }
  }
}

TEST(Materials, AllLawsAreHookesForSmallStrains) {
  Dice dice(2);
  const Mat9 hooke = tangent(Law::kLinear, Mat3::Identity(), kSoft.mu(), kSoft.lambda());
  for (const Law law : kLaws) {
    const Mat9 at_rest = tangent(law, Mat3::Identity(), kSoft.mu(), kSoft.lambda());
    EXPECT_LT((at_rest - hooke).norm(), 1e-10 * hooke.norm()) << static_cast<int>(law);
    EXPECT_LT(stress(law, Mat3::Identity(), kSoft.mu(), kSoft.lambda()).piola.norm(), 1e-9);
  }
}

TEST(Materials, OnlyTheLinearLawTakesATurnForAStrain) {
  const Mat3 turn = Eigen::AngleAxisd(1.5, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  EXPECT_GT(stress(Law::kLinear, turn, kSoft.mu(), kSoft.lambda()).piola.norm(), 1e3);
  for (const Law law : {Law::kCorotational, Law::kStVenantKirchhoff, Law::kNeoHookean}) {
    EXPECT_LT(stress(law, turn, kSoft.mu(), kSoft.lambda()).piola.norm(), 1e-9) << static_cast<int>(law);
  }
}

TEST(Materials, EveryLawIsTheSumOfItsTwoParts) {
  Dice dice(3);
  for (const Law law : kLaws) {
    const Mat3 f = drawn(dice, 0.3);
    const Stress both = stress(law, f, 2, 7);
    const Stress mu = stress(law, f, 2, 0);
    const Stress lambda = stress(law, f, 0, 7);
    EXPECT_NEAR(both.energy, mu.energy + lambda.energy, 1e-13);
    EXPECT_LT((both.piola - mu.piola - lambda.piola).norm(), 1e-13);
  }
}

TEST(Materials, TheNearestRotationIsARotationEvenOfWhatIsTurnedInsideOut) {
  Dice dice(4);
  for (int i = 0; i < 200; ++i) {
    const Mat3 f = drawn(dice, 1.5);
    const Mat3 r = nearest_rotation(f);
    EXPECT_LT((r.transpose() * r - Mat3::Identity()).norm(), 1e-12);
    EXPECT_NEAR(r.determinant(), 1, 1e-12);
    const Mat3 s = r.transpose() * f;
    EXPECT_LT((s - s.transpose()).norm(), 1e-10);  // F = R S
  }
}

TEST(Materials, WithoutNegativeKeepsWhatIsDefiniteAndLosesWhatIsNot) {
  const Mat9 definite = tangent(Law::kNeoHookean, Mat3::Identity(), kSoft.mu(), kSoft.lambda());
  EXPECT_LT((without_negative(definite) - definite).norm(), 1e-10 * definite.norm());
  Mat9 mixed = Mat9::Identity();
  mixed(4, 4) = -3;
  Mat9 kept = Mat9::Identity();
  kept(4, 4) = 0;
  EXPECT_LT((without_negative(mixed) - kept).norm(), 1e-14);
}

TEST(Materials, AnImpossibleMaterialIsRefused) {
  EXPECT_NO_THROW(check(Material{.young = 1, .poisson = 0}));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Material& bad :
       {Material{0, 0.3}, Material{nan, 0.3}, Material{1, 0.5}, Material{1, -0.1}, Material{1, nan}}) {
    EXPECT_THROW(check(bad), std::invalid_argument);
  }
}

}  // namespace
}  // namespace tendon::softbody::material_test
