// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "clients/softbody/models/linear.h"

namespace tendon::softbody {

/// MPI and PETSc, from the beginning to the end of a program. Everything below is to be called by all ranks alike.
class Ranks {
 public:
  /// Takes from the command line what PETSc and MPI want of it. Throws std::runtime_error when they do not start.
  Ranks(int& argc, char**& argv);
  ~Ranks();
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  int rank() const noexcept;  ///< this one's number; 0 reads and writes
  int count() const noexcept;
};

/// How K u = f is solved.
enum class Method : std::uint8_t {
  kChosen,     ///< a factor below kMostForFactor unknowns and above kMostPoisson, multigrid else
  kFactor,     ///< MUMPS' Cholesky factor
  kMultigrid,  ///< conjugate gradients; geometric multigrid where the nodes fill a grid (grid_levels.h), PETSc's GAMG else
};
inline constexpr int kMostForFactor = 100'000;
/// Near incompressibility multigrid wants hundreds of rounds.
inline constexpr double kMostPoisson = 0.49;

/// Linear elasticity, K u = f, by PETSc on all ranks: each assembles the rows that it keeps, which have the same bits on
/// any number of ranks. The environment variable PETSC_OPTIONS chooses otherwise
/// ("-ksp_type cg -pc_type gamg -ksp_rtol 1e-10"). Loads and solutions are whole on every rank.
///
/// By multigrid solve() ends at 1e-10 of the energy. solve_roughly() begins with what the last ten answers say of this
/// one (Fischer 1998) and ends when, with the residual r = f − K u and M the multigrid,
///
///     fᵀ K⁻¹ f = fᵀ u + uᵀ r + rᵀ K⁻¹ r,    0 ≤ rᵀ K⁻¹ r ≤ rᵀ M r / λ ≤ kRough · fᵀ K⁻¹ f
///
/// where λ is 0.8 of the least Ritz value of M K, which a first, exact solution has found.
///
/// With the same number of ranks the same bytes; across numbers of ranks equal to some 1e-12 of the largest (factor) or
/// to the tolerance. The mesh is whole on every rank, too: that ends at some 10⁶ unknowns.
///
/// Throws std::runtime_error with PETSc's sentence when something fails, and when a solver does not converge. The
/// solid's law counts as linear. Nothing of the solid is kept.
std::unique_ptr<Solver> on_ranks(const Solid& solid, Method method = Method::kChosen);
inline constexpr double kRough = 1e-3;

/// Shares bytes out from rank 0 to all.
void share_out(std::vector<std::byte>& bytes);
/// Ends all ranks at once: from one that cannot go on, while others wait for it.
[[noreturn]] void end_all_ranks();

}  // namespace tendon::softbody
