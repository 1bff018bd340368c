// SPDX-License-Identifier: Apache-2.0
// How many devices one core can step in a millisecond, and whether each costs the same however many there are.
#include <sys/mman.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "devices/simulated/profiles.h"
#include "devices/simulated/simulated_device.h"
#include "server/clock.h"
#include "server/haptic_loop.h"
#include "server/realtime.h"
#include "tests/bench/bench.h"
#include "tests/bench/measure.h"
#include "tests/lab/paper.h"

namespace tendon::bench {
namespace {

constexpr Duration kPeriod = std::chrono::milliseconds(1);

/// A device that is there, stands for hardware, and costs next to nothing: its handle goes round a circle.
class CircleDevice final : public Device {
 public:
  explicit CircleDevice(std::size_t number) : angle_(0.01 * static_cast<double>(number)) {
    info_ = {.name = "circle", .max_force = 8.5, .position_resolution = 30e-6};
  }
  const DeviceInfo& info() const noexcept override { return info_; }
  std::optional<PositionSample> read(LocalTime now) noexcept override {
    // A rotation by 3 mrad, once a millisecond: half a turn a second.
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

struct Lane {
  explicit Lane(std::size_t number) : device(number), haptic(config_of(device), device, mail) {}

  static HapticLoop::Config config_of(const Device& device) {
    HapticLoop::Config config;
    config.control.limiter.friction = {0.3, 0.8};
    config.control.limiter.longest_hold = 2 * kPeriod;
    config.control.limiter.parts = lab::default_parts(device.info().position_resolution);
    config.control.max_force = device.info().max_force;
    config.control.max_slew = 1000;
    return config;
  }

  CircleDevice device;
  Mailboxes mail{{.steps = 4, .flight = 64, .datagrams = 1}};
  HapticLoop haptic;
};

struct Paced {
  std::vector<double> rounds;  ///< µs
  std::vector<double> late;    ///< µs
  std::uint64_t missed = 0;
  double processor = 0;  ///< s
  double seconds = 0;
};

/// An engine's answer, as the network thread puts it into the box, every tenth step; and the records taken out.
void be_the_others(Lane& lane, std::uint64_t step, LocalTime now) {
  while (lane.mail.steps.front() != nullptr) lane.mail.steps.pop();
  const DeviceState* state = lane.mail.state.take();
  if (step % 10 != 0 || state == nullptr) return;
  RemoteForce force;
  force.sequence = step;
  force.answers_tick = state->tick;
  force.answers = now;
  force.received = now;
  force.force = -300 * state->position;
  force.valid_for = std::chrono::milliseconds(30);
  lane.mail.forces.front().put(force);
}

/// At 1 kHz, in one thread, on one core.
Paced at_1_khz(std::vector<std::unique_ptr<Lane>>& lanes, Duration length) {
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
      for (const auto& lane : lanes) lane->haptic.step(now);
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
      for (const auto& lane : lanes) be_the_others(*lane, round, now);
      others += clock::processor_time() - spent;
      due = std::max(due, clock::now());  // what the others take is not the step's to answer for
      clock::sleep_until(due);
    }
    result.processor = seconds(clock::processor_time() - processor - others);
    result.seconds = seconds(clock::now() - began);
  });
  haptic.join();
  ::munlockall();
  return result;
}

}  // namespace

void measure_devices(Run& run) {
  const std::vector<std::size_t> counts = run.options.quick
                                              ? std::vector<std::size_t>{1, 10}
                                              : std::vector<std::size_t>{1, 10, 100, 500, 1000, 1500, 2000, 3000, 4000};
  // A device by itself pays for a processor that has slept, and ten share that.
  std::optional<double> ten;
  for (const std::size_t count : counts) {
    std::vector<std::unique_ptr<Lane>> lanes;
    for (std::size_t i = 0; i < count; ++i) lanes.push_back(std::make_unique<Lane>(i));
    const Paced paced = at_1_khz(lanes, std::chrono::milliseconds(run.options.quick ? 50 : 3000));
    const auto number = static_cast<double>(count);
    std::vector<double> each;
    for (const double round : paced.rounds) each.push_back(1e3 * round / number);
    const double p50 = quantile(each, 0.5);
    if (count == 10) ten = p50;
    Row row{.section = {},
            .what = std::to_string(count) + (count == 1 ? " device" : " devices") + ", HapticLoop::step of each",
            .unit = "ns",
            .n = each.size(),
            .p50 = p50,
            .p99 = quantile(each, 0.99),
            .floor = ten ? "each of 10" : "",
            .floor_p50 = ten,
            .ratio = ten ? std::optional(p50 / *ten) : std::nullopt,
            .note = {}};
    const double missed = 100 * static_cast<double>(paced.missed) / static_cast<double>(paced.rounds.size());
    char note[200];
    std::snprintf(note, sizeof note,
                  "all of them in %.0f µs (p50), %.0f µs (p99) of 1000; late by %.0f µs (p99); %.2f %% of the periods "
                  "missed; %.0f %% of a core",
                  quantile(paced.rounds, 0.5), quantile(paced.rounds, 0.99), quantile(paced.late, 0.99), missed,
                  100 * paced.processor / paced.seconds);
    row.note = note;
    if (count == 1000) {
      row.target =
          Row::Target{"1000 at 1 kHz on one core: p99 of a round ≤ 1 ms", quantile(paced.rounds, 0.99) <= 1000};
    }
    run.add(row);
    if (quantile(paced.rounds, 0.5) > 1000) break;  // here it breaks
  }
}

}  // namespace tendon::bench
