// SPDX-License-Identifier: Apache-2.0
#include "server/tables/recorded_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "devices/simulated/simulated_device.h"
#include "tests/devices/device_bench.h"
#include "tests/support/refusal.h"

namespace tendon::recorded_motion_test {
namespace {

using namespace std::chrono_literals;

ScriptedMotion::Recorded load(const std::string& text, const RecordedMotionFile& file) {
  std::istringstream csv(text);
  return load_recorded_motion(csv, file);
}

/// A file hand.csv with a header and its positions in the column x.
std::string complaint(const std::string& text) {
  return thrown_by<std::runtime_error>([&] { load(text, {.path = "hand.csv", .position = "x"}); });
}

TEST(RecordedMotion, ReadsColumnsByTheirNamesAndScalesThePosition) {
  const auto motion = load("t_s,other, angle_rad \n10,9,1\n10.5,9,-2\r\n\n11,9,4e-1\n",
                           {.path = "hand.csv", .position = "angle_rad", .scale = 0.075});
  ASSERT_EQ(motion.samples.size(), 3U);
  EXPECT_EQ(motion.samples[1].t, 10.5);
  EXPECT_EQ(motion.samples[1].x, -0.15);
  EXPECT_EQ(motion.samples[2].x, 0.4 * 0.075);
}

TEST(RecordedMotion, ReadsColumnsByTheirNumbersFromAFileWithoutAHeader) {
  const auto motion = load("7,0,1\n8,0.5,2\n9,1,3", {.path = "hand.csv", .time = 1U, .position = 0U});
  ASSERT_EQ(motion.samples.size(), 3U);
  EXPECT_EQ(motion.samples[2].t, 1);
  EXPECT_EQ(motion.samples[2].x, 9);
}

TEST(RecordedMotion, NamesFileAndLineAndWhatWasExpectedWhenAFileIsWrong) {
  const struct {
    const char* text;
    const char* says;
  } cases[] = {
      {"t_s,x\n0,1\n1,two\n", ":3: expected a finite number as x, found 'two'"},
      {"t_s,x\n0,1\n\n1,\n", ":4: expected a finite number as x, found ''"},
      {"t_s,x\n0,1\n1\n", ":3: expected 2 cells as in the first row, found 1"},
      {"t_s,x\n0,1\n1,1\n1,2\n", ":4: expected a time later than that of the previous sample, found '1'"},
      {"t_s,y\n0,1\n", ":1: expected a header line with a column 'x', found 't_s,y'"},
      {"", ":1: expected a header line with a column 't_s', found an empty file"},
      {"t_s,x\n0,1\n", ":2: expected 2 samples or more, found 1"},
  };
  for (const auto& bad : cases) EXPECT_EQ(complaint(bad.text), std::string("hand.csv") + bad.says);
}

TEST(RecordedMotion, TakesTheUnitOfTimesFromTheirName) {
  const auto motion = load("t_ms,x\n0,1\n500,2\n", {.path = "hand.csv", .time = "t_ms", .position = "x"});
  EXPECT_EQ(motion.samples[1].t, 0.5);
}

TEST(RecordedMotion, RefusesAScaleThatWouldMakeThePositionVanish) {
  EXPECT_THROW(load("", {.path = "any.csv", .position = "x", .scale = 0}), std::invalid_argument);
}

TEST(RecordedMotion, AHumanHandOnAFoamDrivesTheDevice) {
  // This recording of an operator (4.4 s at 2 kHz, lever arm 0.075 m) cannot be distributed.
  const char* data = std::getenv("TENDON_DATA");  // NOLINT(concurrency-mt-unsafe): one thread
  if (data == nullptr) GTEST_SKIP() << "TENDON_DATA is not set: the recorded human motion is not there";

  const auto path = std::filesystem::path(data) / "tue-1dof-teleop" / "m2_question1d_foam.csv";
  std::ifstream csv(path);
  const auto recorded = load_recorded_motion(csv, {.path = path, .position = "master_pos_rad", .scale = 0.075});
  ASSERT_EQ(recorded.samples.size(), 8813U);
  EXPECT_EQ(recorded.samples.front().x, 0.00638790506 * 0.075);
  const double length = recorded.samples.back().t - recorded.samples.front().t;
  EXPECT_NEAR(length, 8812 * 0.0005, 1e-9);

  const ScriptedMotion motion(recorded);
  double furthest = 0;
  double fastest = 0;
  for (double t = 0; t < length; t += 1e-4) {
    furthest = std::max(furthest, motion.at(t).position.norm());
    fastest = std::max(fastest, motion.at(t).velocity.norm());
  }
  RecordProperty("furthest_m", std::to_string(furthest));
  RecordProperty("fastest_m_s", std::to_string(fastest));
  EXPECT_GT(furthest, 0.005);
  EXPECT_LT(furthest, 0.1);
  EXPECT_LT(fastest, 3) << "faster than a hand moves: the path between the samples is wrong";

  SimulatedDevice::Config config;
  config.mass = 0.075;
  config.coulomb_friction = 0.04;
  config.hand = OperatorHand::Config{.stiffness = 2000, .damping = 20, .mass = 0.05, .motion = motion};
  Bench bench(config);
  for (int i = 1; i < static_cast<int>(length * 1000); ++i) {
    bench.wait(1ms);
    ASSERT_LT((bench.truth().position - motion.at(1e-3 * i).position).norm(), 2e-3) << i << " ms";
  }
}

}  // namespace
}  // namespace tendon::recorded_motion_test
