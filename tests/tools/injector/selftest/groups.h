// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tests/tools/injector/selftest/selftest.h"

namespace tendon::injector {

// Groups of checks, in the order in which `selftest` makes them. Each asks one part of the injector for decisions and
// holds them against their laws.

/// A model of delay, as text, and its distribution function in ns.
struct DelayLaw {
  std::string line;
  Cdf law;
  bool continuous = true;
};
std::vector<DelayLaw> delay_laws();

std::vector<Check> all_delays(const SelftestOptions& options);
/// Correlation by time: ρ = exp(−Δt / memory), for datagrams that come unevenly.
std::vector<Check> memory(const SelftestOptions& options);
/// Many links, one datagram each: what begins, begins as if it had always been so, and no link knows of another.
std::vector<Check> first_datagrams(const SelftestOptions& options);
/// Two streams of delays that should have nothing in common.
std::vector<Check> independence(const SelftestOptions& options);
std::vector<Check> all_losses(const SelftestOptions& options);
/// A lossy profile does nothing to delays.
std::vector<Check> separation(const SelftestOptions& options);
std::vector<Check> regimes(const SelftestOptions& options);
std::vector<Check> order(const SelftestOptions& options);
std::vector<Check> copies_and_damage(const SelftestOptions& options);
std::vector<Check> bottleneck(const SelftestOptions& options);
std::vector<Check> events(const SelftestOptions& options);

}  // namespace tendon::injector
