// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/identify/simulated_ramps.h"

#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <stdexcept>

#include "core/base/portable_math.h"
#include "core/base/rotation.h"

namespace tendon::lab {
namespace {

/// Normal distribution by Box and Muller; unlike std::normal_distribution the same in every standard library.
class Noise {
 public:
  explicit Noise(std::uint64_t seed) : random_(seed) {}
  double operator()() {
    const double radius = std::sqrt(-2 * portable::log(1 - uniform()));
    return radius * portable::cos(2 * std::numbers::pi * uniform());
  }

 private:
  double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  std::mt19937_64 random_;
};

class Axis {
 public:
  Axis(Device& device, Freedom freedom) : device_(device), freedom_(freedom) {}

  std::optional<double> read(LocalTime now) {
    const auto sample = device_.read(now);
    if (!sample) return std::nullopt;
    switch (freedom_) {
      case Freedom::kMovement:
        return sample->position.x();
      case Freedom::kRotation:
        if (last_) angle_ += turn_between(*last_, *sample->orientation).x();
        last_ = sample->orientation;
        return angle_;
      case Freedom::kGripper:
        return device_.info().gripper->arm * *sample->opening;
    }
    return std::nullopt;
  }

  double apply(double effort) {
    switch (freedom_) {
      case Freedom::kMovement:
        return device_.apply({effort, 0, 0}).x();
      case Freedom::kRotation:
        return device_.apply_all({.torque = {effort, 0, 0}}).torque.x();
      case Freedom::kGripper:
        return device_.apply_all({.grip = effort}).grip;
    }
    return 0;
  }

 private:
  Device& device_;
  Freedom freedom_;
  std::optional<Quat> last_;
  double angle_ = 0;
};

}  // namespace

RampRun run_ramp(Device& device, LocalTime begin, const RampPlan& plan) {
  RampRun run;
  Axis axis(device, plan.freedom);
  double force = 0;
  for (Duration at{}; at < plan.longest; at += plan.period) {
    const auto position = axis.read(begin + at);
    if (position) force = plan.rate * seconds(at);
    if (position && !run.samples.empty() && std::abs(*position - run.samples.front().position) > plan.travel) break;
    const double disturbance = plan.disturbance ? plan.disturbance() : 0;
    const double written = axis.apply(force + disturbance) - disturbance;
    if (position) run.samples.push_back({.t = seconds(at), .position = *position, .force = written});
  }
  axis.apply(0);
  return run;
}

std::vector<RampRun> simulated_ramps(const RampExperiment& experiment) {
  if (!(experiment.travel > 0)) throw std::invalid_argument("travel: expected more than 0 m");
  if (!(experiment.period > Duration::zero())) throw std::invalid_argument("period: expected more than 0 s");
  Noise noise(experiment.seed);
  RampPlan plan{.freedom = experiment.freedom,
                .travel = experiment.travel,
                .period = experiment.period,
                .longest = experiment.longest,
                .disturbance = [&] { return experiment.force_noise * noise() + experiment.bias; }};
  std::vector<RampRun> runs;
  for (const double rate : experiment.rates) {
    if (!(rate > 0)) throw std::invalid_argument("rates: expected more than 0 N/s");
    for (int i = 0; i < experiment.repeats; ++i) {
      for (const double signed_rate : {rate, -rate}) {
        SimulatedDevice device(experiment.device);
        plan.rate = signed_rate;
        runs.push_back(run_ramp(device, LocalTime{}, plan));
      }
    }
  }
  return runs;
}

}  // namespace tendon::lab
