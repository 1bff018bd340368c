// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/haptic_controller.h"
#include "server/recording/byte_sink.h"
#include "server/recording/recorder.h"
#include "server/recording/records.h"

namespace tendon::lab::testing {

inline constexpr Duration kPeriod = std::chrono::milliseconds(1);

inline LocalTime at_ms(double ms) { return LocalTime(from_seconds(ms * 1e-3)); }

/// Returns step n of a 1 kHz loop with ordinary values, which tests modify.
inline StepRecord step_at(std::uint64_t n) {
  StepRecord step;
  step.tick = n;
  step.scheduled = step.hand.at = LocalTime(std::chrono::seconds(5)) + kPeriod * static_cast<std::int64_t>(n);
  step.held = n == 0 ? Duration::zero() : kPeriod;
  step.permitted = std::numeric_limits<double>::infinity();
  step.mode = Mode::kActive;
  return step;
}

/// ± `amplitude` (m) at `frequency` (Hz) along x through a wall at `wall` (m) of `stiffness` (N/m). Every 10th step
/// uses a new force, which answers the motion `delay` steps before.
inline std::vector<StepRecord> spring_run(std::uint64_t steps, double stiffness, double wall, std::uint64_t delay,
                                          double amplitude = 0.01, double frequency = 1) {
  const auto position = [&](std::uint64_t n) {
    return amplitude * std::sin(2 * std::numbers::pi * frequency * static_cast<double>(n) * 1e-3);
  };
  std::vector<StepRecord> run;
  for (std::uint64_t n = 0; n < steps; ++n) {
    StepRecord step = step_at(n);
    step.hand.position.x() = position(n);
    step.hand.velocity.x() = 2 * std::numbers::pi * frequency * amplitude *
                             std::cos(2 * std::numbers::pi * frequency * static_cast<double>(n) * 1e-3);
    if (n >= delay) {
      const std::uint64_t newest = n - (n - delay) % 10;
      step.force_sequence = newest + 1;
      step.loop_age = kPeriod * static_cast<std::int64_t>(n - (newest - delay));
      step.wanted.x() = -stiffness * std::max(0.0, position(newest - delay) - wall);
    }
    step.force = step.applied = step.wanted;
    run.push_back(step);
  }
  return run;
}

/// The real control law on 0.1 kg with viscous friction, pulled by a spring to a moving hand through a wall at x = 0,
/// whose forces are 20 steps late and arrive every 10 steps.
inline std::vector<StepRecord> toy_run(Law law, std::uint64_t steps) {
  constexpr double kMass = 0.1;
  constexpr double kFriction = 1;
  HapticController controller(
      {.limiter = {.law = law, .friction = {.coulomb = 0.1, .viscous = 0.9}, .longest_hold = kPeriod},
       .watchdog = {},
       .max_force = 8,
       .max_slew = 1000,
       .hold = {}});
  std::vector<StepRecord> run;
  double x = -0.01;
  double v = 0;
  for (std::uint64_t n = 0; n < steps; ++n) {
    StepRecord step = step_at(n);
    const Motion hand{.at = step.hand.at, .position = Vec3(x, 0, 0), .velocity = Vec3(v, 0, 0)};
    if (n >= 20 && n % 10 == 0) {
      const Motion& answered = run[n - 20].hand;
      controller.observe({.sequence = n,
                          .answers_tick = n - 20,
                          .answers = answered.at,
                          .received = hand.at,
                          .force = Vec3(-2000 * std::max(0.0, answered.position.x()), 0, 0),
                          .model = {},
                          .valid_for = std::chrono::milliseconds(50)});
    }
    static_cast<Step&>(step) = controller.step(hand, run.empty() ? Vec3(Vec3::Zero()) : run.back().applied);
    step.applied = step.force;
    run.push_back(step);
    for (int i = 0; i < 20; ++i) {
      constexpr double kH = 1e-3 / 20;
      const double t = static_cast<double>(n) * 1e-3 + i * kH;
      const double target = -0.01 * std::cos(2 * std::numbers::pi * 0.5 * t);
      v += kH / kMass * (step.applied.x() + 200 * (target - x) - kFriction * v - (v > 0 ? 0.1 : v < 0 ? -0.1 : 0));
      x += kH * v;
    }
  }
  return run;
}

/// `names`: of all devices except the first. All runs except the first may be empty.
inline void record_devices(const std::filesystem::path& file, const std::vector<std::vector<StepRecord>>& runs,
                           const std::vector<std::string>& names, bool whole = true) {
  FileSink sink(file);
  Recorder::Config config;
  config.started = runs.front().front().hand.at;
  for (const std::string& name : names) config.more_devices.push_back({.name = name, .scene = {}});
  Recorder recorder(config, sink);
  for (std::size_t n = 0; n < runs.front().size(); ++n) {
    for (std::size_t device = 0; device < runs.size(); ++device) {
      if (n < runs[device].size()) recorder.record(runs[device][n], device);
    }
    recorder.tick(runs.front()[n].hand.at);
  }
  if (whole) recorder.close();
  if (!sink.error().empty()) throw std::runtime_error(sink.error());
}

/// If not `whole`, the file has no end mark, as if the server had been killed.
inline void record(const std::filesystem::path& file, const std::vector<StepRecord>& run, bool whole = true) {
  record_devices(file, {run}, {}, whole);
}

}  // namespace tendon::lab::testing
