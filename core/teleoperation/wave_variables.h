// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "core/control/stability_controller.h"

namespace tendon {

/// The message that one wave port sends to the other in each period. It holds sums since the start, so that no loss is
/// permanent.
template <int N>
struct WaveMessage {
  std::uint64_t sequence = 0;        ///< 1, 2, …; a message with one that is not above the newest is dropped
  Vec<N> wave = Vec<N>::Zero();      ///< √W: half its square is a power
  Vec<N> integral = Vec<N>::Zero();  ///< √W·s, ∫ wave dt: what position drift is corrected with
  double energy = 0;  ///< J, ∫ ‖wave‖²/2 dt, never decreasing: the most that may be made of the waves
};

/// One end of a bilateral connection that stays passive however late its messages are. Instead of velocity and force it
/// exchanges wave variables, which carry their own energy.
///
///     F_wanted = √(2B) r̂ − B v            r̂: the wave that came in
///     s        = (B v̄ − F) / √(2B)        s: the wave to send;  −F·v̄ = (s² − r²)/2
///
/// B (N·s/m, any value above zero) is the wave impedance, v the velocity now, v̄ = Δx/T the mean velocity in the
/// interval that has just ended, and F the force that was **really applied** in it: after the limiter, not the one
/// that was wanted. F is the force on whatever moves with v: on the hand at the leader, on the tool at the follower.
/// In this sign both ends have the same equations, so one class serves as both. Niemeyer and Slotine's F is −F at
/// the leader and F at the follower; u is what the leader sends and w what the follower sends.
///
/// **Passive in sampled time.** The account A of the port (J) books what really went through it,
///
///     A += T r̂²/2 − T s²/2 − F·Δx
///
/// and s is shortened where it would take A below zero. So A + A' + (what is on the way in both directions) is exactly
/// what the two ends have put in, and none of its parts is negative, except that A is when the motion in one period
/// was another than v promised; then nothing is sent until it has been earned back. (The limiter at the device is
/// what bounds the leader's port in every case.)
///
/// **Loss, delay that varies, reordering.** For a period in which no newer message came the wave is zero: passive,
/// since it uses less than was sent. (To hold the last wave would be to use its energy twice.) What this leaves of
/// the sender's ∫ wave dt is made good with the rate λ,
///
///     r̂ = wave + λ (integral − ∫ r̂ dt),     T r̂²/2 ≤ energy − ∫ r̂²/2 dt
///
/// and paid from the waves that were sent and not used: so the correction of position drift is passive, too.
///
/// The price: the connection feels like a damper B in free motion, and waves are reflected at an end whose own
/// impedance is not B.
///
/// Source: Niemeyer and Slotine, IEEE J. Oceanic Eng. 16(1), 1991, and IJRR 23(9), 2004 (both recalled, not re-read);
/// control.md 7. The energy counter, and the account for sampled ports, are ours.
///
/// A message or an interval that is not finite is passed over; when `velocity` is not finite, neither is the demand,
/// and the law at the port answers it with zero force.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
template <int N>
class WavePort {
 public:
  struct Config {
    double impedance = 0;   ///< B, N·s/m; > 0
    double drift_rate = 0;  ///< λ, 1/s; ≥ 0; 0 corrects no drift. Well below 1 / (round trip)
    Duration period{};      ///< T for which a command is to be held; > 0. Intervals are booked as long as they were
  };

  /// Throws std::invalid_argument naming the field, its value and what was expected.
  explicit WavePort(const Config& config);

  /// A message of the other end has come, in whatever order.
  void receive(const WaveMessage<N>& message) noexcept;

  /// The force to want in the period that begins.
  Demand<N> command(const Vec<N>& velocity) noexcept;

  /// The interval that has just ended; returns what to send.
  WaveMessage<N> observe(const Interval<N>& interval) noexcept;

  /// A, J.
  double energy() const noexcept { return account_; }

 private:
  Config config_;
  double root_;  ///< √(2B)
  WaveMessage<N> newest_;
  bool fresh_ = false;            ///< `newest_` has not been used
  Vec<N> wave_ = Vec<N>::Zero();  ///< r̂ of this period
  Vec<N> used_integral_ = Vec<N>::Zero();
  double used_energy_ = 0;
  double account_ = 0;
  WaveMessage<N> sent_;
};

}  // namespace tendon
