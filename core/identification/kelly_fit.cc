// SPDX-License-Identifier: Apache-2.0
#include "core/identification/kelly_fit.h"

#include <cmath>
#include <limits>
#include <string>

#include <Eigen/Core>
#include <Eigen/QR>

#include "core/base/expect.h"

namespace tendon {
namespace {

constexpr double kFittedShare = 0.4;

}  // namespace

KellyFit kelly_fit(const Slide& slide, double mass) {
  expect_above_zero(mass, "mass");
  const Ramp ramp = ramp_of(slide);
  const auto& samples = slide.samples;
  const double end = samples.back().t;
  const double span = kFittedShare * (end - samples.front().t);
  std::size_t first = 0;
  while (samples[first].t < end - span) ++first;

  // x = c₀ + c₁ τ + c₂ τ², τ = (t − end)/span from −1 to 0; the speed at the end is c₁/span, its slope 2 c₂/span².
  const auto n = static_cast<Eigen::Index>(samples.size() - first);
  Eigen::MatrixX3d powers(n, 3);
  Eigen::VectorXd x(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const RampSample& sample = samples[first + static_cast<std::size_t>(i)];
    const double tau = (sample.t - end) / span;
    powers.row(i) << 1, tau, tau * tau;
    x(i) = sample.position;
  }
  const Eigen::Vector3d c = powers.colPivHouseholderQr().solve(x);
  const double mu = 2 * c(2) / (span * span);
  const double intersection = end - ramp.start - c(1) / span / mu;

  KellyFit fit;
  fit.rate = ramp.rate;
  fit.slide_time = end - samples.front().t;
  fit.friction.viscous = ramp.rate / mu;
  fit.friction.coulomb = ramp.rate * intersection - mass * mu;
  fit.time_constant = fit.friction.viscous > 0 ? mass / fit.friction.viscous : std::numeric_limits<double>::infinity();
  return fit;
}

}  // namespace tendon
