// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/compensated_sum.h"
#include "core/ledger/friction.h"
#include "core/ledger/port.h"

namespace tendon {

/// The energy ledger for positions from an encoder. It is a lower bound of the E that EnergyLedger computes using the
/// true positions. Positions are rounded to a count Δ, so the error of each component is at most Δ/2. Therefore:
///     work       Σ f·dx measured ≤ Σ f·dx true + (Δ/2) Σ ‖f(k) − f(k−1)‖₁ + (Δ/2) ‖f(n)‖₁      (Abel summation);
///                the ledger subtracts the two terms
///     Coulomb    credits f_c times the net travel since the last turning point, each component reduced by Δ. The path
///                is never shorter. A handle at rest on the edge of a count earns nothing
///     viscous    credits b ‖D‖² / (T₁ + … + T_N) once per `window` of N intervals, each component of the net travel D
///                reduced by Δ (Cauchy–Schwarz). Per interval, one count of 30 µm at 1 kHz would count as 30 mm/s
/// Credit may arrive late but is never too large, so E − (Δ/2)‖f‖₁ can be spent. The ledger uses net travel, because a
/// play filter per axis would follow a diagonal as a staircase and over-credit it by √N.
///
/// Source: core/PROOFS.md, "Encoder counts".
/// One account for N components with isotropic friction. Thread-safe: no. Realtime-safe: yes.
template <int N>
class RobustLedger {
 public:
  struct Config {
    Friction friction;
    double encoder_step = 0;  ///< Δ, m; ≥ 0
    int window = 10;          ///< intervals; ≥ 1
  };

  /// Throws std::invalid_argument with the name of the field if a value is out of range.
  explicit RobustLedger(const Config& config);

  /// Ignores intervals that are not finite.
  void observe(const Interval<N>& interval) noexcept;

  /// As in EnergyLedger. The travel restarts at zero after `observe_unseen`, because the position is unknown.
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;

  void transfer(double energy) noexcept;

  void adapt(const Friction& friction) noexcept;

  double energy() const noexcept { return energy_.value(); }        ///< E, J
  double spendable() const noexcept { return energy() - margin_; }  ///< E − (Δ/2)‖f‖₁, J
  const Friction& friction() const noexcept { return config_.friction; }

 private:
  double travel_beyond_count(const Vec<N>& travel) const noexcept;
  void restart() noexcept;

  Config config_;
  CompensatedSum energy_;
  double margin_ = 0;                     ///< J, (Δ/2) ‖force of the last interval‖₁
  Vec<N> last_applied_ = Vec<N>::Zero();  ///< N

  Vec<N> from_turn_ = Vec<N>::Zero();  ///< m, net travel since the last turning point
  Vec<N> to_peak_ = Vec<N>::Zero();    ///< m, value of from_turn_ when the credited travel was largest
  double credited_ = 0;                ///< m, travel since the turning point that has been credited
  double least_coulomb_ = 0;           ///< N, the minimum value since the turning point

  Vec<N> in_window_ = Vec<N>::Zero();  ///< m, net travel
  Duration window_length_{};
  int in_window_count_ = 0;
  double least_viscous_ = 0;  ///< N·s/m, minimum in the window
};

}  // namespace tendon
