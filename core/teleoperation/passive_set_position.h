// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"

namespace tendon {

/// The message of one end to the other: where its own end is. It may be sent as seldom and as irregularly as one likes.
template <int N>
struct SetPosition {
  std::uint64_t sequence = 0;        ///< 1, 2, …; a message with one that is not above the newest is dropped
  Vec<N> position = Vec<N>::Zero();  ///< m
};

/// Ties the handle with a spring to a position that arrives late, seldom and in jumps, and moves the spring's other
/// end only as far as there is energy to stretch it: passive set-position modulation.
///
///     F_wanted = K (ȳ − x),   ȳ the nearest to the set position y with   ½ K ‖x − ȳ‖² ≤ E
///
/// E is the ledger of the port (energy_ledger.h), fed with the force really applied: the energy that the hand has put
/// in plus a lower bound of what friction has dissipated. The spring holds ½ K ‖x − ȳ‖² of it; the rest may pay for a
/// jump of the set position. ȳ is chosen again in every period, and so follows y as soon as it can.
///
/// Passive for every sequence of set positions and every motion with K ≤ 2b/T_max, which the constructor asks for: for
/// that K, T (‖F‖ − f_c)₊²/(4b) ≤ ½ K ‖x − ȳ‖² ≤ E, so that a limiter with the same friction and hold never clips its
/// force. It is tight: with K = 2.2 b/T a motion is found that takes E below zero (see the tests).
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
  struct Config {
    double stiffness = 0;     ///< K, N/m; > 0 and ≤ 2b/T_max
    Friction friction;        ///< lower bounds
    Duration longest_hold{};  ///< T_max; > 0
  };

  /// Throws std::invalid_argument naming the field, its value and what was expected.
  explicit PassiveSetPosition(const Config& config);

  void receive(const SetPosition<N>& message) noexcept;

  /// The interval that has just ended.
  void observe(const Interval<N>& interval) noexcept { ledger_.observe(interval.applied, interval.dx, interval.held); }

  /// In place of `observe` when nobody saw the motion.
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept {
    ledger_.observe_unseen(applied.norm(), at_most);
  }

  /// The force to want in the period that begins, and the spring behind it.
  Demand<N> command(const Vec<N>& position) noexcept;

  /// E, J.
  double energy() const noexcept { return ledger_.energy(); }

 private:
  Config config_;
  EnergyLedger ledger_;
  SetPosition<N> newest_;
};

}  // namespace tendon
