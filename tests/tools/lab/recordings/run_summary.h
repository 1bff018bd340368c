// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "core/base/reason.h"
#include "core/base/time.h"
#include "protocol/wire/codec.h"
#include "protocol/wire/header.h"
#include "server/recording/records.h"
#include "tests/tools/lab/experiments/thinned.h"
#include "tests/tools/lab/recordings/contact.h"

namespace tendon::lab {

/// p50 and p99 of some times, as `percentile` defines them.
struct Spread {
  Duration p50{};
  Duration p99{};
};

/// By how much the force differed from the one that was asked for: ‖wanted − applied‖, in the steps that were limited.
struct Difference {
  double p50 = 0;  ///< N
  double p95 = 0;  ///< N
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
  bool passive() const noexcept { return std::max(energy_given_out, grip_energy_given_out.value_or(0)) <= kPromise; }
  /// Likewise that of the gripper's own account; empty: no gripper.
  std::optional<double> grip_energy_given_out;
  /// Intervals longer than the limiter's T in force (Step::longest_hold), for which it promises nothing.
  std::uint64_t holds_beyond_bound = 0;
  /// J, min over all other steps of E(n) − D(n). D ≤ 0 is what holds beyond the bound have drawn below zero, until the
  /// ledger has recovered. +∞ when there is no other step. The lesser of handle and gripper.
  double least_energy = std::numeric_limits<double>::infinity();
  /// What the limiter promises: never below −1 nJ by anything else than holds beyond its bound.
  bool kept_its_promise() const noexcept { return least_energy >= -kPromise; }
  /// A limiter was at work: some step had a finite bound.
  bool limiter_on = false;
  /// Of all steps: T in force was above the scene's longest_hold, because there had been overruns. 0 to 1.
  double share_careful = 0;

  /// J, the largest sum so far of τ·Δθ: what the torques alone have done to the hand, friction not counted. What is above
  /// zero came from the movement's part of the account, from friction, or from nowhere. Empty: the device does not
  /// measure its orientation.
  std::optional<double> torque_work;

  // The hand. Steps without a position count in nothing that has to do with motion.
  double peak_speed = 0;      ///< m/s
  double peak_force = 0;      ///< N, really applied
  Vec3 axis = Vec3::UnitX();  ///< main axis, see RunObserver

  // Why the force was not the one that was asked for: from the first step with a fresh force to the last one.
  std::uint64_t served_steps = 0;                ///< in that time; 0: no fresh force came
  std::uint64_t limited_steps = 0;               ///< for any reason that core/base/reason.h calls a limit
  std::array<std::uint64_t, 32> reason_steps{};  ///< by bit of the reason
  std::optional<Difference> difference;          ///< empty: no step was limited
  double share_limited() const noexcept;         ///< of served_steps, 0 to 1
  double share_limited(Reason why) const noexcept;

  // How the contact feels.
  bool pushed = false;             ///< forces were asked for
  std::optional<Contact> contact;  ///< empty when no force was asked for, or none that depends on where the hand is
  bool stable = true;
  /// N/m. Empty when there was no contact, or it cannot be told within 5 %; without meaning unless `stable`.
  std::optional<double> operational_stiffness;

  // Time.
  std::optional<Spread> loop_age;      ///< from sampling a motion to rendering the force made of it; once per force
  std::optional<Spread> round_trip;    ///< of the controller's datagrams alone
  bool sealed = false;                 ///< some datagrams were: of these nobody knows the round trip
  std::uint64_t forces = 0;            ///< remote forces that steps made use of
  std::optional<double> forces_per_s;  ///< from the first of them to the last
};

/// Reads a run once, step by step, in bounded memory, and says what it comes down to.
///
/// **Main axis.** The common direction of the forces that were asked for, when they have one and the hand moves along
/// it by 0.1 mm (standard deviation) or more. Otherwise the direction in which the positions vary most (first principal
/// component; its largest component is positive); one within 8° of an axis of the device is taken to be that axis, one
/// of a hand that never moves is x.
///
/// **Contact.** Each remote force answers a motion, `loop_age` before the step that makes use of it; so it says what
/// the environment does *there*, however late it comes. A force that is led after the hand by a model (with the
/// stiffness K of the step) is taken back to that place, F + K (x − x_answered), from the last step that makes use of
/// it: then a blend from the model before has ended. Forces that ramp in or fade say nothing. Where the contact begins:
/// `find_contact`.
///
/// **Operational stiffness**: what stiffness the hand felt, whatever was asked for. The mean of the secants
///
///     K_op = mean over n of  F(n) / depth(n)
///
/// F is the part of the applied force that pushes out of the contact; n runs over the steps deeper than 0.1 × the
/// largest depth while forces were fresh. The steps with the last force of a run do not count: when an engine leaves, that
/// force stands still for its validity. Source: core/PROOFS.md, "Operational stiffness".
///
/// **Not stable**: the device gave out energy (the ledger is not passive), *and* the hand moved faster than a hand
/// chooses to. With the velocity v = v_slow + v_fast split by a first-order low-pass of 3 Hz, that is when
/// ‖v_fast‖² sums up to more than ‖v_slow‖²; for a sine: when its frequency is above 3 Hz. Why both: fast tapping on
/// a passive wall is stable, and an active wall may still be held by a strong hand. A wall of 2000 N/m with 50 ms of
/// delay bounces at 5 to 6 Hz.
///
/// Memory: under 16 MB. Thread-safe: no. Realtime-safe: no.
class RunObserver {
 public:
  /// `of_several`: the recording has other devices, too. A round trip then counts only when the datagram brought a
  /// force that this device made use of: the numbers of devices in a datagram are those of its session.
  explicit RunObserver(bool of_several = false) : of_several_(of_several) {}

