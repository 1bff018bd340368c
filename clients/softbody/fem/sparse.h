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

/// A = V diag(λ) Vᵀ of a symmetric A, with λ ascending. Only uses the lower triangle of A. `vectors` is empty without
/// `with_vectors`.
struct Eigensystem {
  VectorXd values;
  MatrixXd vectors;
};
Eigensystem eigensystem(const MatrixXd& symmetric, bool with_vectors = true);

/// The Cholesky factor of a symmetric positive definite matrix (CHOLMOD, supernodal). The ordering is computed once for
/// each pattern. factorize() limits OpenBLAS to one thread in the whole process, and OpenMP to the calling thread.
/// Thread-safe: no, but two threads can use different factors if factors_may_work_at_once(). Realtime-safe: no.
class Factor {
 public:
  explicit Factor(const SymmetricMatrix& pattern);  ///< computes the ordering only; there are no values yet
  ~Factor();
  Factor(Factor&&) noexcept;
  Factor& operator=(Factor&&) noexcept;

  [[nodiscard]] bool factorize(const SymmetricMatrix& matrix);  ///< false, without values: not positive definite

  /// Changes the factor to that of `grown`, in which some unknowns have twins. The twins follow the old unknowns, and
  /// `twin_of` contains their originals. If the twins are tied to their originals, `grown` is equal to the old matrix.
  /// T maps to tied twins, C moves only the twins, and d are the distances of the twins from their originals:
  ///
  ///     TᵀAT = the old matrix,   S = CᵀAC − (CᵀAT)(TᵀAT)⁻¹(TᵀAC),   S d = Cᵀb − (CᵀAT)(TᵀAT)⁻¹Tᵀb
  ///
  /// This is block elimination with a capacitance matrix (James & Pai 1999). It needs one solve for each twin. Returns
  /// false if `grown` is not positive definite, or if a new factor needs fewer operations than all solves since
  /// factorize(). CHOLMOD can update a factor (Davis & Hager 1999), but only the slower simplicial factor.
  [[nodiscard]] bool split(const SymmetricMatrix& grown, const std::vector<int>& twin_of);

  MatrixXd solve(const MatrixXd& b) const;

  std::size_t bytes() const noexcept;

 private:
  struct Cholmod;
  struct Split;
  MatrixXd solve(const MatrixXd& b, std::size_t splits) const;

  std::unique_ptr<Cholmod> cholmod_;
  std::vector<Split> splits_;
};

/// Returns false if two threads must not use factors at the same time. This is the case for an OpenBLAS that was built
/// for one thread (libopenblas0-serial), because its buffers are shared and the factors would be wrong.
bool factors_may_work_at_once();

}  // namespace tendon::softbody
