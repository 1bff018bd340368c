// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/models/spectrum.h"

#include <Spectra/SymEigsSolver.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "protocol/expect.h"

namespace tendon::softbody::compared {
namespace {

constexpr double kPrecision = 1e-7;
constexpr Eigen::Index kMostRestarts = 1000;

/// With y = M^½ x the problem is symmetric, M^−½ K M^−½ y = ω² y, and its inverse yields the slowest modes first.
template <class Apply>
class Operator {
 public:
  using Scalar = double;  // required by Spectra
  Operator(int size, Apply apply) : size_(size), apply_(std::move(apply)) {}
  Eigen::Index rows() const { return size_; }
  Eigen::Index cols() const { return size_; }
  void perform_op(const double* in, double* out) const {
    Eigen::Map<VectorXd>(out, size_) = apply_(Eigen::Map<const VectorXd>(in, size_));
  }

 private:
  int size_;
  Apply apply_;
};

template <class Apply>
Spectra::SymEigsSolver<Operator<Apply>> largest(Operator<Apply>& op, int count) {
  const auto size = op.rows();
  Spectra::SymEigsSolver<Operator<Apply>> solver(op, count, std::min<Eigen::Index>(size, std::max(2 * count, 20)));
  solver.init();
  if (solver.compute(Spectra::SortRule::LargestAlge, kMostRestarts, kPrecision) < count) {
    throw std::runtime_error(
        "the vibration modes of the body were not found, because the Lanczos method did not converge");
  }
  return solver;
}

MatrixXd dense(const SymmetricMatrix& matrix) {
  MatrixXd all(matrix.size, matrix.size);
  for (int i = 0; i < matrix.size; ++i) all.col(i) = matrix.times(VectorXd::Unit(matrix.size, i));
  return all;
}

}  // namespace

double fastest_swing(const SymmetricMatrix& stiffness, const VectorXd& mass) {
  const VectorXd scale = mass.cwiseSqrt().cwiseInverse();
  Operator op(stiffness.size,
              [&](const auto& y) -> VectorXd { return scale.cwiseProduct(stiffness.times(scale.cwiseProduct(y))); });
  return std::sqrt(largest(op, 1).eigenvalues()[0]);
}

Swings slowest_swings(const SymmetricMatrix& stiffness, const VectorXd& mass, int count) {
  expect(count >= 1 && count <= stiffness.size, "count", count,
         "1 to " + std::to_string(stiffness.size) + ", the number of displacements of the body");
  const VectorXd root = mass.cwiseSqrt();
  const VectorXd scale = root.cwiseInverse();
  Swings swings;
  if (2 * count >= stiffness.size) {  // Lanczos' method needs twice as many vectors
    const Eigensystem all = eigensystem(scale.asDiagonal() * dense(stiffness) * scale.asDiagonal());
    swings.squares = all.values.head(count);
    swings.shapes = all.vectors.leftCols(count);
  } else {
    Factor factor(stiffness);
    if (!factor.factorize(stiffness)) throw std::runtime_error("the body can still move as a whole");
    Operator op(stiffness.size,
                [&](const auto& y) -> VectorXd { return root.cwiseProduct(factor.solve(root.cwiseProduct(y))); });
    const auto solver = largest(op, count);
    swings.squares = solver.eigenvalues().cwiseInverse();
    swings.shapes = solver.eigenvectors();
  }
  swings.shapes = scale.asDiagonal() * swings.shapes;
  return swings;
}

}  // namespace tendon::softbody::compared
