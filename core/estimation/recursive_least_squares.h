// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace tendon {

/// How a recursive least-squares estimator remembers. Units follow the parameters θ and the output y.
struct LeastSquaresConfig {
  /// Weight of a sample against the one after it, (0, 1]; 1 never forgets.
  double forgetting = 0.95;
  /// P after a reset is this times the identity: the square of how wrong a parameter may be, over the
  /// square of the noise of y. Scale the regressor so that one number serves all parameters.
  double prior_variance = 1e8;
  /// An error smaller than this teaches nothing; about the noise of y. 0 learns from everything.
  double dead_zone = 0;
};

/// Fits y = φᵀθ to a stream of samples, without ever losing the definiteness of its covariance P, also
/// in float32. After n samples θ is the minimiser of
///
///     λⁿ/p0 · |θ − θ0|² + Σ_i λ^(n−i) · (y_i − φ_iᵀθ)²
///
/// (θ0: the estimate at the last reset; weights while the cap below is not at work.) The textbook recursion P ← (P − K
/// φᵀP)/λ subtracts nearly equal numbers and is indefinite within tens of samples when regressors are almost parallel;
/// here P = U D Uᵀ with U unit upper triangular, and every D is only ever multiplied by positive numbers.
///
/// **Forgetting is capped:** a sample forgets by max(λ, min(1, tr P / (M p0))), hence tr P never exceeds
/// what it is after a reset. Directions that are not excited do not wind up.
///
/// A sample that is not finite, or so large that D would under- or overflow, changes nothing.
///
/// Source: Bierman, "Factorization Methods for Discrete Sequential Estimation", 1977, ch. V.
///
/// Thread-safe: no. Realtime-safe: yes; O(M²) per sample. Instantiated for M = 1…4, float and double.
template <int M, class Scalar = double>
class UdLeastSquares {
 public:
  using Vector = Eigen::Matrix<Scalar, M, 1>;
  using Matrix = Eigen::Matrix<Scalar, M, M>;

  /// Throws std::invalid_argument naming the field when it is out of range.
  explicit UdLeastSquares(const LeastSquaresConfig& config = {});

  /// Takes the next sample; false when it taught nothing (dead zone, or not usable).
  bool observe(const Vector& regressor, Scalar y) noexcept;

  const Vector& estimate() const noexcept { return estimate_; }

  /// Replaces θ, for instance by its projection into bounds; P stays.
  void set_estimate(const Vector& estimate) noexcept { estimate_ = estimate; }

  /// P ← p0 · I: believe what comes next. θ stays.
  void reset() noexcept;

  /// The diagonal of D in P = U D Uᵀ; P is positive definite just when all of it is positive.
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

/// The same estimator as UdLeastSquares, carried as the square root of the information, RᵀR = P⁻¹ and
/// Rθ = z, and updated by Givens rotations of [R z] with the row [φᵀ y]. It needs square roots, and one
/// back-substitution per sample; in return its error grows with the condition of R only, not with that
/// of P. Same contract, same results.
///
/// Source: Golub and Van Loan, "Matrix Computations", 5.1 (Givens rotations).
///
/// Thread-safe: no. Realtime-safe: yes; O(M²) per sample. Instantiated for M = 1…4, float and double.
template <int M, class Scalar = double>
class QrLeastSquares {
 public:
  using Vector = Eigen::Matrix<Scalar, M, 1>;
  using Matrix = Eigen::Matrix<Scalar, M, M>;

  explicit QrLeastSquares(const LeastSquaresConfig& config = {});
  bool observe(const Vector& regressor, Scalar y) noexcept;
  const Vector& estimate() const noexcept { return estimate_; }
  void set_estimate(const Vector& estimate) noexcept;
  void reset() noexcept;

  /// As for UdLeastSquares, whose D_i is 1/R_ii².
  Vector pivots() const noexcept { return r_.diagonal().array().square().inverse().matrix(); }

  Matrix covariance() const noexcept;
  Scalar trace() const noexcept;

 private:
  Scalar forgetting_;
  Scalar prior_variance_;
  Scalar dead_zone_;
  Matrix r_ = Matrix::Zero();
  Vector z_ = Vector::Zero();
  Vector estimate_ = Vector::Zero();
};

}  // namespace tendon
