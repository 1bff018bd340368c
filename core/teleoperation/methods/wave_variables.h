// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "core/control/stability_controller.h"
#include "core/teleoperation/methods/playout_clock.h"

namespace tendon {

/// The message that a wave port sends in each period. The sums since the start make up for lost messages.
template <int N>
struct WaveMessage {
  std::uint64_t sequence = 0;        ///< period of the sender: 1, 2, …, used to ignore duplicates
  Duration time{};                   ///< time of the sender since its start; increases with `sequence`
  Vec<N> integral = Vec<N>::Zero();  ///< √W·s, ∫ wave dt; half of the square of a wave is a power
  double energy = 0;  ///< J, ∫ ‖wave‖²/2 dt, does not decrease; upper bound of the energy of the waves
};

/// Implements one end of a bilateral connection that is passive for any delay. It exchanges wave variables, which
/// contain their own energy, instead of velocity and force.
///     F_wanted = √(2B) r̂ − B v'           r̂: received wave
///     s        = mean of (B v̄ − F) / √(2B) over the last W        s: wave to send;  −F·v̄ = (s² − r²)/2 if W = T
/// B (N·s/m, > 0) is the wave impedance, v̄ = Δx/T the mean velocity in the previous interval, and F the **applied**
/// force in it, after the limiter. F acts on the moving side: on the hand at the leader, on the tool at the follower.
/// With this sign, both ends have the same equations and use the same class. F of Niemeyer and Slotine is −F at the
/// leader and F at the follower; u is the wave from the leader and w the wave from the follower. The mean saves energy,
/// because the displacement comes in encoder counts: a hand at 5 mm/s that moves one count of 30 µm in one of six
/// periods of 1 ms would send six times the energy of a smooth motion.
///
/// v' is the estimated velocity v, corrected so that its integral follows the measured displacement x:
///     v' = v + (x − ∫ v' dt − λ T v) / τ_x,      τ_x = max(B / (150 N/m), W)
/// λ (0 … 1) minimizes the correction, so that an estimate that lags by up to one period is not corrected. If it was
/// not corrected, the errors of the estimator at encoder counts would accumulate in the integral of s, and the two ends
/// would drift apart. If the handle does not move by more than 1.5 counts for 16 ms, v is set to 0, because a handle on
/// the edge of a count is not moving, and because each change of the force reduces a robust ledger by half a count.
///
/// **Playout.** The messages contain I = ∫ wave dt and E = ∫ wave²/2 dt. The receiver interpolates both linearly
/// between messages at the time τ of PlayoutClock, and computes the mean Ī of I over the last W:
///     r̂ = ΔĪ / T + (Ī − ∫ r̂ dt) / 200 ms,      T r̂²/2 ≤ E(τ) − U + max(A − 1.5 reserve, 0)
/// U is the energy used so far and A the account below. A wave with the same integral and less variation has less
/// energy (Cauchy–Schwarz), so the bound is only active while τ catches up. The second term is 0 except after such a
/// limitation or a period of another length. Energy is made available at the time τ and not when it is received.
/// Otherwise, the energy of a burst would be used immediately for a part of its integral, and no energy would be left
/// for the force after that. Jitter, loss, reordering and bursts do not change the integral, so the positions of both
/// ends return to their initial values up to (friction)/K, with K as below. Without messages, r̂ is 0 after W.
///
/// **Passivity in sampled time** (core/PROOFS.md, "Wave variables"). The account A of the port (J) contains the energy
///     A += min(T r̂²/2, E(τ) − U) − T s²/2 − F·Δx
/// s is reduced if A would become negative. The missing part of its sum is sent within 200 ms when A allows it. If A
/// does not allow both, they are reduced together, so that the sum does not drift. So A + A' + (energy in transit in
/// both directions) is exactly the energy received at both ends. No part is negative, but A can become negative if the
/// motion in a period is not v. Nothing is then sent until A is positive. (In all cases the limiter at the device bounds
/// the leader's port.)
///
/// **Felt dynamics.** The hand feels a spring K = B/d with the inertia B d, and a damper B in fast motion. d is the
/// minimum delay from `observe` to the `command` that uses it, plus the playout D, averaged over both directions, plus
/// W. A hand k_h that pushes by Δx on an object k_w feels
///     F = Δx / (1/k_h + d/B + 1/k_w)
/// Messages and intervals that are not finite are ignored, as are messages whose time is not between those of their
/// neighbors. If `velocity` is not finite, the demand is not finite, and the limiter sets the force to 0.
///
/// Source: Niemeyer and Slotine, IEEE J. Oceanic Eng. 16(1), 1991, and IJRR 23(9), 2004 (both recalled, not re-read).
/// The playout of the sum, the energy counter, and the account for sampled ports are ours.
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
template <int N>
class WavePort {
 public:
  static constexpr Duration kSmoothing = std::chrono::milliseconds(12);  ///< default of W
  struct Config {
    double impedance = 0;             ///< B, N·s/m; > 0
    Duration period{};                ///< T, hold time of a command; > 0
    Duration smoothing = kSmoothing;  ///< W, of each end; T … 256 T, rounded to a multiple of T
    /// Maximum of D; ≥ 0. Messages that wait for more than 255 periods of the sender are played out early.
    Duration max_playout = std::chrono::milliseconds(120);
    /// √W, limit of r̂, which bounds the received power (half of its square, in W). The remainder is used later.
    double max_wave = std::numeric_limits<double>::infinity();
    double encoder_step = 0;  ///< m, ≥ 0; one count of the positions, or 0 if exact
  };

