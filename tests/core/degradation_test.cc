// SPDX-License-Identifier: Apache-2.0
// The table in SESSION.md, "When forces stop coming", must agree with the constants of the code.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <regex>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/haptic_controller.h"

namespace tendon::degradation_test {
namespace {

using std::chrono::milliseconds;

struct Stage {
  std::string name;
  bool after_validity = false;  ///< "v + 20 ms": counted from the end of the validity, not from the arrival
  Duration entered{};
  Mode mode{};
  Duration time_constant{};  ///< in the table: "e^(−t / 50 ms)", "t / 100 ms"
};

Duration milliseconds_in(const std::string& cell) {
  std::smatch found;
  return std::regex_search(cell, found, std::regex("([0-9]+) ms")) ? milliseconds(std::stol(found[1])) : Duration{};
}

std::vector<Stage> table() {
  std::ifstream page(TENDON_SESSION_MD);
  EXPECT_TRUE(page.is_open()) << TENDON_SESSION_MD;
  const std::regex row(R"(^\| ([^|]+) \| ([^|]+) \| ([0-9]) [^|]+ \| ([^|]+) \|$)");
  std::vector<Stage> stages;
  bool here = false;
  for (std::string line; std::getline(page, line);) {
    if (line.rfind("## ", 0) == 0) here = line == "## When forces stop coming";
    std::smatch cells;
    if (!here || !std::regex_match(line, cells, row)) continue;
    stages.push_back({.name = cells[1],
                      .after_validity = cells[2].str().find("v +") != std::string::npos,
                      .entered = milliseconds_in(cells[2]),
                      .mode = static_cast<Mode>(std::stoi(cells[3])),
                      .time_constant = milliseconds_in(cells[4])});
  }
  return stages;
}

const Stage& stage(const std::vector<Stage>& stages, const std::string& name) {
  const auto found = std::find_if(stages.begin(), stages.end(), [&](const Stage& r) { return r.name == name; });
  if (found == stages.end()) throw std::runtime_error("SESSION.md has no stage \"" + name + "\"");
  return *found;
}

TEST(Degradation, TheTimesOfThePageAreThoseOfTheCode) {
  const auto stages = table();
  const HeldForce::Config code;
  EXPECT_EQ(stages.size(), 6U);
  EXPECT_EQ(stage(stages, "fresh").entered, Duration{});
  EXPECT_EQ(stage(stages, "local model").entered, Duration{});
  EXPECT_EQ(stage(stages, "hold").entered, Duration{});
  EXPECT_EQ(stage(stages, "decay").entered, code.hold);
  EXPECT_EQ(stage(stages, "decay").time_constant, code.decay);
  EXPECT_EQ(stage(stages, "safe stop").entered, code.safe_stop);
  EXPECT_EQ(stage(stages, "re-engage").time_constant, code.ramp_in);
}

class Walk : public ::testing::Test {
 protected:
  static constexpr Duration kValid = milliseconds(60);
  static constexpr double kSlew = 200;  // N/s: 0.2 N in a step of 1 ms
  static constexpr double kStiffness = 1000;
  static constexpr int kSilent = 1000;  // ms; this is the period after the last force
  static constexpr int kBack = 2000;

  Walk() {
    HapticController::Config config;
    config.limiter.law = Law::kNone;  // otherwise the limiter would reduce the force
    config.limiter.longest_hold = milliseconds(1);
    config.max_force = 10;
    config.max_slew = kSlew;
    HapticController controller(config);
    Vec3 applied = Vec3::Zero();
    for (int ms = 1; ms <= 2500; ++ms) {
      Motion hand;
      hand.at = LocalTime(milliseconds(ms));
      hand.position = Vec3(depth(ms), 0, 0);
      hand.velocity = Vec3(2e-3, 0, 0);
      if (ms % 10 == 0 && (ms < kSilent || ms >= kBack)) {
        RemoteForce force;
        force.sequence = static_cast<std::uint64_t>(ms);
        force.received = hand.at;
        force.force = Vec3(-kStiffness * depth(ms), 0, 0);
        force.model = LocalModel{.at = hand.position, .stiffness = kStiffness * Mat3::Identity()};
        force.valid_for = kValid;
        EXPECT_TRUE(controller.observe(force));
      }
      steps_.push_back(controller.step(hand, applied));
      applied = steps_.back().force;
    }
  }
  static double depth(int ms) { return 4e-3 + 2e-6 * ms; }

  std::vector<Stage> stages_ = table();
  std::vector<Step> steps_;
};

TEST_F(Walk, EachStageIsEnteredAtItsTime) {
  std::map<Mode, int> lasted;  // ms
  for (const Step& step : steps_) {
    if (step.force_sequence == 0) continue;
    Mode expected = stage(stages_, "fresh").mode;
    for (const char* name : {"hold", "decay", "safe stop"}) {
      const Stage& next = stage(stages_, name);
      ASSERT_TRUE(next.after_validity) << name;
      const Duration from = kValid + next.entered;
      const bool there = next.mode == Mode::kSafeStop ? step.force_age >= from : step.force_age > from;
      if (there) expected = next.mode;
    }
    ASSERT_EQ(step.mode, expected) << "force " << seconds(step.force_age) << " s old";
    if (step.hand.at < LocalTime(milliseconds(kBack))) ++lasted[expected];
  }
  EXPECT_EQ(lasted[stage(stages_, "hold").mode], 20);
  EXPECT_EQ(lasted[stage(stages_, "decay").mode], 229);  // ages 81 … 309 ms
  EXPECT_GT(lasted[stage(stages_, "safe stop").mode], 600);
}

TEST_F(Walk, NoStepOfTheForceExceedsTheSlewBound) {
  double largest = 0;
  double peak = 0;
  Vec3 before = Vec3::Zero();
  for (const Step& step : steps_) {
    largest = std::max(largest, (step.force - before).norm());
    peak = std::max(peak, step.force.norm());
    before = step.force;
  }
  EXPECT_LE(largest, kSlew * 1e-3 * (1 + 1e-9));
  EXPECT_GT(peak, 5);
}

TEST_F(Walk, TheForceFollowsItsModelUntilItFadesAndComesBackOnARamp) {
  const auto at = [&](int ms) -> const Step& { return steps_[static_cast<std::size_t>(ms - 1)]; };
  const auto wall = [](int ms) { return kStiffness * depth(ms); };
  EXPECT_NEAR(-at(1040).wanted.x(), wall(1040), 1e-9);
  EXPECT_NEAR(-at(1065).wanted.x(), wall(1065), 1e-9);
  // Decay starts v + 20 ms = 80 ms after 990 ms.
  const double decay = seconds(stage(stages_, "decay").time_constant);
  EXPECT_NEAR(-at(1150).wanted.x(), wall(1150) * std::exp(-0.080 / decay), 1e-9);
  EXPECT_EQ(at(1500).wanted.norm(), 0);
  EXPECT_EQ(at(1999).wanted.norm(), 0);
  const double ramp = seconds(stage(stages_, "re-engage").time_constant);
  EXPECT_NEAR(-at(2025).wanted.x(), wall(2025) * 0.025 / ramp, 1e-9);
  EXPECT_NEAR(-at(2200).wanted.x(), wall(2200), 1e-9);
}

}  // namespace
}  // namespace tendon::degradation_test
