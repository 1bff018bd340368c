// SPDX-License-Identifier: Apache-2.0
#include "core/identification/integral_fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/QR>

#include "core/base/expect.h"

namespace tendon {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kReweightings = 10;
constexpr double kHuber = 1.345;  // 95 % efficiency for normal residuals

/// The regression A θ = y with θ = (b, f_c, c) or (b, f_c, c, m).
struct Regression {
  MatrixXd a;
  VectorXd y;
  VectorXd tau;    ///< s
  VectorXd steps;  ///< s, steps(i) from sample i to i + 1
};

Regression regression_of(const Slide& slide, std::optional<double> mass) {
  const auto& samples = slide.samples;
  const auto n = static_cast<Index>(samples.size());
  Regression r{MatrixXd(n, mass ? 3 : 4), VectorXd(n), VectorXd(n), VectorXd::Zero(n)};
  double area = 0;      // ∫X
  double impulse = 0;   // ∫F
  double integral = 0;  // ∬F
  for (Index i = 0; i < n; ++i) {
    const RampSample& now = samples[static_cast<std::size_t>(i)];
    const double x = now.position - samples.front().position;
    if (i > 0) {
      const RampSample& before = samples[static_cast<std::size_t>(i - 1)];
      const double dt = now.t - before.t;
      r.steps(i - 1) = dt;
      area += dt * (x + before.position - samples.front().position) / 2;
      integral += dt * (impulse + dt * before.force / 2);  // exact because the force is held
      impulse += dt * before.force;
    }
    const double tau = now.t - samples.front().t;
    r.tau(i) = tau;
    r.a(i, 0) = area;
    r.a(i, 1) = tau * tau / 2;
    r.a(i, 2) = tau;
    if (mass) {
      r.y(i) = integral - *mass * x;
    } else {
      r.a(i, 3) = x;
      r.y(i) = integral;
    }
  }
  return r;
}

double median_of_absolutes(const VectorXd& values) {
  std::vector<double> sorted(static_cast<std::size_t>(values.size()));
  std::ranges::transform(values, sorted.begin(), [](double v) { return std::abs(v); });
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::ranges::nth_element(sorted, middle);
  return *middle;
}

/// Returns Lᵀu. The residuals are r = L ε with the force noise ε. Noise that is held from t_j to t_j + h changes the
/// double integral at a later t by h (t − t_j − h/2).
VectorXd transposed_double_integral(const Regression& r, const VectorXd& u) {
  VectorXd result = VectorXd::Zero(u.size());
  double sum = 0;
  double moment = 0;
  for (Index j = u.size() - 2; j >= 0; --j) {
    sum += u(j + 1);
    moment += u(j + 1) * r.tau(j + 1);
    result(j) = r.steps(j) * (moment - (r.tau(j) + r.steps(j) / 2) * sum);
  }
  return result;
}

/// Sum of the squares of all elements of diag(√weights) L.
double squares_of_double_integral(const Regression& r, const VectorXd& weights) {
  double squares = 0;
  double count = 0;
  double first = 0;
  double second = 0;
  for (Index j = r.tau.size() - 2; j >= 0; --j) {
    const double t = r.tau(j + 1);
    const double w = weights(j + 1);
    count += w;
    first += w * t;
    second += w * t * t;
    const double middle = r.tau(j) + r.steps(j) / 2;
    squares += r.steps(j) * r.steps(j) * (second - 2 * middle * first + middle * middle * count);
  }
  return squares;
}

}  // namespace

double IntegralFit::force_noise() const noexcept {
  return unit_residual > 0 ? std::sqrt(residual_squares / unit_residual) : 0;
}

IntegralFit integral_fit(const Slide& slide, std::optional<double> mass) {
  if (mass) expect_above_zero(*mass, "mass");
  const Regression r = regression_of(slide, mass);
  const VectorXd scale = r.a.colwise().norm().cwiseMax(1e-300);
  const MatrixXd a = r.a * scale.cwiseInverse().asDiagonal();

  // W^½ A θ = W^½ y, reweighted until it converges.
  VectorXd root_weights = VectorXd::Ones(r.y.size());
  VectorXd theta = VectorXd::Zero(a.cols());
  VectorXd residual = r.y;
  Eigen::ColPivHouseholderQR<MatrixXd> qr;
  for (int i = 0; i < kReweightings; ++i) {
    qr.compute(root_weights.asDiagonal() * a);
    const VectorXd found = qr.solve(root_weights.cwiseProduct(r.y));
    const bool stays = (found - theta).norm() <= 1e-6 * found.norm();
    theta = found;
    residual = r.y - a * theta;
    if (stays) break;
    const double limit = kHuber * 1.4826 * median_of_absolutes(residual);
    if (!(limit > 0)) break;
    root_weights = (limit / residual.cwiseAbs().cwiseMax(limit).array()).sqrt().matrix();
  }

  // θ − θ_true = G r with G = (AᵀWA)⁻¹AᵀW = P R⁻¹QᵀW^½ and r = Lε: covariance (GL)(GL)ᵀ per unit of ε.
  const Index columns = a.cols();
  const MatrixXd q = qr.householderQ() * MatrixXd::Identity(a.rows(), columns);
  const MatrixXd wq = root_weights.asDiagonal() * q;
  const MatrixXd inverse = qr.colsPermutation() * qr.matrixR()
                                                      .topLeftCorner(columns, columns)
                                                      .triangularView<Eigen::Upper>()
                                                      .solve(MatrixXd::Identity(columns, columns));
  MatrixXd wql(columns, a.rows());  // QᵀW^½L
  for (Index i = 0; i < columns; ++i) wql.row(i) = transposed_double_integral(r, wq.col(i)).transpose();
  const MatrixXd gl = scale.cwiseInverse().asDiagonal() * inverse * wql;
  const MatrixXd covariance = gl * gl.transpose();

  IntegralFit fit;
  fit.friction.viscous = theta(0) / scale(0);
  fit.friction.coulomb = theta(1) / scale(1);
  fit.mass = mass ? *mass : theta(3) / scale(3);
  fit.unit_covariance = covariance.topLeftCorner<2, 2>();
  fit.residual_squares = root_weights.cwiseProduct(residual).squaredNorm();
  fit.unit_residual = std::max(squares_of_double_integral(r, root_weights.cwiseAbs2()) - wql.squaredNorm(), 0.0);
  return fit;
}

}  // namespace tendon
