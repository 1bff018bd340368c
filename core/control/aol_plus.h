// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "core/control/aol.h"
#include "core/control/stability_controller.h"
#include "core/control/worst_loss.h"
#include "core/ledger/energy_ledger.h"
#include "core/ledger/friction.h"
#include "core/ledger/robust_ledger.h"

namespace tendon {

/// AOL+: the Adjusting Output-Limiter with what it needs on real devices. Each part is there when it is listed; with
/// none it is Aol<Blocks, Size>, bit for bit.
///
///     E ← E + the interval just ended               exactly, or as robust_ledger does
///     E ← min(E, E_cap + C)                         energy_cap
///     Ē = E − (Δ/2)‖F_held‖₁ − Σ ℓ(under way)       robust_ledger, latency_reserve
///     γ : the largest with Σ_i ℓ_i(γ ‖F_i‖) ≤ Ē     ℓ: WorstLoss; bounded_acceleration
///     F = κ(1/γ) γ F_wanted                         knee; κ(r) = min(r, 1) without it
///
/// Why it stays passive: E never exceeds the true ledger (discarding credit is safe, Theorem A of control.md 8), and
/// any force of the same direction below the bound is safe (Theorem B).
///
/// **energy_cap** Waving about in free space earns friction credit without end, and with enough of it the limiter is
/// off: 30 s pay for 18 N. The cap keeps E ≤ E_cap + C, where C is what the hand has put into the present contact and
/// may get back from it: that pays for springs which are let go.
///     C ← max(0, C + work),  C ≤ ‖F_wanted‖ · ‖travel since the contact began‖,  C ≤ C_most
/// A contact ends when nothing is wanted or what is wanted turns round: friction that is dragged to and fro gives
/// nothing back. (Of a spring whose force grows with its travel d no more than F·d can come back. The leak in time of
/// control.md 8.1 would take from a hand that just holds a spring the force that it feels.)
///
/// **robust_ledger** For positions in counts of Δ.
///
/// **knee** Forces from 80 % of the bound on are compressed smoothly instead of clipped: quieter on stiff walls.
///     κ(r) = r                                  r ≤ s
///          = s + (1 − s) tanh((r − s)/(1 − s))  beyond
///
/// **latency_reserve** The force chosen now is held only `holds` periods later: what the forces still under way may
/// take is set aside. K_op → 2b/((holds + 1) T).
///
/// **bounded_acceleration** For devices with next to no damping, where 2b/T is a few N/m. The hand's acceleration is
/// at most a, so in the next hold it travels along F by no more than
///     L = T_max (F̂·Δx/T_act + a (T_act + T_max)/2) + Δ-allowance,   and a larger force is safe (WorstLoss).
/// When an interval shows that the assumption was broken, the plain bound holds for that step, and it is counted. As
/// without damping nothing else limits how hard a wall may be, the force is besides kept below what friction
/// `shaping_viscous` would allow. Not proved for a force held later than the next period: not with latency_reserve.
///
/// **adaptive_friction** The lower bounds follow `adapt`: down at once, up slowly.
///
/// Source: control.md 8.1, 8.4, 8.6, 8.7, 8.9, 8.10, 8.12; for several groups of coordinates derived here from 8.5
/// (box form) with ℓ_i in place of its quadratic. Blocks and Size as in Aol.
template <int Blocks, int Size = 1>
class AolPlus {
 public:
  static constexpr int kSize = Blocks * Size;
  /// Longer output latencies than 16 periods are not a reserve's business.
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

  /// What is empty is not there.
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
  };

  /// Throws std::invalid_argument naming the part and its field.
  explicit AolPlus(const Config& config);

  void observe(const Interval<kSize>& interval) noexcept;
  void observe_unseen(const Vec<kSize>& applied, Duration at_most) noexcept;
  LimitedForce<kSize> limit(const Demand<kSize>& wanted) noexcept;

  /// The ledger of eq. (5) with the positions as they were measured, J: the same account that every law keeps.
  double energy() const noexcept;
  /// What may be spent: Ē before it is cut off at zero, without the reserve. J; a lower bound of the **true** ledger,
  /// below zero by no more than rounding may have hidden.
  double spendable() const noexcept;

  /// The device's friction is now at least this. Without the part adaptive_friction nothing changes.
  void adapt(const std::array<Friction, Blocks>& friction) noexcept;

  /// Intervals in which the hand accelerated by more than bounded_acceleration allows.
  std::uint64_t broken_assumptions() const noexcept { return broken_; }

 private:
  double account() const noexcept;
  void cap(const Vec<kSize>& wanted) noexcept;
  double reserved() const noexcept;
  void watch_acceleration(const Interval<kSize>& interval) noexcept;
  void use(std::size_t block, const Friction& friction) noexcept;

  Parts parts_;
  std::array<Friction, Blocks> friction_;  ///< in use
  Duration longest_hold_;
  std::array<EnergyLedger, Blocks> ledgers_;
  std::optional<std::array<RobustLedger<Size>, Blocks>> robust_;
  double discarded_ = 0;                         ///< J, credit above the cap
  double contact_ = 0;                           ///< C, J
  Vec<kSize> travel_ = Vec<kSize>::Zero();       ///< m, since the contact began
  Vec<kSize> last_wanted_ = Vec<kSize>::Zero();  ///< N
  std::array<Friction, Blocks> target_;
  std::array<WorstLoss, Blocks> losses_;

  std::optional<Vec<kSize>> velocity_;  ///< m/s, mean over the last interval; empty when not known
  Duration last_held_{};
  bool acceleration_holds_ = false;
  std::uint64_t broken_ = 0;

  std::array<double, kMostHolds> under_way_{};  ///< J, what each force chosen but not yet held to its end may take
  std::size_t next_under_way_ = 0;
};

}  // namespace tendon
