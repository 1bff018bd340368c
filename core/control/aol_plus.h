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

/// AOL+ is the Adjusting Output-Limiter with optional parts for real devices. Without parts it is equal to Aol<Blocks,
/// Size>: bit for bit with one group of coordinates, and up to rounding with several.
///     E ← E + the last interval                     exactly, or as robust_ledger does
///     E ← min(E, E_cap + C)                         energy_cap
///     Ē = E − (Δ/2)‖F_held‖₁ − Σ ℓ(under way)       robust_ledger, latency_reserve
///     γ : the largest with Σ_i ℓ_i(γ ‖F_i‖) ≤ Ē     ℓ: OutputBound; bounded_acceleration; shaping
///     F₁ = κ(1/γ) γ F_wanted                        knee; κ(r) = min(r, 1) without it
///     F₁ ← F₁ · (1 − a share)                       thrift
///     F₂ = F₁ − D(hand)                             damper
///     F = F₂, shortened to Σ_i ℓ_i(‖F_i‖) ≤ Ē along F₂
/// The port is passive because E never exceeds the true ledger, and because the last line bounds the force whatever the
/// other parts do. If a force is held for T_act > T_max, E can fall below zero by at most ℓ(F) − E, with T_act in ℓ.
///
/// **energy_cap** limits the credit from free motion. Otherwise, 30 s of waving would pay for 18 N. E ≤ E_cap + C,
/// where C is the work of the hand in the current contact, which pays for springs that are released.
///     C ← max(0, C + work),  C ≤ ‖F_wanted‖ · ‖travel since the contact began‖,  C ≤ C_most
/// A contact ends when no force is wanted, or when the wanted force reverses. C does not decay with time, so that the
/// force does not decrease while a hand holds a spring still. A shared account (EnergyTank) also keeps ℓ(F_wanted): the
/// C of a follower is zero, so the cap would discard the energy that its peer paid for the force.
///
/// **robust_ledger** uses RobustLedger for positions in counts of Δ.
///
/// **knee** compresses forces above 80 % of the bound smoothly, which is quieter on stiff walls than clipping.
///     κ(r) = r                                  r ≤ s
///          = s + (1 − s) tanh((r − s)/(1 − s))  beyond
///
/// **latency_reserve** is for devices that apply a force `holds` periods after the step. The energy ℓ of all these
/// forces is reserved. K_op → 2b/((holds + 1) T).
///
/// **bounded_acceleration** is for devices with very little damping, where 2b/T is a few N/m. If the acceleration of
/// the hand is at most a, its travel along F in the next period is at most
///     L = T_max (F̂·Δx/T_act + a (T_act + T_max)/2) + Δ-allowance
/// and a larger force is safe (OutputBound). If an interval violates the assumption, the step uses the plain bound and
/// the violation is counted. Cannot be used with latency_reserve, because the proof only covers the next period.
/// Requires shaping, which limits the stiffness of walls.
///
/// **shaping** keeps the force below that of a spring of stiffness K_s with the energy Ē, for any T:
///     ℓ_s(f) = (f − f_c)₊² / (2 K_s)            J, in addition to ℓ: f ≤ f_c + √(2 K_s Ē)
/// The b_v of the papers is K_s T/2. The damper uses the range up to ℓ. A clipped spring rings without it.
///
/// **thrift** reduces the force slightly while it does work on the hand (F₁·u > 0, u below) and Ē < E_s:
///     F₁ ← F₁ (1 − σ a n (1 − Ē/E_s)),   a = clamp((F₁·u/‖F₁‖ − v₁)/(‖u‖ + 2 mm/s), 0, 1),
///                                        n = clamp((‖F_wanted‖/f_γ − 0.4)/0.4, 0, 1),   f_γ = γ ‖F_wanted‖
/// This leaves 0.1 to 0.3 mJ for the next contact. v₁ is zero, except that with a shared account and a robust ledger it
/// is 1.5 Δ/(e τ_v)/(1 + (‖s‖ τ_h/Δ)²): above the pulse of one count in u if the hand is at rest (s and τ_h below).
/// Otherwise a coupled hand would lose its force, because each count reduces the force for a moment, and the robust
/// ledger pays for both changes. With a robust ledger the force also grows only as far as the account can pay for its
/// counts, ‖F₁‖ ≤ max(f_c, ‖F_held‖ + Ē/(4Δ)). Otherwise an empty account would stay empty.
///
/// **damper** damps fast motion in contact, for hands that ring on a late or clipped spring. For each group of
/// coordinates, with the velocity v of the interval:
///     u₁ ← u₁ + (T/τ_v)(v − u₁),   u ← u + (T/τ_v)(u₁ − u),   s ← s + (T/τ_h)(u − s),   w = u − s       m/s
///     D = min(B' h (1 − O/O_most)₊ (1 − v_q/‖w‖)₊ ‖F₁‖/(‖F₁‖ + f_s), ‖F₁‖/‖w‖) w                        N
///     B' = min(B, max(2.5 P₊/Q, 2 f_s/‖w‖, l B))                                                        N·s/m
///     P ← P + (T/0.1 s)(g·w − P) in N·m/s,   Q ← Q + (T/0.1 s)(‖w‖² − Q) in m²/s²
///     l = clamp((M/m − 1)/2, 0, 1),   m = τ_h ‖F₁‖²/(F₁·w) in kg,   if F₁·u > 0 and F₁·w > 0, else 0
///     v_q = z Δ/(e τ_v) / (1 + (‖s‖ τ_v/Δ)²)                                                            m/s
///     h = clamp(max((‖F_wanted‖/f_γ − 0.3)/0.4, age/10 ms · min(1, k/(0.3 K_s))), 0, 1)
///     k = ‖F_wanted‖/‖travel since the contact began‖ with energy_cap and shaping, else ∞                 N/m
///     O ← max(0, O − O T/0.3 s − D_held·Δx + (Δ/2)‖D_held − D_before‖₁)                                 J
/// g is the undamped force F₁ after the filters of w. P/Q is thus the negative damping of the object, Kτ for a spring
/// that is τ late, and the damper takes more energy than the object gives to the vibration. If the object gives none, as
/// on a hand that is led, or if the learned model compensates τ, D is at most 2 f_s. m is the mass that F₁ would
/// accelerate as it is measured. If it is hardly more than the handle, the hand has let go, and D is not reduced.
/// h is zero for a fresh answer well inside the bound, and small for a soft spring. A late spring acts on the hand like
/// a damper of −k · age N·s/m. The dead zone v_q removes the pulses of single counts, whose cost B Δ²/(e τ_v) would
/// drain the robust ledger. O is the energy that the damper owes for its counts. The force is never reversed.
///
/// **fading_contact** makes C decay instead of resetting it, for objects that soften and return. The work on one object
/// can then pay for an impact for about τ_C longer. With C_b = min(‖F_wanted‖ ‖travel‖, C_most)
///     C ← C + (C_b − C) T/τ_C   while C > C_b;  at a change of sign only the travel starts again
///
/// **adaptive_friction** follows `adapt`: downwards immediately, upwards slowly.
///
/// Source: core/PROOFS.md, "Discarded credit", "Force inside the bound", "Output latency", "Bounded acceleration" and
/// "Encoder counts". Blocks and Size are as in Aol.
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
template <int Blocks, int Size = 1>
class AolPlus {
 public:
  static constexpr int kSize = Blocks * Size;
  static constexpr int kMostHolds = 16;  ///< a reserve for more periods would leave no useful force

