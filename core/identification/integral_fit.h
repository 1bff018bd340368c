// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include <Eigen/Core>

#include "core/identification/ramp_run.h"
#include "core/ledger/friction.h"

namespace tendon {

/// Friction from a slide of any length. The equation of motion is integrated twice from the first sample of the slide,
/// so the fit does not need a derivative or a steady state:
///     m X + b ∫X dt + f_c τ²/2 + c τ = ∬F dt²,       τ = t − t_a,  X = x − x(t_a)
/// The equation is linear in b, f_c, the unknown momentum term c at t_a, and m if that is unknown. Huber weights reduce
/// the influence of outliers. White noise ε of the force enters as ∬ε dt², so the residuals are correlated.
/// `unit_covariance` accounts for this. The errors from the textbook formula σ²(AᵀA)⁻¹ are 35 to 70 times too small.
/// Source: core/PROOFS.md, "Friction identification".
struct IntegralFit {
  Friction friction;  ///< not a lower bound, and can be negative
  double mass = 0;    ///< kg, given or fitted
  /// Covariance of (b, f_c) per N² of force noise. Multiply it by the variance of the noise of one sample.
  Eigen::Matrix2d unit_covariance = Eigen::Matrix2d::Zero();
  double residual_squares = 0;  ///< Σ residual², (N·s²)²
  double unit_residual = 0;     ///< expected value of residual_squares per N² of force noise

  /// Returns the standard deviation of the force noise that explains the residuals, N. Rough for a single run.
  double force_noise() const noexcept;
};

/// `mass` is the mass of the handle and the mechanism in kg. If it is empty, the mass is fitted as well. This increases
/// the errors, and the slide must be long enough to show the effects of both mass and friction. Throws
/// std::invalid_argument if the mass is not a number > 0. Thread-safe: yes. Realtime-safe: no.
IntegralFit integral_fit(const Slide& slide, std::optional<double> mass);

}  // namespace tendon
