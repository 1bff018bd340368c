// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/selftest/loss_chain.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>
#include <vector>

namespace tendon::injector {
namespace {

using Row = std::vector<double>;

constexpr double kNothing = 1e-13;       // remaining probability at which a series is truncated
constexpr std::size_t kForgotten = 500;  // bursts; far more than practical chains need

double sum(const Row& row) { return std::accumulate(row.begin(), row.end(), 0.0); }

Row times(const Row& row, const Row& diagonal) {
  Row result = row;
  std::ranges::transform(row, diagonal, result.begin(), std::multiplies<>());
  return result;
}

Row times(const Row& row, const std::vector<Row>& matrix) {
  Row result(row.size());
  for (std::size_t i = 0; i < row.size(); ++i) {
    for (std::size_t j = 0; j < row.size(); ++j) result[j] += row[i] * matrix[i][j];
  }
  return result;
}

Row complement(const Row& row) {
  Row result = row;
  std::ranges::transform(row, result.begin(), [](double p) { return 1 - p; });
  return result;
}

Row scaled_to_one(Row row) {
  const double total = sum(row);
  for (auto& value : row) value /= total;
  return row;
}

/// From a datagram of this `kind` with distribution `row`: the distribution of the first one that is not of it.
Row after_run(Row row, const LossChain& chain, const Row& kind) {
  Row result(row.size());
  while (sum(row) > kNothing) {
    row = times(row, chain.step);
    const Row out = times(row, complement(kind));
    std::ranges::transform(result, out, result.begin(), std::plus<>());
    row = times(row, kind);
  }
  return result;
}

}  // namespace

LossChain LossChain::bernoulli(double p) { return {{{1}}, {p}}; }

LossChain LossChain::burst(double loss, double mean_burst) {
  return gilbert(loss / (1 - loss) / mean_burst, 1 / mean_burst, 1, 0);
}

LossChain LossChain::gilbert(double p, double r, double loss_in_bad, double loss_in_good) {
  return {{{1 - p, p}, {r, 1 - r}}, {loss_in_good, loss_in_bad}};
}

LossChain LossChain::four_state(double p13, double p31, double p32, double p23, double p14) {
  return {{{1 - p13 - p14, 0, p13, p14}, {0, 1 - p23, p23, 0}, {p31, p32, 1 - p31 - p32, 0}, {1, 0, 0, 0}},
          {0, 0, 1, 1}};
}

LossChain LossChain::pareto_bursts(double p12, double p21, const std::array<double, 2>& shape,
                                   const std::array<double, 2>& scale, std::size_t longest) {
  const std::array<Row, 2> next = {Row{1 - p12, p12}, Row{p21, 1 - p21}};
  LossChain chain{std::vector<Row>(2 * longest, Row(2 * longest)), Row(2 * longest, 1.0)};
  for (std::size_t i = 0; i < 2; ++i) {
    chain.loss[i * longest] = 0;
    for (std::size_t j = 0; j < 2; ++j) {
      const auto at_least = [&](std::size_t k) {
        return k == longest ? 0 : std::pow(1 + static_cast<double>(k) / scale[j], -shape[j]);
      };
      for (std::size_t k = 0; k < longest; ++k) {
        chain.step[i * longest][j * longest + k] = next[i][j] * (at_least(k) - at_least(k + 1));
        if (k > 0) chain.step[i * longest + k][j * longest + k - 1] = next[i][j];
      }
    }
  }
  return chain;
}

LossChain LossChain::regimes(const std::vector<double>& dwell, double period, std::vector<double> loss) {
  const std::size_t n = dwell.size();
  // exp(A) = exp(A / 2ᵏ)^(2ᵏ), with A / 2ᵏ so small that eight terms of the series are exact.
  constexpr int kHalvings = 8;
  std::vector<Row> rate(n, Row(n));
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      rate[i][j] = std::ldexp(period / dwell[i], -kHalvings) * (i == j ? -1 : 1 / static_cast<double>(n - 1));
    }
  }
  std::vector<Row> power(n, Row(n));
  for (std::size_t i = 0; i < n; ++i) power[i][i] = 1;
  std::vector<Row> step = power;
  for (int term = 1; term <= 8; ++term) {
    for (std::size_t i = 0; i < n; ++i) {
      power[i] = times(power[i], rate);
      for (std::size_t j = 0; j < n; ++j) step[i][j] += power[i][j] /= term;
    }
  }
  for (int k = 0; k < kHalvings; ++k) {
    std::vector<Row> square;
    for (const Row& row : step) square.push_back(times(row, step));
    step = square;
  }
  return {step, std::move(loss)};
}

std::vector<double> LossChain::shares() const {
  // Gauss–Jordan on πS = π with one equation replaced by Σπ = 1. Unlike iteration, it also works for periodic chains.
  const std::size_t n = loss.size();
  std::vector<Row> rows(n, Row(n + 1));
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) rows[j][i] = step[i][j] - (i == j ? 1 : 0);
  }
  std::ranges::fill(rows.back(), 1.0);
  for (std::size_t column = 0; column < n; ++column) {
    const auto pivot = std::ranges::max_element(rows.begin() + static_cast<std::ptrdiff_t>(column), rows.end(), {},
                                                [&](const Row& row) { return std::abs(row[column]); });
    std::swap(*pivot, rows[column]);
    for (std::size_t i = 0; i < n; ++i) {
      if (i == column) continue;
      const double factor = rows[i][column] / rows[column][column];
      for (std::size_t j = column; j <= n; ++j) rows[i][j] -= factor * rows[column][j];
    }
  }
  Row shares(n);
  for (std::size_t i = 0; i < n; ++i) shares[i] = rows[i][n] / rows[i][i];
  return shares;
}

double LossChain::rate() const { return sum(times(shares(), loss)); }

double LossChain::variance_factor() const {
  const double p = rate();
  const Row pi = shares();
  // The change of the state distribution due to the knowledge of one loss.
  Row known = times(pi, loss);
  std::ranges::transform(known, pi, known.begin(), [p](double lost, double share) { return lost - p * share; });
  double covariances = 0;
  for (std::size_t k = 0; k < 1'000'000; ++k) {
    known = times(known, step);
    covariances += sum(times(known, loss));
    if (std::ranges::all_of(known, [](double value) { return std::abs(value) < kNothing; })) break;
  }
  return 1 + 2 * covariances / (p * (1 - p));
}

std::vector<double> LossChain::bursts(std::size_t longest) const {
  Row state = scaled_to_one(times(times(times(shares(), complement(loss)), step), loss));
  std::vector<double> result;
  double at_least = 1;
  while (result.size() + 1 < longest) {
    state = times(times(state, step), loss);
    result.push_back(at_least - sum(state));
    at_least = sum(state);
  }
  result.push_back(at_least);
  return result;
}

std::size_t LossChain::bursts_to_forget() const {
  std::vector<Row> starts;  // one for each state in which a burst can begin: the distribution of the state in which a
  for (std::size_t i = 0; i < loss.size(); ++i) {
    Row state(loss.size());
    state[i] = 1;
    if (loss[i] > 0) starts.push_back(state);
  }
  for (std::size_t bursts = 1; bursts < kForgotten; ++bursts) {
    double apart = 0;
    for (auto& state : starts) {
      state = after_run(after_run(state, *this, loss), *this, complement(loss));
      for (std::size_t i = 0; i < state.size(); ++i) apart = std::max(apart, std::abs(state[i] - starts[0][i]));
    }
    if (apart < 1e-3) return bursts;
  }
  return kForgotten;
}

}  // namespace tendon::injector
