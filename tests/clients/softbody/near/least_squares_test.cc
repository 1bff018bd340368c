// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/near/least_squares.h"

#include <gtest/gtest.h>

#include "tests/support/dice.h"

namespace tendon::softbody::least_squares_test {
namespace {

struct Problem {
  MatrixXd g;
  VectorXd b;
  Squares squares() const { return {.gram = g.transpose() * g, .right = g.transpose() * b, .square = b.squaredNorm()}; }
};

MatrixXd drawn(Dice& dice, Eigen::Index rows, Eigen::Index columns) {
  MatrixXd all(rows, columns);
  for (double& entry : all.reshaped()) entry = dice.within(-1, 1);
  return all;
}

TEST(LeastSquares, FewEntriesThatMakeAllOfItAreFound) {
  Dice dice(1);
  Problem problem{.g = drawn(dice, 60, 200), .b = {}};
  VectorXd made = VectorXd::Zero(200);
  for (const Eigen::Index i : {3, 70, 71, 150, 199}) made[i] = dice.within(1, 4);
  problem.b = problem.g * made;
  const VectorXd x = few_not_negative(problem.squares(), 1e-9, 60);
  EXPECT_LE((problem.g * x - problem.b).norm(), 2e-9 * problem.b.norm());
  EXPECT_TRUE((x.array() >= 0).all());
  EXPECT_LE((x.array() > 0).count(), 60);
}

TEST(LeastSquares, NoEntryBecomesNegativeAndTheRestIsTheLeastThatIsLeft) {
  Dice dice(2);
  Problem problem{.g = drawn(dice, 40, 20), .b = {}};
  problem.b = problem.g * drawn(dice, 20, 1);
  const VectorXd x = few_not_negative(problem.squares(), 0, 20);
  EXPECT_TRUE((x.array() >= 0).all());
  // Karush–Kuhn–Tucker: no gradient on the active set, and no other variable would reduce the residual.
  const VectorXd pull = problem.g.transpose() * (problem.b - problem.g * x);
  for (Eigen::Index i = 0; i < 20; ++i) {
    if (x[i] > 0) {
      EXPECT_NEAR(pull[i], 0, 1e-8);
    } else {
      EXPECT_LE(pull[i], 1e-8);
    }
  }
  EXPECT_LT((x.array() > 0).count(), 20);
}

TEST(LeastSquares, ItEndsWhereEnoughIsReachedOrNoMoreAreAllowed) {
  Dice dice(3);
  Problem problem{.g = drawn(dice, 50, 80).cwiseAbs(), .b = {}};
  problem.b = problem.g * VectorXd::Ones(80);
  const VectorXd rough = few_not_negative(problem.squares(), 0.05, 80);
  EXPECT_LE((problem.g * rough - problem.b).norm(), 0.05 * problem.b.norm());
  EXPECT_LT((rough.array() > 0).count(), 20);
  EXPECT_EQ((few_not_negative(problem.squares(), 0, 2).array() > 0).count(), 2);
}

TEST(LeastSquares, WhereEveryEntryWouldHurtAllAreZero) {
  Problem problem{.g = MatrixXd::Ones(4, 3), .b = -VectorXd::Ones(4)};
  EXPECT_EQ(few_not_negative(problem.squares(), 1e-3, 3), VectorXd(VectorXd::Zero(3)));
}

}  // namespace
}  // namespace tendon::softbody::least_squares_test
