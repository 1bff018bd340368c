// SPDX-License-Identifier: Apache-2.0
// Measures how many devices one core can step in a millisecond, and how the cost of a device depends on their number.
#include <sys/mman.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/estimation/velocity_estimator.h"
#include "core/haptic_controller.h"
#include "server/haptic_loop.h"
#include "server/machine/clock.h"
#include "server/machine/realtime.h"
#include "tests/tools/bench/bench.h"
#include "tests/tools/bench/measure.h"
#include "tests/tools/lab/experiments/paper.h"

namespace tendon::bench {
namespace {

constexpr Duration kPeriod = std::chrono::milliseconds(1);

/// Stands for hardware at negligible cost; its handle moves on a circle.
class CircleDevice final : public Device {
 public:
  explicit CircleDevice(std::size_t number) : angle_(0.01 * static_cast<double>(number)) {
    info_ = {.name = "circle", .max_force = 8.5, .position_resolution = 30e-6};
  }
  const DeviceInfo& info() const noexcept override { return info_; }
  std::optional<PositionSample> read(LocalTime now) noexcept override {
    const Vec3 before = arm_;
    arm_ = {before.x() - 3e-3 * before.y(), before.y() + 3e-3 * before.x(), 0};
    arm_ *= 0.015 / arm_.norm();
    return PositionSample{.at = now, .position = 30e-6 * (arm_ / 30e-6).array().round().matrix()};
  }
  Vec3 apply(const Vec3& force) noexcept override { return force; }

 private:
  DeviceInfo info_;
  double angle_;
  Vec3 arm_{0.015 * std::cos(angle_), 0.015 * std::sin(angle_), 0};
};

HapticController::Config control_of(const Device& device) {
  HapticController::Config config;
  config.limiter.friction = {0.3, 0.8};
  config.limiter.longest_hold = 2 * kPeriod;
  config.limiter.parts = lab::default_parts(device.info().position_resolution);
  config.max_force = device.info().max_force;
  config.max_slew = 1000;
  return config;
}

RemoteForce answer_to(const Vec3& position, std::uint64_t tick, LocalTime now) {
  RemoteForce force;
  force.sequence = tick;
  force.answers_tick = tick;
  force.answers = now;
  force.received = now;
  force.force = -300 * position;
  force.valid_for = std::chrono::milliseconds(30);
  return force;
}

struct Lane {
  explicit Lane(std::size_t number) : device(number), haptic({.control = control_of(device)}, device, mail) {}

  void step(LocalTime now) { haptic.step(now); }

  /// Stands for the other threads: removes the records, and posts a force every tenth step.
  void be_the_others(std::uint64_t step, LocalTime now) {
    while (mail.steps.front() != nullptr) mail.steps.pop();
    const DeviceState* state = mail.state.take();
    if (step % 10 == 0 && state != nullptr) mail.forces.front().put(answer_to(state->position, state->tick, now));
  }

  CircleDevice device;
  Mailboxes mail{{.steps = 4, .flight = 64, .datagrams = 1}};
  HapticLoop haptic;
};

struct BareLane {
  explicit BareLane(std::size_t number)
      : device(number), velocity(device.info().position_resolution), controller(control_of(device)) {}

  void step(LocalTime now) {
    const PositionSample sample = *device.read(now);
    const Motion hand{now, sample.position, velocity.observe(now, sample.position)};
    applied = device.apply(controller.step(hand, applied).force);
    position = sample.position;
  }
  void be_the_others(std::uint64_t step, LocalTime now) {
    if (step % 10 == 0) controller.observe(answer_to(position, step, now), 0);
  }