  /// A step of the run; they come in order.
  void observe(const StepRecord& step);
  /// A datagram of the run. Datagrams of observers, of other programs, and without an echo are ignored. An echo is also
  /// ignored if the server refused it because the datagram was never sent, or because the time is in the future or
  /// before the connection.
  void observe(const DatagramRecord& datagram);

  /// What all that has been observed comes down to.
  RunSummary summary() const;

 private:
  /// Statistics are exact for a minute at 1 kHz, and for ten of forces at 100 Hz.
  static constexpr std::size_t kMostSamples = 65'536;
  /// Forces answer a motion of the last 8 s at 1 kHz, or they are too old to be rendered.
  static constexpr std::size_t kMostHistory = 8'192;

  /// A step and the datagram of its force are that near to each other in a recording.
  static constexpr std::size_t kMostBrought = 256;
  /// Steps with one force: 8 s.
  static constexpr std::size_t kMostHeld = 8'192;
  /// More connections than these are not told apart in one recording.
  static constexpr std::size_t kMostConnections = 4'096;

  struct Seen {
    LocalTime at;
    Vec3 position;
  };
  /// An account of the limiter.
  struct Ledger {
    double energy = 0;                                       ///< J, E
    double overdrawn = 0;                                    ///< J, D
    double given_out = 0;                                    ///< J
    double least = std::numeric_limits<double>::infinity();  ///< J, of E − D

    void observe(double energy_now, bool beyond_bound) noexcept;
  };
  /// Of steps: those from the first fresh force to the last, or those since that one.
  struct Limits {
    std::uint64_t steps = 0;
    std::uint64_t limited = 0;
    std::array<std::uint64_t, 32> reasons{};

    void observe(Reasons why) noexcept;
    void add(const Limits& other) noexcept;
  };
  struct Apart {
    std::uint64_t step;
    double by;  ///< N
  };
  /// A force that came in a datagram with a round trip, or that a step made use of: what was seen first of the two.
  struct Brought {
    std::uint64_t sequence;
    LocalTime received;
    std::optional<Duration> round_trip;  ///< empty: the step was seen first
  };
  /// What we have sent on a connection.
  struct Sent {
    LocalTime first;
    std::uint64_t highest_number;
  };

  void observe_energy(const StepRecord& step);
  void observe_limits(const StepRecord& step);
  void bring(std::uint64_t sequence, LocalTime received, std::optional<Duration> round_trip);
  void note_sent(const Header& header, LocalTime at);
  bool believable(const Header& header, const DataContent& content, LocalTime at) const;
  void observe_torque(const StepRecord& step);
  void observe_motion(const StepRecord& step);
  void observe_force(const StepRecord& step);
  Vec3 main_axis(std::span<const Push> pushes) const;
  Mat3 covariance() const;

  bool of_several_;
  RunSummary so_far_;
  Ledger handle_;
  Ledger grip_;
  bool has_grip_ = false;
  Duration bound_ = Duration::max();        ///< T in force when the force of the next interval was chosen
  Duration least_bound_ = Duration::max();  ///< T, the scene's longest_hold
  std::uint64_t careful_ = 0;               ///< steps with a longer one

  Limits served_;
  Limits since_;                        ///< since the last fresh force
  std::uint64_t last_fresh_ = 0;        ///< number of its step, from 1
  Thinned<Apart> apart_{kMostSamples};  ///< in limited steps

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
  std::optional<Push> newest_;        ///< the force in use
  std::vector<FeltStep> felt_since_;  ///< since it came
  Thinned<Push> asked_{kMostSamples};
  Thinned<FeltStep> felt_{kMostSamples};
  Thinned<Duration> loop_ages_{kMostSamples};

  DataReader reader_;
  std::map<std::uint32_t, Sent> sent_;  ///< by connection
  std::deque<Brought> brought_;         ///< the newest, of which one of the two is missing
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
