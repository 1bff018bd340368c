// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/shares.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

namespace tendon::shares_test {
namespace {

using std::chrono::milliseconds;

TEST(Shares, AreReachedOnAStraightLineWithinHalfASecond) {
  Shares shares(std::vector{0.7, 0.2, 0.1});
  shares.set(0, 0.1);
  for (int ms = 1; ms <= 500; ++ms) {
    shares.advance(milliseconds(1));
    EXPECT_NEAR(shares[0], 0.7 - 0.6 * ms / 500, 1e-12);
    EXPECT_NEAR(shares[0] + shares[1] + shares[2], 1, 1e-12);
  }
  EXPECT_EQ(shares[0], 0.1);
  EXPECT_NEAR(shares[1], 0.6, 1e-12) << "as 2 to 1, as before";
  EXPECT_NEAR(shares[2], 0.3, 1e-12);
  shares.advance(milliseconds(1000));
  EXPECT_EQ(shares[0], 0.1);
}

TEST(Shares, OfOthersThatHadNothingAreEqual) {
  Shares shares(std::vector{1.0, 0.0, 0.0});
  shares.set(0, 0.4);
  shares.advance(Shares::kHandOver);
  EXPECT_EQ(shares[0], 0.4);
  EXPECT_NEAR(shares[1], 0.3, 1e-15);
  EXPECT_NEAR(shares[2], 0.3, 1e-15);
}

TEST(Shares, ThatAreSetOnTheWayBeginWhereTheyStand) {
  Shares shares(std::vector{1.0, 0.0});
  shares.set(1, 1);
  shares.advance(milliseconds(250));
  EXPECT_NEAR(shares[1], 0.5, 1e-15);
  shares.set(0, 1);
  shares.advance(milliseconds(1));
  EXPECT_NEAR(shares[0], 0.501, 1e-12);
  shares.advance(milliseconds(10000));
  EXPECT_EQ(shares[0], 1);
  EXPECT_EQ(shares[1], 0);
}

TEST(Shares, TakeNothingThatIsNoShare) {
  Shares shares(std::vector{0.5, 0.5});
  for (const double bad : {-0.1, 1.1, std::numeric_limits<double>::quiet_NaN()}) shares.set(0, bad);
  shares.set(2, 1);
  shares.advance(Shares::kHandOver);
  EXPECT_EQ(shares[0], 0.5);
  Shares one(std::vector{1.0});
  one.set(0, 0);
  one.advance(Shares::kHandOver);
  EXPECT_EQ(one[0], 1);
  for (const std::vector<double>& bad :
       {std::vector<double>{}, {0.5}, {0.6, 0.5}, {1.5, -0.5}, {0.2, 0.2, 0.2, 0.2, 0.2}}) {
    EXPECT_THROW(Shares{bad}, std::invalid_argument);
  }
}

}  // namespace
}  // namespace tendon::shares_test