  /// Default arrays are for the movement of a handle, the first group of coordinates.
  struct EnergyCap {
    double energy = 0.005;       ///< E_cap, J: quiet on a 20 kN/m wall after 10 s of waving
    double most_contact = 0.13;  ///< C_most, J: F_max · 30 mm / 2 for 8.5 N
  };
  struct Robust {
    std::array<double, Blocks> encoder_step{};  ///< Δ, m or rad
    int window = 10;                            ///< intervals per viscous credit
  };
  struct Knee {
    double start = 0.8;  ///< s, in (0, 1); lower is smoother and reduces the displayed stiffness
  };
  struct LatencyReserve {
    int holds = 1;  ///< 1 to kMostHolds
  };
  struct BoundedAcceleration {
    /// a, m/s² or rad/s². At least (F_hand + F_motor)/m: 113 for 8.5 N on a handle of 75 g, and about 200 for a tap.
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
    std::array<double, Blocks> viscous{24};                ///< B, N·s/m or N·m·s/rad; 0: the group is not damped
    std::array<double, Blocks> contact{0.1};               ///< f_s, N or N·m, > 0; larger forces count as contact
    Duration smoothing = std::chrono::microseconds(2200);  ///< τ_v, of the velocity
    Duration slow = std::chrono::milliseconds(20);         ///< τ_h: slower motion is not vibration
    double dead_zone = 0.7;                                ///< z, ≥ 0
    std::array<double, Blocks> mass{0.3};                  ///< M, kg or kg·m², ≥ 0; 0 sets l = 0
    double most_owed = 3e-4;                               ///< O_most, J, > 0
  };
  struct FadingContact {
    Duration memory = std::chrono::milliseconds(300);  ///< τ_C
  };
  struct AdaptiveFriction {
    Duration rise = std::chrono::seconds(10);  ///< time constant of a rising bound
  };

