// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "core/identification/ramp_run.h"
#include "core/ledger/friction.h"

namespace tendon {

/// Friction from a slide of any length: the equation of motion integrated twice from the first sample of the slide, so
/// that nothing is differentiated and no steady state is waited for,
///
///     m X + b ∫X dt + f_c τ²/2 + c τ = ∬F dt²,       τ = t − t_a,  X = x − x(t_a)
///
/// linear in b, f_c (and m, when it is not known) and the unknown momentum c at t_a. Solved by least squares with
/// Huber's weights, so that single wrong samples do not count.
///
/// **Its covariance** models the disturbance as white noise ε of the force, which enters the equation as ∬ε dt²:
/// residuals are then the integral of a random walk. The textbook's σ²(AᵀA)⁻¹ assumes that they are independent and
/// states errors 35 to 70 times too small (0.005 and 0.26 N·s/m, 0.1 N/s): bounds published from it would be wrong.
///
/// Source: control.md 2 (derived), covariance here.
struct IntegralFit {
  Friction friction;  ///< not a lower bound; may be negative
  double mass = 0;    ///< kg, given or fitted
  /// Covariance of (b, f_c) per N² of force noise: multiply by the variance of one sample's noise.
  Eigen::Matrix2d unit_covariance = Eigen::Matrix2d::Zero();
  double residual_squares = 0;  ///< Σ residual², (N·s²)²
  double unit_residual = 0;     ///< the expected value of that per N² of force noise

  /// Force noise that explains the residuals, N (standard deviation of one sample). Of one run: a rough figure.
  double force_noise() const noexcept;
};

/// `mass`: kg, of handle and mechanism; left out: fitted too, which needs a slide long enough to show both mass and
/// friction and widens the errors. Throws std::invalid_argument for a mass that is not a number > 0.
/// Thread-safe: yes. Realtime-safe: no.
IntegralFit integral_fit(const Slide& slide, std::optional<double> mass);

}  // namespace tendon
