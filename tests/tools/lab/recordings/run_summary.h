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
#include "tests/tools/lab/recordings/field_summary.h"

namespace tendon::lab {

struct Spread {
  Duration p50{};
  Duration p99{};
};

/// ‖wanted − applied‖ over the limited steps.
struct Difference {
  double p50 = 0;  ///< N
  double p95 = 0;  ///< N
};

/// J, tolerance of the ledger for rounding.
inline constexpr double kPromise = 1e-9;

/// Summary of one run in SI units. Forces act on the hand.
struct RunSummary {
  std::uint64_t steps = 0;
  LocalTime start{};            ///< of the first step
  Duration span{};              ///< from the first step to the last
  std::uint64_t overruns = 0;   ///< number of intervals that exceed the scene's longest_hold
  std::uint64_t watchdogs = 0;  ///< intervals that exceed the watchdog of the device
  Duration longest_interval{};

  // Energy. E(n) is the recorded ledger.
  double energy_given_out = 0;  ///< J, max(0, max over n of −E(n)): net output
  /// True if the ledger was never below −1 nJ.
  bool passive() const noexcept { return std::max(energy_given_out, grip_energy_given_out.value_or(0)) <= kPromise; }
  std::optional<double> grip_energy_given_out;
  /// Intervals longer than the limiter's T at that time (Step::longest_hold), for which it guarantees nothing.
  std::uint64_t holds_beyond_bound = 0;
  /// J, minimum over all other steps of E(n) − D(n). D ≤ 0 is the energy that holds beyond the bound have drawn below
  /// zero, until the ledger has recovered. The lesser of handle and gripper; +∞ if there is no other step.
  double least_energy = std::numeric_limits<double>::infinity();
  /// Returns true if the ledger was at least −1 nJ for all holds within the bound. The limiter guarantees this.
  bool kept_its_promise() const noexcept { return least_energy >= -kPromise; }
  bool limiter_on = false;
  /// Fraction of steps (0 to 1) in which T was above the scene's longest_hold because of overruns.
  double share_careful = 0;

  /// J, maximum over time of Σ τ·Δθ, the work of the torques on the hand without friction. If positive, it must come
  /// from the translational part of the account or from friction. Empty: orientation is not measured.
  std::optional<double> torque_work;

  // Hand. These values ignore all steps without a position.
  double peak_speed = 0;      ///< m/s
  double peak_force = 0;      ///< N, applied
  Vec3 axis = Vec3::UnitX();  ///< main axis, see RunObserver

  std::uint64_t served_steps = 0;                ///< steps in this interval; 0: no fresh force arrived
  std::uint64_t limited_steps = 0;               ///< for any reason that core/base/reason.h classifies as a limit
  std::array<std::uint64_t, 32> reason_steps{};  ///< by bit of the reason
  std::optional<Difference> difference;          ///< empty: no step was limited
  double share_limited() const noexcept;         ///< fraction of served_steps, 0 to 1
  double share_limited(Reason why) const noexcept;

  bool pushed = false;             ///< a force was requested
  std::optional<Contact> contact;  ///< empty without requested forces that depend on position
  bool stable = true;
  /// N/m. Empty without a contact or if the error exceeds 5 %; meaningful only if `stable`.
  std::optional<double> operational_stiffness;

  std::optional<Spread> loop_age;    ///< from sampling a motion to applying the force computed from it; once per force
  std::optional<Spread> round_trip;  ///< of the controller's datagrams
  bool sealed = false;               ///< some datagrams were sealed; they have no round trip here
  std::uint64_t forces = 0;          ///< remote forces that were used
  std::optional<double> forces_per_s;  ///< in the time from the first force to the last force

