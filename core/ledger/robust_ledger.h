// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/compensated_sum.h"
#include "core/ledger/friction.h"
#include "core/ledger/port.h"

namespace tendon {

/// The energy ledger for a position that an encoder has rounded: a lower bound of EnergyLedger's E as exact
/// sensing would have found it, whatever the true motion between the counts.
///
/// With counts of Δ the plain ledger is wrong in three ways, and each has its remedy here (measured positions are the
/// centres of counts, so each component is off by at most Δ/2):
///
///     work       Σ f·dx measured ≤ Σ f·dx true + (Δ/2) Σ ‖f(k) − f(k−1)‖₁ + (Δ/2) ‖f(n)‖₁      (Abel summation)
///     Coulomb    a hand that rests on the edge of a count earns nothing: the credit is f_c times the net travel
///                since the last turning point, each component less Δ. The path is never shorter than that
///     viscous    once per `window` of N intervals: b ‖D‖² / (T₁ + … + T_N), each component of the net travel D
///                less Δ (Cauchy–Schwarz over the window). A single count at 1 kHz would pass for 30 mm/s
///
/// Credit comes late and never too high, so E − (Δ/2)‖f‖₁ is what may be spent (control.md 8.9, Theorem A; the
/// form for several components is derived here: the spec's play filter, applied to each axis, would follow a
/// diagonal as a staircase and over-credit it by √N).
///
/// One account for N components of isotropic friction. Thread-safe: no. Realtime-safe: yes.
template <int N>
class RobustLedger {
 public:
  struct Config {
    Friction friction;
    double encoder_step = 0;  ///< Δ, m; ≥ 0
    int window = 10;          ///< intervals; ≥ 1
  };

  /// Throws std::invalid_argument naming the field when a value is impossible.
  explicit RobustLedger(const Config& config);

  /// Books one interval. When anything is not finite nothing is booked.
  void observe(const Interval<N>& interval) noexcept;

  /// As EnergyLedger::observe_unseen. Where the hand is now is unknown: travel starts again from zero.
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;

  /// As EnergyLedger::transfer.
  void transfer(double energy) noexcept;

  /// As EnergyLedger::adapt.
  void adapt(const Friction& friction) noexcept;

  double energy() const noexcept { return energy_.value(); }        ///< E, J
  double spendable() const noexcept { return energy() - margin_; }  ///< E − (Δ/2)‖f‖₁, J
  const Friction& friction() const noexcept { return config_.friction; }

 private:
  double travel_beyond_count(const Vec<N>& travel) const noexcept;
  void restart() noexcept;

  Config config_;
  CompensatedSum energy_;
  double margin_ = 0;                     ///< (Δ/2) ‖force held in the last interval‖₁, J
  Vec<N> last_applied_ = Vec<N>::Zero();  ///< N

  Vec<N> from_turn_ = Vec<N>::Zero();  ///< m, net travel since the last turning point
  Vec<N> to_peak_ = Vec<N>::Zero();    ///< m, the longest of it
  double credited_ = 0;                ///< m, of that travel
  double least_coulomb_ = 0;           ///< N, since the turning point

  Vec<N> in_window_ = Vec<N>::Zero();  ///< m, net travel
  Duration window_length_{};
  int in_window_count_ = 0;
  double least_viscous_ = 0;  ///< N·s/m, in the window
};

}  // namespace tendon
