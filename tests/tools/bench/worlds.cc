// SPDX-License-Identifier: Apache-2.0
// Measures how many simulated worlds of 10 s (tests/tools/worlds) one core runs in a second.
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/haptic_controller.h"
#include "tests/tools/bench/bench.h"
#include "tests/tools/bench/measure.h"
#include "tests/tools/bench/other_process.h"
#include "tests/tools/lab/experiments/paper.h"
#include "tests/tools/worlds/drawn_world.h"
#include "tests/tools/worlds/explore.h"

namespace tendon::bench {

void measure_worlds(Run& run) {
  const AtPriority high(run.options.priority);
  const std::size_t worlds = run.options.quick ? 3 : 200;
  const lab::Meter meter;
  HapticController::Config config;
  config.limiter.friction = {0.05, 0.26};
  config.limiter.longest_hold = std::chrono::milliseconds(1);
  config.limiter.parts = lab::default_parts(lab::kPaperEncoder);
  config.max_force = 8.5;
  config.max_slew = 1000;
  std::vector<double> per_world;
  std::vector<double> floors;
  std::vector<double> ratios;
  double total = 0;
  std::uint64_t steps = 0;
  for (std::size_t i = 0; i < worlds; ++i) {
    const lab::Meter::Reading before = meter.read();
    const simulation::Outcome outcome = simulation::run(simulation::draw_world(run.options.seed + i));
    const lab::Meter::Reading after = meter.read();
    if (outcome.breach)
      throw std::runtime_error("seed " + std::to_string(run.options.seed + i) + " violates a guarantee");
    HapticController controller(config);
    Vec3 held = Vec3::Zero();
    LocalTime now{};
    for (std::uint64_t step = 0; step < outcome.steps; ++step) {
      now += std::chrono::milliseconds(1);
      const double x = 1e-5 * static_cast<double>(step % 1000);
      held = controller.step({now, Vec3(x, 0, 0), Vec3::Zero()}, held).force;
      keep(held);
    }
    const lab::Meter::Reading end = meter.read();
    per_world.push_back(1e3 * (after - before).processor);
    floors.push_back(1e3 * (end - after).processor);
    ratios.push_back(per_world.back() / floors.back());
    total += (after - before).processor;
    steps += outcome.steps;
  }
  const auto count = static_cast<double>(worlds);
  Row row{.section = {},
          .what = "a world of 10 s, processor time",
          .unit = "ms",
          .n = worlds,
          .p50 = quantile(per_world, 0.5),
          .p99 = quantile(per_world, 0.99),
          .floor = "HapticController::step alone, as often",
          .floor_p50 = quantile(floors, 0.5),
          .floor_p99 = quantile(floors, 0.99),
          .ratio = quantile(ratios, 0.5),
          .note = {}};
  char note[160];
  std::snprintf(note, sizeof note,
                "%.1f worlds a second on one core, %.0f times as fast as time; %.2f µs for each haptic step with all "
                "that belongs to it",
                count / total, 10 * count / total, 1e6 * total / static_cast<double>(steps));
  row.note = note;
  run.add(row);
}

}  // namespace tendon::bench
