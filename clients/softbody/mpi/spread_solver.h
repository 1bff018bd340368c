// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

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

/// Linear elasticity, K u = f, by PETSc on all ranks: each assembles its share of the elements and keeps its share of
/// the rows. MUMPS makes a Cholesky factor; the environment variable PETSC_OPTIONS chooses otherwise ("-ksp_type cg
/// -pc_type gamg -ksp_rtol 1e-10"). Loads and solutions are whole on every rank.
///
/// With the same number of ranks the same bytes; across numbers of ranks equal to some 1e-12 of the largest. The mesh
/// is whole on every rank, too: that ends at some 10⁶ unknowns.
///
/// Throws std::runtime_error with PETSc's sentence when something fails, and when a solver does not converge. The
/// solid's law counts as linear. Nothing of the solid is kept.
std::unique_ptr<Solver> on_ranks(const Solid& solid);

}  // namespace tendon::softbody
