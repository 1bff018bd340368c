// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/replay/rerun.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include "core/control/limiter.h"
#include "devices/simulated/simulated_device.h"
#include "server/haptic_loop.h"
#include "server/scene/scene.h"
#include "tests/tools/replay/tapping.h"
#include "tests/tools/worlds/world.h"

namespace tendon::replay::rerun_test {
namespace {

Scene scene_with(const std::vector<std::string>& settings) {
  return parse_scene(std::string(testing::kTapping), "scene", ".", settings);
}

std::vector<StepRecord> recorded(const Scene& scene) {
  SimulatedDevice device(scene.simulated());
  simulation::World::Config config;
  config.loop = scene.loop;
  config.latest_wake = std::chrono::microseconds(300);
  config.pause_probability = 0.002;
  config.pause = std::chrono::milliseconds(7);
  simulation::World world(config, device);
  world.add_controller({.name = "wall", .rate_hz = 100}, [](const DeviceState& state) -> Touch {
    Touch touch(Vec3(-2000 * std::max(0.0, state.position.x()), 0, 0));
    if (state.position.x() > 0) touch.stiffness = Vec3(2000, 0, 0).asDiagonal();
    return touch;
  });
  std::vector<StepRecord> steps;
  world.watch_steps([&steps](const StepRecord& step) { steps.push_back(step); });
  world.run_for(std::chrono::seconds(2));
  return steps;
}

std::string first_difference(const HapticController::Config& control, const std::vector<StepRecord>& steps) {
  Rerun rerun(control, Rerun::Held::kRecorded);
  for (const StepRecord& step : steps) {
    if (const std::string how = difference(step, rerun.step(step)); !how.empty()) {
      return "step " + std::to_string(step.tick) + ": " + how;
    }
  }
  return "";
}

std::size_t limited(const std::vector<StepRecord>& steps) {
  return static_cast<std::size_t>(
      std::count_if(steps.begin(), steps.end(), [](const StepRecord& step) { return step.force != step.wanted; }));
}

struct Case {
  std::string name;
  std::vector<std::string> settings;
};
void PrintTo(const Case& one, std::ostream* out) { *out << one.name; }

std::vector<Case> cases() {
  std::vector<Case> cases;
  for (const LawInfo& law : laws()) {
    Case one{"Law_" + std::string(law.name), {"limiter.kind=" + std::string(law.name)}};
    if (law.needs_stiffness) one.settings.emplace_back("limiter.environment_stiffness_n_per_m=2000");
    if (law.law == Law::kClamp) one.settings.emplace_back("limiter.clamp_n=2");
    cases.push_back(one);
  }
  cases.push_back(
      {"PartsOfAolPlus",
       {"limiter.energy_cap={}", "limiter.knee={}", "limiter.robust_ledger={}", "limiter.latency_reserve={}"}});
  cases.push_back({"BoundedAcceleration",
                   {"limiter.bounded_acceleration={most_m_per_s2=50}", "limiter.shaping={stiffness_n_per_m=600}"}});
  cases.push_back({"APreset", {"limiter.preset=\"feel\""}});
  cases.push_back({"AnEstimatorOfTheEnvironment", {"force.output_estimator={}"}});
  cases.push_back({"ALocalModel", {"force.adaptive_local_model={}"}});
  cases.push_back({"AWatchdog", {"device.effects.watchdog_ms=5"}});
  cases.push_back({"TightForceLimits", {"force.max_force_n=1", "force.max_slew_n_per_s=50"}});
  cases.push_back({"AdmittanceControl",
                   {"device.effects.force_sensor=0",
                    "admittance={mass_kg=0.3, damping_n_s_per_m=2, proportional_n_s_per_m=40, integral_n_per_m=400}"}});
  return cases;
}

class EveryLaw : public ::testing::TestWithParam<Case> {};

TEST_P(EveryLaw, DecidesTheSameAgainToTheLastBit) {
  const Scene scene = scene_with(GetParam().settings);
  const std::vector<StepRecord> steps = recorded(scene);
  ASSERT_GT(steps.size(), 1800U);
  EXPECT_EQ(first_difference(scene.loop.control, steps), "");
}

INSTANTIATE_TEST_SUITE_P(Rerun, EveryLaw, ::testing::ValuesIn(cases()), [](const auto& one) {
  std::string name = one.param.name;
  for (char& c : name) c = c == '+' ? 'P' : std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return name;
});

class Flaky : public Device {
 public:
  const DeviceInfo& info() const noexcept override { return info_; }
  std::optional<PositionSample> read(LocalTime now) noexcept override {
    const std::uint64_t n = ++reads_;
    if ((n >= 300 && n < 305) || (n >= 400 && n < 430)) return {};
    double x = 0.01 * std::sin(12 * seconds(now.time_since_epoch()));
    if (n == 700) x = std::numeric_limits<double>::quiet_NaN();
    if (n == 900) x += 1;
    return PositionSample{.at = now, .position = Vec3(x, 0, 0)};
  }
  Vec3 apply(const Vec3& force) noexcept override { return 0.75 * force; }

