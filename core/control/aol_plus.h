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
///     γ : the largest with Σ_i ℓ_i(γ ‖F_i‖) ≤ Ē     ℓ: OutputBound; bounded_acceleration; shaping
///     F₁ = κ(1/γ) γ F_wanted                        knee; κ(r) = min(r, 1) without it
///     F₁ ← F₁ less a share of it                    thrift
///     F₂ = F₁ − D(hand)                             damper
///     F = F₂, no longer than the largest with Σ_i ℓ_i(‖F_i‖) ≤ Ē along F₂
///
/// Why it stays passive: E never exceeds the true ledger (to discard credit is safe, Theorem A of control.md 8), and
/// any force F with Σ ℓ_i(‖F_i‖) ≤ Ē is safe, wherever it comes from (Theorem 1; Theorem B): the last line asks for
/// nothing else, and without a damper the lines before it have seen to that. As in Aol, E ≥ 0 while every hold is no
/// longer than T_max; a hold of length T_act > T_max takes at most ℓ(F) with T_act in place of T_max, less E, from
/// below zero.
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
/// Not proved for a force held later than the next period: not with latency_reserve. Nothing else then limits how hard
/// a wall may be, so it needs shaping.
///
/// **shaping** The force that is wanted is kept below the one of a spring of stiffness K_s that stores Ē,
///     ℓ_s(f) = (f − f_c)₊² / (2 K_s)            J, beside ℓ: f ≤ f_c + √(2 K_s Ē)
/// so no object is shown stiffer than K_s, whatever T is. (b_v of the papers is K_s T/2.) Between this bound and ℓ is
/// the room in which a damper works; a clipped spring alone is a conservative one, and rings.
///
/// **thrift** While the hand is let out (F₁·u > 0, u its velocity, below) and Ē < E_s, a little less is given back than
/// may be:
///     F₁ ← F₁ (1 − σ a n (1 − Ē/E_s)),   a = clamp(F₁·u/(‖F₁‖ (‖u‖ + 2 mm/s)), 0, 1),
///                                        n = clamp((‖F_wanted‖/f_γ − 0.4)/0.4, 0, 1),   f_γ = γ ‖F_wanted‖
/// It leaves the 0.1 to 0.3 mJ with which the next contact begins. And with a robust ledger a force grows only by what
/// the account can pay the counts of, ‖F₁‖ ≤ max(f_c, ‖F_held‖ + Ē/(4Δ)): else a nearly empty account spends on the
/// force's going up and down what the motion earns, and stays empty. A shorter force of the same direction is safe.
///
/// **damper** For the hand that rings on a late or a clipped spring: a damper on fast motion, blind to counts, in contact
/// only, behind the clip. With the velocity v of the interval, the filters and the force of one group of coordinates
///     u₁ ← u₁ + (T/τ_v)(v − u₁),   u ← u + (T/τ_v)(u₁ − u),   s ← s + (T/τ_h)(u − s),   w = u − s       m/s
///     D = min(B h (1 − O/O_most)₊ (1 − v_q/‖w‖)₊ ‖F₁‖/(‖F₁‖ + f_s), ‖F₁‖/‖w‖) w                         N
///     v_q = z Δ/(e τ_v) / (1 + (‖s‖ τ_v/Δ)²)                                                            m/s
///     h = clamp(max((‖F_wanted‖/f_γ − 0.3)/0.4, age/10 ms · min(1, k/(0.3 K_s))), 0, 1)
///     k = ‖F_wanted‖/‖travel since the contact began‖ with energy_cap and shaping, else ∞                 N/m
///     O ← max(0, O − O T/0.3 s − D_held·Δx + (Δ/2)‖D_held − D_before‖₁)                                 J
/// None is needed where a fresh answer is shown well inside the bound. A late spring gives the hand −k · age N·s/m, so a
/// soft one needs little. And a damper never turns a force round: a hand that is drawn out is not held.
/// Δ/(e τ_v) is the height of the pulse that one lone count Δ makes behind the two filters; where counts come faster
/// than the filters forget them, pulses run together and only a ripple is left. A count costs the robust ledger the
/// variation of the damper's force times Δ/2, which is B Δ²/(e τ_v), and friction pays f_c Δ: without the dead zone (z
/// = 0) the damper eats the account. A true vibration above v_q earns instead: D·Δx = B w² T enters as measured work.
/// O is what the damper owes: D_held, what it really took of the force, has to earn what its counts cost.
///
/// **fading_contact** With energy_cap, C fades where it would vanish. With C_b = min(‖F_wanted‖ ‖travel‖, C_most)
///     C ← C + (C_b − C) T/τ_C   while C > C_b;  at a change of sign only the travel starts anew
/// so an object that softens to nothing and comes back does not begin from E_cap. Still E ≤ E_cap + C and credit is
/// only ever discarded: Theorem A holds unchanged. The price: stirring pays for a blow for about τ_C longer.
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

  /// The default of an array is for the movement of a handle, which is the first group of coordinates. The other groups
  /// have no default.
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
    /// a, m/s² or rad/s²; must cover (F_hand + F_motor)/m at their largest. 8.5 N on a handle of 75 g that nobody holds
    /// are 113 m/s²; a tap is some 200 (control.md 8.7).
    std::array<double, Blocks> most{300};
  };
  struct Shaping {
    std::array<double, Blocks> stiffness{1000};  ///< K_s, N/m or N·m/rad, > 0; below 2b/T_max that is in force
  };
  struct Thrift {
    double share = 0.5;     ///< σ, in (0, 1]
    double energy = 0.004;  ///< E_s, J
  };
  struct Damper {
    std::array<double, Blocks> viscous{24};                ///< B, N·s/m or N·m·s/rad; 0: that group is not damped
    std::array<double, Blocks> contact{0.1};               ///< f_s, N or N·m, > 0; a larger force counts as a contact
    Duration smoothing = std::chrono::microseconds(2200);  ///< τ_v, of the velocity
    Duration slow = std::chrono::milliseconds(20);         ///< τ_h: what is slower is not vibration
    double dead_zone = 0.7;                                ///< z, ≥ 0; Δ is the robust ledger's
    double most_owed = 3e-4;                               ///< O_most, J, > 0
  };
  struct FadingContact {
    Duration memory = std::chrono::milliseconds(300);  ///< τ_C
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
    std::optional<Shaping> shaping{};
    std::optional<AdaptiveFriction> adaptive_friction{};
    std::optional<Thrift> thrift{};
    std::optional<Damper> damper{};
    std::optional<FadingContact> fading_contact{};
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
  /// Counts the knee (a bound of F/s lets F through whole), the forces under way and shaping in.
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
  void fade_contact(double most) noexcept;
  double reserved() const noexcept;
  void watch_acceleration(const Interval<kSize>& interval) noexcept;
  void follow_hand(const Interval<kSize>& interval) noexcept;
  void forget_velocity() noexcept;
  double count(std::size_t block) const noexcept;
  OutputBound bound_along(std::size_t block, const Vec<Size>& force, double size) const noexcept;
  double largest_share(const Vec<kSize>& force, double budget) const noexcept;
  OutputBound shaping_along(std::size_t block) const noexcept;
  double shaped_share(const Vec<kSize>& force, double budget) const noexcept;
  double give_back(const Vec<kSize>& force, double size, double near, double budget) const noexcept;
  double grow(double size, double budget) const noexcept;
  double stiff(std::size_t block) const noexcept;
  Vec<kSize> damping(const Vec<kSize>& force, double near, Duration age) const noexcept;
  void shape(Duration age, double near, double budget, LimitedForce<kSize>& result) noexcept;
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

  /// The hand's motion behind the filters of the damper.
  Vec<kSize> once_smoothed_ = Vec<kSize>::Zero();  ///< u₁, m/s
  Vec<kSize> smoothed_ = Vec<kSize>::Zero();       ///< u, m/s
  Vec<kSize> slow_ = Vec<kSize>::Zero();           ///< s, m/s
  Vec<kSize> damped_ = Vec<kSize>::Zero();         ///< N, what the damper took of the force now held
  Vec<kSize> damped_before_ = Vec<kSize>::Zero();  ///< N, and of the one before
  double damper_owes_ = 0;                         ///< O, J
  double held_ = 0;                                ///< N, ‖F_held‖; of thrift
  double smoothing_ = 0;                           ///< τ_v, s; the damper's, or as without one
  double slowness_ = 0;                            ///< τ_h, s

  std::array<double, kMostHolds> under_way_{};  ///< J, the most that each force under way may take
  std::size_t next_under_way_ = 0;
};

}  // namespace tendon
