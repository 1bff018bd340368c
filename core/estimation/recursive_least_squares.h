// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace tendon {

/// Units follow the parameters θ and the output y.
struct LeastSquaresConfig {
  double forgetting = 0.95;  ///< λ, (0, 1]; 1 never forgets
  /// After a reset, P is this value times the identity. It is the squared error of a parameter divided by the squared
  /// noise of y. Scale the regressor so that one value fits all parameters.
  double prior_variance = 1e8;
  double dead_zone = 0;  ///< smaller errors are ignored; this can be 0, or similar to the noise of y
};

/// Fits y = φᵀθ to a stream of samples. The covariance P stays positive definite, even in float32. θ minimizes
///     λⁿ/p0 · |θ − θ0|² + Σ_i λ^(n−i) · (y_i − φ_iᵀθ)²
/// θ0 is the estimate at the last reset. These weights apply while the cap below is inactive. The textbook recursion P
/// ← (P − K φᵀP)/λ subtracts nearly equal numbers. If the regressors are almost parallel, P becomes indefinite within
/// tens of samples. Here P = U D Uᵀ with U unit upper triangular, and D is only multiplied by positive numbers.
///
/// **Forgetting is capped:** the forgetting factor of a sample is max(λ, min(1, tr P / (M p0))), so tr P never exceeds
/// its value after a reset, and P does not wind up in directions that are not excited. A sample is ignored if it is not
/// finite or if D under- or overflows.
///
/// Source: Bierman, "Factorization Methods for Discrete Sequential Estimation", 1977, ch. V.
/// Thread-safe: no. Realtime-safe: yes; O(M²) per sample. Instantiated for M = 1…4, float and double.
template <int M, class Scalar = double>
class UdLeastSquares {
 public:
  using Vector = Eigen::Matrix<Scalar, M, 1>;
  using Matrix = Eigen::Matrix<Scalar, M, M>;

  /// Throws std::invalid_argument with the name of the field if it is out of range.
  explicit UdLeastSquares(const LeastSquaresConfig& config = {});

  /// Returns false if the sample had no effect (dead zone, or not usable).
  bool observe(const Vector& regressor, Scalar y) noexcept;

  const Vector& estimate() const noexcept { return estimate_; }

  /// Sets θ, for example to its projection into bounds. P stays.
  void set_estimate(const Vector& estimate) noexcept { estimate_ = estimate; }

  void reset() noexcept;  ///< resets P to p0 · I, so that the next samples dominate. θ does not change.

  /// The diagonal of D. P is positive definite if and only if all elements are positive.
  const Vector& pivots() const noexcept { return d_; }

  Matrix covariance() const noexcept { return u_ * d_.asDiagonal() * u_.transpose(); }
  Scalar trace() const noexcept;

 private:
  Scalar forgetting_;
  Scalar prior_variance_;
  Scalar dead_zone_;
  Matrix u_ = Matrix::Identity();
  Vector d_ = Vector::Zero();
  Vector estimate_ = Vector::Zero();
};

}  // namespace tendon
