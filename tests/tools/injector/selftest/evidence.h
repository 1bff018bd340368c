// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "tests/tools/injector/selftest/selftest.h"

namespace tendon::injector {

// Samples and counts against their laws, each as one Check. `model` is the profile line, `what` the statistic. A bound
// is the value that a correct injector exceeds with a probability of 1e-7.

/// How many standard deviations a normal variate exceeds with that probability, either way.
double most_deviations();

/// Kolmogorov's distance of `samples` from `law`; they say as much as `independent` samples that are independent.
Check kolmogorov(std::string model, std::string what, std::vector<double> samples, const Cdf& law, double independent);
Check kolmogorov(std::string model, std::string what, const std::vector<double>& samples, const Cdf& law);

/// Pearson's chi-square of `counts` against the `shares` of their cells.
Check pearson(std::string model, std::string what, std::span<const std::uint64_t> counts,
              std::span<const double> shares);

/// `happened` of n events of probability p: the deviation of the rate, in absolute terms.
Check rate(std::string model, std::string what, double happened, double n, double p, double variance_factor = 1);

/// A count that has to be zero.
Check none(std::string model, std::string what, std::size_t deviations);

/// Events that should come as `chain` says: their share and how many follow one another.
std::vector<Check> check_events(const std::string& model, const std::string& what, const std::vector<bool>& events,
                                const LossChain& chain);

/// Innovations of samples that should be a Gaussian copula: independent standard normal variates. rho(t) is that
/// between t − 1 and t.
std::vector<double> innovations(const std::vector<double>& z, const std::function<double(std::size_t)>& rho);

/// Φ⁻¹(law(sample)) of each.
std::vector<double> normal_scores(std::vector<double> samples, const Cdf& law);

/// That innovations are standard normal and independent.
std::vector<Check> check_innovations(const std::string& model, const std::vector<double>& independent);

std::vector<double> even_shares(std::size_t cells);

void append(std::vector<Check>& checks, std::vector<Check> more);

}  // namespace tendon::injector
