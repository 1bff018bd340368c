// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/control/stability_controller.h"
#include "core/teleoperation/methods/quiet_stiffness.h"

namespace tendon {

/// What one end of a position–position coupling tells the other, in the receiver's frame and scale.
template <int N>
struct PortMotion {
  std::uint64_t epoch = 1;     ///< of the sender, > 0: above every one before when it starts anew (Purse)
  std::uint64_t sequence = 0;  ///< the sender's period in it: 1, 2, …; one that is not above the newest is dropped
  std::uint64_t answers_epoch = 0;   ///< the receiver's epoch that `answers` belongs to; 0: none yet
  std::uint64_t answers = 0;         ///< sequence of the receiver's motion that the sender used; 0: none yet
  Duration time{};                   ///< the sender's own: only differences are used; ± 2⁶⁰ ns
  Duration round_trip{};             ///< that the sender has measured; 0: not yet
  Vec<N> position = Vec<N>::Zero();  ///< m
  Vec<N> velocity = Vec<N>::Zero();  ///< m/s
};

/// As much of a spring's stretch y − x (m) as an account pays for: the nearest to it with ½ K ‖stretch‖² ≤ energy (J,
/// +∞ is allowed). K in N/m, > 0. Thread-safe: yes. Realtime-safe: yes.
template <int N>
Vec<N> paid_stretch(const Vec<N>& stretch, double stiffness, double energy) noexcept {
  const double farthest = std::sqrt(2 * std::max(energy, 0.0) / stiffness);
  const double distance = stretch.norm();
  return distance > farthest ? Vec<N>(stretch * (farthest / distance)) : stretch;
}

/// Ties two handles with a spring and a damper, each end by itself: the same class at both.
///
///     F = K (y − x) + D (ẏ − v) − B v,   ‖F‖ ≤ max_force        N, on whoever holds this end
///     K = min(stiffness, 2B/T_loop)                             with `adapt_to_delay`
///
/// x, v are this end's position and velocity, y, ẏ the other's: the newest that came, and y + ẏ e when that is by e
/// later than the quickest messages lately (e ≤ kMostAhead, then y stands still and ẏ is 0). F acts along each axis by
/// itself and is the same in every frame.
///
/// **Why K falls with the delay.** The late spring lags behind the motion and gives out what a damper of K·T_loop/2 at
/// each end takes up; with K ≤ 2B/T_loop the coupling is quiet (B: all damping at one end that is sure). Above it the
/// limiters and the purse keep the pair passive, but it buzzes: 0.04 … 0.08 m/s in free motion from 50 ms on.
///
/// **T_loop** is measured without a clock: a message says which of our motions it answers, and our periods since then
/// are counted, so delay, loss and the other end's waiting are all in it. Both ends take the longer of what they
/// measured: two different K would hold two different forces. T_loop rises at once; it falls after `recovery`, being
/// the longest of the last one to two of these, so that a held force does not waver. K follows with kSettling: the two
/// ends learn of a longer way at different times, and a step of K would be felt. When nothing comes T_loop grows and K
/// falls; when to give up is the caller's business (the loss ladder). A change of K under stretch costs ½ ΔK δ², which
/// the accounts pay.
///
/// **Why y + ẏ e.** A message that is 5 ms later than the last one leaves y 1 mm behind at 0.2 m/s: 0.4 N of noise at
/// 400 N/m. Measured free motion at RTT 10 ms with 5 ms of jitter: see the README.
///
/// **What it feels like** in free motion, as a damper, with a sine of peak speed v̂ and the follower's friction b_f,
/// f_c:
///
///     b_felt = K·T_loop + B_l + B_f + b_f + 4 f_c/(π v̂)
///
/// and a hand cannot feel a coupling stiffer than K_op of the two limiters, 1/K_op = T_l/(2 b_l) + T_f/(2 b_f). Both
/// ends need the same K, D and B up to the scale of the map: K_l = s_f s_x K_f, and so D and B.
///
/// This law is not passive. It needs a limiter and a Purse at both ends.
///
/// A message that is not finite or out of its bounds is dropped and counted in `refused`. A higher epoch of the other
/// end begins anew with it; one of a lower epoch is passed over. When the position is not finite, neither is the
/// demand, which the limiter turns to zero. Before the first message only −B v.
///
/// Source: position–position coupling, Hannaford 1989 (recalled); the bound on K derived here and measured.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
template <int N>
class PositionPosition {
 public:
  /// e is at most this.
  static constexpr Duration kMostAhead = std::chrono::milliseconds(20);
  /// The time constant with which K follows T_loop.
  static constexpr Duration kSettling = QuietStiffness::kSettling;

  struct Config {
    double stiffness = 0;    ///< most K, N/m; > 0
    double damping = 0;      ///< D, N·s/m; ≥ 0
    double own_damping = 0;  ///< B, N·s/m; ≥ 0, and > 0 with adapt_to_delay
    bool adapt_to_delay = true;
    Duration period{};        ///< of this end, > 0
    std::uint64_t epoch = 1;  ///< > 0, as the Purse's
    /// T_loop falls when it has been shorter for one to two of these; > 0.
    Duration recovery = std::chrono::seconds(5);
    double max_force = std::numeric_limits<double>::infinity();  ///< N, > 0
  };

  /// Throws std::invalid_argument naming the field, its value and what was expected.
  explicit PositionPosition(const Config& config);

  void receive(const PortMotion<N>& message) noexcept;

  /// After a loss of the peer: T_loop is measured anew, without the silence in it.
  void forget_round_trip() noexcept;

  /// Begins a period: the force to want in it, and the spring behind it. The caller maps positions (clutch, scale).
  /// `energy`, J: the spring is stretched only as far as this pays (paid_stretch).
  Demand<N> command(const Vec<N>& position, const Vec<N>& velocity,
                    double energy = std::numeric_limits<double>::infinity()) noexcept;

  /// What to send in this period, after `command`.
  PortMotion<N> message() const noexcept;

  /// Forgets the other end, and has another epoch itself (Purse::renew).
  void renew(std::uint64_t epoch) noexcept;

  /// K, D and B from now on, each in its bounds of Config. K goes there within kSettling.
  void become(double stiffness, double damping, double own_damping) noexcept;

  double stiffness() const noexcept { return stiffness_.value(); }  ///< K in use, N/m
  /// T_loop in use; zero until the other end has answered.
  Duration round_trip() const noexcept { return std::max({loop_, loop_before_, newest_.round_trip}); }
  double ahead() const noexcept { return ahead_; }  ///< e of the newest command, s
  std::uint64_t refused() const noexcept { return refused_; }

 private:
  Config config_;
  PortMotion<N> newest_;
  std::uint64_t sequence_ = 0;
  Vec<N> position_ = Vec<N>::Zero();
  Vec<N> velocity_ = Vec<N>::Zero();
  QuietStiffness stiffness_;
  Duration loop_{};         ///< measured here: the longest of this stretch of `recovery`
  Duration loop_before_{};  ///< of the stretch before
  std::uint64_t stretch_began_ = 0;
  double floor_ = 0;  ///< s, our time less the other's when its message is used: the least lately
  double ahead_ = 0;  ///< s, e
  std::uint64_t refused_ = 0;
};

}  // namespace tendon
