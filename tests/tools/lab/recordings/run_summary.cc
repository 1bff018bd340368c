// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/recordings/run_summary.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bit>
#include <cmath>
#include <initializer_list>
#include <iterator>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "core/base/rotation.h"

namespace tendon::lab {
namespace {

constexpr double kFastestChosenMotion = 3;  // Hz, the limit of voluntary motion
constexpr double kSnap = 0.99;              // cosine of 8°

constexpr std::uint32_t kLimits =
    ~(static_cast<std::uint32_t>(Reason::kOverrun) |  //
      static_cast<std::uint32_t>(Reason::kWatchdog) | static_cast<std::uint32_t>(Reason::kAcceleration));

constexpr double kMoves = 1e-4;  // m, standard deviation along an axis; several encoder counts

bool any(Reasons reasons, std::initializer_list<Reason> of) {
  return std::ranges::any_of(of, [reasons](Reason reason) { return reasons.has(reason); });
}

std::optional<Spread> spread(const Thinned<Duration>& times) {
  if (times.kept().empty()) return std::nullopt;
  return Spread{*percentile(times.kept(), 0.50), *percentile(times.kept(), 0.99)};
}

}  // namespace

double RunSummary::share_limited() const noexcept {
  return served_steps == 0 ? 0 : static_cast<double>(limited_steps) / static_cast<double>(served_steps);
}

double RunSummary::share_limited(Reason why) const noexcept {
  if (served_steps == 0 || why == Reason::kNone) return 0;
  const auto bit = static_cast<std::size_t>(std::countr_zero(static_cast<std::uint32_t>(why)));
  return static_cast<double>(reason_steps[bit]) / static_cast<double>(served_steps);
}

void RunObserver::observe(const StepRecord& step) {
  if (so_far_.steps == 0) so_far_.start = step.hand.at;
  ++so_far_.steps;
  so_far_.span = step.hand.at - so_far_.start;
  so_far_.longest_interval = std::max(so_far_.longest_interval, step.held);
  so_far_.overruns += step.reasons.has(Reason::kOverrun) ? 1 : 0;
  so_far_.watchdogs += step.reasons.has(Reason::kWatchdog) ? 1 : 0;
  so_far_.limiter_on |= std::isfinite(step.permitted);
  so_far_.peak_force = std::max(so_far_.peak_force, step.applied.norm());

  observe_energy(step);
  observe_limits(step);
  observe_torque(step);
  if (!step.reasons.has(Reason::kUnseen)) observe_motion(step);
  observe_force(step);
  fields_.observe(step);
}

void RunObserver::Ledger::observe(double energy_now, bool beyond_bound) noexcept {
  const double before = std::min(std::exchange(energy, energy_now), 0.0);
  given_out = std::max(given_out, -energy);
  if (energy >= 0) overdrawn = 0;
  if (beyond_bound) {
    overdrawn += std::min(std::min(energy, 0.0) - before, 0.0);
  } else {
    least = std::min(least, energy - overdrawn);
  }
}

void RunObserver::observe_energy(const StepRecord& step) {
  // Old recordings have no bound (0). The scene's bound, which flags overruns, was in force then.
  const Duration bound = std::exchange(bound_, step.longest_hold);
  const bool beyond = bound > Duration::zero() ? step.held > bound : step.reasons.has(Reason::kOverrun);
  so_far_.holds_beyond_bound += beyond ? 1 : 0;
  handle_.observe(step.energy, beyond);
  if (const GripStep* const grip = step.grip()) {
    has_grip_ = true;
    grip_.observe(grip->energy, beyond);
  }
  // The scene's T is the first and the smallest.
  if (step.longest_hold > Duration::zero()) least_bound_ = std::min(least_bound_, step.longest_hold);
  careful_ += step.longest_hold > least_bound_ ? 1 : 0;
}

void RunObserver::Limits::observe(Reasons why) noexcept {
  ++steps;
  limited += (why.bits() & kLimits) != 0 ? 1 : 0;
  for (std::uint32_t bits = why.bits(); bits != 0; bits &= bits - 1)
    ++reasons[static_cast<std::size_t>(std::countr_zero(bits))];
}

void RunObserver::Limits::add(const Limits& other) noexcept {
  steps += other.steps;
  limited += other.limited;
  for (std::size_t bit = 0; bit < reasons.size(); ++bit) reasons[bit] += other.reasons[bit];
}

void RunObserver::observe_limits(const StepRecord& step) {
  const bool fresh = step.mode == Mode::kActive;
  if (!fresh && last_fresh_ == 0) return;
  since_.observe(step.reasons);
  const double by = (step.wanted - step.applied).norm();
  if ((step.reasons.bits() & kLimits) != 0 && std::isfinite(by)) apart_.observe({so_far_.steps, by});
  if (!fresh) return;
  served_.add(std::exchange(since_, {}));
  last_fresh_ = so_far_.steps;
}

/// A rotation that was not measured is assumed to be about a single axis, with the last torque.
void RunObserver::observe_torque(const StepRecord& step) {
  const TurnStep* const turn = step.turn();
  if (turn == nullptr || step.reasons.has(Reason::kUnseen)) return;
  const Quat& orientation = turn->hand.orientation;
  if (orientation_) torque_work_ += turn->was_applied.dot(turn_between(*orientation_, orientation));
  orientation_ = orientation;
  so_far_.torque_work = std::max(so_far_.torque_work.value_or(0), torque_work_);
}

void RunObserver::observe_motion(const StepRecord& step) {
  const Vec3& position = step.hand.position;
  const Vec3& velocity = step.hand.velocity;
  so_far_.peak_speed = std::max(so_far_.peak_speed, velocity.norm());

  if (!origin_) origin_ = position;
  const Vec3 moved = position - *origin_;
  ++positions_;
  sum_ += moved;
  sum_of_squares_ += moved * moved.transpose();

  if (!slow_velocity_) slow_velocity_ = velocity;
  const double gain = 1 - std::exp(-2 * std::numbers::pi * kFastestChosenMotion * std::max(seconds(step.held), 0.0));
  *slow_velocity_ += gain * (velocity - *slow_velocity_);
  slow_ += slow_velocity_->squaredNorm();
  fast_ += (velocity - *slow_velocity_).squaredNorm();

  history_.push_back({step.hand.at, position});
  if (history_.size() > kMostHistory) history_.pop_front();
  const bool fresh = step.mode == Mode::kActive || step.mode == Mode::kHolding;
  if (!fresh || step.reasons.has(Reason::kRampIn)) return;
  const FeltStep felt{position, step.applied};
  if (step.force_sequence == 0) {
    felt_.observe(felt);  // a force of a coupling
  } else if (felt_since_.size() < kMostHeld) {
    felt_since_.push_back(felt);
  }
}

void RunObserver::observe_force(const StepRecord& step) {
  if (step.force_sequence == 0) return;
  if (step.force_sequence != force_in_use_) {
    if (newest_) asked_.observe(*std::exchange(newest_, std::nullopt));
    for (const FeltStep& felt : felt_since_) felt_.observe(felt);
    felt_since_.clear();
    force_in_use_ = step.force_sequence;
    if (so_far_.forces == 0) first_force_ = step.hand.at;
    last_force_ = step.hand.at;
    ++so_far_.forces;
    loop_ages_.observe(step.loop_age);
    if (of_several_) bring(step.force_sequence, step.hand.at - step.force_age, std::nullopt);
  }
  if (!step.wanted.allFinite() || !step.stiffness.allFinite() || step.reasons.has(Reason::kUnseen)) return;
  if (any(step.reasons, {Reason::kRampIn, Reason::kDecaying, Reason::kSafeStop, Reason::kNotFinite})) return;
  const auto later = std::ranges::upper_bound(history_, step.hand.at - step.loop_age, {}, &Seen::at);
  if (later == history_.begin()) return;
  const Vec3& place = std::prev(later)->position;
  const Vec3& used = step.hand.position;
  newest_ = Push{.place = place, .used = used, .force = step.wanted + step.stiffness * (used - place)};
}

void RunObserver::bring(std::uint64_t sequence, LocalTime received, std::optional<Duration> round_trip) {
  constexpr Duration kNear = std::chrono::milliseconds(2);  // the age is 0 if it arrives within a step
  const auto other = std::ranges::find_if(brought_, [&](const Brought& one) {
    return one.sequence == sequence && one.round_trip.has_value() != round_trip.has_value() &&
           std::chrono::abs(one.received - received) <= kNear;
  });
  if (other == brought_.end()) {
    brought_.push_back({sequence, received, round_trip});
    if (brought_.size() > kMostBrought) brought_.pop_front();
    return;
  }
  round_trips_.observe(round_trip ? *round_trip : *other->round_trip);
  brought_.erase(other);
}

void RunObserver::note_sent(const Header& header, LocalTime at) {
  if (sent_.size() >= kMostConnections && !sent_.contains(header.connection_id)) return;
  Sent& sent = sent_.try_emplace(header.connection_id, Sent{at, 0}).first->second;
  if (header.type == DatagramType::kData) sent.highest_number = std::max(sent.highest_number, header.packet_number);
}

/// The rule of the session (SESSION.md). Datagrams sent before the recording began are unknown.
bool RunObserver::believable(const Header& header, const DataContent& content, LocalTime at) const {
  const auto sent = sent_.find(header.connection_id);
  return sent != sent_.end() && content.echo->packet_number <= sent->second.highest_number &&
         content.echo->sent >= sent->second.first && content.echo->sent <= at && content.sent >= content.echo->received;
}

void RunObserver::observe(const DatagramRecord& datagram) {
  if (datagram.size > datagram.bytes.size()) return;
  const std::span<const std::byte> bytes = std::span(datagram.bytes).first(datagram.size);
  const auto header = decode_header(bytes);
  if (!header) return;
  if (datagram.direction == DatagramRecord::Direction::kOut) {
    note_sent(*header, datagram.at);
    return;
  }
  if (header->type != DatagramType::kData) return;
  // Sealed contents cannot be read: recordings contain no keys.
  if (header->suite != Suite::kPlain) {
    so_far_.sealed = true;
    return;
  }
  const DataContent* content = reader_.read(bytes.subspan(kHeaderSize));
  if (content == nullptr || !content->echo || !believable(*header, *content, datagram.at)) return;
  const Duration sample = (datagram.at - content->echo->sent) - (content->sent - content->echo->received);
  if (sample < Duration::zero()) return;
  for (const Frame& frame : content->frames) {
    const auto* const force = std::get_if<ForceCommand>(&frame);
    if (force == nullptr) continue;
    if (!of_several_) return round_trips_.observe(sample);
    bring(force->sequence, datagram.at, sample);
  }
}

Mat3 RunObserver::covariance() const {
  if (positions_ == 0) return Mat3::Zero();
  const Vec3 mean = sum_ / positions_;
  return sum_of_squares_ / positions_ - mean * mean.transpose();
}

Vec3 RunObserver::main_axis(std::span<const Push> pushes) const {
  const Mat3 motion = covariance();
  if (const auto axis = common_direction(pushes); axis && axis->dot(motion * *axis) > kMoves * kMoves) return *axis;
  if (!(motion.trace() > 0)) return Vec3::UnitX();
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(motion);
  Vec3 axis = solver.eigenvectors().col(2);  // eigenvalues are in increasing order
  Eigen::Index largest = 0;
  axis.cwiseAbs().maxCoeff(&largest);
  if (std::abs(axis[largest]) > kSnap) return Vec3::Unit(largest);
  return axis[largest] < 0 ? Vec3(-axis) : axis;
}

RunSummary RunObserver::summary() const {
  RunSummary summary = so_far_;
  summary.energy_given_out = handle_.given_out;
  summary.least_energy = handle_.least;
  if (has_grip_) {
    summary.grip_energy_given_out = grip_.given_out;
    summary.least_energy = std::min(summary.least_energy, grip_.least);
  }
  if (summary.steps > 0) summary.share_careful = static_cast<double>(careful_) / static_cast<double>(summary.steps);
  summary.served_steps = served_.steps;
  summary.limited_steps = served_.limited;
  summary.reason_steps = served_.reasons;
  std::vector<double> apart;
  for (const Apart& one : apart_.kept()) {
    if (one.step <= last_fresh_) apart.push_back(one.by);
  }
  if (!apart.empty()) summary.difference = Difference{*percentile(apart, 0.50), *percentile(apart, 0.95)};

  std::vector<Push> pushes = asked_.kept();
  if (newest_) pushes.push_back(*newest_);
  summary.axis = main_axis(pushes);
  summary.pushed = std::ranges::any_of(pushes, [](const Push& push) { return !push.force.isZero(0); });
  summary.contact = find_contact(pushes, summary.axis);
  if (summary.contact) summary.operational_stiffness = felt_stiffness(felt_.kept(), summary.axis, *summary.contact);
  summary.stable = summary.passive() || fast_ <= slow_;
  summary.loop_age = spread(loop_ages_);
  summary.round_trip = spread(round_trips_);
  if (summary.forces > 1 && last_force_ > first_force_)
    summary.forces_per_s = static_cast<double>(summary.forces - 1) / seconds(last_force_ - first_force_);
  summary.fields = fields_.summary();
  return summary;
}

}  // namespace tendon::lab
