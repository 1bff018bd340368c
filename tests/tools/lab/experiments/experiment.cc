// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/experiment.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <memory>
#include <stdexcept>
#include <variant>

#include "core/ledger/energy_ledger.h"
#include "tests/support/dice.h"
#include "tests/tools/injector/injector.h"
#include "tests/tools/lab/experiments/perception.h"

namespace tendon::lab {
namespace {

constexpr double kMeanOver = 0.05;         // s, the limit of vibration
constexpr double kLongestLatency = 0.5;    // s
constexpr std::uint32_t kDatagram = 200;   // bytes
constexpr double kCorrelationStep = 2e-3;  // s, between the correlated samples

class Remote {
 public:
  Remote(const Environment& environment, std::uint64_t seed) : environment_(environment), dice_(seed) {
    if (!environment.route) return;
    there_.emplace(environment.route->there, seed, 0, injector::Direction::kDown, LocalTime{});
    back_.emplace(environment.route->back, seed, 0, injector::Direction::kUp, LocalTime{});
  }

  /// The answer to the hand's rest position, which has arrived before the clock starts.
  RemoteForce at_rest(const Motion& hand) { return answer(hand, hand.at); }

  void observe(const Motion& hand) {
    if (there_) {
      send(hand);
      return;
    }
    if (hand.at < next_) return;
    next_ += environment_.period;
    // Drawn even if unused, so that the same datagram has the same fate with every law.
    const bool lost = dice_.chance(environment_.loss);
    const Duration late = from_seconds(seconds(environment_.jitter) * dice_.uniform());
    const RemoteForce next = answer(hand, hand.at + environment_.delay + late);
    if (!lost) under_way_.push_back(next);
  }

  /// Returns the newest force that arrived since the last call, if any.
  std::optional<RemoteForce> arrived(LocalTime now) {
    std::optional<RemoteForce> newest;
    std::erase_if(under_way_, [&](const RemoteForce& force) {
      if (force.received > now) return false;
      if (force.sequence > delivered_) {
        newest = force;
        newest->received = now;
        delivered_ = force.sequence;
      }
      return true;
    });
    return newest;
  }

 private:
  void send(const Motion& hand) {
    const injector::Decision way = there_->decide({.arrival = hand.at, .size = kDatagram});
    if (way.verdict != injector::Verdict::kDrop) waiting_.push_back({way.release, hand});
    work(hand.at);
  }

  /// Simulates the engine until `now`. This requires all motions that arrive before `now`.
  void work(LocalTime now) {
    while (true) {
      auto first = LocalTime::max();
      for (const Waiting& one : waiting_) first = std::min(first, one.arrival);
      const LocalTime start = std::max(first, free_);
      if (start > now) return;
      Motion newest = answered_;
      std::erase_if(waiting_, [&](const Waiting& one) {
        if (one.arrival > start) return false;
        if (one.hand.at > newest.at) newest = one.hand;
        return true;
      });
      if (newest.at <= answered_.at) continue;  // all of them were overtaken by a newer motion
      answered_ = newest;
      free_ = start + environment_.route->compute;
      const injector::Decision way = back_->decide({.arrival = free_, .size = kDatagram});
      const RemoteForce force = answer(newest, way.release);
      if (way.verdict != injector::Verdict::kDrop) under_way_.push_back(force);
    }
  }

  RemoteForce answer(const Motion& hand, LocalTime received) {
    const double t = seconds(hand.at.time_since_epoch());
    RemoteForce force{.sequence = ++sequence_,
                      .answers_tick = sequence_,
                      .answers = hand.at,
                      .received = received,
                      .force = environment_.force(t, hand.position),
                      .model = {},
                      .valid_for = std::chrono::hours(1)};
    if (environment_.stiffness || environment_.surface) force.model = {.at = hand.position};
    if (environment_.stiffness) force.model->stiffness = environment_.stiffness(t, hand.position);
    if (environment_.surface) force.model->contact = environment_.surface(t, hand.position);
    return force;
  }

  const Environment& environment_;
  Dice dice_;
  LocalTime next_{};
  std::uint64_t sequence_ = 0;
  std::uint64_t delivered_ = 0;
  std::deque<RemoteForce> under_way_;

