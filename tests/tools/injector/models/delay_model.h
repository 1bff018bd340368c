// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "core/base/time.h"
#include "tests/tools/injector/models/quantile_table.h"
#include "tests/tools/injector/profile/profile.h"

namespace tendon::injector {

/// In nanoseconds. The table of a smooth distribution takes up to a few milliseconds to build (gamma), so the most
/// recent ones are cached by their parameters. Thread-safe: yes.
QuantileTable delay_table(const Delay& delay);

/// Correlates consecutive uniform draws and keeps each of them uniform, with a Gaussian copula AR(1).
///
///     e = Φ⁻¹(draw)     z' = ρz + √(1 − ρ²)e     draw' = Φ(z')
///
/// z is standard normal for every ρ, so F⁻¹(draw') has exactly the distribution F. (netem mixes the uniforms
/// themselves, xₙ = (1 − ρ)Uₙ + ρxₙ₋₁. These are not uniform, so distributions drawn from them are too narrow.) The
/// autocorrelation of z at lag k is ρᵏ; that of the delays is slightly lower, depending on F.
///
/// Uses integers: z in units of 2⁻²⁹, ρ and √(1 − ρ²) in units of 2⁻³⁰, the latter computed from the rounded ρ.
///
/// Thread-safe: no.
class Copula {
 public:
  /// By packet (rho) or by time (memory: ρ = exp(−Δt/memory)), as in Profile.
  Copula(double rho, Duration memory);

  bool trivial() const noexcept { return rho_ == 0 && per_ns_ == 0; }

  std::uint64_t next(std::uint64_t draw, LocalTime at) noexcept;

  void continue_from(const Copula& before) noexcept;

 private:
  void set_rho(std::int64_t rho) noexcept;

  std::int64_t rho_ = 0;
  std::int64_t rest_ = 0;     ///< √(1 − ρ²)
  std::uint64_t per_ns_ = 0;  ///< log₂e/memory in units of 2⁻⁶⁴ per ns; 0: by packet
  Duration step_{-1};         ///< the Δt for which rho_ was computed
  bool started_ = false;
  std::int64_t z_ = 0;
  LocalTime last_{};
};

}  // namespace tendon::injector
