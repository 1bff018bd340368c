// SPDX-License-Identifier: Apache-2.0
#include "tests/lab/identify/simulated_ramps.h"

#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

namespace tendon::lab {
namespace {

/// Normal numbers by Box and Muller: the same with every standard library.
class Noise {
 public:
  explicit Noise(std::uint64_t seed) : random_(seed) {}
  double operator()() {
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
  }

 private:
  double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  std::mt19937_64 random_;
};

RampRun simulated_ramp(const RampExperiment& experiment, double rate, Noise& noise) {
  SimulatedDevice device(experiment.device);
  const double t = seconds(experiment.period);
  const auto steps = experiment.longest / experiment.period;
  RampRun run;
  LocalTime now{};
  for (Duration::rep i = 0; i < steps; ++i, now += experiment.period) {
    const double x = device.read(now)->position.x();
    const double at = static_cast<double>(i) * t;
    run.samples.push_back({.t = at, .position = x, .force = rate * at});
    if (std::abs(x - run.samples.front().position) > experiment.travel) break;
    device.apply({rate * at + experiment.force_noise * noise() + experiment.bias, 0, 0});
  }
  return run;
}

}  // namespace

std::vector<RampRun> simulated_ramps(const RampExperiment& experiment) {
  if (!(experiment.travel > 0)) throw std::invalid_argument("travel: expected more than 0 m");
  if (!(experiment.period > Duration::zero())) throw std::invalid_argument("period: expected more than 0 s");
  Noise noise(experiment.seed);
  std::vector<RampRun> runs;
  for (const double rate : experiment.rates) {
    if (!(rate > 0)) throw std::invalid_argument("rates: expected more than 0 N/s");
    for (int i = 0; i < experiment.repeats; ++i) {
      runs.push_back(simulated_ramp(experiment, rate, noise));
      runs.push_back(simulated_ramp(experiment, -rate, noise));
    }
  }
  return runs;
}

}  // namespace tendon::lab
