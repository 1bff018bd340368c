// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/perception.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "tests/tools/lab/experiments/experiment.h"

namespace tendon::lab::perception_test {
namespace {

constexpr Duration kPeriod = std::chrono::milliseconds(1);

/// One second of a sine along x; `speed`: m/s, rms.
std::vector<Vec3> sine(double frequency, double speed) {
  std::vector<Vec3> velocity(1000, Vec3::Zero());
  for (std::size_t i = 0; i < velocity.size(); ++i) {
    const double phase = 2 * std::numbers::pi * frequency * static_cast<double>(i) * 1e-3;
    velocity[i].x() = speed * std::numbers::sqrt2 * std::sin(phase + 0.3);
  }
  return velocity;
}

/// m/s, rms, of a sine at the detection threshold.
double just_felt(double frequency) {
  return detection_threshold(frequency) * 2 * std::numbers::pi * frequency / std::numbers::sqrt2;
}

TEST(DetectionThreshold, IsFlatTo40HzAndFalls12DecibelAnOctaveTo250Hz) {
  EXPECT_DOUBLE_EQ(detection_threshold(10), detection_threshold(40));
  EXPECT_NEAR(20 * std::log10(detection_threshold(50) / detection_threshold(100)), 12.04, 0.01);
  EXPECT_DOUBLE_EQ(detection_threshold(250), 1e-7);
  EXPECT_GT(detection_threshold(400), detection_threshold(250));
}

TEST(SensationLevel, OfASineThatIsJustFeltIsZeroAtEveryFrequency) {
  for (const double frequency : {12.0, 20.0, 40.0, 63.5, 100.0, 200.0, 300.0, 450.0}) {
    EXPECT_NEAR(sensation_level(sine(frequency, just_felt(frequency)), kPeriod), 0, 0.3) << frequency << " Hz";
  }
}

TEST(SensationLevel, ThreeMillimetresASecondAreFeltMoreAt200HzThanAt20Hz) {
  const double slow = sensation_level(sine(20, 3e-3), kPeriod);
  const double fast = sensation_level(sine(200, 3e-3), kPeriod);
  EXPECT_NEAR(slow, 18.7, 0.5);
  EXPECT_NEAR(fast, 26.7, 0.5);
}

TEST(SensationLevel, DoesNotDependOnThePeriodOfTheLoop) {
  std::vector<Vec3> finer(4000, Vec3::Zero());
  for (std::size_t i = 0; i < finer.size(); ++i) {
    finer[i].y() = 3e-3 * std::numbers::sqrt2 * std::sin(2 * std::numbers::pi * 90 * static_cast<double>(i) * 0.25e-3);
  }
  EXPECT_NEAR(sensation_level(finer, kPeriod / 4), sensation_level(sine(90, 3e-3), kPeriod), 0.1);
}

TEST(SensationLevel, OfTheMotionThatAHandIntendsIsBelowItsThreshold) {
  std::vector<Moment> record(2000);
  for (std::size_t i = 0; i < record.size(); ++i) {
    const double t = static_cast<double>(i) * 1e-3;
    record[i].velocity.x() = 0.015 * std::numbers::pi * std::cos(std::numbers::pi * t);
  }
  EXPECT_LT(sensation_level(fast_velocity(record, kPeriod, 1), kPeriod), 0);
  EXPECT_EQ(sensation_level(std::vector<Vec3>(1000, Vec3::Zero()), kPeriod), kNothing);
  EXPECT_EQ(sensation_level(std::vector<Vec3>(3, Vec3::Ones()), kPeriod), kNothing);
}

TEST(NoticedForce, IsOffByMoreThanAWeberFraction) {
  const Vec3 truth(0, 3, 0);
  EXPECT_FALSE(notices(1.06 * truth, truth));
  EXPECT_TRUE(notices(1.08 * truth, truth));
  EXPECT_TRUE(notices(truth + Vec3(0.22, 0, 0), truth)) << "a force across the true one is an error, too";
  EXPECT_FALSE(notices(Vec3::Zero(), Vec3(0.4, 0, 0))) << "smaller forces are not judged";
}

TEST(NoticedStiffness, IsOffByMoreThanAWeberFraction) {
  EXPECT_FALSE(notices_stiffness(390, 500));
  EXPECT_FALSE(notices_stiffness(610, 500));
  EXPECT_TRUE(notices_stiffness(380, 500));
  EXPECT_TRUE(notices_stiffness(620, 500));
  EXPECT_TRUE(notices_stiffness(std::nan(""), 500));
}

TEST(NoticedShare, IsThatOfTheMomentsWhichAreJudged) {
  std::vector<Moment> record(100);
  for (std::size_t i = 0; i < record.size(); ++i) {
    record[i].true_force.x() = i < 50 ? 2 : 0.1;
    record[i].step.force.x() = i < 10 ? 1.5 : record[i].true_force.x();
  }
  EXPECT_DOUBLE_EQ(outcome(record, kPeriod).noticed_share, 0.2);
}

}  // namespace
}  // namespace tendon::lab::perception_test
