// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"

namespace tendon {

/// The less conservative force-bounding algorithm, which bounds a force by the energy of the current contact.
///     E(n)  = E(n−1) − F(n−1)·Δx + b ‖Δx‖²/T(n)         E(n−1) := 0 first, when F(n−1) = 0 (no contact)
///     F(n)  = F_wanted · min(1, F_max/‖F_wanted‖),       F_max = 2 √( b max(E, 0)/T_max )
/// F is in N on the hand, Δx in m, E in J. Within one contact this is the Adjusting Output-Limiter without Coulomb
/// friction. Resetting a positive E between contacts softens the first millimetres of each contact, and prevents that
/// energy from free motion feeds a vibration. The port is passive for every demand if each force is held for at most
/// T_max, because E never exceeds the ledger of the port (core/PROOFS.md, "Discarded credit").
///
/// Source: Kim, Baek, Ryu, 2015 (recalled; form as in published code), B = b/T · I.
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
template <int N>
class ForceBounding {
 public:
  struct Config {
    Friction friction;        ///< f_c is only for the ledger; b > 0
    Duration longest_hold{};  ///< T_max, > 0
  };

  /// Throws std::invalid_argument if a field is out of range.
  explicit ForceBounding(const Config& config);

  void observe(const Interval<N>& interval) noexcept;
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;
  LimitedForce<N> limit(const Demand<N>& demand) noexcept;
  double energy() const noexcept { return port_.energy(); }

  /// Sets T_max, which must be positive. This is used by the next call of `limit`.
  void hold_at_most(Duration longest_hold) noexcept { viscous_per_hold_ = viscous_ / seconds(longest_hold); }

 private:
  double viscous_;           ///< b, N·s/m
  double viscous_per_hold_;  ///< b/T_max, N/m
  EnergyLedger port_;
  EnergyLedger empty_;   ///< without Coulomb friction
  EnergyLedger budget_;  ///< E
};

/// The more conservative force-bounding algorithm, which bounds a force by the previous force and the last motion only.
///     ‖F(n)‖ ≤ ‖F(n−1) − 2b Δx/T‖
/// F is in N on the hand, F(n−1) is the applied force, and T the longest hold time. Walls feel like a spring with a
/// stiffness of 2b/T. If a bound is not used, it is not saved. The force therefore only grows while the hand moves into
/// the wall, and decreases by 2b/T times the distance of the hand to its deepest point. The port is passive for every
/// demand, because E(n) ≥ T ‖F(n)‖²/(4b) in every step. If a hold was longer than T, the viscous term uses its length.
///
/// Source: Kim, Baek, Ryu, 2015, "more conservative" form with ξ = 1 (recalled; form as in published code);
/// core/PROOFS.md, "Comparison laws".
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
template <int N>
class MemorylessForceBounding {
 public:
  using Config = typename ForceBounding<N>::Config;

  /// Throws std::invalid_argument if a field is out of range.
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
