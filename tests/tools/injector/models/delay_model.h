// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "core/base/time.h"
#include "tests/tools/injector/models/quantile_table.h"
#include "tests/tools/injector/profile/profile.h"

namespace tendon::injector {

/// The delays of a distribution as a table in nanoseconds. A smooth one's takes some milliseconds to make (a gamma's),
/// so that those made last are kept, and made once for the same numbers.
///
/// Thread-safe: yes.
QuantileTable delay_table(const Delay& delay);

/// Makes independent uniform draws depend on the one before, and leaves each of them uniform: a Gaussian copula AR(1).
///
///     e = Φ⁻¹(draw)     z' = ρz + √(1 − ρ²)e     draw' = Φ(z')
///
/// z is standard normal whatever ρ is, so F⁻¹(draw') has the distribution F exactly. (netem mixes the uniforms
/// themselves, xₙ = (1 − ρ)Uₙ + ρxₙ₋₁, which are then no longer uniform, and every distribution drawn from them is too
/// narrow.) The autocorrelation of z at lag k is ρᵏ; that of the delays is a little below, depending on F.
///
/// All in integers: z in units of 2⁻²⁹, ρ and √(1 − ρ²) in units of 2⁻³⁰, the second computed from the rounded first.
///
/// Thread-safe: no.
class Copula {
 public:
  /// By packet (rho) or by time (memory: ρ = exp(−Δt/memory)), as the fields of Profile.
  Copula(double rho, Duration memory);

  /// Nothing to do: each draw stays as it is.
  bool trivial() const noexcept { return rho_ == 0 && per_ns_ == 0; }

  std::uint64_t next(std::uint64_t draw, LocalTime at) noexcept;

  /// Goes on from where `before` was, with the correlation of this one.
  void continue_from(const Copula& before) noexcept;

 private:
  void set_rho(std::int64_t rho) noexcept;

  std::int64_t rho_ = 0;
  std::int64_t rest_ = 0;     ///< √(1 − ρ²)
  std::uint64_t per_ns_ = 0;  ///< log₂e/memory in units of 2⁻⁶⁴ per ns; 0: by packet
  Duration step_{-1};         ///< the Δt that rho_ is for
  bool started_ = false;
  std::int64_t z_ = 0;
  LocalTime last_{};
};

}  // namespace tendon::injector
