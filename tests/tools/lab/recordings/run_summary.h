// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <vector>

#include "core/base/reason.h"
#include "core/base/time.h"
#include "protocol/wire/codec.h"
#include "server/recording/records.h"
#include "tests/tools/lab/experiments/thinned.h"

namespace tendon::lab {

/// p50 and p99 of some times, as `percentile` defines them.
struct Spread {
  Duration p50{};
  Duration p99{};
};

/// Where the remote environment pushes, along the main axis: beyond `above`, before `below`, or both (a slot; a spring
/// to a centre has them at the same place).
struct Contact {
  std::optional<double> above;  ///< m; there the force points down the axis
  std::optional<double> below;  ///< m; there it points up the axis

  bool operator==(const Contact&) const = default;
  /// How deep in the contact `x` is, m; 0 outside.
  double depth(double x) const noexcept;
  /// Of a force along the axis at `x`, what pushes the hand out of the contact; 0 outside.
  double outward(double x, double force) const noexcept;
};

/// J: the ledger may be that much below zero, which is rounding.
inline constexpr double kPromise = 1e-9;

/// What one run comes down to. SI units. Forces are on the hand.
struct RunSummary {
  // How much, how long.
  std::uint64_t steps = 0;
  LocalTime start{};            ///< of the first step
  Duration span{};              ///< from the first step to the last
  std::uint64_t overruns = 0;   ///< intervals longer than the scene's longest_hold
  std::uint64_t watchdogs = 0;  ///< … and than the device's own watchdog
  Duration longest_interval{};

  // Energy. E(n) is the recorded ledger.
  double energy_given_out = 0;  ///< J, max(0, max over n of −E(n)): beyond what the device had taken in
  /// The ledger was never below −1 nJ.
  bool passive() const noexcept { return energy_given_out <= kPromise; }
  /// Intervals longer than the limiter's T in force (Step::longest_hold), for which it promises nothing.
  std::uint64_t holds_beyond_bound = 0;
  /// J, min over all other steps of E(n) − D(n). D ≤ 0 is what holds beyond the bound have drawn below zero, until the
  /// ledger has recovered. +∞ when there is no other step.
  double least_energy = std::numeric_limits<double>::infinity();
  /// What the limiter promises: never below −1 nJ by anything else than holds beyond its bound.
  bool kept_its_promise() const noexcept { return least_energy >= -kPromise; }
  /// A limiter was at work: some step had a finite bound.
  bool limiter_on = false;

  /// J, the largest sum so far of τ·Δθ: what the torques alone have done to the hand, friction not counted. What is above
  /// zero came from the movement's part of the account, from friction, or from nowhere. Empty: the device does not
  /// measure its orientation.
  std::optional<double> torque_work;

  // The hand. Steps without a position count in nothing that has to do with motion.
  double peak_speed = 0;      ///< m/s
  double peak_force = 0;      ///< N, really applied
  Vec3 axis = Vec3::UnitX();  ///< main axis of motion, see RunObserver

  // Why the force was not the one that was asked for.
  std::uint64_t limited_steps = 0;               ///< for any reason that core/base/reason.h calls a limit
  std::array<std::uint64_t, 32> reason_steps{};  ///< by bit of the reason
  double share_limited() const noexcept;         ///< of all steps, 0 to 1
  double share_limited(Reason why) const noexcept;

  // How the contact feels.
  std::optional<Contact> contact;  ///< empty when no force was asked for, or none that depends on where the hand is
  bool stable = true;
  /// N/m. Empty when there was no contact; without meaning unless `stable`.
  std::optional<double> operational_stiffness;

