// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/selftest/evidence.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace tendon::injector {
namespace {

constexpr double kSignificance = 1e-7;
constexpr std::size_t kLongestRun = 2000;  // longer runs are one class

}  // namespace

double most_deviations() { return -normal_quantile(kSignificance / 2); }

Check kolmogorov(std::string model, std::string what, std::vector<double> samples, const Cdf& law, double independent) {
  std::ranges::sort(samples);
  return {std::move(model), std::move(what), kolmogorov_distance(samples, law),
          kolmogorov_bound(independent, kSignificance)};
}

Check kolmogorov(std::string model, std::string what, const std::vector<double>& samples, const Cdf& law) {
  return kolmogorov(std::move(model), std::move(what), samples, law, static_cast<double>(samples.size()));
}

Check pearson(std::string model, std::string what, std::span<const std::uint64_t> counts,
              std::span<const double> shares) {
  const ChiSquare fit = chi_square(counts, shares);
  return {std::move(model), std::move(what) + ", chi-square of " + std::to_string(fit.freedom), fit.value,
          chi_square_bound(fit.freedom, kSignificance)};
}

Check rate(std::string model, std::string what, double happened, double n, double p, double variance_factor) {
  const double bound = most_deviations() * std::sqrt(p * (1 - p) * variance_factor / n);
  return {std::move(model), std::move(what), std::abs(happened / n - p), std::max(bound, 1 / n)};
}

Check none(std::string model, std::string what, std::size_t deviations) {
  return {std::move(model), std::move(what), static_cast<double>(deviations), 0};
}

std::vector<double> even_shares(std::size_t cells) {
  return std::vector<double>(cells, 1.0 / static_cast<double>(cells));
}

void append(std::vector<Check>& checks, std::vector<Check> more) {
  checks.insert(checks.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

std::vector<Check> check_events(const std::string& model, const std::string& what, const std::vector<bool>& events,
                                const LossChain& chain) {
  const auto happened = static_cast<double>(std::ranges::count(events, true));
  return {
      rate(model, what + " rate", happened, static_cast<double>(events.size()), chain.rate(), chain.variance_factor()),
      pearson(model, what + " lengths", run_lengths(events, chain.bursts_to_forget()), chain.bursts(kLongestRun))};
}

std::vector<double> innovations(const std::vector<double>& z, const std::function<double(std::size_t)>& rho) {
  std::vector<double> result;
  result.reserve(z.size());
  for (std::size_t t = 1; t < z.size(); ++t)
    result.push_back((z[t] - rho(t) * z[t - 1]) / std::sqrt(1 - rho(t) * rho(t)));
  return result;
}

std::vector<double> normal_scores(std::vector<double> samples, const Cdf& law) {
  for (auto& sample : samples) sample = normal_quantile(std::clamp(law(sample), 1e-9, 1 - 1e-9));
  return samples;
}

std::vector<Check> check_innovations(const std::string& model, const std::vector<double>& independent) {
  const auto n = static_cast<double>(independent.size());
  return {kolmogorov(model, "innovations, Kolmogorov", independent, normal_cdf),
          {model, "innovations, autocorrelation", std::abs(autocorrelation(independent, 1)),
           most_deviations() / std::sqrt(n)}};
}

}  // namespace tendon::injector
