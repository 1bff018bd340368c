// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/products.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace tendon::softbody::products_test {
namespace {

TEST(Products, AreThoseOfAMatrixAndOfItsTranspose) {
  for (const Eigen::Index columns : {1, 3, 4, 9}) {
    const MatrixXd m = MatrixXd::Random(12, columns);
    const VectorXd x = VectorXd::Random(columns);
    const VectorXd y = VectorXd::Random(12);
    VectorXd found = VectorXd::Ones(5);
    times(m, x, found);
    EXPECT_LT((found - m * x).norm(), 1e-14);
    times_transposed(m, y, found);
    EXPECT_LT((found - m.transpose() * y).norm(), 1e-14);
  }
}

TEST(Products, RowsThatAreNoMultipleOfFourAreRefused) {
  VectorXd ignored;
  EXPECT_THROW(times(MatrixXd::Zero(5, 2), VectorXd::Zero(2), ignored), std::invalid_argument);
  EXPECT_THROW(times_transposed(MatrixXd::Zero(6, 2), VectorXd::Zero(6), ignored), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::softbody::products_test
