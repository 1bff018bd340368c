// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/mpi/spread_solver.h"

#include <petscksp.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "clients/softbody/mpi/grid_levels.h"

namespace tendon::softbody {
namespace {

void check(PetscErrorCode code) {
  if (code == 0) return;
  const char* text = nullptr;
  char* more = nullptr;
  PetscErrorMessage(code, &text, &more);
  throw std::runtime_error("PETSc: " + std::string(text != nullptr ? text : "an unknown error") +
                           (more != nullptr && *more != '\0' ? std::string(": ") + more : std::string()));
}

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
using Vector = Owned<Vec, VecDestroy>;
using NullSpace = Owned<MatNullSpace, MatNullSpaceDestroy>;

constexpr double kFineTolerance = 1e-10;
constexpr int kRemembered = 10;

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

PetscInt share(PetscInt whole, int index, int parts) {
  return static_cast<PetscInt>(static_cast<std::int64_t>(whole) * index / parts);
}

/// Σ V (λ gᵢ gⱼᵀ + µ (gⱼ gᵢᵀ + gᵢ·gⱼ I))
using StiffnessOfElement = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
StiffnessOfElement stiffness_of_element(const Solid& solid, int element) {
  const auto nodes = static_cast<Eigen::Index>(solid.mesh().element(element).size());
  StiffnessOfElement k = StiffnessOfElement::Zero(3 * nodes, 3 * nodes);
  for (int q = 0; q < solid.points_per_element(); ++q) {
    const auto [point, g] = solid.part(element, q);
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
  SpreadSolver(const Solid& solid, Method method)
      : comm_(PETSC_COMM_WORLD),
        size_(solid.free_count()),
        first_(first_row(rank_of(comm_))),
        rows_(first_row(rank_of(comm_) + 1) - first_),
        iterates_(method == Method::kMultigrid ||
                  (method == Method::kChosen && size_ >= kMostForFactor && solid.largest_poisson() <= kMostPoisson)) {
    if (size_ % 3 != 0)
      throw std::invalid_argument("on several ranks, all coordinates of a node must be fixed, or none");
    assemble(solid);
    check(KSPCreate(comm_, krylov_.address()));
    check(KSPSetOperators(krylov_, matrix_, matrix_));
    PC preconditioner = nullptr;
    check(KSPGetPC(krylov_, &preconditioner));
    if (iterates_) {
      iterate(solid, preconditioner);
    } else {
      check(KSPSetType(krylov_, KSPPREONLY));
      check(PCSetType(preconditioner, PCCHOLESKY));
      check(PCFactorSetMatSolverType(preconditioner, MATSOLVERMUMPS));
    }
    check(KSPSetFromOptions(krylov_));
    check(KSPSetUp(krylov_));
    if (iterates_) know_the_spectrum();
  }

  Rough solve_roughly(const VectorXd& load) const override {
    if (!iterates_) return Solver::solve_roughly(load);
    put(load, load_);
    Rough rough;
    // The compliance of the last patch is a good estimate.
    double end = std::sqrt(kRough * least_ * compliance_);
    constexpr int kTries = 4;
    for (int i = 0; i < kTries; ++i) {
      check(KSPSetTolerances(krylov_, compliance_ > 0 ? 1e-14 : kRough, end, PETSC_DEFAULT, kMostRounds));
      check(KSPSolve(krylov_, load_, solution_));
      expect_convergence();
      check(MatMult(matrix_, solution_, residual_));
      check(VecAYPX(residual_, -1, load_));
      PetscReal of_residual = 0;
      check(KSPGetResidualNorm(krylov_, &of_residual));
      PetscScalar by_load = 0;
      PetscScalar by_residual = 0;
      check(VecDot(load_, solution_, &by_load));
      check(VecDot(residual_, solution_, &by_residual));
      rough.compliance = by_load + by_residual;
      rough.missing = of_residual * of_residual / least_;
      if (rough.missing <= kRough * rough.compliance) break;
      end = 0.5 * std::sqrt(kRough * least_ * std::max(rough.compliance, 0.0));
      compliance_ = rough.compliance;
    }
    compliance_ = rough.compliance;
    rough.displacements = gathered(solution_);
    return rough;
  }

  MatrixXd solve(const MatrixXd& loads) const override {
    if (iterates_) {
      check(KSPSetTolerances(krylov_, kFineTolerance, 0, PETSC_DEFAULT, kMostRounds));
      MatrixXd solutions(size_, loads.cols());
      for (Eigen::Index j = 0; j < loads.cols(); ++j) {
        put(loads.col(j), load_);
        check(KSPSolve(krylov_, load_, solution_));
        expect_convergence();
        solutions.col(j) = gathered(solution_);
      }
      return solutions;
    }
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
    expect_convergence();
    return gathered(left, loads.cols());
  }

 private:
  static constexpr PetscInt kMostRounds = 1000;

  PetscInt first_row(int rank) const { return 3 * share(size_ / 3, rank, count_of(comm_)); }  // ranks own whole nodes

  void expect_convergence() const {
    KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
    check(KSPGetConvergedReason(krylov_, &reason));
    if (reason < 0) {
      throw std::runtime_error("PETSc: the solver did not converge (" + std::string(KSPConvergedReasons[reason]) + ")");
    }
  }

  void iterate(const Solid& solid, PC preconditioner) {
    check(KSPSetType(krylov_, KSPCG));
    check(KSPSetNormType(krylov_, KSP_NORM_NATURAL));
    check(KSPSetComputeSingularValues(krylov_, PETSC_TRUE));  // must precede KSPSetUp
    check(MatCreateVecs(matrix_, solution_.address(), load_.address()));
    check(VecDuplicate(load_, residual_.address()));
    const std::vector<GridLevel> levels = grid_levels(solid);
    if (levels.empty()) {
      send_rigid_motions(solid);
      check(PCSetType(preconditioner, PCGAMG));
      return;
    }
    check(PCSetType(preconditioner, PCMG));
    check(PCMGSetLevels(preconditioner, static_cast<PetscInt>(levels.size()) + 1, nullptr));
    check(PCMGSetGalerkin(preconditioner, PC_MG_GALERKIN_BOTH));
    for (std::size_t i = 0; i < levels.size(); ++i) {
      Matrix interpolation;
      make_interpolation(levels[i], interpolation);
      const auto level = static_cast<PetscInt>(levels.size() - i);
      check(PCMGSetInterpolation(preconditioner, level, interpolation));
      // Chebyshev with Jacobi needs twice the iterations of SOR, but a third of the time.
      KSP smoother = nullptr;
      PC diagonal = nullptr;
      check(PCMGGetSmoother(preconditioner, level, &smoother));
      check(KSPGetPC(smoother, &diagonal));
      check(PCSetType(diagonal, PCJACOBI));
    }
  }

  void make_interpolation(const GridLevel& level, Matrix& to) const {
    const auto share_of = [&](std::size_t nodes, int rank) {
      return share(static_cast<PetscInt>(nodes), rank, count_of(comm_));
    };
    const int rank = rank_of(comm_);
    const PetscInt from = share_of(level.rows.size(), rank);
    const PetscInt till = share_of(level.rows.size(), rank + 1);
    const auto coarse = static_cast<std::size_t>(level.nodes);
    const PetscInt columns = 3 * (share_of(coarse, rank + 1) - share_of(coarse, rank));
    check(MatCreate(comm_, to.address()));
    check(MatSetSizes(to, 3 * (till - from), columns, 3 * static_cast<PetscInt>(level.rows.size()), 3 * level.nodes));
    check(MatSetType(to, MATAIJ));
    std::vector<PetscInt> rows;
    std::vector<PetscInt> across;
    std::vector<PetscScalar> values;
    for (PetscInt node = from; node < till; ++node) {
      for (const GridLevel::Weight& weight : level.rows[static_cast<std::size_t>(node)]) {
        for (PetscInt c = 0; c < 3; ++c) {
          rows.push_back(3 * node + c);
          across.push_back(3 * weight.node + c);
          values.push_back(weight.value);
        }
      }
    }
    check(MatSetPreallocationCOO(to, static_cast<PetscCount>(values.size()), rows.data(), across.data()));
    check(MatSetValuesCOO(to, values.data(), INSERT_VALUES));
  }

  void send_rigid_motions(const Solid& solid) {
    Vector places;
    check(VecCreate(comm_, places.address()));
    check(VecSetSizes(places, rows_, size_));
    check(VecSetBlockSize(places, 3));
    check(VecSetUp(places));
    VectorXd all(solid.size());
    for (std::size_t i = 0; i < solid.mesh().nodes.size(); ++i) {
      all.segment<3>(3 * static_cast<Eigen::Index>(i)) = solid.mesh().nodes[i];
    }
    put(solid.to_free(all), places);
    NullSpace motions;
    check(MatNullSpaceCreateRigidBody(places, motions.address()));
    check(MatSetNearNullSpace(matrix_, motions));
  }

  void know_the_spectrum() {
    VectorXd load(size_);  // the same pseudorandom numbers on every rank
    std::uint64_t state = 1;
    for (double& entry : load) {
      state = state * 6364136223846793005ULL + 1442695040888963407ULL;
      entry = static_cast<double>(state >> 40U) / (1U << 24U) - 0.5;
    }
    put(load, load_);
    check(KSPSetTolerances(krylov_, kFineTolerance, 0, PETSC_DEFAULT, kMostRounds));
    check(KSPSolve(krylov_, load_, solution_));
    expect_convergence();
    PetscReal most = 0;
    PetscReal least = 0;
    check(KSPComputeExtremeSingularValues(krylov_, &most, &least));
    check(KSPSetComputeSingularValues(krylov_, PETSC_FALSE));
    if (!(least > 0)) throw std::runtime_error("PETSc: the body can still move as a whole: expected more fixed nodes");
    least_ = 0.8 * least;
    check(KSPSetUseFischerGuess(krylov_, 1, kRemembered));
  }

  void put(const VectorXd& from, Vec to) const {
    PetscScalar* values = nullptr;
    check(VecGetArrayWrite(to, &values));
    for (PetscInt i = 0; i < rows_; ++i) values[i] = from[first_ + i];
    check(VecRestoreArrayWrite(to, &values));
  }

  /// Rows are assembled without communication, and have the same bits for any number of ranks.
  void assemble(const Solid& solid) {
    const Mesh& mesh = solid.mesh();
    const PetscInt first = first_ / 3;
    const PetscInt mine = rows_ / 3;
    const auto free_node = [&](int node) {
      const int free = solid.free_of(3 * node);
      return free < 0 ? -1 : free / 3;
    };
    const auto is_mine = [&](int free) { return free >= first && free < first + mine; };
    std::vector<int> elements;
    std::vector<std::vector<int>> beside(static_cast<std::size_t>(mine));
    for (int e = 0; e < mesh.element_count(); ++e) {
      const auto nodes = mesh.element(e);
      const auto touched = elements.size();
      for (const int node : nodes) {
        const int row = free_node(node);
        if (!is_mine(row)) continue;
        if (elements.size() == touched) elements.push_back(e);
        beside[static_cast<std::size_t>(row - first)].push_back(e);
      }
    }
    std::vector<PetscInt> here(static_cast<std::size_t>(mine));
    std::vector<PetscInt> elsewhere(static_cast<std::size_t>(mine));
    std::vector<int> neighbours;
    for (std::size_t row = 0; row < beside.size(); ++row) {
      neighbours.clear();
      for (const int e : beside[row]) {
        for (const int node : mesh.element(e)) {
          if (const int free = free_node(node); free >= 0) neighbours.push_back(free);
        }
      }
      std::ranges::sort(neighbours);
      const auto all = std::unique(neighbours.begin(), neighbours.end()) - neighbours.begin();
      here[row] = static_cast<PetscInt>(std::count_if(neighbours.begin(), neighbours.begin() + all, is_mine));
      elsewhere[row] = static_cast<PetscInt>(all) - here[row];
    }
    check(MatCreate(comm_, matrix_.address()));
    check(MatSetSizes(matrix_, rows_, rows_, size_, size_));
    check(MatSetType(matrix_, MATAIJ));
    check(MatSetBlockSize(matrix_, 3));
    check(MatXAIJSetPreallocation(matrix_, 3, here.data(), elsewhere.data(), nullptr, nullptr));
    check(MatSetOption(matrix_, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
    std::vector<PetscInt> rows;
    std::vector<PetscInt> columns;
    for (const int e : elements) {
      const StiffnessOfElement k = stiffness_of_element(solid, e);
      rows.clear();
      columns.clear();
      for (const int node : mesh.element(e)) {  // PETSc ignores negative numbers
        columns.push_back(free_node(node));
        rows.push_back(is_mine(columns.back()) ? columns.back() : -1);
      }
      const auto count = static_cast<PetscInt>(rows.size());
      check(MatSetValuesBlocked(matrix_, count, rows.data(), count, columns.data(), k.data(), ADD_VALUES));
    }
    check(MatAssemblyBegin(matrix_, MAT_FINAL_ASSEMBLY));
    check(MatAssemblyEnd(matrix_, MAT_FINAL_ASSEMBLY));
    check(MatSetOption(matrix_, MAT_SPD, PETSC_TRUE));
  }

  void gather(const PetscScalar* values, double* whole) const {
    const int ranks = count_of(comm_);
    std::vector<int> sizes(static_cast<std::size_t>(ranks));
    std::vector<int> starts(static_cast<std::size_t>(ranks));
    for (int r = 0; r < ranks; ++r) {
      starts[static_cast<std::size_t>(r)] = first_row(r);
      sizes[static_cast<std::size_t>(r)] = first_row(r + 1) - first_row(r);
    }
    MPI_Allgatherv(values, rows_, MPI_DOUBLE, whole, sizes.data(), starts.data(), MPI_DOUBLE, comm_);
  }
  MatrixXd gathered(Mat spread, Eigen::Index columns) const {
    MatrixXd whole(size_, columns);
    const PetscScalar* values = nullptr;
    PetscInt stride = 0;
    check(MatDenseGetArrayRead(spread, &values));
    check(MatDenseGetLDA(spread, &stride));
    for (Eigen::Index j = 0; j < columns; ++j) gather(values + j * stride, whole.col(j).data());
    check(MatDenseRestoreArrayRead(spread, &values));
    return whole;
  }
  VectorXd gathered(Vec spread) const {
    VectorXd whole(size_);
    const PetscScalar* values = nullptr;
    check(VecGetArrayRead(spread, &values));
    gather(values, whole.data());
    check(VecRestoreArrayRead(spread, &values));
    return whole;
  }

  MPI_Comm comm_;
  PetscInt size_;
  PetscInt first_;
  PetscInt rows_;
  bool iterates_;
  Matrix matrix_;
  Krylov krylov_;
  // For multigrid.
  Vector load_;
  Vector solution_;
  Vector residual_;
  double least_ = 0;
  mutable double compliance_ = 0;  ///< m/N
};

}  // namespace

Ranks::Ranks(int& argc, char**& argv) {
  check(PetscInitialize(&argc, &argv, nullptr, nullptr));
  // check() throws instead.
  PetscPushErrorHandler(PetscIgnoreErrorHandler, nullptr);
}

Ranks::~Ranks() {
  PetscPopErrorHandler();
  PetscFinalize();
}

int Ranks::rank() const noexcept { return rank_of(PETSC_COMM_WORLD); }
int Ranks::count() const noexcept { return count_of(PETSC_COMM_WORLD); }

std::unique_ptr<Solver> on_ranks(const Solid& solid, Method method) {
  return std::make_unique<SpreadSolver>(solid, method);
}

void share_out(std::vector<std::byte>& bytes) {
  auto size = static_cast<std::uint64_t>(bytes.size());
  MPI_Bcast(&size, 1, MPI_UINT64_T, 0, PETSC_COMM_WORLD);
  bytes.resize(size);
  MPI_Bcast(bytes.data(), static_cast<int>(size), MPI_BYTE, 0, PETSC_COMM_WORLD);
}

void end_all_ranks() {
  MPI_Abort(MPI_COMM_WORLD, 1);
  std::abort();
}

}  // namespace tendon::softbody