  struct Waiting {
    LocalTime arrival;
    Motion hand;
  };
  std::optional<injector::Injector> there_;
  std::optional<injector::Injector> back_;
  std::vector<Waiting> waiting_;  ///< at the engine or in transit
  Motion answered_{.at = LocalTime::min()};
  LocalTime free_{};  ///< when the engine finishes the current answer
};

HapticController::Config controller(const Experiment& experiment) {
  HapticController::Config config;
  config.limiter = experiment.limiter;
  config.limiter.longest_hold = experiment.period;
  config.limiter.max_force = experiment.max_force;
  config.max_force = experiment.max_force;
  config.max_slew = std::numeric_limits<double>::infinity();
  config.hold.ramp_in = Duration::zero();
  config.hold.max_valid_for = std::chrono::hours(1);
  config.hold.output_estimator = experiment.estimator;
  config.hold.learned_model = experiment.learned_model;
  return config;
}

double count(double x, double step) { return step > 0 ? std::round(x / step) * step : x; }

class Hand {
 public:
  explicit Hand(const PrescribedMotion& motion) : motion_(&motion), friction_(motion.friction) {}
  explicit Hand(const FreeHand& config) : friction_(least_friction(config)) { device_.emplace(config); }

  const Friction& friction() const { return friction_; }
  const Vec3& position() const { return position_; }
  const Vec3& velocity() const { return velocity_; }
  /// Position of the motors, which a structural mode separates from the handle.
  Vec3 motor_position() const { return device_ ? Vec3(position_ + device_->truth().deflection) : position_; }

  Motion read(LocalTime now) {
    Motion seen;
    seen.at = now;
    if (device_) {
      seen.position = device_->read(now)->position;
      position_ = device_->truth().position;
      velocity_ = device_->truth().velocity;
      return seen;
    }
    const double t = seconds(now.time_since_epoch());
    constexpr double kDifference = 1e-6;
    position_ = motion_->position(t);
    velocity_ = (motion_->position(t + kDifference) - motion_->position(t - kDifference)) / (2 * kDifference);
    seen.position = position_.unaryExpr([this](double x) { return count(x, motion_->encoder_step); });
    return seen;
  }

  Vec3 apply(const Vec3& force) { return device_ ? device_->apply(force) : force; }

 private:
  const PrescribedMotion* motion_ = nullptr;
  std::optional<SimulatedDevice> device_;
  Friction friction_;
  Vec3 position_ = Vec3::Zero();
  Vec3 velocity_ = Vec3::Zero();
};

}  // namespace

struct LiveRun::Parts {
  explicit Parts(const Experiment& given)
      : experiment(given),
        heart(controller(experiment)),
        remote(experiment.environment, experiment.seed),
        hand(std::visit([](const auto& kind) { return Hand(kind); }, experiment.hand)),
        ledger(hand.friction()),
        truth(experiment.environment.truth ? experiment.environment.truth : experiment.environment.force) {}

