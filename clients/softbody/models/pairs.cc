// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/models/pairs.h"

namespace tendon::softbody {
namespace {

constexpr double kLeastCurvature = 1e-8;  ///< minimum cosine between a step and its change of forces

}  // namespace

void Pairs::add(const VectorXd& step, const VectorXd& change, const VectorXd& solved) {
  if (!(step.dot(change) > kLeastCurvature * step.norm() * change.norm())) return;
  if (steps_.rows() != step.size()) {
    order_.clear();
    steps_.resize(step.size(), kMost);
    changes_.resize(step.size(), kMost);
    solved_.resize(step.size(), kMost);
  }
  int column = count();
  if (column == kMost) {
    column = order_.front();
    order_.erase(order_.begin());
  }
  order_.push_back(column);
  steps_.col(column) = step;
  changes_.col(column) = change;
  solved_.col(column) = solved;
  for (const int i : order_) {
    steps_changes_(i, column) = steps_.col(i).dot(change);
    steps_changes_(column, i) = step.dot(changes_.col(i));
    changes_solved_(i, column) = changes_solved_(column, i) = solved_.col(i).dot(change);
  }
}

VectorXd Pairs::times(const VectorXd& b, const VectorXd& solved) const {
  VectorXd x = solved;
  const auto size = order_.size();
  std::array<double, kMost> taken{};
  for (std::size_t i = size; i-- > 0;) {
    const int own = order_[i];
    double along = steps_.col(own).dot(b);
    for (std::size_t j = i + 1; j < size; ++j) along -= taken[j] * steps_changes_(own, order_[j]);
    taken[i] = along / steps_changes_(own, own);
  }
  std::array<double, kMost> given{};
  for (std::size_t i = 0; i < size; ++i) {
    const int own = order_[i];
    double along = solved_.col(own).dot(b);
    for (std::size_t j = 0; j < size; ++j) along -= taken[j] * changes_solved_(own, order_[j]);
    for (std::size_t j = 0; j < i; ++j) along += given[j] * steps_changes_(order_[j], own);
    given[i] = taken[i] - along / steps_changes_(own, own);
  }
  for (std::size_t i = 0; i < size; ++i) x += given[i] * steps_.col(order_[i]) - taken[i] * solved_.col(order_[i]);
  return x;
}

MatrixXd Pairs::adds(const std::vector<int>& unknowns) const {
  const auto size = static_cast<Eigen::Index>(unknowns.size());
  const int pairs = count();
  if (pairs == 0) return MatrixXd::Zero(size, size);
  // Compact form (Byrd, Nocedal & Schnabel 1994): with S, Y the pairs and R the upper triangle of SᵀY, H − K₀⁻¹ = [S,
  // K₀⁻¹Y] [[R⁻ᵀ(diag R + Yᵀ K₀⁻¹ Y)R⁻¹, −R⁻ᵀ], [−R⁻¹, 0]] [S, K₀⁻¹Y]ᵀ.
  MatrixXd both(size, 2 * pairs);
  both << steps_(unknowns, order_), solved_(unknowns, order_);
  const MatrixXd upper = MatrixXd(steps_changes_(order_, order_)).triangularView<Eigen::Upper>();
  MatrixXd within = changes_solved_(order_, order_);
  within.diagonal() += upper.diagonal();
  const MatrixXd inverse = upper.triangularView<Eigen::Upper>().solve(MatrixXd::Identity(pairs, pairs));
  MatrixXd middle = MatrixXd::Zero(2 * pairs, 2 * pairs);
  middle.topLeftCorner(pairs, pairs) = inverse.transpose() * within * inverse;
  middle.topRightCorner(pairs, pairs) = -inverse.transpose();
  middle.bottomLeftCorner(pairs, pairs) = -inverse;
  return both * middle * both.transpose();
}

std::size_t Pairs::bytes() const noexcept {
  return static_cast<std::size_t>(steps_.size() + changes_.size() + solved_.size()) * sizeof(double);
}

}  // namespace tendon::softbody
