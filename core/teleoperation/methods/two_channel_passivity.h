// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "core/control/stability_controller.h"

namespace tendon {

/// The message that the leader's port sends in each period.
template <int N>
struct LeaderMessage {
  std::uint64_t sequence = 0;            ///< 1, 2, …; a message with one that is not above the newest is dropped
  Vec<N> velocity = Vec<N>::Zero();      ///< m/s, mean over the interval that has just ended
  Vec<N> displacement = Vec<N>::Zero();  ///< m, since the start: what position drift is corrected with
  double energy_in = 0;                  ///< J, what the leader's port has taken in, never decreasing
};

/// The message that the follower's port sends in each period.
template <int N>
struct FollowerMessage {
  std::uint64_t sequence = 0;
  Vec<N> force = Vec<N>::Zero();  ///< N, that the hand is to feel: the negative of the force on the tool
  double energy_in = 0;           ///< J, what the follower's port has taken in, never decreasing
};

/// The leader's end of two-channel time-domain passivity control: velocity goes out, force comes back, and neither end
/// gives out energy that the other has not taken in before, whatever the network does.
///
///     E_in  = Σ (−F·Δx)₊      E_out = Σ (F·Δx)₊         of the force F really applied on the hand
///     F_wanted = F_received − α v,   α ≥ 0 the least with   T F_wanted·v ≤ E_in,follower(received) − E_out
///
/// a damper in series (α, N·s/m), at most `max_damping`, which also keeps the division by a small v at bay. Since
/// E_in never decreases, an old one is a lower bound: delay, loss and reordering only make it careful. The condition
/// looks one period ahead with the velocity now; where the motion was another, E_out has it right afterwards and
/// the next period makes it good, so the channel can be short by what one period changed; with a motion that is known
/// it is exact. The papers' f is −F at the leader, and F at the follower.
///
/// Source: Ryu, Artigas and Preusche, Mechatronics 20(7), 2010 (recalled, not re-read); control.md 7. Ours is: one
/// period ahead, and booked with the force really applied.
///
/// A message or an interval that is not finite is passed over; when `velocity` is not finite, neither is the demand.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
template <int N>
class PassivityLeader {
 public:
  struct Config {
    double max_damping = 0;  ///< N·s/m; > 0. For a device with viscous friction b no more than b can be rendered
    Duration period{};       ///< T for which a command is to be held; > 0
  };

  /// Throws std::invalid_argument naming the field, its value and what was expected.
  explicit PassivityLeader(const Config& config);

  void receive(const FollowerMessage<N>& message) noexcept;

  /// The force to want in the period that begins; the last one received stays until a newer one comes.
  Demand<N> command(const Vec<N>& velocity) noexcept;

  /// The interval that has just ended; returns what to send.
  LeaderMessage<N> observe(const Interval<N>& interval) noexcept;

  /// The energy that may still be given out, J: E_in,follower(received) − E_out. Below zero: see above.
  double energy() const noexcept { return newest_.energy_in - out_; }

 private:
  Config config_;
  FollowerMessage<N> newest_;
  LeaderMessage<N> sent_;
  double out_ = 0;
};

/// The follower's end: the velocity to make the tool follow, given the force that this takes.
///
///     v = v_received + λ (x_received − ∫ v dt) − β f,   β ≥ 0 the least with
///     T f·v + ½ K T² v² ≤ E = E_in,leader(received) − E_out
///
/// f is the force on the tool (N), in the same period and really applied; β an admittance in parallel (m/(N·s)). K is
/// the stiffness of the controller's spring whose far end moves by T v: its force rises by K T v meanwhile, which costs
/// ½ K T² v² (J) and is booked. With K > 0 the velocity that breaks the condition goes to the nearest that keeps it.
/// Both sides are known when they are booked, so that this end is exact. The second term gives back the displacement
/// that the β of earlier periods, or lost messages, have taken away (about 40 mm in a few seconds without); it stands
/// under the same condition as the rest, so drift is corrected with what energy there is and waits when there is none.
/// A period without a newer message has v_received = 0.
///
/// Source: as above; drift compensators: Artigas, Ryu and Preusche, IROS 2010 (recalled, not re-read).
///
/// A message that is not finite is passed over; with a force that is not finite the tool is to stand still.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
template <int N>
class PassivityFollower {
 public:
  struct Config {
    double drift_rate = 0;  ///< λ, 1/s; ≥ 0; 0 corrects no drift
    Duration period{};      ///< T; > 0
    double stiffness = 0;   ///< K of the tool's controller, N/m; ≥ 0; 0: the force does not change within a period
  };

  struct Command {
    Vec<N> velocity;             ///< m/s, for the tool's controller to follow until the next step
    FollowerMessage<N> message;  ///< to send
  };

  /// Throws std::invalid_argument naming the field, its value and what was expected.
  explicit PassivityFollower(const Config& config);

  void receive(const LeaderMessage<N>& message) noexcept;

  /// The tool's controller follows from `displacement` (m) on, where the leader's newest one is, too. Energies stay.
  void begin(const Vec<N>& displacement) noexcept;

  /// One step: `force` is what the tool's controller exerts on the tool in the period that begins.
  Command step(const Vec<N>& force) noexcept;

  /// m, ∫ v dt: where the tool's controller is to be after the newest step.
  const Vec<N>& displacement() const noexcept { return displacement_; }

  /// The energy that may still be given out, J; below zero only by rounding.
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