  Experiment experiment;
  HapticController heart;
  Remote remote;
  Hand hand;
  EnergyLedger ledger;
  Environment::Force truth;
  LocalTime now{};
  Vec3 applied = Vec3::Zero();
  Vec3 before = Vec3::Zero();
};

LiveRun::LiveRun(const Experiment& experiment) {
  if (!experiment.environment.force) throw std::invalid_argument("an experiment requires an environment");
  if (experiment.environment.period <= Duration::zero() || experiment.period <= Duration::zero())
    throw std::invalid_argument("a period must be above zero");
  parts_ = std::make_unique<Parts>(experiment);
}

LiveRun::~LiveRun() = default;

Moment LiveRun::step() {
  auto& [experiment, heart, remote, hand, ledger, truth, now, applied, before] = *parts_;
  const Motion seen = hand.read(now);
  if (now == LocalTime{}) {
    heart.observe(remote.at_rest(seen));
  } else {
    ledger.observe<3>(applied, hand.motor_position() - before, experiment.period);
  }
  before = hand.motor_position();
  remote.observe(seen);
  if (const auto force = remote.arrived(now)) heart.observe(*force);

  Moment moment;
  moment.step = heart.step(seen, applied);
  moment.t = seconds(now.time_since_epoch());
  moment.position = hand.position();
  moment.velocity = hand.velocity();
  moment.true_force = truth(moment.t, hand.position());
  moment.energy = ledger.energy();
  applied = hand.apply(moment.step.force);
  moment.step.force = applied;
  now += experiment.period;
  return moment;
}

std::vector<Moment> run(const Experiment& experiment) {
  LiveRun live(experiment);
  std::vector<Moment> record;
  record.reserve(static_cast<std::size_t>(experiment.length / experiment.period));
  for (Duration t{}; t < experiment.length; t += experiment.period) record.push_back(live.step());
  return record;
}

std::vector<Vec3> fast_velocity(const std::vector<Moment>& record, Duration period, double last) {
  const auto half = static_cast<std::size_t>(kMeanOver / seconds(period) / 2);
  const auto wanted = static_cast<std::size_t>(std::llround(last / seconds(period)));
  // At least one neighbor on each side is needed to separate vibration from motion.
  const std::size_t reach = std::max<std::size_t>(half, 1);
  if (record.size() < 2 * reach + 2) return {};
  const std::size_t end = record.size() - reach;
  const std::size_t begin = std::max(reach, record.size() > wanted ? record.size() - wanted : 0);

  std::vector<Vec3> sums(record.size() + 1, Vec3::Zero());
  for (std::size_t i = 0; i < record.size(); ++i) sums[i + 1] = sums[i] + record[i].velocity;
  std::vector<Vec3> fast;
  for (std::size_t i = begin; i < end; ++i) {
    fast.emplace_back(record[i].velocity -
                      (sums[i + reach + 1] - sums[i - reach]) / static_cast<double>(2 * reach + 1));
  }
  return fast;
}

double vibration(const std::vector<Moment>& record, Duration period, double last) {
  const std::vector<Vec3> fast = fast_velocity(record, period, last);
  if (fast.empty()) return 0;
  Vec3 mean = Vec3::Zero();
  double squares = 0;
  for (const Vec3& v : fast) {
    mean += v;
    squares += v.squaredNorm();
  }
  const auto n = static_cast<double>(fast.size());
  return std::sqrt(std::max(0.0, squares / n - (mean / n).squaredNorm()));
}

namespace {

double stiffness(const std::vector<Moment>& record) {
  const Vec3 origin = record.front().position;
  const Vec3 force = record.front().step.force;
  double farthest = 0;
  for (const Moment& m : record) farthest = std::max(farthest, (m.position - origin).norm());
  double sum = 0;
  double n = 0;
  for (const Moment& m : record) {
    const Vec3 d = m.position - origin;
    if (d.norm() <= farthest / 10) continue;
    sum -= (m.step.force - force).dot(d) / d.squaredNorm();
    n += 1;
  }
  return n > 0 ? sum / n : 0;
}

double latency(const std::vector<Moment>& record, Duration period) {
  const auto stride = std::max<std::size_t>(1, static_cast<std::size_t>(kCorrelationStep / seconds(period)));
  const auto longest = std::min(static_cast<std::size_t>(kLongestLatency / seconds(period)), record.size() / 2);
  double best = 0;
  std::size_t shift = 0;
  for (std::size_t s = 0; s <= longest; s += stride) {
    double product = 0;
    double felt = 0;
    double truth = 0;
    for (std::size_t i = longest; i < record.size(); i += stride) {
      product += record[i].step.force.dot(record[i - s].true_force);
      felt += record[i].step.force.squaredNorm();
      truth += record[i - s].true_force.squaredNorm();
    }
    const double likeness = felt > 0 && truth > 0 ? product / std::sqrt(felt * truth) : 0;
    if (likeness > best) {
      best = likeness;
      shift = s;
    }
  }
  return static_cast<double>(shift) * seconds(period);
}

}  // namespace

Outcome outcome(const std::vector<Moment>& record, Duration period) {
  Outcome result;
  if (record.empty()) return result;
  result.operational_stiffness = stiffness(record);
  result.late_vibration = vibration(record, period, 1);
  result.vibration = vibration(record, period, 4);
  result.sensation = sensation_level(fast_velocity(record, period, 1), period);
  result.stable = result.late_vibration <= kMostVibration;
  double error = 0;
  double truth = 0;
  double limited = 0;
  double judged = 0;
  double noticed = 0;
  for (const Moment& m : record) {
    result.least_energy = std::min(result.least_energy, m.energy);
    result.largest_force = std::max(result.largest_force, m.step.force.norm());
    if (m.step.reasons.has(Reason::kEnergy)) limited += 1;
    error += (m.step.force - m.true_force).squaredNorm();
    truth += m.true_force.squaredNorm();
    if (m.true_force.norm() < kLeastJudged) continue;
    judged += 1;
    if (notices(m.step.force, m.true_force)) noticed += 1;
  }
  const auto n = static_cast<double>(record.size());
  result.limited_share = limited / n;
  result.noticed_share = judged > 0 ? noticed / judged : 0;
  result.force_error = std::sqrt(error / n);
  result.true_force = std::sqrt(truth / n);
  result.latency = latency(record, period);
  return result;
}

}  // namespace tendon::lab
