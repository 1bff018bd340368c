// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace tendon::injector {

// Distances of samples from a law, and their bounds under chance. No decision depends on them, so doubles and <cmath>
// are allowed.

/// F(x) = P(X ≤ x), which may have steps.
using Cdf = std::function<double(double)>;

/// sup |Fₙ(x) − F(x)| of ascending samples; exact for steps. 0 without samples.
double kolmogorov_distance(std::span<const double> ascending, const Cdf& law);

/// Bound that the distance of n independent samples of the law exceeds with probability `significance` at most:
///     ε = √( ln(2 / significance) / 2n )
/// (Dvoretzky, Kiefer, Wolfowitz 1956, with the constant of Massart, Ann. Probab. 18(3), 1990; holds for every n and
/// law). n can be the effective number of independent samples, a fraction.
double kolmogorov_bound(double n, double significance);

/// Effective number of independent samples of an AR(1) Gaussian copula of length n, at the median, where it is
/// smallest:
///     n / (1 + 2 Σ_k (2/π) asin ρᵏ),  k = 1 … n − 1       as P(z₀ < 0, z_k < 0) = 1/4 + asin(ρᵏ) / 2π (Sheppard 1899)
/// Approximate, because the supremum over a dependent path has another distribution.
double independent_samples(std::size_t n, double rho);

/// Pearson's Σ (observed − expected)² / expected, and the degrees of freedom.
struct ChiSquare {
  double value = 0;
  std::size_t freedom = 0;
};

/// The probabilities should sum to 1. Merges neighboring cells until each expects at least ten. With fewer than two
/// cells left, returns {0, 0}.
ChiSquare chi_square(std::span<const std::uint64_t> counts, std::span<const double> probabilities);

/// P(X ≥ value), the p-value; 1 if freedom is 0.
double chi_square_tail(double value, std::size_t freedom);

/// The value that a chi-square law exceeds with probability `significance`. 0 if freedom is 0.
double chi_square_bound(std::size_t freedom, double significance);

/// Σ (x_t − x̄)(x_{t+lag} − x̄) / Σ (x_t − x̄)².  0 if all samples are equal or there are not more than `lag`.
double autocorrelation(std::span<const double> samples, std::size_t lag);

/// [k − 1] counts the runs of exactly k `true`. Omits runs at either end, which may be incomplete. Uses only each
/// `every`-th run, starting with that one.
std::vector<std::uint64_t> run_lengths(const std::vector<bool>& events, std::size_t every = 1);

/// P(a, x) = ∫₀ˣ t^(a−1) e^(−t) dt / Γ(a), a > 0, regularized. Series below a + 1, Lentz's continued fraction above
/// (Press et al., Numerical Recipes, 6.2); relative error below 1e-12. 0 for x ≤ 0.
double incomplete_gamma(double a, double x);

double normal_cdf(double x);

/// Φ⁻¹(p): Acklam's rational approximation and one Halley step; relative error below 1e-13. ∓∞ at 0 and 1.
double normal_quantile(double p);

}  // namespace tendon::injector
