// SPDX-License-Identifier: Apache-2.0
#include "core/estimation/recursive_least_squares.h"

#include <algorithm>
#include <cmath>

#include "core/base/expect.h"

namespace tendon {
namespace {

const LeastSquaresConfig& checked(const LeastSquaresConfig& config) {
  expect(config.forgetting > 0 && config.forgetting <= 1, "forgetting", config.forgetting,
         "a number above 0 and at most 1");
  expect_above_zero(config.prior_variance, "prior_variance");
  expect_not_negative(config.dead_zone, "dead_zone");
  return config;
}

/// The update alone reduces tr P, so a divisor of at least tr P / cap keeps tr P below the cap.
template <class Scalar>
Scalar capped(Scalar forgetting, Scalar trace, Scalar cap) noexcept {
  return std::max(forgetting, std::min(Scalar(1), trace / cap));
}

}  // namespace

template <int M, class Scalar>
UdLeastSquares<M, Scalar>::UdLeastSquares(const LeastSquaresConfig& config)
    : forgetting_(static_cast<Scalar>(checked(config).forgetting)),
      prior_variance_(static_cast<Scalar>(config.prior_variance)),
      dead_zone_(static_cast<Scalar>(config.dead_zone)) {
  reset();
}

template <int M, class Scalar>
void UdLeastSquares<M, Scalar>::reset() noexcept {
  u_.setIdentity();
  d_.setConstant(prior_variance_);
}

template <int M, class Scalar>
Scalar UdLeastSquares<M, Scalar>::trace() const noexcept {
  Scalar trace = 0;
  for (int j = 0; j < M; ++j) {
    for (int i = 0; i <= j; ++i) trace += u_(i, j) * u_(i, j) * d_[j];
  }
  return trace;
}

template <int M, class Scalar>
bool UdLeastSquares<M, Scalar>::observe(const Vector& regressor, Scalar y) noexcept {
  if (!regressor.allFinite() || !std::isfinite(y)) return false;
  const Scalar error = y - regressor.dot(estimate_);
  if (std::abs(error) < dead_zone_) return false;

  const Scalar forgetting = capped(forgetting_, trace(), Scalar(M) * prior_variance_);
  const Vector f = u_.transpose() * regressor;
  const Vector v = d_.cwiseProduct(f);
  Matrix u = u_;
  Vector d = d_;
  Vector gain = Vector::Zero();
  Scalar a = forgetting;  // grows to λ + φᵀPφ, one pivot at a time
  for (int j = 0; j < M; ++j) {
    const Scalar next = a + v[j] * f[j];
    d[j] *= a / (next * forgetting);
    const Scalar p = -f[j] / a;
    for (int i = 0; i < j; ++i) {
      const Scalar old = u(i, j);
      u(i, j) = old + gain[i] * p;
      gain[i] += old * v[j];
    }
    gain[j] = v[j];
    a = next;
  }
  const Vector estimate = estimate_ + gain * (error / a);
  if (!(d.minCoeff() > 0 && d.allFinite() && u.allFinite() && estimate.allFinite())) return false;
  u_ = u;
  d_ = d;
  estimate_ = estimate;
  return true;
}

template class UdLeastSquares<1, float>;
template class UdLeastSquares<2, float>;
template class UdLeastSquares<3, float>;
template class UdLeastSquares<4, float>;
template class UdLeastSquares<1, double>;
template class UdLeastSquares<2, double>;
template class UdLeastSquares<3, double>;
template class UdLeastSquares<4, double>;

}  // namespace tendon
