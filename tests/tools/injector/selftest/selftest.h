// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "tests/tools/injector/selftest/loss_chain.h"
#include "tests/tools/injector/selftest/statistics.h"

namespace tendon::injector {

/// `tendon-inject selftest`: does the injector do what its profiles say? Each model is asked for many decisions, and
/// what came out is held against its law in closed form: computed here, with doubles and libm, by code that shares
/// nothing with the code that decides.
struct SelftestOptions {
  std::size_t count = 1'000'000;  ///< datagrams for each model
  std::uint64_t seed = 7;
  /// A folder: every histogram in it (*.csv, in folders below too) is one more model.
  std::optional<std::filesystem::path> data = {};
  bool json = false;
};

/// One number that was measured, and the most that it may be. What is exact (times of events, order) has a bound of 0
/// deviations or 1 ns; what is random has the value that a correct injector exceeds with a probability of 1e-7: some
/// hundred checks then fail for one seed in 100 000.
struct Check {
  std::string model;      ///< a profile line
  std::string statistic;  ///< what was measured
  double value = 0;
  double bound = 0;

  bool passed() const { return value <= bound; }  // not a number has not
};

/// Delays of `line` at 1 kHz, against the law F (in ns): Kolmogorov's distance; and, when F is continuous, as an AR(1)
/// Gaussian copula of this rho: with z = Φ⁻¹(F(delay)), its lag-1 autocorrelation against rho, and the innovations
/// (z_t − ρ z_{t−1}) / √(1 − ρ²), which must be independent standard normal variates: Kolmogorov's distance without the
/// allowance that correlated samples need, and their own autocorrelation.
std::vector<Check> check_delays(std::string_view line, const Cdf& law, double rho, bool continuous,
                                const SelftestOptions& options);

/// Losses of `line` against a chain: how many, and the lengths of bursts (chi-square).
std::vector<Check> check_losses(std::string_view line, const LossChain& chain, const SelftestOptions& options);

/// The law, in ns, of a measured histogram: a line is the lower edge of a bin in ms, then its share or count. Read here
/// once more, not by the code that the injector reads it with: straight within a bin, the last as wide as the one
/// before it. None when the file is something else.
std::optional<Cdf> histogram_law(const std::filesystem::path& path);

/// Runs all checks and writes a line for each as soon as it is known: model, statistic, value, bound, PASS or FAIL; or
/// one JSON object; and a line with the counts at the end. True when all have passed. Throws std::invalid_argument when
/// the count is below 1000, std::runtime_error when `data` is no folder or has no histogram in it.
bool selftest(const SelftestOptions& options, std::ostream& out);

}  // namespace tendon::injector
