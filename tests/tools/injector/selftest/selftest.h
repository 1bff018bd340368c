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

/// Compares many decisions of each model with its law in closed form. The laws use doubles and libm and share no code
/// with the decision core.
struct SelftestOptions {
  std::size_t count = 1'000'000;
  std::uint64_t seed = 7;
  /// Each histogram in this folder (*.csv, recursively) adds a model.
  std::optional<std::filesystem::path> data = {};
  bool json = false;
};

/// The bound of exact quantities (times of events, order) is 0 deviations or 1 ns. A correct injector exceeds that of a
/// random one with a probability of 1e-7, so some hundred checks fail for one seed in 100 000.
struct Check {
  std::string model;  ///< a profile line
  std::string statistic;
  double value = 0;
  double bound = 0;

  bool passed() const { return value <= bound; }  // false for NaN
};

/// Kolmogorov distance of the delays of `line` at 1 kHz from the law F (in ns). If F is continuous, also the AR(1)
/// Gaussian copula with this rho: with z = Φ⁻¹(F(delay)), the lag-1 autocorrelation of z, and the innovations (z_t − ρ
/// z_{t−1}) / √(1 − ρ²), which must be independent standard normal variates. Their bound does not depend on the
/// correlation.
std::vector<Check> check_delays(std::string_view line, const Cdf& law, double rho, bool continuous,
                                const SelftestOptions& options);

/// Rate and burst lengths (chi-square).
std::vector<Check> check_losses(std::string_view line, const LossChain& chain, const SelftestOptions& options);

/// In ns. A line is the lower edge of a bin in ms and its share or count; linear within a bin; the last bin is as wide
/// as its predecessor. Independent of the injector's parser. Returns nullopt if the file is not a histogram.
std::optional<Cdf> histogram_law(const std::filesystem::path& path);

/// Writes a line for each check (model, statistic, value, bound, PASS or FAIL, or one JSON object) and the totals.
/// Returns true if all have passed. Throws std::invalid_argument if the count is below 1000, and std::runtime_error if
/// `data` is not a folder or contains no histogram.
bool selftest(const SelftestOptions& options, std::ostream& out);

}  // namespace tendon::injector
