// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <vector>

namespace tendon::softbody {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A symmetric sparse matrix: its lower triangle by columns, row indices ascending.
struct SymmetricMatrix {
  int size = 0;
  std::vector<int> column_starts;  ///< size + 1
  std::vector<int> rows;
  std::vector<double> values;

  VectorXd times(const VectorXd& x) const;
  int slot(int row, int column) const;  ///< where an entry of the lower triangle is in `values`; it must be there
  std::size_t bytes() const noexcept;
};

/// The Cholesky factor of a symmetric positive definite matrix (CHOLMOD, supernodal). The order of elimination is found
/// once for a pattern; factorize() does the rest again for new values.
///
/// Thread-safe: no. Realtime-safe: no.
class Factor {
 public:
  /// Finds the order of elimination; has no values yet.
  explicit Factor(const SymmetricMatrix& pattern);
  ~Factor();
  Factor(Factor&&) noexcept;
  Factor& operator=(Factor&&) noexcept;

  /// False when the matrix is not positive definite; the factor then has no values.
  [[nodiscard]] bool factorize(const SymmetricMatrix& matrix);

  /// x with A x = b; of each column.
  MatrixXd solve(const MatrixXd& b) const;

  std::size_t bytes() const noexcept;

 private:
  struct Cholmod;  // keeps CHOLMOD and Eigen/Sparse out of this header
  std::unique_ptr<Cholmod> cholmod_;
};

}  // namespace tendon::softbody