  std::optional<FieldSummary> fields;  ///< empty: no step has a field
};

/// Computes the summary of a run from its steps in one pass and bounded memory.
///
/// **Main axis.** The common direction of the requested forces, if the hand moves along it with a standard deviation of
/// at least 0.1 mm; otherwise the first principal component of the positions, with its largest component positive; x
/// without motion. Within 8° of an axis of the device, that axis.
///
/// **Contact.** Each remote force answers a motion `loop_age` before the step that uses it, so it describes the
/// environment at *that* position regardless of delay. A force extrapolated by a model with the step's stiffness K is
/// referred back to that position by F + K (x − x_answered), from the last step that uses it, when blending from the
/// previous model has ended. Forces that ramp in or fade out are ignored. See `find_contact`.
///
/// **Operational stiffness.** The stiffness felt by the hand, independent of the requested one: the mean of the secants
///
///     K_op = mean over n of  F(n) / depth(n)
///
/// F is the part of the applied force that pushes out of the contact; n runs over the steps deeper than 0.1 × the
/// largest depth while forces were fresh. The steps with the last force of a run are excluded, because this force is
/// constant after an engine has left, until its validity ends. Source: core/PROOFS.md, "Operational stiffness".
///
/// **Unstable.** The ledger is not passive *and* the hand moved faster than voluntary motion: with v = v_slow + v_fast
/// split by a first-order low-pass filter at 3 Hz, Σ‖v_fast‖² > Σ‖v_slow‖²; for a sine, a frequency above 3 Hz. Both
/// are required: fast tapping on a passive wall is stable, and a strong hand may hold an active wall. A wall of 2000
/// N/m with 50 ms of delay bounces at 5 to 6 Hz.
///
/// Memory: under 16 MB. Thread-safe: no. Realtime-safe: no.
class RunObserver {
 public:
  /// `of_several`: the recording has other devices. A round trip then only counts if the datagram contains a force used
  /// by this device, because the numbers of devices in a datagram are those of its session.
  explicit RunObserver(bool of_several = false) : of_several_(of_several) {}

  /// Steps must come in order.
  void observe(const StepRecord& step);
  /// Ignores datagrams of observers and other programs, and those without an echo. Also ignores an echo that the server
  /// rejects, because its datagram was never sent or its time is in the future or before the connection.
  void observe(const DatagramRecord& datagram);

  RunSummary summary() const;

 private:
  /// Exact for up to one minute at 1 kHz, or ten minutes of forces at 100 Hz.
  static constexpr std::size_t kMostSamples = 65'536;
  /// This is 8 s at 1 kHz. Older answers cannot be used.
  static constexpr std::size_t kMostHistory = 8'192;

  /// The maximum distance between the datagram of a force and the step that uses it.
  static constexpr std::size_t kMostBrought = 256;
  /// The maximum number of steps with the same force. This is 8 s at 1 kHz.
  static constexpr std::size_t kMostHeld = 8'192;
  static constexpr std::size_t kMostConnections = 4'096;

  struct Seen {
    LocalTime at;
    Vec3 position;
  };
  struct Ledger {
    double energy = 0;                                       ///< J, E
    double overdrawn = 0;                                    ///< J, D
    double given_out = 0;                                    ///< J
    double least = std::numeric_limits<double>::infinity();  ///< J, of E − D

    void observe(double energy_now, bool beyond_bound) noexcept;
  };
  /// Counts from the first fresh force to the last, or since the last.
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
  /// A force known from a datagram with a round trip or from a step, until the other one is seen.
  struct Brought {
    std::uint64_t sequence;
    LocalTime received;
    std::optional<Duration> round_trip;  ///< empty: the step came first
  };
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
  Duration bound_ = Duration::max();        ///< T when the force of the next interval was chosen
  Duration least_bound_ = Duration::max();  ///< T of the scene
  std::uint64_t careful_ = 0;               ///< steps with a longer T

  Limits served_;
  Limits since_;                        ///< since the last fresh force
  std::uint64_t last_fresh_ = 0;        ///< its step number, from 1
  Thinned<Apart> apart_{kMostSamples};  ///< in limited steps

  std::optional<Quat> orientation_;  ///< last known orientation
  double torque_work_ = 0;           ///< Σ τ·Δθ, J

  std::optional<Vec3> origin_;  ///< first position, subtracted for numerical accuracy
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
  std::vector<FeltStep> felt_since_;  ///< steps since it arrived
  Thinned<Push> asked_{kMostSamples};
  Thinned<FeltStep> felt_{kMostSamples};
  Thinned<Duration> loop_ages_{kMostSamples};

  FieldObserver fields_;

  DataReader reader_;
  std::map<std::uint32_t, Sent> sent_;  ///< by connection
  std::deque<Brought> brought_;         ///< the newest ones, still without their counterparts
  Thinned<Duration> round_trips_{kMostSamples};
};

template <class Steps>
RunSummary summarise(const Steps& steps) {
  RunObserver observer;
  for (const StepRecord& step : steps) observer.observe(step);
  return observer.summary();
}

}  // namespace tendon::lab
