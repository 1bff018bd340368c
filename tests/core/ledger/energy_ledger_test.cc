// SPDX-License-Identifier: Apache-2.0
#include "core/ledger/energy_ledger.h"

#include <gtest/gtest.h>

#include <limits>

namespace tendon::energy_ledger_test {
namespace {

using std::chrono::milliseconds;
using Vec1 = Eigen::Matrix<double, 1, 1>;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr Friction kFriction{0.05, 0.26};

TEST(EnergyLedger, StartsAtZero) { EXPECT_EQ(EnergyLedger(kFriction).energy(), 0); }

TEST(EnergyLedger, BooksEquationFiveTermByTerm) {
  EnergyLedger ledger(kFriction);
  // If the force is 2 N along −x and the hand moves by 3 mm along +x, this is 6 mJ of work plus friction.
  const double energy = ledger.observe(Vec3(-2, 0, 0), Vec3(0.003, 0, 0), milliseconds(1));
  EXPECT_NEAR(energy, 2 * 0.003 + 0.05 * 0.003 + 0.26 * 0.003 * 0.003 / 0.001, 1e-15);
}

TEST(EnergyLedger, TakesOutWhatTheDeviceGivesToTheHand) {
  EnergyLedger ledger({0, 0});
  EXPECT_DOUBLE_EQ(ledger.observe(Vec3(2, 0, 0), Vec3(0.003, 0, 0), milliseconds(1)), -0.006);
}

TEST(EnergyLedger, UsesTheActualLengthOfTheInterval) {
  EnergyLedger shorter({0, 0.26});
  EnergyLedger longer({0, 0.26});
  const Vec3 dx(0.001, 0, 0);
  EXPECT_DOUBLE_EQ(shorter.observe(Vec3::Zero().eval(), dx, milliseconds(1)),
                   2 * longer.observe(Vec3::Zero().eval(), dx, milliseconds(2)));
}

TEST(EnergyLedger, IsTheSameInEveryFrame) {
  const Eigen::Matrix3d turn = (Eigen::Matrix3d() << 0.36, 0.48, -0.8, -0.8, 0.60, 0, 0.48, 0.64, 0.60).finished();
  EnergyLedger a(kFriction);
  EnergyLedger b(kFriction);
  const Vec3 force(1, -2, 0.5);
  const Vec3 dx(1e-3, 2e-3, -3e-3);
  EXPECT_NEAR(a.observe(force, dx, milliseconds(1)), b.observe<3>(turn * force, turn * dx, milliseconds(1)), 1e-17);
}

TEST(EnergyLedger, OneAxisOfTheVectorFormIsThePapersForm) {
  EnergyLedger vector(kFriction);
  EnergyLedger scalar(kFriction);
  EXPECT_EQ(vector.observe(Vec3(0, -2, 0), Vec3(0, 0.003, 0), milliseconds(1)),
            scalar.observe(Vec1(-2), Vec1(0.003), milliseconds(1)));
}

TEST(EnergyLedger, FreezesOnWhatIsNotANumber) {
  EnergyLedger ledger(kFriction);
  const double before = ledger.observe(Vec3(-1, 0, 0), Vec3(1e-3, 0, 0), milliseconds(1));
  EXPECT_EQ(ledger.observe(Vec3(kNaN, 0, 0), Vec3(1e-3, 0, 0), milliseconds(1)), before);
  EXPECT_EQ(ledger.observe(Vec3(1, 0, 0), Vec3(kNaN, 0, 0), milliseconds(1)), before);
  EXPECT_EQ(ledger.observe(Vec3(1, 0, 0), Vec3(std::numeric_limits<double>::infinity(), 0, 0), milliseconds(1)),
            before);
  EXPECT_EQ(ledger.observe_unseen(kNaN, milliseconds(1)), before);
}

TEST(EnergyLedger, EarnsNothingFromViscosityInNoTime) {
  EnergyLedger ledger({0, 0.26});
  EXPECT_EQ(ledger.observe(Vec3::Zero().eval(), Vec3(1e-3, 0, 0), Duration::zero()), 0);
}

TEST(EnergyLedger, ChargesAnUnseenIntervalAtLeastAsMuchAsAnySeenOne) {
  const double force = 3;
  EnergyLedger unseen(kFriction);
  unseen.observe_unseen(force, milliseconds(2));
  double worst = 0;
  for (int i = -2000; i <= 2000; ++i) {
    EnergyLedger seen(kFriction);
    worst = std::min(worst, seen.observe(Vec1(force), Vec1(i * 1e-5), milliseconds(2)));
  }
  EXPECT_LE(unseen.energy(), worst);
  EXPECT_NEAR(unseen.energy(), worst, 1e-6);  // the bound is tight
}

TEST(EnergyLedger, RefusesImpossibleFriction) {
  EXPECT_THROW(EnergyLedger({-0.1, 0}), std::invalid_argument);
  EXPECT_THROW(EnergyLedger({0, -0.1}), std::invalid_argument);
  EXPECT_THROW(EnergyLedger({kNaN, 0}), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::energy_ledger_test
