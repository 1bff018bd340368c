// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"
#include "core/ledger/friction.h"
#include "core/ledger/output_bound.h"
#include "core/ledger/robust_ledger.h"

namespace tendon {

/// AOL+: the Adjusting Output-Limiter with what it needs on real devices, as parts. A part that is not listed is not
/// used and costs nothing; without any it is Aol<Blocks, Size>, bit for bit.
///
///     E ← E + the interval just ended               exactly, or as robust_ledger does
///     E ← min(E, E_cap + C)                         energy_cap
///     Ē = E − (Δ/2)‖F_held‖₁ − Σ ℓ(under way)       robust_ledger, latency_reserve
///     γ : the largest with Σ_i ℓ_i(γ ‖F_i‖) ≤ Ē     ℓ: OutputBound; bounded_acceleration
///     F = κ(1/γ) γ F_wanted                         knee; κ(r) = min(r, 1) without it
///
/// Why it stays passive: E never exceeds the true ledger (to discard credit is safe, Theorem A of control.md 8), and
/// any force of the same direction below the bound is safe (Theorem B). As in Aol, E ≥ 0 while every hold is no longer
/// than T_max; a hold of length T_act > T_max takes at most ℓ(F) with T_act in place of T_max, less E, from below zero.
///
/// **energy_cap** Free motion earns friction credit without end, and enough credit switches the limiter off: 30 s of
/// waving pay for 18 N. The cap keeps E ≤ E_cap + C, where C is the work that the hand has put into the present contact
/// and may get back from it: that pays for springs which are let go.
///     C ← max(0, C + work),  C ≤ ‖F_wanted‖ · ‖travel since the contact began‖,  C ≤ C_most
/// A contact ends when no force is wanted, or when the wanted force reverses: friction that is dragged to and fro gives
/// nothing back. (A spring whose force grows with its travel d returns at most F·d. The leak in time of control.md 8.1
/// would weaken the force on a hand that just holds a spring.)
///
/// An account that ports share (Purse) keeps ℓ(F_wanted) besides: E ≤ E_cap + C + ℓ(F_wanted). A follower's port does
/// work, so it has no C of its own, and what its peer paid for the force would be discarded each period (README of
/// core/teleoperation has the figures).
///
/// **robust_ledger** For positions in counts of Δ.
///
/// **knee** Forces above 80 % of the bound are compressed smoothly instead of clipped: quieter on stiff walls.
///     κ(r) = r                                  r ≤ s
///          = s + (1 − s) tanh((r − s)/(1 − s))  beyond
///
/// **latency_reserve** The force chosen now is held only `holds` periods later: the most that the forces still under
/// way may take is set aside. K_op → 2b/((holds + 1) T).
///
/// **bounded_acceleration** For devices with next to no damping, where 2b/T is a few N/m. The hand's acceleration is
/// at most a, so in the next hold it travels along F by no more than
///     L = T_max (F̂·Δx/T_act + a (T_act + T_max)/2) + Δ-allowance,   and a larger force is safe (OutputBound).
/// When an interval shows that the assumption was broken, the plain bound holds for that step, and it is counted.
/// Without damping nothing else limits how hard a wall may be, so the force is also kept below what friction of
/// `shaping_viscous` would allow. Not proved for a force held later than the next period: not with latency_reserve.
///
/// **adaptive_friction** The lower bounds follow `adapt`: down at once, up slowly.
///
/// Source: control.md 8.1, 8.4, 8.6, 8.7, 8.9, 8.10, 8.12; for several groups of coordinates derived here from 8.5
/// (box form) with ℓ_i in place of its quadratic. Blocks and Size as in Aol.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
template <int Blocks, int Size = 1>
class AolPlus {
 public:
  static constexpr int kSize = Blocks * Size;
  /// A reserve for more than 16 periods would leave no force worth rendering.
  static constexpr int kMostHolds = 16;

