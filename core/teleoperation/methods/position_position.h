// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/control/stability_controller.h"
#include "core/teleoperation/methods/quiet_stiffness.h"

namespace tendon {

/// The message between the ends of a position–position coupling, in the frame and scale of the receiver.
template <int N>
struct PortMotion {
  std::uint64_t epoch = 1;           ///< epoch of the sender, > 0; increases at each restart (EnergyTank)
  std::uint64_t sequence = 0;        ///< period of the sender: 1, 2, …; older messages and duplicates are ignored
  std::uint64_t answers_epoch = 0;   ///< epoch of the receiver for `answers`, or 0 if there is none
  std::uint64_t answers = 0;         ///< sequence of the receiver's message that was used, or 0 if there is none
  Duration time{};                   ///< time of the sender, ± 2⁶⁰ ns; only used for differences
  Duration round_trip{};             ///< as measured by the sender; 0 if unknown
  Vec<N> position = Vec<N>::Zero();  ///< m
  Vec<N> velocity = Vec<N>::Zero();  ///< m/s
};

/// Limits the stretch y − x (m) of a spring such that ½ K ‖stretch‖² ≤ energy (J, +∞ is allowed). K in N/m, > 0.
/// Thread-safe: yes. Realtime-safe: yes.
template <int N>
Vec<N> paid_stretch(const Vec<N>& stretch, double stiffness, double energy) noexcept {
  const double farthest = std::sqrt(2 * std::max(energy, 0.0) / stiffness);
  const double distance = stretch.norm();
  return distance > farthest ? Vec<N>(stretch * (farthest / distance)) : stretch;
}

/// Couples two handles with a spring and a damper. Both ends use this class.
///     F = K (y − x) + D (ẏ − v) − B v,   ‖F‖ ≤ max_force        N, on the hand at this end
///     K = min(stiffness, 2B/T_loop)                             with `adapt_to_delay`
/// x, v are the position and velocity of this end, and y, ẏ those of the other end: the newest received values,
/// extrapolated to y + ẏ e if they are later than the fastest recent messages by e (e ≤ kMostAhead; beyond that y is
/// constant and ẏ = 0). Without the extrapolation, a message that is 5 ms later than the previous one would cause an
/// error of 1 mm in y at 0.2 m/s, which is a noise of 0.4 N at 400 N/m. The law is isotropic.
///
/// **Dependence of K on the delay** (core/PROOFS.md, "Coupling springs"). A delayed spring generates energy. This
/// energy can be dissipated by a damper of K·T_loop/2 at each end. The coupling is quiet for K ≤ 2B/T_loop, where B is
/// the reliable damping at one end. With a larger K, the pair is still passive because of the limiters and the tank,
/// but it oscillates with 0.04 … 0.08 m/s in free motion for delays above 50 ms.
///
/// **T_loop** is measured without a common clock, by counting the periods since the sequence that a message answers.
/// This includes delay, loss and waiting at the other end. Both ends use the larger of the two measurements, because
/// the forces would differ if the ends used different values of K. T_loop increases immediately. It is the maximum
/// during the last one to two intervals of `recovery`, so that K does not follow the jitter of single messages. A
/// longer interval is not required for passivity, which does not depend on K because of the limiters and the tank. K is
/// changed with the time constant kSettling, because an increase of the delay is not measured at the same time by both
/// ends. Without messages T_loop increases and K decreases; the caller must detect this loss. If K changes while the
/// spring is stretched by δ, the accounts pay ½ ΔK δ².
///
/// **Felt damping** in free motion, for a sine with the peak speed v̂ and the friction b_f, f_c of the follower:
///     b_felt = K·T_loop + B_l + B_f + b_f + 4 f_c/(π v̂)
/// The stiffness that a hand can feel is at most K_op of the two limiters, 1/K_op = T_l/(2 b_l) + T_f/(2 b_f). Both
/// ends must use the same K, D and B up to the scales: K_l = s_f s_x K_f, and the same for D and B. This law is not
/// passive. There must be a limiter and an EnergyTank at both ends.
///
/// Messages that are not finite or out of bounds are dropped and counted in `refused`. If the epoch of the other end
/// increases, all values are reset. Messages of a lower epoch are ignored. If the position is not finite, the demand is
/// not finite, and the limiter sets the force to 0. Before the first message, the force is −B v.
///
/// Source: position–position coupling, Hannaford 1989 (recalled); the bound on K derived here and measured.
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
template <int N>
class PositionPosition {
 public:
  static constexpr Duration kMostAhead = std::chrono::milliseconds(20);  ///< maximum of e
  static constexpr Duration kSettling = QuietStiffness::kSettling;

  struct Config {
    double stiffness = 0;    ///< maximum of K, N/m; > 0
    double damping = 0;      ///< D, N·s/m; ≥ 0
    double own_damping = 0;  ///< B, N·s/m; ≥ 0, and not 0 if adapt_to_delay is true
    bool adapt_to_delay = true;
    Duration period{};                                           ///< of this end, > 0
    std::uint64_t epoch = 1;                                     ///< > 0, see EnergyTank
    Duration recovery = std::chrono::milliseconds(500);          ///< > 0; T_loop can decrease after this time
    double max_force = std::numeric_limits<double>::infinity();  ///< N, > 0
  };

  /// Throws std::invalid_argument with the name of the field, its value and the expected value.
  explicit PositionPosition(const Config& config);

  void receive(const PortMotion<N>& message) noexcept;

  /// Must be called after a loss of the peer. Starts a new measurement of T_loop without the silence.
  void forget_round_trip() noexcept;

  /// Returns the requested force for this period and its stiffness. The caller maps positions (clutch, scale). `energy`
  /// (J) limits the stretch of the spring (paid_stretch).
  Demand<N> command(const Vec<N>& position, const Vec<N>& velocity,
                    double energy = std::numeric_limits<double>::infinity()) noexcept;

  /// Returns the message to send in this period. Must be called after `command`.
  PortMotion<N> message() const noexcept;

  /// Resets the values of the other end and sets the epoch of this end (EnergyTank::renew).
  void renew(std::uint64_t epoch) noexcept;

  /// Sets K, D and B, within the bounds of Config. K changes with the time constant kSettling.
  void become(double stiffness, double damping, double own_damping) noexcept;

  double stiffness() const noexcept { return stiffness_.value(); }  ///< K in use, N/m
  /// T_loop, or 0 if the other end has not answered.
  Duration round_trip() const noexcept { return std::max({loop_, loop_before_, newest_.round_trip}); }
  double ahead() const noexcept { return ahead_; }  ///< e in the last command, s
  std::uint64_t refused() const noexcept { return refused_; }

 private:
  Config config_;
  PortMotion<N> newest_;
  std::uint64_t sequence_ = 0;
  Vec<N> position_ = Vec<N>::Zero();
  Vec<N> velocity_ = Vec<N>::Zero();
  QuietStiffness stiffness_;
  Duration loop_{};         ///< measured here: maximum in the current interval of `recovery`
  Duration loop_before_{};  ///< maximum in the previous interval
  std::uint64_t stretch_began_ = 0;
  double floor_ = 0;  ///< s, minimum of the local time minus the other end's time
  double ahead_ = 0;  ///< s, e
  std::uint64_t refused_ = 0;
};

}  // namespace tendon
