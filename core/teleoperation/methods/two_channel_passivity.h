// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "core/control/stability_controller.h"

namespace tendon {

/// The message of the leader in each period.
template <int N>
struct LeaderMessage {
  std::uint64_t sequence = 0;            ///< 1, 2, …; messages are dropped if they are not newer
  Vec<N> velocity = Vec<N>::Zero();      ///< m/s, mean over the previous interval
  Vec<N> displacement = Vec<N>::Zero();  ///< m, since the start; used to correct position drift
  double energy_in = 0;                  ///< J, energy received from the hand, which cannot decrease
};

/// The message of the follower in each period.
template <int N>
struct FollowerMessage {
  std::uint64_t sequence = 0;
  Vec<N> force = Vec<N>::Zero();  ///< N, to apply to the hand: the negative force on the tool
  double energy_in = 0;           ///< J, energy received from the tool, which cannot decrease
};

/// The leader's end of two-channel time-domain passivity control. The velocity is sent to the follower, and the force
/// is received. For any network, an end can only output energy that was received by the other end before.
///     E_in  = Σ (−F·Δx)₊      E_out = Σ (F·Δx)₊         with the force F applied to the hand
///     F_wanted = F_received − α v,   smallest α ≥ 0 with   T F_wanted·v ≤ E_in,follower(received) − E_out
/// α (N·s/m) is a series damper with the limit `max_damping`, which also avoids the division by a small v. Since E_in
/// does not decrease, an old value is a lower bound, so delay, loss and reordering are safe. The condition uses the
/// current velocity for the next period. If the motion is different, this is included in E_out and compensated in the
/// next period. The error is limited to one period, and is 0 if the motion is known. The f of the papers is −F at the
/// leader and F at the follower. Non-finite messages and intervals are ignored. A non-finite velocity gives a
/// non-finite demand.
///
/// Source: Ryu, Artigas and Preusche, Mechatronics 20(7), 2010 (recalled, not re-read); core/PROOFS.md, "Two-channel
/// passivity control". The prediction by one period and the use of the applied force are ours.
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
template <int N>
class PassivityLeader {
 public:
  struct Config {
    double max_damping = 0;  ///< N·s/m, > 0. A device with viscous friction b can render at most b
    Duration period{};       ///< T, hold time of a command; > 0
  };

  /// Throws std::invalid_argument with the name of the field, its value and the expected value.
  explicit PassivityLeader(const Config& config);

  void receive(const FollowerMessage<N>& message) noexcept;

  /// Returns the requested force for this period. The last received force is used until a newer one arrives.
  Demand<N> command(const Vec<N>& velocity) noexcept;

  LeaderMessage<N> observe(const Interval<N>& interval) noexcept;

  /// J, energy that can still be output: E_in,follower(received) − E_out. This can be negative (see above).
  double energy() const noexcept { return newest_.energy_in - out_; }

 private:
  Config config_;
  FollowerMessage<N> newest_;
  LeaderMessage<N> sent_;
  double out_ = 0;
};

/// The follower's end: computes the velocity of the tool from the force that the tool requires.
///     v = v_received + λ (x_received − ∫ v dt) − β f,   smallest β ≥ 0 with
///     T f·v + ½ K T² v² ≤ E = E_in,leader(received) − E_out
/// f is the applied force on the tool (N) in the same period, and β a parallel admittance (m/(N·s)). K is the stiffness
/// of the controller's spring, whose end moves by T v, so that its force increases by K T v and it stores ½ K T² v²
/// (J). If K > 0, a velocity that violates the condition is replaced by the closest one that satisfies it. This end is
/// exact because all values are known when they are used. The second term restores the displacement that β or lost
/// messages have removed (without it, about 40 mm in a few seconds). It is subject to the same condition, so the drift
/// is only corrected with available energy. In a period without a new message, v_received = 0. Messages are ignored if
/// they are not finite. If the force is not finite, the tool must not move.
///
/// Source: as above; drift compensators: Artigas, Ryu and Preusche, IROS 2010 (recalled, not re-read).
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
template <int N>
class PassivityFollower {
 public:
  struct Config {
    double drift_rate = 0;  ///< λ, 1/s, ≥ 0; not corrected if this is 0
    Duration period{};      ///< T; > 0
    double stiffness = 0;   ///< K of the tool's controller, N/m, ≥ 0; if this is 0, the force is constant in a period
  };

  struct Command {
    Vec<N> velocity;             ///< m/s, velocity of the tool until the next step
    FollowerMessage<N> message;  ///< to send
  };

  /// Throws std::invalid_argument with the name of the field, its value and the expected value.
  explicit PassivityFollower(const Config& config);

  void receive(const LeaderMessage<N>& message) noexcept;

  /// Starts at `displacement` (m), which is also that of the leader. The energies are kept.
  void begin(const Vec<N>& displacement) noexcept;

  /// `force` is the force of the controller on the tool in this period.
  Command step(const Vec<N>& force) noexcept;

  /// m, ∫ v dt: target of the tool's controller.
  const Vec<N>& displacement() const noexcept { return displacement_; }

  /// J, energy that can still be output. This can only be negative because of rounding.
  double energy() const noexcept { return newest_.energy_in - out_; }

 private:
  Config config_;
  LeaderMessage<N> newest_;
  bool fresh_ = false;
  FollowerMessage<N> sent_;
  Vec<N> displacement_ = Vec<N>::Zero();  ///< m, ∫ v dt
  double out_ = 0;
};

}  // namespace tendon
