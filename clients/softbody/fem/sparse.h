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
/// once for a pattern; factorize() does the rest again for new values. After split() the pattern is the grown one,
/// whose order the next factorize() finds.
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

  /// Goes on as the factor of `grown`, which the matrix becomes when some unknowns are given twins that take over a
  /// part of what couples them to others: `grown` has the twins behind the unknowns that there were, `twin_of` says
  /// whose they are, and with every twin held to its own it is the matrix that this is a factor of. With d = how far
  /// the twins are from their own, T all of them held together and C each twin alone,
  ///
  ///     TᵀAT = the old matrix,   S = CᵀAC − (CᵀAT)(TᵀAT)⁻¹(TᵀAC),   S d = Cᵀb − (CᵀAT)(TᵀAT)⁻¹Tᵀb
  ///
  /// (block elimination; a capacitance matrix, James & Pai 1999): the factor stays, and S, one row for each twin, costs
  /// a solution each. False, and nothing is changed, where `grown` is not positive definite, or where all solutions
  /// since factorize() would be more work than a new factor, as CHOLMOD counts. What CHOLMOD has for this itself, rank
  /// updates (Davis & Hager 1999), wants the slower simplicial factor and more of them: a twin changes many rows.
  [[nodiscard]] bool split(const SymmetricMatrix& grown, const std::vector<int>& twin_of);

  /// x with A x = b; of each column.
  MatrixXd solve(const MatrixXd& b) const;

  std::size_t bytes() const noexcept;

 private:
  struct Cholmod;  // keeps CHOLMOD and Eigen/Sparse out of this header
  struct Split;
  MatrixXd solve(const MatrixXd& b, std::size_t splits) const;

  std::unique_ptr<Cholmod> cholmod_;
  std::vector<Split> splits_;
};

}  // namespace tendon::softbody
