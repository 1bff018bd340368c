// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/mpi/spread_solver.h"

#include <petscksp.h>

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace tendon::softbody {
namespace {

/// Throws what PETSc says.
void check(PetscErrorCode code) {
  if (code == 0) return;
  const char* text = nullptr;
  char* more = nullptr;
  PetscErrorMessage(code, &text, &more);
  throw std::runtime_error("PETSc: " + std::string(text != nullptr ? text : "an unknown error") +
                           (more != nullptr && *more != '\0' ? std::string(": ") + more : std::string()));
}

/// One of PETSc's objects, destroyed at the end.
template <class Handle, PetscErrorCode (*kDestroy)(Handle*)>
class Owned {
 public:
  Owned() = default;
  ~Owned() {
    if (handle_ != nullptr) kDestroy(&handle_);
  }
  Owned(const Owned&) = delete;
  Owned& operator=(const Owned&) = delete;
  operator Handle() const { return handle_; }  // NOLINT(google-explicit-constructor): it stands for it
  Handle* address() { return &handle_; }

 private:
  Handle handle_ = nullptr;
};
using Matrix = Owned<Mat, MatDestroy>;
using Krylov = Owned<KSP, KSPDestroy>;

int rank_of(MPI_Comm comm) {
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  return rank;
}

int count_of(MPI_Comm comm) {
  int count = 1;
  MPI_Comm_size(comm, &count);
  return count;
}

/// The share of `whole` that begins at rank `index` of `parts`.
PetscInt share(PetscInt whole, int index, int parts) {
  return static_cast<PetscInt>(static_cast<std::int64_t>(whole) * index / parts);
}

/// The stiffness of an element of linear, isotropic material: Σ V (λ gᵢ gⱼᵀ + µ (gⱼ gᵢᵀ + gᵢ·gⱼ)).
MatrixXd stiffness_of_element(const Solid& solid, int element) {
  const auto nodes = static_cast<Eigen::Index>(solid.mesh().element(element).size());
  MatrixXd k = MatrixXd::Zero(3 * nodes, 3 * nodes);
  for (int q = 0; q < solid.points_per_element(); ++q) {
    const Solid::Point& point = solid.point(element, q);
    const auto g = solid.gradient(element, q);
    for (Eigen::Index i = 0; i < nodes; ++i) {
      for (Eigen::Index j = 0; j < nodes; ++j) {
        k.block<3, 3>(3 * i, 3 * j) += point.volume * (point.lambda * g.col(i) * g.col(j).transpose() +
                                                       point.mu * g.col(j) * g.col(i).transpose() +
                                                       point.mu * g.col(i).dot(g.col(j)) * Mat3::Identity());
      }
    }
  }
  return k;
}

class SpreadSolver : public Solver {
 public:
  explicit SpreadSolver(const Solid& solid)
      : comm_(PETSC_COMM_WORLD),
        size_(solid.free_count()),
        first_(share(size_, rank_of(comm_), count_of(comm_))),
        rows_(share(size_, rank_of(comm_) + 1, count_of(comm_)) - first_) {
    assemble(solid);
    check(KSPCreate(comm_, krylov_.address()));
    check(KSPSetOperators(krylov_, matrix_, matrix_));
    check(KSPSetType(krylov_, KSPPREONLY));
    PC preconditioner = nullptr;
    check(KSPGetPC(krylov_, &preconditioner));
    check(PCSetType(preconditioner, PCCHOLESKY));
    check(PCFactorSetMatSolverType(preconditioner, MATSOLVERMUMPS));
    check(KSPSetFromOptions(krylov_));
    check(KSPSetUp(krylov_));
  }

  MatrixXd solve(const MatrixXd& loads) const override {
    const auto columns = static_cast<PetscInt>(loads.cols());
    Matrix right;
    Matrix left;
    check(MatCreateDense(comm_, rows_, PETSC_DECIDE, size_, columns, nullptr, right.address()));
    PetscScalar* values = nullptr;
    PetscInt stride = 0;
    check(MatDenseGetArrayWrite(right, &values));
    check(MatDenseGetLDA(right, &stride));
    for (PetscInt j = 0; j < columns; ++j) {
      for (PetscInt i = 0; i < rows_; ++i) values[j * stride + i] = loads(first_ + i, j);
    }
    check(MatDenseRestoreArrayWrite(right, &values));
    check(MatDuplicate(right, MAT_DO_NOT_COPY_VALUES, left.address()));
    check(KSPMatSolve(krylov_, right, left));
    KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
    check(KSPGetConvergedReason(krylov_, &reason));
    if (reason < 0) {
      throw std::runtime_error("PETSc: the solver did not converge (" + std::string(KSPConvergedReasons[reason]) + ")");
    }
    return gathered(left, loads.cols());
  }

 private:
  void assemble(const Solid& solid) {
    const int elements = solid.mesh().element_count();
    const PetscInt from = share(elements, rank_of(comm_), count_of(comm_));
    const PetscInt to = share(elements, rank_of(comm_) + 1, count_of(comm_));
    std::vector<PetscInt> rows;
    std::vector<PetscInt> columns;
    std::vector<PetscScalar> values;
    for (PetscInt e = from; e < to; ++e) {
      const MatrixXd k = stiffness_of_element(solid, e);
      const auto nodes = solid.mesh().element(e);
      const auto free = [&](Eigen::Index i) {
        return solid.free_of(3 * nodes[static_cast<std::size_t>(i / 3)] + static_cast<int>(i % 3));
      };
      for (Eigen::Index i = 0; i < k.rows(); ++i) {
        for (Eigen::Index j = 0; j < k.cols(); ++j) {
          if (free(i) < 0 || free(j) < 0) continue;
          rows.push_back(free(i));
          columns.push_back(free(j));
          values.push_back(k(i, j));
        }
      }
    }
    check(MatCreate(comm_, matrix_.address()));
    check(MatSetSizes(matrix_, rows_, rows_, size_, size_));
    check(MatSetType(matrix_, MATAIJ));
    check(MatSetPreallocationCOO(matrix_, static_cast<PetscCount>(values.size()), rows.data(), columns.data()));
    check(MatSetValuesCOO(matrix_, values.data(), ADD_VALUES));
    check(MatSetOption(matrix_, MAT_SPD, PETSC_TRUE));
  }

  /// All rows, on every rank.
  MatrixXd gathered(Mat spread, Eigen::Index columns) const {
    const int ranks = count_of(comm_);
    std::vector<int> sizes(static_cast<std::size_t>(ranks));
    std::vector<int> starts(static_cast<std::size_t>(ranks));
    for (int r = 0; r < ranks; ++r) {
      starts[static_cast<std::size_t>(r)] = share(size_, r, ranks);
      sizes[static_cast<std::size_t>(r)] = share(size_, r + 1, ranks) - share(size_, r, ranks);
    }
    MatrixXd whole(size_, columns);
    const PetscScalar* values = nullptr;
    PetscInt stride = 0;
    check(MatDenseGetArrayRead(spread, &values));
    check(MatDenseGetLDA(spread, &stride));
    for (Eigen::Index j = 0; j < columns; ++j) {
      MPI_Allgatherv(values + j * stride, rows_, MPI_DOUBLE, whole.col(j).data(), sizes.data(), starts.data(),
                     MPI_DOUBLE, comm_);
    }
    check(MatDenseRestoreArrayRead(spread, &values));
    return whole;
  }

  MPI_Comm comm_;
  PetscInt size_;
  PetscInt first_;
  PetscInt rows_;
  Matrix matrix_;
  Krylov krylov_;
};

}  // namespace

Ranks::Ranks(int& argc, char**& argv) {
  check(PetscInitialize(&argc, &argv, nullptr, nullptr));
  // What fails is thrown, and said once.
  PetscPushErrorHandler(PetscIgnoreErrorHandler, nullptr);
}

Ranks::~Ranks() {
  PetscPopErrorHandler();
  PetscFinalize();
}

int Ranks::rank() const noexcept { return rank_of(PETSC_COMM_WORLD); }
int Ranks::count() const noexcept { return count_of(PETSC_COMM_WORLD); }

std::unique_ptr<Solver> on_ranks(const Solid& solid) { return std::make_unique<SpreadSolver>(solid); }

}  // namespace tendon::softbody