  CircleDevice device;
  VelocityEstimator velocity;
  HapticController controller;
  Vec3 applied = Vec3::Zero();
  Vec3 position = Vec3::Zero();
};

struct Paced {
  std::vector<double> rounds;  ///< µs
  std::vector<double> late;    ///< µs
  std::uint64_t missed = 0;
  double processor = 0;  ///< s
  double seconds = 0;
};

template <class AnyLane>
Paced at_1_khz(std::size_t count, Duration length) {
  std::vector<std::unique_ptr<AnyLane>> lanes;
  for (std::size_t i = 0; i < count; ++i) lanes.push_back(std::make_unique<AnyLane>(i));
  Paced result;
  std::thread haptic([&] {
    enter_realtime(kHapticPriority);
    stay_on(0);
    const auto rounds = static_cast<std::uint64_t>(length / kPeriod);
    const Duration processor = clock::processor_time();
    Duration others{};
    const LocalTime began = clock::now();
    LocalTime due = began;
    for (std::uint64_t round = 1; round <= rounds; ++round) {
      const LocalTime now = clock::now();
      for (const auto& lane : lanes) lane->step(now);
      const LocalTime done = clock::now();
      result.late.push_back(1e6 * seconds(now - due));
      result.rounds.push_back(1e6 * seconds(done - now));
      due += kPeriod;
      if (due < done) {
        const auto behind = (done - due) / kPeriod + 1;
        result.missed += static_cast<std::uint64_t>(behind);
        due += behind * kPeriod;
      }
      const Duration spent = clock::processor_time();
      for (const auto& lane : lanes) lane->be_the_others(round, now);
      others += clock::processor_time() - spent;
      due = std::max(due, clock::now());  // excludes the time of the other threads' part
      clock::sleep_until(due);
    }
    result.processor = seconds(clock::processor_time() - processor - others);
    result.seconds = seconds(clock::now() - began);
  });
  haptic.join();
  ::munlockall();
  return result;
}

Row row_of(const Paced& paced, std::size_t count, const std::string& what, std::optional<double>& ten) {
  std::vector<double> each;
  for (const double round : paced.rounds) each.push_back(1e3 * round / static_cast<double>(count));
  const double p50 = quantile(each, 0.5);
  const double missed = 100 * static_cast<double>(paced.missed) / static_cast<double>(paced.rounds.size());
  char note[200];
  std::snprintf(note, sizeof note,
                "all of them in %.0f µs (p50), %.0f µs (p99) of 1000; late by %.0f µs (p99); %.2f %% of the periods "
                "missed; %.0f %% of a core",
                quantile(paced.rounds, 0.5), quantile(paced.rounds, 0.99), quantile(paced.late, 0.99), missed,
                100 * paced.processor / paced.seconds);
  Row row;
  row.what = std::to_string(count) + (count == 1 ? " device, " : " devices, ") + what;
  row.unit = "ns";
  row.n = each.size();
  row.p50 = p50;
  row.p99 = quantile(each, 0.99);
  row.note = note;
  if (count == 10) ten = p50;
  if (ten) {
    row.floor = "each of 10";
    row.floor_p50 = ten;
    row.ratio = p50 / *ten;
  }
  if (count == 1000) {
    row.target = Row::Target{"1000 at 1 kHz on one core: p99 of a round ≤ 1 ms", quantile(paced.rounds, 0.99) <= 1000};
  }
  return row;
}

template <class AnyLane>
void measure_lanes(Run& run, const std::string& what, const std::vector<std::size_t>& counts) {
  std::optional<double> ten;
  for (const std::size_t count : counts) {
    const Paced paced = at_1_khz<AnyLane>(count, std::chrono::milliseconds(run.options.quick ? 50 : 3000));
    run.add(row_of(paced, count, what, ten));
    if (quantile(paced.rounds, 0.5) > 1000) break;  // overloaded
  }
}

}  // namespace

void measure_devices(Run& run) {
  const std::vector<std::size_t> counts = run.options.quick
                                              ? std::vector<std::size_t>{1, 10}
                                              : std::vector<std::size_t>{1, 10, 100, 500, 1000, 1500, 2000, 3000, 4000};
  measure_lanes<BareLane>(run, "velocity and HapticController::step of each", counts);
  measure_lanes<Lane>(run, "HapticLoop::step of each", counts);
}

}  // namespace tendon::bench
