// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"
#include "core/ledger/output_bound.h"

namespace tendon {

/// The message of one end to the other: where its own end is. It may be sent as seldom and as irregularly as one likes.
template <int N>
struct SetPosition {
  std::uint64_t sequence = 0;        ///< 1, 2, …; a message with one that is not above the newest is dropped
  Vec<N> position = Vec<N>::Zero();  ///< m
};

/// As much of a spring's stretch y − x (m) as an account pays for: the nearest to it with ½ K ‖stretch‖² ≤ energy (J,
/// +∞ is allowed). K in N/m, > 0. Thread-safe: yes. Realtime-safe: yes.
template <int N>
Vec<N> paid_stretch(const Vec<N>& stretch, double stiffness, double energy) noexcept {
  const double farthest = std::sqrt(2 * std::max(energy, 0.0) / stiffness);
  const double distance = stretch.norm();
  return distance > farthest ? Vec<N>(stretch * (farthest / distance)) : stretch;
}

/// Ties the handle with a spring to a position that arrives late, seldom and in jumps, and moves the spring's other
/// end only as far as there is energy to stretch it: passive set-position modulation.
///
///     F_wanted = K (ȳ − x) − B v,   ȳ the nearest to the set position y with   ½ K ‖x − ȳ‖² ≤ E
///
/// E is the ledger of the port (energy_ledger.h), fed with the force really applied: the energy that the hand has put
/// in plus a lower bound of what friction has dissipated. The spring holds ½ K ‖x − ȳ‖² of it; the rest may pay for a
/// jump of the set position. ȳ is chosen again in every period, and so follows y as soon as it can.
///
/// Passive for every sequence of set positions and every motion with K ≤ 2b/T_max, which the constructor asks for: for
/// that K, T (‖F‖ − f_c)₊²/(4b) ≤ ½ K ‖x − ȳ‖² ≤ E, so that a limiter with the same friction and hold never clips its
/// force. It is tight: with K = 2.2 b/T a motion is found that takes E below zero (see the tests). With B > 0 the whole
/// is shortened to the limiter's bound.
///
/// **bounded_acceleration**, as in AolPlus: for devices with next to no damping (b = 0.005 N·s/m: K ≤ 10 N/m). The
/// hand's acceleration is at most `most`, and friction of `shaping_viscous` in place of b says how stiff the spring may
/// be: K ≤ 2 shaping_viscous/T_max. What an OutputBound with that travel allows is the other bound on F; an interval
/// that breaks the assumption, or none yet, leaves the plain bound of b. For exact positions, and forces held from now
/// on.
///
/// **K falls with the delay**, K ≤ 2B/T_loop, once `loop_delay` was told: a stiffer spring to a late position is
/// passive, but buzzes. B is `damping`, rendered here; 0: K stays. K follows with 100 ms, so that no step is felt; a
/// change under stretch is paid from E like a jump.
///
/// Source: Lee and Huang, IEEE T-RO 26(2), 2010 (recalled, not re-read). Differs from what is recalled of it: they book
/// the dissipation once per message as D_min = b (max x − min x)²/(t_{k+1} − t_k), here it is booked in each period as
/// b ‖Δx‖²/T + f_c ‖Δx‖, whose sum is never less (Cauchy–Schwarz); and no energy is passed on between the two
/// ends, because the limiter at the port would not count it.
///
/// For the end that a hand moves. An end that only its spring moves earns nothing and would stay where it is: it
/// follows the other's position with an ordinary position controller.
///
/// A message or an interval that is not finite is passed over; when `position` is not finite, neither is the demand.
/// Before the first message there is no force.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
template <int N>
class PassiveSetPosition {
 public:
  struct BoundedAcceleration {
    double most = 0;             ///< m/s²; > 0. Must cover (F_hand + F_motor)/m at their largest
    double shaping_viscous = 0;  ///< N·s/m; ≥ b
  };

  struct Config {
    double stiffness = 0;     ///< K, N/m; > 0 and ≤ 2b/T_max, or 2 shaping_viscous/T_max
    Friction friction;        ///< lower bounds
    Duration longest_hold{};  ///< T_max; > 0
    double damping = 0;       ///< B, N·s/m; ≥ 0
    std::optional<BoundedAcceleration> bounded_acceleration{};
  };

  /// Throws std::invalid_argument naming the field, its value and what was expected.
  explicit PassiveSetPosition(const Config& config);

  void receive(const SetPosition<N>& message) noexcept;

  /// T_loop: there and back with all waiting, as the caller has measured it. Negative: passed over.
  void loop_delay(Duration round_trip) noexcept;

  /// The interval that has just ended.
  void observe(const Interval<N>& interval) noexcept;

  /// In place of `observe` when nobody saw the motion.
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;

  /// The force to want in the period that begins, and the spring behind it: once in each period. `velocity`, m/s, is
  /// for B.
  Demand<N> command(const Vec<N>& position, const Vec<N>& velocity = Vec<N>::Zero()) noexcept;

  /// K in use, N/m.
  double stiffness() const noexcept { return stiffness_; }

  /// Intervals in which the hand accelerated by more than bounded_acceleration allows.
  std::uint64_t broken_assumptions() const noexcept { return broken_; }

  /// E, J.
  double energy() const noexcept { return ledger_.energy(); }

 private:
  double permitted(const Vec<N>& force) const noexcept;
  void forget_velocity() noexcept;

  Config config_;
  EnergyLedger ledger_;
  OutputBound bound_;
  SetPosition<N> newest_;
  double stiffness_;
  double aim_;                      ///< N/m, where K goes
  std::optional<Vec<N>> velocity_;  ///< m/s, mean of the last interval
  Duration last_held_{};
  bool acceleration_holds_ = false;
  std::uint64_t broken_ = 0;
};

}  // namespace tendon
