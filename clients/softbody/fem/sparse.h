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
/// once for each pattern; factorize() then uses it for new values. After split() the pattern is the grown one, and the
/// next factorize() finds its order.
///
/// factorize() tells OpenBLAS to use one thread for each call, in the whole process, and OpenMP to use none beside the
/// calling thread.
///
/// Thread-safe: no; two threads may each have their own where factors_may_work_at_once(). Realtime-safe: no.
class Factor {
 public:
  /// Finds the order of elimination; has no values yet.
  explicit Factor(const SymmetricMatrix& pattern);
  ~Factor();
  Factor(Factor&&) noexcept;
  Factor& operator=(Factor&&) noexcept;

  /// False when the matrix is not positive definite; the factor then has no values.
  [[nodiscard]] bool factorize(const SymmetricMatrix& matrix);

  /// Becomes the factor of `grown`: the same matrix after some unknowns got twins, which take over some of their
  /// coupling to other unknowns. In `grown` the twins come after the old unknowns; `twin_of` names the original of
  /// each. With every twin tied to its original, `grown` is the old matrix. With d the distances of the twins from
  /// their originals, T the map that ties them and C the map that moves each twin alone,
  ///
  ///     TᵀAT = the old matrix,   S = CᵀAC − (CᵀAT)(TᵀAT)⁻¹(TᵀAC),   S d = Cᵀb − (CᵀAT)(TᵀAT)⁻¹Tᵀb
  ///
  /// (block elimination; a capacitance matrix, James & Pai 1999): the factor stays, and each row of S, one for each
  /// twin, costs one solution. False, and nothing changes, when `grown` is not positive definite, or when by CHOLMOD's
  /// count all solutions since factorize() would be more work than a new factor. CHOLMOD's own rank updates (Davis &
  /// Hager 1999) need the slower simplicial factor, and many of them, because a twin changes many rows.
  [[nodiscard]] bool split(const SymmetricMatrix& grown, const std::vector<int>& twin_of);

  /// Solves A x = b for each column.
  MatrixXd solve(const MatrixXd& b) const;

  std::size_t bytes() const noexcept;

 private:
  struct Cholmod;  // keeps CHOLMOD and Eigen/Sparse out of this header
  struct Split;
  MatrixXd solve(const MatrixXd& b, std::size_t splits) const;

  std::unique_ptr<Cholmod> cholmod_;
  std::vector<Split> splits_;
};

/// Whether two threads may make or use factors at once, each its own. False where the BLAS is an OpenBLAS that was built
/// for one thread (libopenblas0-serial): it hands the same buffers to both, and most factors come out wrong.
bool factors_may_work_at_once();

}  // namespace tendon::softbody
