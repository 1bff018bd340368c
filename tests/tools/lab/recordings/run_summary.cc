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

constexpr double kFastestChosenMotion = 3;  // Hz: above it, hands tremble or are shaken
constexpr double kSnap = 0.99;              // cosine of 8°

constexpr std::uint32_t kLimits =
    ~(static_cast<std::uint32_t>(Reason::kOverrun) |  //
      static_cast<std::uint32_t>(Reason::kWatchdog) | static_cast<std::uint32_t>(Reason::kAcceleration));

bool any(Reasons reasons, std::initializer_list<Reason> of) {
  return std::ranges::any_of(of, [reasons](Reason reason) { return reasons.has(reason); });
}

/// What the environment does at a place: `outward` (N) pushes towards smaller x.
struct Asked {
  double x;
  double outward;
};

struct Edge {
  double first;  ///< the outermost place with a force
  double at;     ///< where the force begins
  double sum;    ///< N, of all forces
};

/// A force that a model leads to the hand may pull for a moment where a contact ends: as much less than the contact's
/// other forces is no contact of its own.
constexpr double kOnlyLed = 0.1;

/// Where a contact that lies towards larger x begins. A force counts when it is above `least`.
std::optional<Edge> find_edge(const std::vector<Asked>& asked, double least) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  double first = kFar;
  double n = 0;
  double sum_x = 0;
  double sum_f = 0;
  for (const Asked& a : asked) {
    if (a.outward <= least) continue;
    first = std::min(first, a.x);
    ++n;
    sum_x += a.x;
    sum_f += a.outward;
  }
  if (n == 0) return std::nullopt;
  double last_without = -kFar;
  double squares = 0;
  double products = 0;
  for (const Asked& a : asked) {
    if (a.outward <= least) {
      if (a.x < first) last_without = std::max(last_without, a.x);
      continue;
    }
    squares += (a.x - sum_x / n) * (a.x - sum_x / n);
    products += (a.x - sum_x / n) * (a.outward - sum_f / n);
  }
  const double begins = products > 0 ? (sum_x - sum_f * squares / products) / n : first;
  return Edge{first, std::clamp(begins, last_without, first), sum_f};
}

std::optional<Spread> spread(const Thinned<Duration>& times) {
  if (times.kept().empty()) return std::nullopt;
  return Spread{*percentile(times.kept(), 0.50), *percentile(times.kept(), 0.99)};
}

}  // namespace

double Contact::depth(double x) const noexcept {
  if (above && x > *above) return x - *above;
  if (below && x < *below) return *below - x;
  return 0;
}

double Contact::outward(double x, double force) const noexcept {
  if (above && x > *above) return -force;
  if (below && x < *below) return force;
  return 0;
}

double RunSummary::share_limited() const noexcept {
  return steps == 0 ? 0 : static_cast<double>(limited_steps) / static_cast<double>(steps);
}

double RunSummary::share_limited(Reason why) const noexcept {
  if (steps == 0 || why == Reason::kNone) return 0;
  const auto bit = static_cast<std::size_t>(std::countr_zero(static_cast<std::uint32_t>(why)));
  return static_cast<double>(reason_steps[bit]) / static_cast<double>(steps);
}

void RunObserver::observe(const StepRecord& step) {
  if (so_far_.steps == 0) so_far_.start = step.hand.at;
  ++so_far_.steps;
  so_far_.span = step.hand.at - so_far_.start;
  so_far_.longest_interval = std::max(so_far_.longest_interval, step.held);
  so_far_.overruns += step.reasons.has(Reason::kOverrun) ? 1 : 0;
  so_far_.watchdogs += step.reasons.has(Reason::kWatchdog) ? 1 : 0;
  so_far_.limited_steps += (step.reasons.bits() & kLimits) != 0 ? 1 : 0;
  for (std::uint32_t bits = step.reasons.bits(); bits != 0; bits &= bits - 1)
    ++so_far_.reason_steps[static_cast<std::size_t>(std::countr_zero(bits))];
  so_far_.limiter_on |= std::isfinite(step.permitted);
  so_far_.peak_force = std::max(so_far_.peak_force, step.applied.norm());

  observe_energy(step);
  observe_torque(step);
  if (!step.reasons.has(Reason::kUnseen)) observe_motion(step);
  observe_force(step);
}

void RunObserver::observe_energy(const StepRecord& step) {
  const double before = std::min(energy_, 0.0);
  energy_ = step.energy;
  so_far_.energy_given_out = std::max(so_far_.energy_given_out, -energy_);
  if (energy_ >= 0) overdrawn_ = 0;
  // Recordings made before a step knew its bound have 0 there: the scene's bound, which flags overruns, was in force.
  const Duration bound = std::exchange(bound_, step.longest_hold);
  const bool beyond = bound > Duration::zero() ? step.held > bound : step.reasons.has(Reason::kOverrun);
  if (beyond) {
    ++so_far_.holds_beyond_bound;
    overdrawn_ += std::min(std::min(energy_, 0.0) - before, 0.0);
  } else {
    so_far_.least_energy = std::min(so_far_.least_energy, energy_ - overdrawn_);
  }
}

