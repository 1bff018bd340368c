// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"
#include "core/ledger/output_bound.h"

namespace tendon {

/// The Adjusting Output-Limiter on one ledger; it keeps the direction of the force.
///
/// The port's N = Blocks · Size coordinates come in `Blocks` groups of `Size`. Friction is isotropic within a group
/// (its own lower bounds f_c,i and b_i); all groups share one account:
///
///     E(n) = Σₖ [ −F(k−1)·Δx(k) + Σ_i ( f_c,i ‖Δx_i‖ + b_i ‖Δx_i‖²/T(k) ) ]
///     F    = γ F_wanted,  γ ≤ 1 the largest with  Σ_i T_max (γ‖F_wanted,i‖ − f_c,i)₊²/(4 b_i) ≤ max(E, 0)
///
///     Aol<1>        one axis: eqs (1)–(9) of the paper
///     Aol<1, 3>     a point: friction isotropic in space; the same in every frame ("aol")
///     Aol<3>, <6>   the box form, for joint torques: N·m, rad, τ_c and b of each joint ("aol-box"). Exact when
///                   torques, not Cartesian forces, are held between two steps
///     Aol<2, 3>     a wrench: force and torque, each with its own friction
///
/// The set of forces it allows contains that of one limiter per coordinate with the same history.
///
/// Passive whatever is wanted: E ≥ 0 while every hold is no longer than T_max (OutputBound, Theorem 1).
///
/// Source: Lee & Lee, IEEE TCST 17(4), 2009, eqs (1)–(9), Table I; the joint forms: control.md 8.5.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
template <int Blocks, int Size = 1>
class Aol {
 public:
  static constexpr int kSize = Blocks * Size;

  struct Config {
    std::array<Friction, Blocks> friction;
    Duration longest_hold{};  ///< T_max: no force may be held longer; > 0
  };

  /// Throws std::invalid_argument when a friction bound is negative or longest_hold not above zero.
  explicit Aol(const Config& config);

  void observe(const Interval<kSize>& interval) noexcept;
  void observe_unseen(const Vec<kSize>& applied, Duration at_most) noexcept;
  LimitedForce<kSize> limit(const Demand<kSize>& wanted) noexcept;
  double energy() const noexcept;

  /// SharesAccount: E is then the shared account.
  void credit(double energy) noexcept;
  void withdraw(double energy) noexcept;
  double payable() const noexcept { return energy(); }
  double worst_loss(const Vec<kSize>& force) const noexcept;

  /// From the next `limit` on, T_max is this (> 0).
  void hold_at_most(Duration longest_hold) noexcept;

 private:
  std::array<Friction, Blocks> friction_;
  std::array<EnergyLedger, Blocks> ledgers_;  ///< their sum is the account
  std::array<OutputBound, Blocks> bounds_;
};

/// The paper's form for several degrees of freedom (eq. 10): a ledger and a limiter for each axis by itself.
///
///     E = Σ_i E_i,   |F_i| ≤ f_c,i + 2 √( b_i max(E_i, 0) / T_max )
///
/// Its output depends on the frame and can lose or reverse a lateral force (control.md 8.5); and the bounds must
/// hold for each axis **by itself** for every direction of motion: of isotropic Coulomb friction f_c an axis has
/// f_c/√N (control.md 1.6 (a)). Kept because it is what the paper's experiments ran.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
template <int N>
class PerAxisAol {
 public:
  struct Config {
    Friction friction;        ///< of each axis by itself
    Duration longest_hold{};  ///< T_max; > 0
  };

  /// Throws std::invalid_argument when a friction bound is negative or longest_hold not above zero.
  explicit PerAxisAol(const Config& config);

  void observe(const Interval<N>& interval) noexcept;
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;
  /// `permitted` is that of the axis with the largest bound.
  LimitedForce<N> limit(const Demand<N>& wanted) noexcept;
  /// The least of the accounts, J: none may be negative.
  double energy() const noexcept;

  /// From the next `limit` on, T_max is this (> 0).
  void hold_at_most(Duration longest_hold) noexcept;

 private:
  Friction friction_;
  std::array<EnergyLedger, N> ledgers_;
  OutputBound bound_;
};

}  // namespace tendon
