// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/identify/simulated_ramps.h"

#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

#include "core/base/portable_math.h"

namespace tendon::lab {
namespace {

/// Normal numbers by Box and Muller: the same with every standard library.
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

}  // namespace

RampRun run_ramp(Device& device, LocalTime begin, const RampPlan& plan) {
  RampRun run;
  double force = 0;
  for (Duration at{}; at < plan.longest; at += plan.period) {
    const auto sample = device.read(begin + at);
    if (sample) force = plan.rate * seconds(at);
    if (sample && !run.samples.empty() && std::abs(sample->position.x() - run.samples.front().position) > plan.travel) {
      break;
    }
    const double disturbance = plan.disturbance ? plan.disturbance() : 0;
    const double written = device.apply({force + disturbance, 0, 0}).x() - disturbance;
    if (sample) run.samples.push_back({.t = seconds(at), .position = sample->position.x(), .force = written});
  }
  device.apply(Vec3::Zero());
  return run;
}

std::vector<RampRun> simulated_ramps(const RampExperiment& experiment) {
  if (!(experiment.travel > 0)) throw std::invalid_argument("travel: expected more than 0 m");
  if (!(experiment.period > Duration::zero())) throw std::invalid_argument("period: expected more than 0 s");
  Noise noise(experiment.seed);
  RampPlan plan{
      .travel = experiment.travel, .period = experiment.period, .longest = experiment.longest, .disturbance = [&] {
        return experiment.force_noise * noise() + experiment.bias;
      }};
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
