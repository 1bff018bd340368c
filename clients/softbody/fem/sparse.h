// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <vector>

namespace tendon::softbody {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A symmetric sparse matrix: lower triangle in compressed column storage, row indices ascending.
struct SymmetricMatrix {
  int size = 0;
  std::vector<int> column_starts;
  std::vector<int> rows;
  std::vector<double> values;

  VectorXd times(const VectorXd& x) const;
  int slot(int row, int column) const;  ///< index in `values` of an existing entry of the lower triangle
  std::size_t bytes() const noexcept;
};

/// Cholesky factor of a symmetric positive definite matrix (CHOLMOD, supernodal). The fill-reducing ordering is
/// computed once per pattern and reused by factorize(). After split() the pattern is that of the grown matrix, and the
/// next factorize() computes its ordering.
///
/// factorize() sets OpenBLAS to one thread per call for the whole process, and OpenMP to the calling thread only.
///
/// Thread-safe: no; two threads may each use their own factor if factors_may_work_at_once(). Realtime-safe: no.
class Factor {
 public:
  /// Computes the ordering only; there are no values yet.
  explicit Factor(const SymmetricMatrix& pattern);
  ~Factor();
  Factor(Factor&&) noexcept;
  Factor& operator=(Factor&&) noexcept;

  /// Returns false if the matrix is not positive definite; the factor then has no values.
  [[nodiscard]] bool factorize(const SymmetricMatrix& matrix);

  /// Becomes the factor of `grown`: the same matrix after some unknowns were duplicated, with some of their couplings
  /// moved to the twins. The twins follow the old unknowns; `twin_of` gives the original of each. Tying every twin to
  /// its original recovers the old matrix. With d the displacements of the twins relative to their originals, T the map
  /// that ties them, and C the map that moves each twin alone,
  ///
  ///     TᵀAT = the old matrix,   S = CᵀAC − (CᵀAT)(TᵀAT)⁻¹(TᵀAC),   S d = Cᵀb − (CᵀAT)(TᵀAT)⁻¹Tᵀb
  ///
  /// (block elimination with a capacitance matrix, James & Pai 1999): the factor is kept, and each row of S, one per
  /// twin, costs one solve. Returns false without changes if `grown` is not positive definite, or if by CHOLMOD's
  /// operation count all solves since factorize() would exceed the work of a new factor. CHOLMOD's rank updates (Davis
  /// & Hager 1999) are not used: they need the slower simplicial factor, and a twin changes many rows.
  [[nodiscard]] bool split(const SymmetricMatrix& grown, const std::vector<int>& twin_of);

  MatrixXd solve(const MatrixXd& b) const;

  std::size_t bytes() const noexcept;

 private:
  struct Cholmod;  // keeps CHOLMOD and Eigen/Sparse out of this header
  struct Split;
  MatrixXd solve(const MatrixXd& b, std::size_t splits) const;

  std::unique_ptr<Cholmod> cholmod_;
  std::vector<Split> splits_;
};

/// Whether two threads may factorize or solve concurrently, each with its own factor. False with an OpenBLAS built for
/// one thread (libopenblas0-serial), whose shared buffers corrupt most factors.
bool factors_may_work_at_once();

}  // namespace tendon::softbody
