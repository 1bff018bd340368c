// SPDX-License-Identifier: Apache-2.0
// A stylus that turns and grips, with an engine 20 ms away. Its recording replays to the last bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include "core/base/rotation.h"
#include "devices/simulated/simulated_device.h"
#include "server/scene/scene.h"
#include "tests/tools/replay/rerun.h"
#include "tests/tools/replay/tapping.h"
#include "tests/tools/worlds/world.h"

namespace tendon::replay::whole_handle_test {
namespace {

const std::string kStylus = R"([device]
kind = "simulated"
profile = "touch"
[device.hand]
profile = "stylus"
[[device.hand.press]]
from_ms = 500
for_ms = 30
[device.hand.motion]
kind = "sine"
amplitude_mm = 15
frequency_hz = 1
[device.rotation]
inertia_kg_m2 = 2e-5
viscous_friction_nm_s_per_rad = 2e-4
coulomb_friction_nm = 1e-3
max_torque_nm = 0.2
[device.rotation.hand]
stiffness_nm_per_rad = 0.3
damping_nm_s_per_rad = 2e-3
[device.rotation.hand.motion]
kind = "sine"
amplitude_deg = 30
frequency_hz = 1.3
direction = [0.2, 0.3, 1]
[device.gripper]
open_deg = 40
arm_mm_per_rad = 60
mass_kg = 0.02
viscous_friction_n_s_per_m = 0.5
coulomb_friction_n = 0.1
max_force_n = 3
[device.gripper.hand]
stiffness_n_per_m = 300
damping_n_s_per_m = 3
[device.gripper.hand.motion]
kind = "sine"
amplitude_deg = 10
centre_deg = 20
frequency_hz = 1.1
[limiter.rotation]
coulomb_friction_nm = 5e-4
viscous_friction_nm_s_per_rad = 1e-4
[limiter.gripper]
coulomb_friction_n = 0.05
viscous_friction_n_s_per_m = 0.25
)";

Scene stylus(const std::vector<std::string>& settings) { return parse_scene(kStylus, "scene", ".", settings); }

/// A wall at x > 0, a torsion spring about z, and a soft object between the fingers.
Touch peg(const DeviceState& state) {
  Touch touch(Vec3(-1000 * std::max(0.0, state.position.x()), 0, 0));
  const Mat3 stiffness = Vec3(0.1, 0.1, 0.5).asDiagonal();
  touch.torque = spring_torque(stiffness, Quat{}, state.turning->orientation);
  touch.angular_stiffness = stiffness;
  touch.grip_force = 200 * 0.06 * std::max(0.0, 0.35 - state.grip->opening);
  return touch;
}

/// 4 s with an engine of 100 Hz, 20 ± 5 ms away, and 2 % loss.
std::vector<StepRecord> lived(const Scene& scene, const Physics& physics = peg) {
  SimulatedDevice device(scene.simulated());
  simulation::World::Config config;
  config.loop = scene.loop;
  const auto way = injector::parse_profile("delay=uniform(15ms,25ms) loss=2%");
  config.weather = {.up = way, .down = way};
  config.latest_wake = std::chrono::microseconds(300);
  simulation::World world(config, device);
  world.add_controller({.name = "peg", .rate_hz = 100}, physics);
  std::vector<StepRecord> steps;
  world.watch_steps([&steps](const StepRecord& step) { steps.push_back(step); });
  world.run_for(std::chrono::seconds(4));
  return steps;
}

TEST(WholeHandle, IsTakenAgainToTheLastBit) {
  for (const std::string law : {"aol", "aol+", "none"}) {
    const Scene scene = stylus({"limiter.kind=" + law});
    Rerun rerun(scene.loop.control, Rerun::Held::kRecorded);
    int turned = 0;
    for (const StepRecord& step : lived(scene)) {
      ASSERT_EQ(difference(step, rerun.step(step)), "") << law << ", step " << step.tick;
      if (step.turn()->torque.norm() > 0) ++turned;
    }
    EXPECT_GT(turned, 1000) << law;
  }
}

TEST(WholeHandle, ATorqueThatTheDeviceCannotGiveChangesNothing) {
  const Scene scene = parse_scene(std::string(testing::kTapping) + "[limiter]\nkind = \"aol+\"\n", "scene", ".");
  const auto touch = [](const DeviceState& state, double torque) {
    Touch asked(Vec3(-1000 * std::max(0.0, state.position.x()), 0, 0));
    if (torque != 0) asked.torque = Vec3(0, 0, torque);
    return asked;
  };
  const auto with = lived(scene, [&](const DeviceState& state) { return touch(state, 0.01); });
  const auto without = lived(scene, [&](const DeviceState& state) { return touch(state, 0); });
  ASSERT_EQ(with.size(), without.size());
  Rerun rerun(scene.loop.control, Rerun::Held::kRecorded);
  for (std::size_t n = 0; n < with.size(); ++n) {
    ASSERT_EQ(difference(with[n], rerun.step(with[n])), "") << "step " << with[n].tick;
    ASSERT_EQ(with[n].reasons, without[n].reasons) << "step " << with[n].tick;
  }
}

TEST(WholeHandle, ADifferenceInItsTorqueIsSeen) {
  const Scene scene = stylus({});
  std::vector<StepRecord> steps = lived(scene);
  StepRecord& odd = steps[2000];
  odd.handle->turn->wanted *= 1.5;
  Rerun rerun(scene.loop.control, Rerun::Held::kRecorded);
  std::string how;
  for (const StepRecord& step : steps) {
    if (how = difference(step, rerun.step(step)); !how.empty()) break;
  }
  EXPECT_NE(how.find("torque_commanded_nm"), std::string::npos) << how;
}

TEST(WholeHandle, ItsEngineSeesWhatTheHandDoes) {
  bool turned = false;
  bool opened = false;
  bool pressed = false;
  lived(stylus({}), [&](const DeviceState& state) {
    EXPECT_TRUE(state.turning && state.grip && state.torque_applied && state.grip_applied);
    turned = turned || rotation_vector(state.turning->orientation).norm() > 0.3;
    opened = opened || state.grip->opening > 0.4;
    pressed = pressed || (state.buttons & 1U) != 0;
    return peg(state);
  });
  EXPECT_TRUE(turned);
  EXPECT_TRUE(opened);
  EXPECT_TRUE(pressed);
}

}  // namespace
}  // namespace tendon::replay::whole_handle_test
