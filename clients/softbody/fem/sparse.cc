// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/sparse.h"

#include <dlfcn.h>

#include <Eigen/Cholesky>
#include <Eigen/CholmodSupport>
#include <Eigen/Eigenvalues>
#include <Eigen/SparseCore>
#include <algorithm>
#include <stdexcept>
#include <utility>

namespace tendon::softbody {
namespace {

/// A solve needs 4 operations per entry of the factor, which take as long as 6 of a factorization (7803 unknowns).
constexpr double kWorkPerEntry = 6;

using View = Eigen::Map<const Eigen::SparseMatrix<double>>;

View view(const SymmetricMatrix& matrix) {
  return {matrix.size,
          matrix.size,
          static_cast<Eigen::Index>(matrix.rows.size()),
          matrix.column_starts.data(),
          matrix.rows.data(),
          matrix.values.data()};
}

template <class Function>
Function* function_named(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_DEFAULT, name));
}

/// Threads would take longer to synchronize than an answer. OpenBLAS is set for the process. CHOLMOD uses four OpenMP
/// threads whatever OMP_NUM_THREADS is, so each calling thread must disable them.
void one_thread_for_a_factor() {
  const auto told = [](const char* name, int count) {
    auto* const set = function_named<void(int)>(name);
    if (set != nullptr) set(count);
    return true;
  };
  [[maybe_unused]] static const bool openblas = told("openblas_set_num_threads", 1);
  [[maybe_unused]] thread_local const bool openmp = told("omp_set_max_active_levels", 0);
}

}  // namespace

VectorXd SymmetricMatrix::times(const VectorXd& x) const { return view(*this).selfadjointView<Eigen::Lower>() * x; }

int SymmetricMatrix::slot(int row, int column) const {
  const auto begin = rows.begin() + column_starts[static_cast<std::size_t>(column)];
  const auto end = rows.begin() + column_starts[static_cast<std::size_t>(column) + 1];
  return static_cast<int>(std::lower_bound(begin, end, row) - rows.begin());
}

std::size_t SymmetricMatrix::bytes() const noexcept {
  return (column_starts.size() + rows.size()) * sizeof(int) + values.size() * sizeof(double);
}

Eigensystem eigensystem(const MatrixXd& symmetric, bool with_vectors) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(
      symmetric, with_vectors ? Eigen::ComputeEigenvectors : Eigen::EigenvaluesOnly);
  return {solver.eigenvalues(), with_vectors ? solver.eigenvectors() : MatrixXd()};
}

struct Factor::Cholmod {
  Eigen::CholmodSupernodalLLT<Eigen::SparseMatrix<double>, Eigen::Lower> llt;
  void analyze(const SymmetricMatrix& pattern) {
    llt.cholmod().print = 0;  // indefinite matrices are expected
    llt.analyzePattern(view(pattern));
    if (llt.info() != Eigen::Success) throw std::runtime_error("CHOLMOD cannot analyse the matrix");
  }
};

struct Factor::Split {
  std::vector<int> twin_of;
  Eigen::SparseMatrix<double> coupling;  // TᵀAC
  MatrixXd follows;                      // (TᵀAT)⁻¹ TᵀAC
  Eigen::LLT<MatrixXd> openings;         // of S
};

Factor::Factor(const SymmetricMatrix& pattern) : cholmod_(new Cholmod) { cholmod_->analyze(pattern); }

Factor::~Factor() = default;
Factor::Factor(Factor&&) noexcept = default;
Factor& Factor::operator=(Factor&&) noexcept = default;

bool Factor::factorize(const SymmetricMatrix& matrix) {
  if (!splits_.empty()) cholmod_->analyze(matrix);
  splits_.clear();
  one_thread_for_a_factor();
  cholmod_->llt.factorize(view(matrix));
  return cholmod_->llt.info() == Eigen::Success;
}

bool Factor::split(const SymmetricMatrix& grown, const std::vector<int>& twin_of) {
  const auto count = static_cast<Eigen::Index>(twin_of.size());
  const Eigen::Index before = grown.size - count;
  auto twins = static_cast<double>(count);
  for (const Split& split : splits_) twins += static_cast<double>(split.twin_of.size());
  const auto& counts = cholmod_->llt.cholmod();
  if (twins * kWorkPerEntry * counts.lnz > counts.fl) return false;

  Split split{twin_of, {before, count}, {}, {}};
  MatrixXd among = MatrixXd::Zero(count, count);
  std::vector<Eigen::Triplet<double>> entries;
  const auto own = [&](Eigen::Index i) {
    return i < before ? static_cast<int>(i) : twin_of[static_cast<std::size_t>(i - before)];
  };
  for (int column = 0; column < grown.size; ++column) {
    for (int k = grown.column_starts[static_cast<std::size_t>(column)];
         k < grown.column_starts[static_cast<std::size_t>(column) + 1]; ++k) {
      const int row = grown.rows[static_cast<std::size_t>(k)];
      if (row < before) continue;
      const double value = grown.values[static_cast<std::size_t>(k)];
      entries.emplace_back(own(column), row - static_cast<int>(before), value);
      if (column < before) continue;
      among(row - before, column - before) = among(column - before, row - before) = value;
      if (row != column) entries.emplace_back(own(row), column - static_cast<int>(before), value);
    }
  }
  split.coupling.setFromTriplets(entries.begin(), entries.end());
  split.follows = solve(MatrixXd(split.coupling));
  split.openings.compute(among - split.coupling.transpose() * split.follows);
  if (split.openings.info() != Eigen::Success) return false;
  splits_.push_back(std::move(split));
  return true;
}

MatrixXd Factor::solve(const MatrixXd& b) const {
  if (!splits_.empty()) return solve(b, splits_.size());
  return cholmod_->llt.solve(b);
}

MatrixXd Factor::solve(const MatrixXd& b, std::size_t splits) const {
  if (splits == 0) return cholmod_->llt.solve(b);
  const Split& split = splits_[splits - 1];
  const Eigen::Index before = split.coupling.rows();
  const Eigen::Index count = split.coupling.cols();
  MatrixXd together = b.topRows(before);
  for (Eigen::Index i = 0; i < count; ++i) {
    together.row(split.twin_of[static_cast<std::size_t>(i)]) += b.row(before + i);
  }
  together = solve(together, splits - 1);
  const MatrixXd opening = split.openings.solve(b.bottomRows(count) - split.coupling.transpose() * together);
  MatrixXd x(b.rows(), b.cols());
  x.topRows(before) = together - split.follows * opening;
  for (Eigen::Index i = 0; i < count; ++i) {
    x.row(before + i) = x.row(split.twin_of[static_cast<std::size_t>(i)]) + opening.row(i);
  }
  return x;
}

std::size_t Factor::bytes() const noexcept {
  std::size_t sum = cholmod_->llt.cholmod().memory_inuse;
  for (const Split& split : splits_) {
    sum += split.twin_of.size() * sizeof(int) +
           static_cast<std::size_t>(split.follows.size() + split.openings.matrixLLT().size()) * sizeof(double) +
           static_cast<std::size_t>(split.coupling.nonZeros()) * (sizeof(double) + sizeof(int));
  }
  return sum;
}

bool factors_may_work_at_once() {
  auto* const parallel = function_named<int()>("openblas_get_parallel");
  return parallel == nullptr || parallel() != 0;  // 0: built for one thread
}

}  // namespace tendon::softbody
