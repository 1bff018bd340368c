// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"

namespace tendon {

/// A virtual coupling with a slope condition. A static force law passes unchanged if its slope is at most the one that
/// the friction of the device allows. All other laws are connected to the hand by a spring with this slope, K_max. The
/// spring connects the hand to a proxy. The reflective force f = −F becomes g while the proxy does not move, and f(n)
/// if it moves by (g − f(n))/K_max. P is the energy that the proxy has received so far:
///     g    = f(n−1) + K_max Δx(n)
///     f(n) = the force nearest to f_e with  P(n) = P(n−1) + f(n)·(g − f(n))/K_max ≥ 0      (a ball about g/2)
/// in N, m and J, with P(0) = 0. The port is passive for every demand if
///     b ≥ K_max T/2
/// because E(n) ≥ ‖f(n)‖²/(2 K_max) + P(n). A static field that starts at rest, with a convex potential and slopes in
/// [0, K_max], passes unchanged. If a field is late or stiffer, it feels like a spring K_max. The device may reduce the
/// force. If an interval was not measured or not finite, the law restarts from zero force and keeps P.
///
/// Source: the slope condition is that of the nonlinear virtual coupling of Lee & Lee (ref. [17] of IEEE TCST 17(4),
/// 2009), but its formula is not available to us. The law and the proofs are ours: core/PROOFS.md, "Comparison laws".
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
template <int N>
class NonlinearCoupling {
 public:
  struct Config {
    Friction friction;                  ///< f_c is only for the ledger; b > 0
    Duration longest_hold{};            ///< T, > 0
    std::optional<double> max_slope{};  ///< K_max, N/m, in (0, 2b/T], or 2b/T if empty
  };

  /// Throws std::invalid_argument if a field is out of range.
  explicit NonlinearCoupling(const Config& config);

  void observe(const Interval<N>& interval) noexcept;
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;
  LimitedForce<N> limit(const Demand<N>& demand) noexcept;
  double energy() const noexcept { return port_.energy(); }

  double account() const noexcept { return account_; }  ///< P, J

 private:
  double max_slope_;
  EnergyLedger port_;
  Vec<N> returned_ = Vec<N>::Zero();  ///< N, the last result of `limit`, reflective
  Vec<N> elastic_ = Vec<N>::Zero();   ///< g, N
  double account_ = 0;
};

}  // namespace tendon
