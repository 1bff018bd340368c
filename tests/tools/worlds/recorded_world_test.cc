// SPDX-License-Identifier: Apache-2.0
// A human hand recorded on a teleoperation rig (TU/e, 2 kHz, lever angle × 0.075 m) over a 5G mid-band link with
// measured one-way delays (DETERMINISTIC6G). The device is the UE: its states take the uplink, the answering forces the
// downlink. The data is in $TENDON_DATA. The recordings are written next to the test, so that `tendon-report` can read
// them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <ostream>

#include "devices/simulated/profiles.h"
#include "devices/simulated/simulated_device.h"
#include "server/recording/byte_sink.h"
#include "server/tables/recorded_motion.h"
#include "tests/tools/worlds/world.h"

namespace tendon::simulation::recorded_world_test {
namespace {

struct Outcome {
  double least_energy = std::numeric_limits<double>::infinity();  ///< J
  double peak_force = 0;                                          ///< N
  double peak_speed = 0;                                          ///< m/s
  std::uint64_t limited = 0;
  std::uint64_t steps = 0;
};

struct Hand {
  const char* recording;
  double wall;  ///< m, position of the wall, within the range of the motion
};

void PrintTo(const Hand& hand, std::ostream* out) { *out << hand.recording << ", wall at " << hand.wall << " m"; }

Outcome run(const std::filesystem::path& data, const Hand& hand, Law limiter, const std::filesystem::path& out) {
  const std::string recording = std::string(hand.recording) + ".csv";
  const DeviceProfile& falcon = *find_device_profile("falcon");
  SimulatedDevice::Config config = falcon.device();
  const std::filesystem::path path = data / "tue-1dof-teleop" / recording;
  std::ifstream csv(path);
  ScriptedMotion::Recorded motion =
      load_recorded_motion(csv, {.path = path, .position = "master_pos_rad", .scale = 0.075});
  const double length = motion.samples.back().t - motion.samples.front().t;
  config.hand =
      OperatorHand::Config{.stiffness = 300, .damping = 3, .mass = 0.05, .motion = ScriptedMotion(std::move(motion))};
  SimulatedDevice device(config);

  World::Config world_config;
  world_config.seed = 5;
  world_config.record = true;
  world_config.scene_text =
      "recorded hand " + recording + " over 5G mid-band, " + (limiter == Law::kNone ? "no limiter" : "AOL");
  world_config.loop.control.limiter.law = limiter;
  world_config.loop.control.limiter.friction = {falcon.coulomb_bound.value, falcon.viscous_bound.value};
  world_config.loop.control.limiter.longest_hold = std::chrono::milliseconds(1);
  world_config.loop.control.max_force = device.info().max_force;
  world_config.loop.control.max_slew = 1000;
  const auto hist = data / "d6g-tsn-5g" / "hist";
  const auto measured = [&hist](const char* file) {
    return injector::parse_profile("delay=histogram(" + (hist / file).string() + ")");
  };
  world_config.weather = {.up = measured("5G-midband-Downlink_PD-Wireless-5G-2a.csv"),
                          .down = measured("5G-midband-Uplink_PD-Wireless-5G-2a.csv")};
  World world(world_config, device);
  world.add_controller({.name = "wall", .rate_hz = 100}, [wall = hand.wall](const DeviceState& state) -> Touch {
    return Vec3(-2000 * std::max(0.0, state.position.x() - wall), 0, 0);
  });
  Outcome outcome;
  world.watch_steps([&outcome](const StepRecord& step) {
    outcome.least_energy = std::min(outcome.least_energy, step.energy);
    outcome.peak_force = std::max(outcome.peak_force, step.applied.norm());
    outcome.peak_speed = std::max(outcome.peak_speed, step.hand.velocity.norm());
    outcome.limited += step.reasons.has(Reason::kEnergy) ? 1 : 0;
    ++outcome.steps;
  });
  world.run_for(from_seconds(length));

  std::filesystem::remove(out);
  FileSink sink(out);
  sink.append(world.finish_recording());
  return outcome;
}

class RecordedWorld : public testing::TestWithParam<Hand> {};

TEST_P(RecordedWorld, ARecordedHandBehindMeasured5GIsPassiveOnlyWithTheLimiter) {
  const char* data = std::getenv("TENDON_DATA");  // NOLINT(concurrency-mt-unsafe): nobody sets variables here
  if (data == nullptr) GTEST_SKIP() << "TENDON_DATA is not set: no recorded hand, no measured network";
  const std::filesystem::path out = TENDON_RECORDED_WORLDS;
  std::filesystem::create_directories(out);
  const std::string name = GetParam().recording;
  const Outcome off = run(data, GetParam(), Law::kNone, out / (name + "-off.mcap"));
  const Outcome aol = run(data, GetParam(), Law::kAol, out / (name + "-aol.mcap"));
  for (const auto& [label, o] : {std::pair("off", off), std::pair("AOL", aol)}) {
    std::cout << name << ", limiter " << label << ": least energy " << o.least_energy << " J, peak force "
              << o.peak_force << " N, peak speed " << o.peak_speed << " m/s, limited in "
              << 100.0 * static_cast<double>(o.limited) / static_cast<double>(o.steps) << " % of " << o.steps
              << " steps\n";
  }
  EXPECT_LT(off.least_energy, -1e-3);
  EXPECT_GE(aol.least_energy, -1e-9);
  EXPECT_GT(aol.peak_force, 0.5);
}

INSTANTIATE_TEST_SUITE_P(Hands, RecordedWorld,
                         testing::Values(Hand{"m2_question1d_foam", 0}, Hand{"m2_question1d_rigid", -0.002}),
                         [](const auto& hand) { return std::string(hand.param.recording); });

}  // namespace
}  // namespace tendon::simulation::recorded_world_test
