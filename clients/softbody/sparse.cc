// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/sparse.h"

#include <Eigen/CholmodSupport>
#include <Eigen/SparseCore>
#include <algorithm>
#include <stdexcept>

namespace tendon::softbody {
namespace {

using View = Eigen::Map<const Eigen::SparseMatrix<double>>;

View view(const SymmetricMatrix& matrix) {
  return {matrix.size,
          matrix.size,
          static_cast<Eigen::Index>(matrix.rows.size()),
          matrix.column_starts.data(),
          matrix.rows.data(),
          matrix.values.data()};
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

struct Factor::Cholmod {
  Eigen::CholmodSupernodalLLT<Eigen::SparseMatrix<double>, Eigen::Lower> llt;
};

Factor::Factor(const SymmetricMatrix& pattern) : cholmod_(new Cholmod) {
  cholmod_->llt.cholmod().print = 0;  // what is not definite is an answer, not a message
  cholmod_->llt.analyzePattern(view(pattern));
  if (cholmod_->llt.info() != Eigen::Success) throw std::runtime_error("CHOLMOD cannot analyse the matrix");
}

Factor::~Factor() = default;
Factor::Factor(Factor&&) noexcept = default;
Factor& Factor::operator=(Factor&&) noexcept = default;

bool Factor::factorize(const SymmetricMatrix& matrix) {
  cholmod_->llt.factorize(view(matrix));
  return cholmod_->llt.info() == Eigen::Success;
}

MatrixXd Factor::solve(const MatrixXd& b) const { return cholmod_->llt.solve(b); }

std::size_t Factor::bytes() const noexcept { return cholmod_->llt.cholmod().memory_inuse; }

}  // namespace tendon::softbody
