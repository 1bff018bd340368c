// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/selftest/statistics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace tendon::injector {
namespace {

constexpr double kFewestExpected = 10;  // with fewer, a cell's count is too skewed for the chi-square law

/// ln Γ(a). std::lgamma is not thread-safe, because it writes the sign into a global variable.
double log_gamma(double a) {
  int sign = 0;
  return ::lgamma_r(a, &sign);
}

double gamma_series(double a, double x) {
  double term = 1 / a;
  double sum = term;
  for (double n = a + 1; std::abs(term) > sum * 1e-17; ++n) {
    term *= x / n;
    sum += term;
  }
  return sum * std::exp(a * std::log(x) - x - log_gamma(a));
}

double gamma_fraction(double a, double x) {
  constexpr double kTiny = 1e-300;
  double b = x + 1 - a;
  double c = 1 / kTiny;
  double d = 1 / b;
  double product = d;
  for (double n = 1; n < 100'000; ++n) {
    const double numerator = -n * (n - a);
    b += 2;
    d = numerator * d + b;
    if (std::abs(d) < kTiny) d = kTiny;
    c = b + numerator / c;
    if (std::abs(c) < kTiny) c = kTiny;
    d = 1 / d;
    product *= d * c;
    if (std::abs(d * c - 1) < 1e-16) break;
  }
  return product * std::exp(a * std::log(x) - x - log_gamma(a));
}

/// 1 − P(a, x), without cancellation for P near 1.
double upper_gamma(double a, double x) {
  if (x <= 0) return 1;
  return x < a + 1 ? 1 - gamma_series(a, x) : gamma_fraction(a, x);
}

}  // namespace

double kolmogorov_distance(std::span<const double> ascending, const Cdf& law) {
  const auto n = static_cast<double>(ascending.size());
  double distance = 0;
  for (std::size_t first = 0; first < ascending.size();) {
    const double x = ascending[first];
    std::size_t end = first + 1;
    while (end < ascending.size() && ascending[end] == x) ++end;
    const double before = law(std::nextafter(x, -std::numeric_limits<double>::infinity()));
    distance = std::max(
        {distance, std::abs(law(x) - static_cast<double>(end) / n), std::abs(before - static_cast<double>(first) / n)});
    first = end;
  }
  return distance;
}

double kolmogorov_bound(double n, double significance) { return std::sqrt(std::log(2 / significance) / (2 * n)); }

double independent_samples(std::size_t n, double rho) {
  double sum = 0;
  double power = rho;
  for (std::size_t k = 1; k < n && std::abs(power) > 1e-12; ++k, power *= rho) sum += std::asin(power);
  return static_cast<double>(n) / (1 + 4 / std::numbers::pi * sum);
}

ChiSquare chi_square(std::span<const std::uint64_t> counts, std::span<const double> probabilities) {
  const auto total = static_cast<double>(std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}));
  struct Cell {
    double observed = 0;
    double expected = 0;
  };
  std::vector<Cell> cells;
  Cell open;
  for (std::size_t i = 0; i < std::max(counts.size(), probabilities.size()); ++i) {
    open.observed += i < counts.size() ? static_cast<double>(counts[i]) : 0;
    open.expected += i < probabilities.size() ? probabilities[i] * total : 0;
    if (open.expected >= kFewestExpected) {
      cells.push_back(open);
      open = {};
    }
  }
  if (!cells.empty()) {
    cells.back().observed += open.observed;
    cells.back().expected += open.expected;
  }
  if (cells.size() < 2) return {};
  ChiSquare result{0, cells.size() - 1};
  for (const auto& cell : cells) {
    result.value += (cell.observed - cell.expected) * (cell.observed - cell.expected) / cell.expected;
  }
  return result;
}

double chi_square_tail(double value, std::size_t freedom) {
  return freedom == 0 ? 1 : upper_gamma(static_cast<double>(freedom) / 2, value / 2);
}

double chi_square_bound(std::size_t freedom, double significance) {
  if (freedom == 0) return 0;
  double low = 0;
  double high = 1;
  while (chi_square_tail(high, freedom) > significance) high *= 2;
  while (high - low > 1e-9 * high) {
    const double middle = (low + high) / 2;
    (chi_square_tail(middle, freedom) > significance ? low : high) = middle;
  }
  return high;
}

double autocorrelation(std::span<const double> samples, std::size_t lag) {
  if (samples.size() <= lag) return 0;
  const double mean = std::accumulate(samples.begin(), samples.end(), 0.0) / static_cast<double>(samples.size());
  double together = 0;
  double alone = 0;
  for (std::size_t t = 0; t < samples.size(); ++t) {
    alone += (samples[t] - mean) * (samples[t] - mean);
    if (t >= lag) together += (samples[t] - mean) * (samples[t - lag] - mean);
  }
  return alone > 0 ? together / alone : 0;
}

std::vector<std::uint64_t> run_lengths(const std::vector<bool>& events, std::size_t every) {
  std::vector<std::uint64_t> counts;
  std::size_t runs = 0;
  std::size_t length = 0;
  bool whole = false;
  for (const bool event : events) {
    if (event) {
      ++length;
      continue;
    }
    if (length > 0 && whole && ++runs % every == 0) {
      if (counts.size() < length) counts.resize(length);
      ++counts[length - 1];
    }
    length = 0;
    whole = true;
  }
  return counts;
}

double incomplete_gamma(double a, double x) {
  if (x <= 0) return 0;
  return x < a + 1 ? gamma_series(a, x) : 1 - gamma_fraction(a, x);
}

double normal_cdf(double x) { return std::erfc(-x / std::numbers::sqrt2) / 2; }

double normal_quantile(double p) {
  if (p <= 0) return -std::numeric_limits<double>::infinity();
  if (p >= 1) return std::numeric_limits<double>::infinity();
  // Symmetry for the upper half. The result is as accurate as 1 − p.
  if (p > 0.5) return -normal_quantile(1 - p);
  constexpr std::array kA = {-3.969683028665376e+01, 2.209460984245205e+02,  -2.759285104469687e+02,
                             1.383577518672690e+02,  -3.066479806614716e+01, 2.506628277459239e+00};
  constexpr std::array kB = {-5.447609879822406e+01, 1.615858368580409e+02,  -1.556989798598866e+02,
                             6.680131188771972e+01,  -1.328068155288572e+01, 1.0};
  constexpr std::array kC = {-7.784894002430293e-03, -3.223964580411365e-01, -2.400758277161838e+00,
                             -2.549732539343734e+00, 4.374664141464968e+00,  2.938163982698783e+00};
  constexpr std::array kD = {7.784695709041462e-03, 3.224671290700398e-01, 2.445134137142996e+00, 3.754408661907416e+00,
                             1.0};
  const auto polynomial = [](const auto& coefficients, double t) {
    return std::accumulate(coefficients.begin(), coefficients.end(), 0.0,
                           [t](double sum, double next) { return sum * t + next; });
  };
  double x = 0;
  if (p < 0.02425) {
    const double q = std::sqrt(-2 * std::log(p));
    x = polynomial(kC, q) / polynomial(kD, q);
  } else {
    const double q = p - 0.5;
    x = q * polynomial(kA, q * q) / polynomial(kB, q * q);
  }
  const double error = (normal_cdf(x) - p) * std::sqrt(2 * std::numbers::pi) * std::exp(x * x / 2);
  return x - error / (1 + x * error / 2);
}

}  // namespace tendon::injector
