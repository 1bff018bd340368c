// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"
#include "core/ledger/output_bound.h"

namespace tendon {

/// The Adjusting Output-Limiter with one ledger. It does not change the direction of the force. The N = Blocks · Size
/// coordinates form `Blocks` groups of `Size` coordinates each. The friction of a group is isotropic and has the lower
/// bounds f_c,i and b_i. All groups share one account:
///     E(n) = Σₖ [ −F(k−1)·Δx(k) + Σ_i ( f_c,i ‖Δx_i‖ + b_i ‖Δx_i‖²/T(k) ) ]
///     F    = γ F_wanted,  γ ≤ 1 the largest with  Σ_i T_max (γ‖F_wanted,i‖ − f_c,i)₊²/(4 b_i) ≤ max(E, 0)
///
///     Aol<1>        one axis: eqs (1)–(9) of the paper
///     Aol<1, 3>     a point with isotropic friction; the same in every frame ("aol")
///     Aol<3>, <6>   the box form for joint torques: N·m, rad, τ_c and b of each joint ("aol-box"). It is exact if
///                   torques, not Cartesian forces, are held between two steps
///     Aol<2, 3>     a wrench: force and torque, each with its own friction
///
/// The port is passive for every demand if each force is held for at most T_max.
/// Source: Lee & Lee, IEEE TCST 17(4), 2009, eqs (1)–(9), Table I; core/PROOFS.md, "Output bound" and "Several
/// coordinates".
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
template <int Blocks, int Size = 1>
class Aol {
 public:
  static constexpr int kSize = Blocks * Size;

  struct Config {
    std::array<Friction, Blocks> friction;
    Duration longest_hold{};  ///< T_max, > 0
  };

  /// Throws std::invalid_argument if a friction bound is negative or longest_hold is not positive.
  explicit Aol(const Config& config);

  void observe(const Interval<kSize>& interval) noexcept;
  void observe_unseen(const Vec<kSize>& applied, Duration at_most) noexcept;
  LimitedForce<kSize> limit(const Demand<kSize>& wanted) noexcept;
  double energy() const noexcept;

  void credit(double energy) noexcept;
  void withdraw(double energy) noexcept;
  double payable() const noexcept { return energy(); }
  double worst_loss(const Vec<kSize>& force) const noexcept;

  /// Sets T_max, which must be positive. This is used by the next call of `limit`.
  void hold_at_most(Duration longest_hold) noexcept;

 private:
  std::array<Friction, Blocks> friction_;
  std::array<EnergyLedger, Blocks> ledgers_;  ///< their sum is the account
  std::array<OutputBound, Blocks> bounds_;
};

/// The form of the paper for several degrees of freedom (eq. 10), with a separate ledger and limiter for each axis.
///     E = Σ_i E_i,   |F_i| ≤ f_c,i + 2 √( b_i max(E_i, 0) / T_max )
/// The friction bounds must be valid for each axis alone, so with isotropic Coulomb friction f_c an axis can only use
/// f_c/√N. The output depends on the frame, and can lose or reverse a lateral force. Use this class to reproduce the
/// experiments of the paper. Source: core/PROOFS.md, "Several coordinates".
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
template <int N>
class PerAxisAol {
 public:
  struct Config {
    Friction friction;        ///< of each axis alone
    Duration longest_hold{};  ///< T_max; > 0
  };

  /// Throws std::invalid_argument if a friction bound is negative or longest_hold is not positive.
  explicit PerAxisAol(const Config& config);

  void observe(const Interval<N>& interval) noexcept;
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;
  LimitedForce<N> limit(const Demand<N>& wanted) noexcept;
  double energy() const noexcept;  ///< the smallest of the accounts, J

  /// Sets T_max, which must be positive. This is used by the next call of `limit`.
  void hold_at_most(Duration longest_hold) noexcept;

 private:
  Friction friction_;
  std::array<EnergyLedger, N> ledgers_;
  OutputBound bound_;
};

}  // namespace tendon
