// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "clients/softbody/models/linear.h"

namespace tendon::softbody {

/// Initializes MPI and PETSc. All functions below are collective.
class Ranks {
 public:
  Ranks(int& argc, char**& argv);  ///< throws std::runtime_error if MPI or PETSc cannot be started
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  int rank() const noexcept;  ///< rank 0 reads and writes files
  int count() const noexcept;
};

enum class Method : std::uint8_t {
  kChosen,  ///< kFactor below kMostForFactor unknowns or above kMostPoisson, else kMultigrid
  kFactor,  ///< MUMPS' Cholesky factor
  /// conjugate gradients, preconditioned by geometric multigrid if the nodes form a grid, else by PETSc's GAMG
  kMultigrid,
};
inline constexpr int kMostForFactor = 100'000;
inline constexpr double kMostPoisson = 0.49;  ///< above this, multigrid needs hundreds of iterations

/// Linear elasticity, K u = f, by PETSc on all ranks. Each rank assembles its own rows; their bits do not depend on the
/// number of ranks. The environment variable PETSC_OPTIONS overrides the solver ("-ksp_type cg -pc_type gamg -ksp_rtol
/// 1e-10"). Loads and solutions are replicated on every rank.
///
/// With multigrid, solve() ends at a relative energy error of 1e-10. solve_roughly() starts from the last ten answers
/// (Fischer 1998) and ends when, with the residual r = f − K u and the multigrid preconditioner M,
///
///     fᵀ K⁻¹ f = fᵀ u + uᵀ r + rᵀ K⁻¹ r,    0 ≤ rᵀ K⁻¹ r ≤ rᵀ M r / λ ≤ kRough · fᵀ K⁻¹ f
///
/// where λ is 0.8 times the smallest Ritz value of M K from a first exact solve.
///
/// Results are byte-identical for the same number of ranks; for others they agree to about 1e-12 of the largest value
/// (factor) or to the tolerance. The mesh is replicated on every rank, which limits it to about 10⁶ unknowns.
///
/// Treats the law as linear. Does not keep the solid. Throws std::runtime_error with PETSc's message on failure or if a
/// solver does not converge.
std::unique_ptr<Solver> on_ranks(const Solid& solid, Method method = Method::kChosen);
inline constexpr double kRough = 1e-3;

void share_out(std::vector<std::byte>& bytes);  ///< sends bytes from rank 0 to all ranks
[[noreturn]] void end_all_ranks();

}  // namespace tendon::softbody