  /// Unused parts are empty.
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
    bool shared_account = false;  ///< other ports can credit the account (see energy_cap)
  };

  /// Throws std::invalid_argument with the names of the part and its field.
  explicit AolPlus(const Config& config);

  void observe(const Interval<kSize>& interval) noexcept;
  void observe_unseen(const Vec<kSize>& applied, Duration at_most) noexcept;
  LimitedForce<kSize> limit(const Demand<kSize>& wanted) noexcept;

  /// Returns the ledger of eq. (5) for the measured positions in J. All laws publish this account.
  double energy() const noexcept;
  /// Returns Ē in J, before it is limited to zero and before the reserve is subtracted. It is a lower bound of the
  /// **true** ledger, and can be negative by at most the energy that rounding can hide.
  double spendable() const noexcept;

  /// SharesAccount. `credit` and `withdraw` change the exact and the robust ledger alike.
  void credit(double energy) noexcept;
  void withdraw(double energy) noexcept;
  double payable() const noexcept { return spendable() - reserved(); }
  /// Includes the knee (a bound of F/s passes all of F), the forces under way and shaping.
  double worst_loss(const Vec<kSize>& force) const noexcept;

  /// Sets lower bounds of the friction. Does nothing without adaptive_friction.
  void adapt(const std::array<Friction, Blocks>& friction) noexcept;

  /// Takes effect with the next `limit`. T_max must be positive.
  void hold_at_most(Duration longest_hold) noexcept;

  std::uint64_t broken_assumptions() const noexcept { return broken_; }  ///< intervals that broke bounded_acceleration

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
  OutputBound shaping_along(std::size_t block) const noexcept;
  double largest_share(const Vec<kSize>& force, double budget, bool shaping = false) const noexcept;
  double give_back(const Vec<kSize>& force, double size, double near, double budget) const noexcept;
  double grow(double size, double budget) const noexcept;
  double stiff(std::size_t block) const noexcept;
  double let_go(std::size_t block, const Vec<Size>& force, const Vec<Size>& fast) const noexcept;
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

  std::optional<Vec<kSize>> velocity_;  ///< m/s, mean over the last interval; empty if unknown
  Duration last_held_{};
  bool acceleration_holds_ = false;
  std::uint64_t broken_ = 0;

  using MotionAndForce = Eigen::Matrix<double, kSize, 2>;  ///< m/s, and N of the undamped force
  MotionAndForce once_smoothed_ = MotionAndForce::Zero();  ///< column 0: u₁
  MotionAndForce smoothed_ = MotionAndForce::Zero();       ///< column 0: u
  MotionAndForce slow_ = MotionAndForce::Zero();           ///< column 0: s
  std::array<double, Blocks> driven_{};                    ///< P, N·m/s
  std::array<double, Blocks> vibrating_{};                 ///< Q, m²/s²
  Vec<kSize> damped_ = Vec<kSize>::Zero();                 ///< N, the damping in the current force
  Vec<kSize> damped_before_ = Vec<kSize>::Zero();          ///< N, the damping in the previous force
  double damper_owes_ = 0;                                 ///< O, J
  double held_ = 0;                                        ///< N, ‖F_held‖, for thrift
  double smoothing_ = 0;                                   ///< τ_v in s, also used without a damper
  double slowness_ = 0;                                    ///< τ_h, s

  std::array<double, kMostHolds> under_way_{};  ///< J, the reserve for each force
  std::size_t next_under_way_ = 0;
};

}  // namespace tendon
