// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <string>

#include "core/base/time.h"
#include "tests/tools/injector/injector.h"
#include "tests/tools/injector/profile/profile.h"
#include "tests/tools/injector/selftest/evidence.h"
#include "tests/tools/injector/selftest/groups.h"
#include "tests/tools/injector/selftest/traffic.h"

namespace tendon::injector {

using std::chrono::microseconds;
using std::chrono::milliseconds;

std::vector<DelayLaw> delay_laws() {
  const auto gamma_law = [](double mean, double deviation) {
    const double shape = mean * mean / (deviation * deviation);
    return [shape, scale = mean / shape](double x) { return incomplete_gamma(shape, x / scale); };
  };
  const auto lognormal_law = [](double mean, double deviation) {
    const double variance = std::log1p(deviation * deviation / (mean * mean));
    return [mu = std::log(mean) - variance / 2, sigma = std::sqrt(variance)](double x) {
      return x <= 0 ? 0 : normal_cdf((std::log(x) - mu) / sigma);
    };
  };
  return {
      {"delay=uniform(5ms,15ms)", [](double x) { return std::clamp((x - 5 * kMs) / (10 * kMs), 0.0, 1.0); }},
      {"delay=normal(20ms,4ms)", [](double x) { return x < 0 ? 0 : normal_cdf((x - 20 * kMs) / (4 * kMs)); }},
      // Negative values become zero: an atom of 16 %.
      {"delay=normal(2ms,2ms)", [](double x) { return x < 0 ? 0 : normal_cdf((x - 2 * kMs) / (2 * kMs)); }, false},
      {"delay=exponential(2ms,8ms)", [](double x) { return x < 2 * kMs ? 0 : -std::expm1((2 * kMs - x) / (6 * kMs)); }},
      {"delay=lognormal(20ms,10ms)", lognormal_law(20 * kMs, 10 * kMs)},
      {"delay=pareto(5ms,2.5)", [](double x) { return x < 5 * kMs ? 0 : 1 - std::pow(5 * kMs / x, 2.5); }},
      {"delay=gamma(10ms,7ms)", gamma_law(10 * kMs, 7 * kMs)},
      // A thousandth of it is below 100 ns, where rounding to nanoseconds hides the draw.
      {"delay=gamma(10ms,14ms)", gamma_law(10 * kMs, 14 * kMs), false},
      // Bins of 1 ms with shares 0.1, 0.6, 0, 0.3.
      {"delay=histogram(3ms:1,4ms:6,5ms:0,6ms:3)",
       [](double x) {
         const double ms = x / kMs - 3;
         return 0.1 * std::clamp(ms, 0.0, 1.0) + 0.6 * std::clamp(ms - 1, 0.0, 1.0) +
                0.3 * std::clamp(ms - 3, 0.0, 1.0);
       }},
      {"delay=samples(3ms:1,5ms:6,9ms:3)",
       [](double x) { return x < 3 * kMs   ? 0
                             : x < 5 * kMs ? 0.1
                             : x < 9 * kMs ? 0.7
                                           : 1.0; }, false},
      {"delay=mixture(2ms,3:10ms,1:3ms)",
       [](double x) {
         const double above = std::max(x / kMs - 2, 0.0);
         return -0.75 * std::expm1(-above / 10) - 0.25 * std::expm1(-above / 3);
       }},
  };
}

std::vector<Check> all_delays(const SelftestOptions& options) {
  std::vector<Check> checks;
  std::size_t off = 0;
  play(parse_profile("base=5ms delay=20ms"), {}, options,
       [&](std::size_t, const Decision& decision) { off += delay(decision) == milliseconds(25) ? 0U : 1U; });
  checks.push_back(none("base=5ms delay=20ms", "delays that differ", off));
  for (const auto& [line, law, continuous] : delay_laws()) {
    for (const double rho : {0.0, 0.5, 0.9, 0.99}) {
      std::ostringstream correlated;
      correlated << line << " order=free";
      if (rho > 0) correlated << " rho=" << rho;
      append(checks, check_delays(correlated.str(), law, rho, continuous, options));
    }
  }
  return checks;
}

std::vector<Check> memory(const SelftestOptions& options) {
  const std::string line = "delay=lognormal(20ms,10ms) memory=20ms order=free";
  const DelayLaw law = delay_laws()[4];
  const std::array gaps = {0.5, 7.0, 0.1, 30.0, 2.0};  // ms before datagram i, cyclic
  const double round = 39.6;
  Traffic traffic;
  traffic.at = [&](std::size_t i) {
    const std::size_t rounds = i / gaps.size();
    double after = round * static_cast<double>(rounds);
    for (std::size_t k = 0; k < i % gaps.size(); ++k) after += gaps[k + 1];
    return microseconds(std::llround(after * 1000));
  };
  const auto z = normal_scores(delays(parse_profile(line), traffic, options), law.law);
  return check_innovations(line, innovations(z, [&](std::size_t t) { return std::exp(-gaps[t % gaps.size()] / 20); }));
}

std::vector<Check> first_datagrams(const SelftestOptions& options) {
  const std::string line = "delay=lognormal(20ms,10ms) rho=0.99 loss=gilbert(0.001,0.01,1,0) order=free";
  const Injector any_link(parse_profile(line), options.seed, 0, Direction::kDown);
  std::vector<double> samples;
  std::vector<bool> losses;
  // One percent of the count, because creating an injector costs more than a decision.
  for (std::uint32_t link = 0; link < options.count / 100; ++link) {
    const Decision first = any_link.for_link(link).decide({.arrival = kStart, .size = 200});
    samples.push_back(ns(delay(first)));
    losses.push_back(lost(first));
  }
  const auto n = static_cast<double>(samples.size());
  const auto z = normal_scores(samples, delay_laws()[4].law);
  return {kolmogorov(line, "first datagrams of links, Kolmogorov", samples, delay_laws()[4].law),
          {line, "link against link, correlation", std::abs(autocorrelation(z, 1)), most_deviations() / std::sqrt(n)},
          rate(line, "first datagrams of links, loss rate", static_cast<double>(std::ranges::count(losses, true)), n,
               1.0 / 11)};
}

std::vector<Check> independence(const SelftestOptions& options) {
  const std::string line = "delay=normal(20ms,4ms) order=free";
  const Profile profile = parse_profile(line);
  const Cdf law = delay_laws()[1].law;
  SelftestOptions other_seed = options;
  ++other_seed.seed;
  const auto ours = normal_scores(delays(profile, {}, options), law);
  const auto check = [&](const std::string& what, const std::vector<double>& others) {
    double products = 0;
    for (std::size_t i = 0; i < ours.size(); ++i) products += ours[i] * others[i];
    const auto n = static_cast<double>(ours.size());
    return Check{line, what, std::abs(products / n), most_deviations() / std::sqrt(n)};
  };
  return {check("up against down, correlation",
                normal_scores(delays(profile, {.direction = Direction::kDown}, options), law)),
          check("link 0 against link 1, correlation", normal_scores(delays(profile, {.link = 1}, options), law)),
          check("seed against next seed, correlation", normal_scores(delays(profile, {}, other_seed), law))};
}

std::vector<Check> check_delays(std::string_view line, const Cdf& law, double rho, bool continuous,
                                const SelftestOptions& options) {
  const std::string model(line);
  const auto samples = delays(parse_profile(line), {}, options);
  std::vector<Check> checks = {kolmogorov(model, "Kolmogorov", samples, law, independent_samples(samples.size(), rho))};
  if (!continuous) return checks;
  const auto n = static_cast<double>(samples.size());
  if (rho == 0) {
    // The Kolmogorov distance is insensitive to tails. About 100 are expected, enough for the normal approximation.
    const double far = std::max(1e-4, 100 / n);
    const auto high = std::ranges::count_if(samples, [&](double x) { return law(x) > 1 - far; });
    const auto low = std::ranges::count_if(samples, [&](double x) { return law(x) < far; });
    checks.push_back(rate(model, "share of the longest", static_cast<double>(high), n, far));
    checks.push_back(rate(model, "share of the shortest", static_cast<double>(low), n, far));
  }
  const auto z = normal_scores(samples, law);
  // Standard deviation and bias of the AR(1) estimate: Bartlett 1946, Kendall 1954.
  checks.push_back({model, "autocorrelation of z against rho", std::abs(autocorrelation(z, 1) - rho),
                    most_deviations() * std::sqrt((1 - rho * rho) / n) + (1 + 3 * rho) / n});
  if (rho > 0) append(checks, check_innovations(model, innovations(z, [rho](std::size_t) { return rho; })));
  return checks;
}

}  // namespace tendon::injector
