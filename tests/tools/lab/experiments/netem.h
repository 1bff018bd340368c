// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <random>
#include <string>

namespace tendon::lab {

/// get_crandom() in Linux' net/sched/sch_netem.c:
///     x_t = (U_t (2³² − ρ') + x_{t−1} ρ') / 2³²,   ρ' = ρ + 1 in units of 2⁻³², U uniform in 0 … 2³² − 1
/// The result is not uniform: its variance is 1/12 · (1 − ρ)/(1 + ρ).
///
/// Thread-safe: no.
class NetemRandom {
 public:
  /// The `correlation` must be at least 0 (independent) and less than 1. The value in `loss 10% 50%` is 0.5.
  NetemRandom(double correlation, std::uint64_t seed);
  std::uint32_t next();

 private:
  std::uint64_t rho_;
  std::uint32_t last_ = 0;
  std::mt19937_64 random_;
};

struct NetemOptions {
  std::size_t count = 1'000'000;               ///< datagrams per line
  std::uint64_t seed = 7;                      ///< of both
  std::optional<std::filesystem::path> out{};  ///< folder for netem.csv and the figure
  std::string command{};                       ///< repeats the run
  bool json = false;
};

/// Actual loss rates, bursts, delays and autocorrelation for a requested correlation, by tc-netem and by the injector.
void netem(const NetemOptions& options, std::ostream& out);

}  // namespace tendon::lab
