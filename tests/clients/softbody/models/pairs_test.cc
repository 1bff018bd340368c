// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/models/pairs.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <utility>
#include <vector>

#include "tests/support/dice.h"

namespace tendon::softbody::pairs_test {
namespace {

constexpr int kSize = 20;

VectorXd drawn(Dice& dice) {
  VectorXd all(kSize);
  for (double& one : all) one = dice.within(-1, 1);
  return all;
}

struct Drawn {
  explicit Drawn(Dice& dice) : older(kSize, kSize), now(kSize, kSize) {
    for (double& one : older.reshaped()) one = dice.within(-1, 1);
    older = (older * older.transpose()).eval() + MatrixXd::Identity(kSize, kSize);
    now = older;
    for (int i = 0; i < 3; ++i) {
      const VectorXd along = drawn(dice);
      now += along * along.transpose();
    }
    inverse = older.inverse();
  }
  MatrixXd older;
  MatrixXd now;
  MatrixXd inverse;
};

TEST(Pairs, AreTheInverseOfTheFactorBroughtAlongByTheLastEight) {
  Dice dice(1);
  const Drawn drawn_one(dice);
  Pairs pairs;
  std::vector<std::pair<VectorXd, VectorXd>> all;
  for (int i = 0; i < 12; ++i) {
    const VectorXd step = drawn(dice);
    const VectorXd change = drawn_one.now * step;
    pairs.add(step, change, drawn_one.inverse * change);
    all.emplace_back(step, change);
    MatrixXd expected = drawn_one.inverse;  // textbook BFGS
    for (std::size_t k = all.size() < Pairs::kMost ? 0 : all.size() - Pairs::kMost; k < all.size(); ++k) {
      const auto& [s, y] = all[k];
      const MatrixXd one = MatrixXd::Identity(kSize, kSize) - s * y.transpose() / y.dot(s);
      expected = (one * expected * one.transpose() + s * s.transpose() / y.dot(s)).eval();
    }
    const VectorXd b = drawn(dice);
    EXPECT_LT((pairs.times(b, drawn_one.inverse * b) - expected * b).norm(), 1e-10 * (expected * b).norm()) << i;
    EXPECT_LT((pairs.times(change, drawn_one.inverse * change) - step).norm(), 1e-10 * step.norm());
    const std::vector<int> some{3, 7, 8, 19};
    const MatrixXd among = (expected - drawn_one.inverse)(some, some);
    EXPECT_LT((pairs.adds(some) - among).norm(), 1e-9 * among.norm()) << i;
  }
  EXPECT_EQ(pairs.count(), Pairs::kMost);
}

TEST(Pairs, AStepWithoutStiffnessTeachesNothing) {
  Dice dice(2);
  const Drawn drawn_one(dice);
  Pairs pairs;
  const VectorXd step = drawn(dice);
  pairs.add(step, -step, drawn_one.inverse * -step);
  pairs.add(step, VectorXd::Zero(kSize), VectorXd::Zero(kSize));
  EXPECT_EQ(pairs.count(), 0);
  EXPECT_EQ(pairs.times(step, drawn_one.inverse * step), drawn_one.inverse * step);
}

}  // namespace
}  // namespace tendon::softbody::pairs_test