  // Time.
  std::optional<Spread> loop_age;      ///< from sampling a motion to rendering the force made of it; once per force
  std::optional<Spread> round_trip;    ///< of the controller's datagrams alone
  std::uint64_t forces = 0;            ///< remote forces that steps made use of
  std::optional<double> forces_per_s;  ///< from the first of them to the last
};

/// Reads a run once, step by step, in bounded memory, and says what it comes down to.
///
/// **Main axis.** The direction in which the positions vary most (first principal component; its largest component is
/// positive). One within 8° of an axis of the device is taken to be that axis, one of a hand that never moves is x.
///
/// **Contact.** Each remote force answers a motion, `loop_age` before the step that first makes use of it; so it says
/// what the environment does *there*, however late it comes. A contact begins between the last position that was
/// answered without a force and the first one with a force along the axis (above 1 % of the largest; forces that ramp
/// in or fade say nothing): where the straight line through all positions and forces of the contact has no force. There
/// is no contact when forces of both signs were asked for at the same places, neither of them ten times the other.
///
/// **Operational stiffness**: what stiffness the hand felt, whatever was asked for. The mean of the secants
///
///     K_op = mean over n of  F(n) / depth(n)
///
/// F is the part of the applied force that pushes out of the contact; n runs over the steps deeper than 0.1 × the
/// largest depth while forces were fresh. Source: control.md 1.4, for Lee & Lee 2009.
///
/// **Not stable**: the device gave out energy (the ledger is not passive), *and* the hand moved faster than a hand
/// chooses to. With the velocity v = v_slow + v_fast split by a first-order low-pass of 3 Hz, that is when
/// ‖v_fast‖² sums up to more than ‖v_slow‖²; for a sine: when its frequency is above 3 Hz. Why both: fast tapping on
/// a passive wall is stable, and an active wall may still be held by a strong hand. A wall of 2000 N/m with 50 ms of
/// delay bounces at 5 to 6 Hz.
///
/// Memory: under 12 MB. Thread-safe: no. Realtime-safe: no.
class RunObserver {
 public:
  /// A step of the run; they come in order.
  void observe(const StepRecord& step);
  /// A datagram of the run. One without an echo, of an observer, or that is none of ours, says nothing.
  void observe(const DatagramRecord& datagram);

  /// What all that has been observed comes down to.
  RunSummary summary() const;

 private:
  /// Statistics are exact for a minute at 1 kHz, and for ten of forces at 100 Hz.
  static constexpr std::size_t kMostSamples = 65'536;
  /// Forces answer a motion of the last 8 s at 1 kHz, or they are too old to be rendered.
  static constexpr std::size_t kMostHistory = 8'192;

  struct Seen {
    LocalTime at;
    Vec3 position;
  };
  struct Push {
    Vec3 position;
    Vec3 force;
  };

  void observe_energy(const StepRecord& step);
  void observe_torque(const StepRecord& step);
  void observe_motion(const StepRecord& step);
  void observe_force(const StepRecord& step);
  Vec3 main_axis() const;
  std::optional<Contact> contact(const Vec3& axis) const;
  std::optional<double> stiffness(const Vec3& axis, const Contact& contact) const;

  RunSummary so_far_;
  double energy_ = 0;
  double overdrawn_ = 0;              ///< D, J
  Duration bound_ = Duration::max();  ///< T in force when the force of the next interval was chosen

  std::optional<Quat> orientation_;  ///< of the last step that saw one
  double torque_work_ = 0;           ///< Σ τ·Δθ, J

  std::optional<Vec3> origin_;  ///< the first position: sums of small numbers keep their digits
  double positions_ = 0;
  Vec3 sum_ = Vec3::Zero();
  Mat3 sum_of_squares_ = Mat3::Zero();
  std::optional<Vec3> slow_velocity_;
  double slow_ = 0;
  double fast_ = 0;

  std::deque<Seen> history_;
  std::uint64_t force_in_use_ = 0;
  LocalTime first_force_{};
  LocalTime last_force_{};
  Thinned<Push> asked_{kMostSamples};  ///< positions answered, and with which force
  Thinned<Push> felt_{kMostSamples};
  Thinned<Duration> loop_ages_{kMostSamples};

  DataReader reader_;
  Thinned<Duration> round_trips_{kMostSamples};
};

/// The summary of a range of steps.
template <class Steps>
RunSummary summarise(const Steps& steps) {
  RunObserver observer;
  for (const StepRecord& step : steps) observer.observe(step);
  return observer.summary();
}

/// Whether `why` says that the force is not the one that was asked for. The others are facts about the step.
constexpr bool is_limit(Reason why) noexcept { return why != Reason::kOverrun && why != Reason::kWatchdog; }

}  // namespace tendon::lab