/// A turn that was not seen is booked as one about a single axis, with the torque held last.
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
  if (fresh && !step.reasons.has(Reason::kRampIn)) felt_.observe({position, step.applied});
}

void RunObserver::observe_force(const StepRecord& step) {
  if (step.force_sequence == 0 || step.force_sequence == force_in_use_) return;
  force_in_use_ = step.force_sequence;
  if (so_far_.forces == 0) first_force_ = step.hand.at;
  last_force_ = step.hand.at;
  ++so_far_.forces;
  loop_ages_.observe(step.loop_age);

  if (!step.wanted.allFinite()) return;
  if (any(step.reasons, {Reason::kRampIn, Reason::kDecaying, Reason::kSafeStop, Reason::kNotFinite})) return;
  const auto later = std::ranges::upper_bound(history_, step.hand.at - step.loop_age, {}, &Seen::at);
  if (later != history_.begin()) asked_.observe({std::prev(later)->position, step.wanted});
}

void RunObserver::observe(const DatagramRecord& datagram) {
  if (datagram.direction != DatagramRecord::Direction::kIn || datagram.size > datagram.bytes.size()) return;
  const std::span<const std::byte> bytes = std::span(datagram.bytes).first(datagram.size);
  const auto header = decode_header(bytes);
  // What is sealed stays sealed: the keys are not in the recording.
  if (!header || header->type != DatagramType::kData || header->suite != Suite::kPlain) return;
  const DataContent* content = reader_.read(bytes.subspan(kHeaderSize));
  if (content == nullptr || !content->echo) return;
  if (std::ranges::none_of(content->frames,
                           [](const Frame& frame) { return std::holds_alternative<ForceCommand>(frame); }))
    return;
  const Duration sample = (datagram.at - content->echo->sent) - (content->sent - content->echo->received);
  if (sample >= Duration::zero()) round_trips_.observe(sample);
}

Vec3 RunObserver::main_axis() const {
  if (positions_ == 0) return Vec3::UnitX();
  const Vec3 mean = sum_ / positions_;
  const Mat3 covariance = sum_of_squares_ / positions_ - mean * mean.transpose();
  if (!(covariance.trace() > 0)) return Vec3::UnitX();
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(covariance);
  Vec3 axis = solver.eigenvectors().col(2);  // eigenvalues come in increasing order
  Eigen::Index largest = 0;
  axis.cwiseAbs().maxCoeff(&largest);
  if (std::abs(axis[largest]) > kSnap) return Vec3::Unit(largest);
  return axis[largest] < 0 ? Vec3(-axis) : axis;
}

std::optional<Contact> RunObserver::contact(const Vec3& axis) const {
  std::vector<Asked> up;
  std::vector<Asked> down;
  double largest = 0;
  for (const Push& push : asked_.kept()) {
    const double x = push.position.dot(axis);
    const double force = push.force.dot(axis);
    up.push_back({.x = x, .outward = -force});
    down.push_back({.x = -x, .outward = force});
    largest = std::max(largest, std::abs(force));
  }
  std::optional<Edge> above = find_edge(up, 0.01 * largest);
  std::optional<Edge> below = find_edge(down, 0.01 * largest);
  if (!above && !below) return std::nullopt;
  if (above && below && -below->first > above->first) {
    if (below->sum < kOnlyLed * above->sum) {
      below.reset();
    } else if (above->sum < kOnlyLed * below->sum) {
      above.reset();
    }
  }
  if (above && below && -below->first > above->first) return std::nullopt;
  Contact contact;
  if (above) contact.above = above->at;
  if (below) contact.below = -below->at;
  return contact;
}

std::optional<double> RunObserver::stiffness(const Vec3& axis, const Contact& contact) const {
  double deepest = 0;
  for (const Push& push : felt_.kept()) deepest = std::max(deepest, contact.depth(push.position.dot(axis)));
  double sum = 0;
  double count = 0;
  for (const Push& push : felt_.kept()) {
    const double x = push.position.dot(axis);
    const double depth = contact.depth(x);
    if (depth <= 0.1 * deepest) continue;
    sum += contact.outward(x, push.force.dot(axis)) / depth;
    ++count;
  }
  if (count == 0) return std::nullopt;
  return sum / count;
}

RunSummary RunObserver::summary() const {
  RunSummary summary = so_far_;
  summary.axis = main_axis();
  summary.contact = contact(summary.axis);
  if (summary.contact) summary.operational_stiffness = stiffness(summary.axis, *summary.contact);
  summary.stable = summary.passive() || fast_ <= slow_;
  summary.loop_age = spread(loop_ages_);
  summary.round_trip = spread(round_trips_);
  if (summary.forces > 1 && last_force_ > first_force_)
    summary.forces_per_s = static_cast<double>(summary.forces - 1) / seconds(last_force_ - first_force_);
  return summary;
}

}  // namespace tendon::lab
