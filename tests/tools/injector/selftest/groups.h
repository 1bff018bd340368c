// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tests/tools/injector/selftest/selftest.h"

namespace tendon::injector {

// In the order of `selftest`. Each group compares the decisions of the injector with the expected distribution.

/// A delay model as text, and its distribution function in ns.
struct DelayLaw {
  std::string line;
  Cdf law;
  bool continuous = true;
};
std::vector<DelayLaw> delay_laws();

std::vector<Check> all_delays(const SelftestOptions& options);
/// Correlation by time, ρ = exp(−Δt / memory), for datagrams at irregular intervals.
std::vector<Check> memory(const SelftestOptions& options);
/// Processes start in their stationary distribution, and links are independent.
std::vector<Check> first_datagrams(const SelftestOptions& options);
std::vector<Check> independence(const SelftestOptions& options);
std::vector<Check> all_losses(const SelftestOptions& options);
std::vector<Check> separation(const SelftestOptions& options);
std::vector<Check> regimes(const SelftestOptions& options);
std::vector<Check> order(const SelftestOptions& options);
std::vector<Check> copies_and_damage(const SelftestOptions& options);
std::vector<Check> bottleneck(const SelftestOptions& options);
std::vector<Check> events(const SelftestOptions& options);

}  // namespace tendon::injector
