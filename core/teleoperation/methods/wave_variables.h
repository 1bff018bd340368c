// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "core/control/stability_controller.h"
#include "core/teleoperation/methods/playout_clock.h"

namespace tendon {

/// The message that one wave port sends to the other in each period. It holds sums since the start, so that no loss is
/// permanent.
template <int N>
struct WaveMessage {
  std::uint64_t sequence = 0;        ///< 1, 2, …: the periods of the sender; one that came before is dropped
  Duration time{};                   ///< of the sender since it began; grows with `sequence`
  Vec<N> integral = Vec<N>::Zero();  ///< √W·s, ∫ wave dt; half the square of a wave is a power
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
/// **Played out.** What is sent are the sums I = ∫ wave dt and ∫ wave²/2 dt. The receiver plays I out, straight between
/// the messages that came, at the moment τ that PlayoutClock says, and takes the mean Ī over the last W:
///
///     r̂ = ΔĪ / T + (Ī − ∫ r̂ dt) / W,      T r̂²/2 ≤ energy − ∫ r̂²/2 dt
///
/// A wave of the same sum that varies less has less energy than what was sent (Cauchy–Schwarz), so the bound on the
/// right hardly ever acts; it is there for what no assumption covers. The second term is zero but after such a cut or a
/// period of another length. Nothing of the sum is lost by jitter, loss or order, and so neither is the place: both
/// ends end up where they began to within (their friction)/K, K below. When nothing more comes, r̂ is zero after W.
///
/// **Passive in sampled time.** The account A of the port (J) books what really went through it,
///
///     A += T r̂²/2 − T s²/2 − F·Δx
///
/// and s is shortened where it would take A below zero; what was left out of its sum is sent within 200 ms when A has it
/// again.
/// So A + A' + (what is on the way in both directions) is exactly what the two ends have put in, and none of its parts
/// is negative, except that A is when the motion in one period was another than v promised; then nothing is sent until
/// it has been earned back. (The limiter at the device is what bounds the leader's port in every case.)
///
/// **What it feels like.** A spring of K = B/d with the inertia B d, and a damper B when it is let move fast. d is the
/// least way from `observe` to the `command` that uses it plus the playout D, the mean of both directions, plus
/// T + (W − T)/2. So a hand of k_h pressing by Δx at something of k_w feels
///
///     F = Δx / (1/k_h + d/B + 1/k_w)
///
/// Source: Niemeyer and Slotine, IEEE J. Oceanic Eng. 16(1), 1991, and IJRR 23(9), 2004 (both recalled, not re-read);
/// control.md 7. Playing out the sum, the energy counter, and the account for sampled ports, are ours.
///
/// A message or an interval that is not finite is passed over, and so is a message whose time does not lie between
/// those of its neighbours; when `velocity` is not finite, neither is the demand, and the law at the port answers it
/// with zero force.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
template <int N>
class WavePort {
 public:
  struct Config {
    double impedance = 0;                                ///< B, N·s/m; > 0
    Duration period{};                                   ///< T for which a command is to be held; > 0
    Duration smoothing = std::chrono::milliseconds(20);  ///< W; ≥ T and ≤ 256 T, rounded to a whole number of T
    /// The most that D may be; ≥ 0. Messages that wait for more than 255 periods of the sender are played early.
    Duration max_playout = std::chrono::milliseconds(60);
    /// √W, the longest r̂ that is used: no more than half of its square, in W, comes in. The rest comes later.
    double max_wave = std::numeric_limits<double>::infinity();
  };

  /// Throws std::invalid_argument naming the field, its value and what was expected.
  explicit WavePort(const Config& config);

  /// The first message of an other end that began before this one heard of it, or began anew: only what it sends from
  /// now on counts.
  void join(const WaveMessage<N>& first) noexcept;

  /// A message of the other end has come, in whatever order.
  void receive(const WaveMessage<N>& message) noexcept;

  /// The force to want in the period that begins: once in each.
  Demand<N> command(const Vec<N>& velocity) noexcept;

  /// The interval that has just ended; returns what to send.
  WaveMessage<N> observe(const Interval<N>& interval) noexcept;

  /// What the limiter of a port says that lets the line draw on its account (SharesAccount).
  struct SharedAccount {
    double payable = 0;              ///< J, after its `observe`: takes the place of A
    double reserve = 0;              ///< J, ℓ of the force that is wanted: what the limiter needs for itself
    Vec<N> wanted = Vec<N>::Zero();  ///< N, what the line wanted in the interval, of which `applied` was left
  };
  /// The same for a port with a limiter, which cuts forces for want of the energy that the line has. Below the reserve
  /// a fifth of each wave's energy stays here, so that the limiter gets what it needs without the line falling silent;
  /// what a cut force has left out of the sum is sent when there is more than one and a half reserves. The caller
  /// credits `taken` to the limiter and withdraws `given`.
  WaveMessage<N> observe(const Interval<N>& interval, const SharedAccount& account) noexcept;

  /// Does not send any more what was left out.
  void forgive() noexcept { unsent_.setZero(); }

  /// A, J.
  double energy() const noexcept { return account_; }
  /// J ≥ 0, of the waves that came and went in the interval observed last.
  double taken() const noexcept { return taken_; }
  double given() const noexcept { return given_; }

  /// D in use, but for what the clock still has to steer.
  Duration playout() const noexcept { return clock_.playout(); }

 private:
  static constexpr std::size_t kMost = 256;
  static constexpr Duration kLate = std::chrono::milliseconds(200);  ///< what was left out is sent over so long
  static constexpr double kPoorShare = 0.8;

  WaveMessage<N>& heard(std::size_t k) noexcept { return heard_[(begin_ + k) % kMost]; }
  Vec<N> sum_at(Duration time) noexcept;
  WaveMessage<N> observe(const Interval<N>& interval, const Vec<N>& cut, double reserve) noexcept;
  void send(const Vec<N>& wave, double held, double reserve) noexcept;

  Config config_;
  double root_;        ///< √(2B)
  std::size_t means_;  ///< W/T
  PlayoutClock clock_;

  std::array<WaveMessage<N>, kMost> heard_{};  ///< a ring, in their order; the first is before the time played out
  std::size_t begin_ = 0;
  std::size_t count_ = 1;               ///< the sender's start counts as heard
  bool joined_ = false;                 ///< a message has come
  std::array<Vec<N>, kMost> played_{};  ///< a ring of the last W/T values of I
  std::size_t next_ = 0;
  Vec<N> mean_ = Vec<N>::Zero();  ///< Ī

  Vec<N> wave_ = Vec<N>::Zero();  ///< r̂ of this period
  Vec<N> used_integral_ = Vec<N>::Zero();
  double used_energy_ = 0;
  double newest_energy_ = 0;
  double account_ = 0;
  double taken_ = 0;
  double given_ = 0;
  WaveMessage<N> sent_;
  Vec<N> unsent_ = Vec<N>::Zero();  ///< of ∫ wave dt, left out for want of energy
};

}  // namespace tendon
