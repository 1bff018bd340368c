// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace tendon::injector {

// What the self-test measures with: how far samples are from the law they were asked to follow, and how far chance
// alone would take them. Doubles and <cmath>, for nothing here decides the fate of a datagram. Nothing keeps state. All
// sample values may be in any unit, as long as the law is in the same.

/// A distribution function F(x) = P(X ≤ x): from 0 to 1, never falling, continuous from the right. It may have steps.
using Cdf = std::function<double(double)>;

/// Kolmogorov and Smirnov's distance sup |Fₙ(x) − F(x)| of samples, ascending, from a law; exact where either has
/// steps. 0 for no samples.
double kolmogorov_distance(std::span<const double> ascending, const Cdf& law);

/// What that distance exceeds with probability `significance` at the most, if n independent samples follow the law:
///     ε = √( ln(2 / significance) / 2n )
/// (Dvoretzky, Kiefer, Wolfowitz 1956, with the constant of Massart, Ann. Probab. 18(3), 1990; holds for every n and
/// law). n may be a fraction: of dependent samples, as many as independent ones would say as much.
double kolmogorov_bound(double n, double significance);

/// How many independent samples say as much about the distribution as n of an AR(1) Gaussian copula do, where that
/// is least, at the median:
///     n / (1 + 2 Σ_k (2/π) asin ρᵏ),  k = 1 … n − 1       as P(z₀ < 0, z_k < 0) = 1/4 + asin(ρᵏ) / 2π (Sheppard 1899)
/// A first order correction: the supremum over a dependent path is not the supremum over an independent one, and the
/// bounds made with it are taken as approximate.
double independent_samples(std::size_t n, double rho);

/// Pearson's Σ (observed − expected)² / expected, and how many cells were free to differ.
struct ChiSquare {
  double value = 0;
  std::size_t freedom = 0;
};

/// Of counts against the probabilities of their cells, which should sum to 1. Neighbouring cells are merged until each
/// expects at least ten. Fewer than two cells then: {0, 0}, which says nothing.
ChiSquare chi_square(std::span<const std::uint64_t> counts, std::span<const double> probabilities);

/// P(X ≥ value) for a chi-square law: the p-value. 1 when freedom is 0.
double chi_square_tail(double value, std::size_t freedom);

/// The value that a chi-square law exceeds with probability `significance`. 0 when freedom is 0.
double chi_square_bound(std::size_t freedom, double significance);

/// The share of the variance that samples have in common with those `lag` later:
///     Σ (x_t − x̄)(x_{t+lag} − x̄) / Σ (x_t − x̄)².  0 when all are equal or there are not more than `lag`.
double autocorrelation(std::span<const double> samples, std::size_t lag);

/// How often each run length occurs among the runs of `true`: [k − 1] counts the runs of exactly k. Runs that touch
/// either end are left out, for they may have been longer. `every` m takes each m-th run only, the m-th first.
std::vector<std::uint64_t> run_lengths(const std::vector<bool>& events, std::size_t every = 1);

/// The regularised incomplete gamma function P(a, x) = ∫₀ˣ t^(a−1) e^(−t) dt / Γ(a), a > 0: the law of a gamma variate
/// of shape a and scale 1. Series below a + 1, Lentz's continued fraction above (Press et al., Numerical Recipes, 6.2);
/// relative error below 1e-12. 0 for x ≤ 0.
double incomplete_gamma(double a, double x);

/// Φ(x) of the standard normal law.
double normal_cdf(double x);

/// Φ⁻¹(p): Acklam's rational function and one step of Halley's; relative error below 1e-13. ∓∞ at 0 and 1.
double normal_quantile(double p);

}  // namespace tendon::injector
