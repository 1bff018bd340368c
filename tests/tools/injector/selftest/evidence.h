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

// `model` is the profile line, `what` the statistic. A correct injector exceeds a bound with a probability of 1e-7.

/// The two-sided quantile of the normal distribution for that probability.
double most_deviations();

/// Kolmogorov distance of `samples` from `law`. `independent` is their effective number of independent samples.
Check kolmogorov(std::string model, std::string what, std::vector<double> samples, const Cdf& law, double independent);
Check kolmogorov(std::string model, std::string what, const std::vector<double>& samples, const Cdf& law);

Check pearson(std::string model, std::string what, std::span<const std::uint64_t> counts,
              std::span<const double> shares);

Check rate(std::string model, std::string what, double happened, double n, double p, double variance_factor = 1);

Check none(std::string model, std::string what, std::size_t deviations);

/// Compares the rate and the run lengths of events with `chain`.
std::vector<Check> check_events(const std::string& model, const std::string& what, const std::vector<bool>& events,
                                const LossChain& chain);

/// Of a Gaussian copula; should be independent standard normal. rho(t) is the correlation between t − 1 and t.
std::vector<double> innovations(const std::vector<double>& z, const std::function<double(std::size_t)>& rho);

std::vector<double> normal_scores(std::vector<double> samples, const Cdf& law);

std::vector<Check> check_innovations(const std::string& model, const std::vector<double>& independent);

std::vector<double> even_shares(std::size_t cells);

void append(std::vector<Check>& checks, std::vector<Check> more);

}  // namespace tendon::injector