  /// Throws std::invalid_argument with the name of the field, its value and the expected value.
  explicit WavePort(const Config& config);

  /// Must be called with the first message of an end that was started earlier or has restarted. Only later waves count.
  void join(const WaveMessage<N>& first) noexcept;

  void receive(const WaveMessage<N>& message) noexcept;  ///< in any order

  /// Returns the requested force for this period. Must be called once per period.
  Demand<N> command(const Vec<N>& velocity) noexcept;

  WaveMessage<N> observe(const Interval<N>& interval) noexcept;

  /// Values of the limiter of a port, whose account the line uses (SharesAccount).
  struct SharedAccount {
    double payable = 0;              ///< J, after `observe` of the limiter, used instead of A
    double reserve = 0;              ///< J, the reserve of the limiter for the requested force, ℓ
    Vec<N> wanted = Vec<N>::Zero();  ///< N, force that the line requested in the interval
  };
  /// For a port with a limiter, which may reduce the force. Below the reserve, a fifth of the energy of each wave is
  /// kept for the limiter. The missing part of the sum also uses the energy beyond 1.5 reserves. The caller must credit
  /// `taken` to the limiter and withdraw `given`.
  WaveMessage<N> observe(const Interval<N>& interval, const SharedAccount& account) noexcept;

  void forgive() noexcept { unsent_.setZero(); }  ///< discards the missing part of the sum
  /// Discards x − ∫ v' dt, because the line does not move with the handle.
  void rest() noexcept {
    ahead_.setZero();
    velocity_.setZero();
    wandered_.setZero();
  }

  double energy() const noexcept { return account_; }  ///< A, J
  /// J, ≥ 0, of the waves received and sent in the last observed interval.
  double taken() const noexcept { return taken_; }
  double given() const noexcept { return given_; }

  Duration playout() const noexcept { return clock_.playout(); }  ///< D; the clock may still be adjusting to it

 private:
  static constexpr std::size_t kMost = 256;
  static constexpr Duration kLate = std::chrono::milliseconds(200);  ///< the missing part is sent within this time
  static constexpr double kPoorShare = 0.8;
  static constexpr double kReserves = 1.5;    ///< a missing part is made up with the energy beyond these reserves
  static constexpr double kTracking = 150.0;  ///< N/m, B/τ_x
  static constexpr double kStill = 1.5;       ///< counts; v = 0 if the handle stays within them for kStillFor
  static constexpr Duration kStillFor = std::chrono::milliseconds(16);

  WaveMessage<N>& heard(std::size_t k) noexcept { return heard_[(begin_ + k) % kMost]; }
  struct Sums {
    Vec<N> integral;
    double energy;
  };
  Sums sums_at(Duration time) noexcept;
  void follow(const Vec<N>& velocity) noexcept;
  void watch_rest(const Vec<N>& dx, Duration held) noexcept;
  WaveMessage<N> observe(const Interval<N>& interval, const Vec<N>& cut, double reserve) noexcept;
  void send(const Vec<N>& wave, double held, double reserve) noexcept;

  Config config_;
  double root_;        ///< √(2B)
  std::size_t means_;  ///< W/T
  double tracking_;    ///< 1/s, 1/τ_x
  PlayoutClock clock_;

  std::array<WaveMessage<N>, kMost> heard_{};  ///< ordered ring buffer; the first one is before the time played out
  std::size_t begin_ = 0;
  std::size_t count_ = 1;               ///< includes the start of the sender
  bool joined_ = false;                 ///< a message was received
  std::array<Vec<N>, kMost> played_{};  ///< ring buffer of the last W/T values of I
  std::size_t next_ = 0;
  Vec<N> mean_ = Vec<N>::Zero();  ///< Ī

  Vec<N> wave_ = Vec<N>::Zero();      ///< r̂ of this period
  Vec<N> velocity_ = Vec<N>::Zero();  ///< v' of this period
  Vec<N> ahead_ = Vec<N>::Zero();     ///< m, x − ∫ v' dt
  Vec<N> wandered_ = Vec<N>::Zero();  ///< m, distance to the center of the last rest, at most 1.5 counts
  Duration still_{};                  ///< time since the handle last moved farther
  Vec<N> used_integral_ = Vec<N>::Zero();
  double used_energy_ = 0;
  double played_energy_ = 0;  ///< E(τ)
  double account_ = 0;
  double spare_ = 0;  ///< J, part of A that can be used for r̂
  double taken_ = 0;
  double given_ = 0;
  WaveMessage<N> sent_;
  std::array<Vec<N>, kMost> due_{};  ///< ring buffer of the last W/T values of ∫ (B v̄ − F)/√(2B) dt
  std::size_t due_next_ = 0;
  Vec<N> due_sum_ = Vec<N>::Zero();  ///< the newest value
  Vec<N> unsent_ = Vec<N>::Zero();   ///< missing part of ∫ wave dt
};

}  // namespace tendon
