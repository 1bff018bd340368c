// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"

namespace tendon {

/// Bounds a force by the energy that this contact has earned: the less conservative force-bounding algorithm.
///
///     E(n)  = E(n−1) − F(n−1)·Δx + b ‖Δx‖²/T(n)         E(n−1) := 0 first, when F(n−1) = 0 (no contact)
///     F(n)  = F_wanted · min(1, F_max/‖F_wanted‖),       F_max = 2 √( b max(E, 0)/T_max )
///
/// F in N on the hand, Δx in m, E in J. Without Coulomb friction and within one contact this is the Adjusting
/// Output-Limiter; with it, it does not claim that part of the credit. Forgetting E between contacts costs the first
/// millimetres of each contact and keeps energy won in free motion from feeding a buzz (control.md 8.1).
///
/// Passive for every demand while no hold is longer than T_max: its E is never above the port's ledger, and only credit
/// is thrown away (control.md 8, Theorem A); a debt is never forgotten.
///
/// Source: Kim, Baek, Ryu, 2015 (recalled; form as in published code, control.md 5.3), B = b/T · I.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
template <int N>
class ForceBounding {
 public:
  struct Config {
    Friction friction;        ///< f_c serves the ledger alone; b > 0
    Duration longest_hold{};  ///< T_max, > 0
  };

  /// Throws std::invalid_argument when a field is out of its range.
  explicit ForceBounding(const Config& config);

  void observe(const Interval<N>& interval) noexcept;
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;
  LimitedForce<N> limit(const Demand<N>& demand) noexcept;
  double energy() const noexcept { return port_.energy(); }

  /// From the next `limit` on, T_max is this (> 0).
  void hold_at_most(Duration longest_hold) noexcept { viscous_per_hold_ = viscous_ / seconds(longest_hold); }

 private:
  double viscous_;           ///< b, N·s/m
  double viscous_per_hold_;  ///< b/T_max, N/m
  EnergyLedger port_;
  EnergyLedger empty_;   ///< without Coulomb friction
  EnergyLedger budget_;  ///< E
};

/// Bounds a force by the one before it and the motion since. It remembers nothing else.
///
///     ‖F(n)‖ ≤ ‖F(n−1) − 2b Δx/T‖
///
/// F in N on the hand, F(n−1) the force really held, T the longest hold. It shows a wall as a spring of 2b/T. A step
/// that does not use its bound loses the rest: a force appears only as the hand moves into the wall, and a held force
/// shrinks by 2b/T times the way that the hand has come back from its deepest place.
///
/// Passive for every demand: E(n) ≥ T ‖F(n)‖²/(4b) holds at every step, since
///
///     E(n) ≥ T ‖F(n−1)‖²/(4b) − F(n−1)·Δx + b ‖Δx‖²/T = T/(4b) · ‖F(n−1) − 2b Δx/T‖²
///
/// (in any number of dimensions), and the worst motion in the next hold takes no more than that. After a hold longer
/// than T the viscous term is divided by its measured length, so that an overrun is not credited.
///
/// Source: Kim, Baek, Ryu, 2015, "more conservative" form with ξ = 1 (recalled; form as in published code). Invariant
/// and vector form: control.md 5.3.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
template <int N>
class MemorylessForceBounding {
 public:
  using Config = typename ForceBounding<N>::Config;

  /// Throws std::invalid_argument when a field is out of its range.
  explicit MemorylessForceBounding(const Config& config);

  void observe(const Interval<N>& interval) noexcept;
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;
  LimitedForce<N> limit(const Demand<N>& demand) noexcept;
  double energy() const noexcept { return port_.energy(); }

 private:
  double viscous_;
  double longest_hold_;  ///< s
  EnergyLedger port_;
  double permitted_ = 0;
};

}  // namespace tendon