 private:
  DeviceInfo info_{.name = "flaky", .max_force = 10, .position_resolution = 1e-5};
  std::uint64_t reads_ = 0;
};

/// A force of 3 N into a wall and faults of all kinds, each followed by a rearm.
std::vector<StepRecord> troubled(const HapticLoop::Config& config) {
  Flaky device;
  const auto mail = std::make_unique<Mailboxes>();
  HapticLoop loop(config, device, *mail);
  std::vector<StepRecord> steps;
  LocalTime now(std::chrono::seconds(1));
  for (std::uint64_t n = 1; n <= 1200; ++n) {
    if (n % 10 == 0) {
      RemoteForce force;
      force.sequence = n;
      force.received = force.answers = now;
      force.force = Vec3(-3, 0, 0);
      force.valid_for = std::chrono::milliseconds(20);
      mail->forces[0].put(force);
    }
    if (n == 100 || n == 350) mail->orders.try_push({HapticOrder::Kind::kDisarm});
    if (n == 200 || n == 500 || n == 800 || n == 1000) mail->orders.try_push({HapticOrder::Kind::kRearm});
    now = loop.step(now);
    while (const StepRecord* step = mail->steps.front()) {
      steps.push_back(*step);
      mail->steps.pop();
    }
  }
  return steps;
}

HapticLoop::Config with_fault_detection() {
  HapticLoop::Config config = scene_with({}).loop;
  config.control.max_speed = 10;
  return config;
}

TEST(Rerun, FaultsAndRearmsAsTheControllerDid) {
  const HapticLoop::Config config = with_fault_detection();
  const std::vector<StepRecord> steps = troubled(config);
  const auto faulty = [&steps](std::uint64_t tick) { return steps[tick - 1].mode == Mode::kFault; };
  ASSERT_FALSE(faulty(310));
  ASSERT_TRUE(faulty(440));   // silent
  ASSERT_FALSE(faulty(510));  // rearmed
  ASSERT_TRUE(faulty(700));   // not a number
  ASSERT_FALSE(faulty(810));
  ASSERT_TRUE(faulty(900));  // jumped
  ASSERT_FALSE(faulty(1010));
  EXPECT_EQ(first_difference(config.control, steps), "");
}

TEST(Rerun, DisarmsAsTheLoopDid) {
  const HapticLoop::Config config = with_fault_detection();
  std::vector<StepRecord> steps = troubled(config);
  ASSERT_NE(steps[98].force, Vec3::Zero());
  ASSERT_EQ(steps[99].force, Vec3::Zero()) << "step 100";
  ASSERT_EQ(steps[198].force, Vec3::Zero());
  ASSERT_NE(steps[250].force, Vec3::Zero());
  ASSERT_TRUE(steps[420].disarmed && steps[440].mode == Mode::kFault);
  for (StepRecord& step : steps) step.disarmed = false;
  EXPECT_NE(first_difference(config.control, steps).find("step 100: "), std::string::npos);
}

TEST(Rerun, NoticesARearmThatIsNotInTheRecord) {
  const HapticLoop::Config config = with_fault_detection();
  std::vector<StepRecord> steps = troubled(config);
  for (StepRecord& step : steps) step.rearmed = false;
  EXPECT_NE(first_difference(config.control, steps).find("step 200: "), std::string::npos);
}

TEST(Rerun, NamesTheFirstBitThatDiffers) {
  const Scene scene = scene_with({});
  std::vector<StepRecord> steps = recorded(scene);
  ASSERT_GT(limited(steps), 50U);
  double& energy = steps[1000].energy;
  energy = std::nextafter(energy, 1.0);
  const std::string how = first_difference(scene.loop.control, steps);
  EXPECT_EQ(how.find("step 1001: energy_j: recorded "), 0U) << how;
  EXPECT_EQ(how.find("permitted"), std::string::npos) << how;
}

TEST(Rerun, NoticesAnotherLawAndAnotherSetting) {
  const std::vector<StepRecord> steps = recorded(scene_with({}));
  for (const char* setting : {"limiter.kind=aol-box", "limiter.coulomb_friction_n=0.1", "force.max_slew_n_per_s=20",
                              "force.max_force_n=1", "loop.longest_hold_us=5000"}) {
    EXPECT_NE(first_difference(scene_with({setting}).loop.control, steps), "") << setting;
  }
}

TEST(Rerun, WithItsOwnForcesAPassiveLawKeepsItsOwnAccountPassive) {
  const std::vector<StepRecord> steps = recorded(scene_with({"limiter.kind=none"}));
  Rerun rerun(scene_with({"limiter.kind=aol", "loop.longest_hold_us=9000"}).loop.control, Rerun::Held::kOwn);
  double least = 0;
  double least_recorded = 0;
  double most_force = 0;
  for (const StepRecord& step : steps) {
    const StepRecord again = rerun.step(step);
    least = std::min(least, again.energy);
    least_recorded = std::min(least_recorded, step.energy);
    most_force = std::max(most_force, again.applied.norm());
    EXPECT_LE(again.applied.norm(), again.permitted + 1e-12);
  }
  EXPECT_LT(least_recorded, -1e-4);
  EXPECT_GT(least, -1e-12);
  EXPECT_GT(most_force, 0.3);
}

}  // namespace
}  // namespace tendon::replay::rerun_test