  struct EnergyCap {
    double energy = 0.005;       ///< E_cap, J: with it a 20 kN/m wall after 10 s of waving is quiet (control.md 8.1)
    double most_contact = 0.13;  ///< J, the most C may be: F_max · 30 mm / 2 for 8.5 N
  };
  struct Robust {
    std::array<double, Blocks> encoder_step{};  ///< Δ, m or rad
    int window = 10;                            ///< intervals per viscous credit
  };
  struct Knee {
    double start = 0.8;  ///< s, in (0, 1): lower is smoother, and costs displayed stiffness
  };
  struct LatencyReserve {
    int holds = 1;  ///< 1 to kMostHolds
  };
  struct BoundedAcceleration {
    std::array<double, Blocks> most{};  ///< a, m/s² or rad/s²; must cover (F_hand + F_motor)/m at their largest
    std::array<double, Blocks> shaping_viscous{};  ///< N·s/m, ≥ b: K_op → 2 · this / T_max
  };
  struct AdaptiveFriction {
    Duration rise = std::chrono::seconds(10);  ///< time constant with which a bound may go up
  };

  /// Empty: not used, costs nothing. AolPart (aol_parts.h) lists them by name.
  struct Parts {
    std::optional<EnergyCap> energy_cap{};
    std::optional<Robust> robust_ledger{};
    std::optional<Knee> knee{};
    std::optional<LatencyReserve> latency_reserve{};
    std::optional<BoundedAcceleration> bounded_acceleration{};
    std::optional<AdaptiveFriction> adaptive_friction{};
  };

  struct Config {
    std::array<Friction, Blocks> friction{};
    Duration longest_hold{};  ///< T_max; > 0
    Parts parts{};
    bool shared_account = false;  ///< other ports pay into the account: see energy_cap
  };

  /// Throws std::invalid_argument naming the part and its field.
  explicit AolPlus(const Config& config);

  void observe(const Interval<kSize>& interval) noexcept;
  void observe_unseen(const Vec<kSize>& applied, Duration at_most) noexcept;
  LimitedForce<kSize> limit(const Demand<kSize>& wanted) noexcept;

  /// The ledger of eq. (5) with the positions as they were measured, J: the same account that every law keeps.
  double energy() const noexcept;
  /// What may be spent: Ē before it is cut off at zero, and before the reserve is set aside. J; a lower bound of the
  /// **true** ledger, below zero by at most what rounding may have hidden.
  double spendable() const noexcept;

  /// SharesAccount. `credit` and `withdraw` change the exact and the robust ledger alike.
  void credit(double energy) noexcept;
  void withdraw(double energy) noexcept;
  double payable() const noexcept { return spendable() - reserved(); }
  /// Counts the knee (a bound of F/s lets F through whole), the forces under way and shaping_viscous in.
  double worst_loss(const Vec<kSize>& force) const noexcept;

  /// The device's friction is now at least this. Without the part adaptive_friction nothing changes.
  void adapt(const std::array<Friction, Blocks>& friction) noexcept;

  /// From the next `limit` on, T_max is this (> 0).
  void hold_at_most(Duration longest_hold) noexcept;

  /// Intervals in which the hand accelerated by more than bounded_acceleration allows.
  std::uint64_t broken_assumptions() const noexcept { return broken_; }

 private:
  double account() const noexcept;
  void cap(const Vec<kSize>& wanted) noexcept;
  double reserved() const noexcept;
  void watch_acceleration(const Interval<kSize>& interval) noexcept;
  void forget_velocity() noexcept;
  void use(std::size_t block, const Friction& friction) noexcept;

  Parts parts_;
  bool shared_;
  std::array<Friction, Blocks> friction_;  ///< in use
  Duration longest_hold_;
  std::array<EnergyLedger, Blocks> ledgers_;
  std::optional<std::array<RobustLedger<Size>, Blocks>> robust_;
  double discarded_ = 0;                         ///< J, credit above the cap
  double contact_ = 0;                           ///< C, J
  Vec<kSize> travel_ = Vec<kSize>::Zero();       ///< m, since the contact began
  Vec<kSize> last_wanted_ = Vec<kSize>::Zero();  ///< N
  std::array<Friction, Blocks> target_;
  std::array<OutputBound, Blocks> bounds_;

  std::optional<Vec<kSize>> velocity_;  ///< m/s, mean over the last interval; empty when not known
  Duration last_held_{};
  bool acceleration_holds_ = false;
  std::uint64_t broken_ = 0;

  std::array<double, kMostHolds> under_way_{};  ///< J, the most that each force under way may take
  std::size_t next_under_way_ = 0;
};

}  // namespace tendon
