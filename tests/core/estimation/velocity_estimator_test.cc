// SPDX-License-Identifier: Apache-2.0
#include "core/estimation/velocity_estimator.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace tendon::velocity_estimator_test {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

double counted(double x, double resolution) { return std::round(x / resolution) * resolution; }

TEST(VelocityEstimator, IsTheBackwardDifferenceForExactPositions) {
  VelocityEstimator estimator(0);
  LocalTime at{};
  Vec3 before = Vec3::Zero();
  for (int i = 0; i < 100; ++i) {
    const Vec3 x(std::sin(0.1 * i), i * i * 1e-4, 0);
    const Vec3 v = estimator.observe(at, x);
    if (i > 0) {
      EXPECT_NEAR((v - (x - before) / 1e-3).norm(), 0, 1e-9);
    }
    before = x;
    at += milliseconds(1);
  }
}

TEST(VelocityEstimator, IsTenTimesQuieterThanBackwardDifferencesAtLowSpeed) {
  constexpr double kCount = 30e-6;
  VelocityEstimator estimator(kCount);
  double squares = 0;
  double backward_squares = 0;
  double before = 0;
  for (int i = 0; i < 2000; ++i) {
    const double t = i * 1e-3;
    const double x = counted(5e-3 * t, kCount);  // 5 mm/s
    const double v = estimator.observe(LocalTime(milliseconds(i)), Vec3(x, 0, 0)).x();
    if (i > 50) {
      squares += (v - 5e-3) * (v - 5e-3);
      const double backward = (x - before) / 1e-3;
      backward_squares += (backward - 5e-3) * (backward - 5e-3);
    }
    before = x;
  }
  EXPECT_LT(squares, backward_squares / 100);
}

TEST(VelocityEstimator, FollowsFastMotionWithinThreePercent) {
  constexpr double kCount = 30e-6;
  VelocityEstimator estimator(kCount);
  const double omega = 2 * std::numbers::pi * 2;  // 20 mm at 2 Hz: 0.25 m/s
  double worst = 0;
  for (int i = 0; i < 2000; ++i) {
    const double t = i * 1e-3;
    const double v =
        estimator.observe(LocalTime(milliseconds(i)), Vec3(counted(0.02 * std::sin(omega * t), kCount), 0, 0)).x();
    if (i > 50) worst = std::max(worst, std::abs(v - 0.02 * omega * std::cos(omega * t)));
  }
  EXPECT_LT(worst, 0.25 * 0.06);
}

TEST(VelocityEstimator, UsesTheTimeStampsNotANominalPeriod) {
  VelocityEstimator estimator(30e-6);
  LocalTime at{};
  Vec3 v = Vec3::Zero();
  for (int i = 0; i < 200; ++i) {
    at += microseconds(i % 2 == 0 ? 500 : 2000);
    v = estimator.observe(at, Vec3(0.1 * seconds(at.time_since_epoch()), 0, 0));
  }
  EXPECT_NEAR(v.x(), 0.1, 1e-9);
}

TEST(VelocityEstimator, SaysZeroForAHandleThatFlickersBetweenTwoCounts) {
  VelocityEstimator estimator(30e-6);
  double worst = 0;
  for (int i = 0; i < 200; ++i) {
    const double v = estimator.observe(LocalTime(milliseconds(i)), Vec3(i % 2 == 0 ? 0 : 30e-6, 0, 0)).x();
    if (i > 50) worst = std::max(worst, std::abs(v));
  }
  EXPECT_LE(worst, 30e-6 / 15e-3 + 1e-12);  // one count over the window; the error of a finite difference is 30 mm/s
}

TEST(VelocityEstimator, IgnoresWhatIsNotANumberAndWhatIsNotNewer) {
  VelocityEstimator estimator(0);
  estimator.observe(LocalTime(milliseconds(0)), Vec3(0, 0, 0));
  const Vec3 v = estimator.observe(LocalTime(milliseconds(1)), Vec3(1e-3, 0, 0));
  EXPECT_EQ(estimator.observe(LocalTime(milliseconds(2)), Vec3(std::nan(""), 0, 0)), v);
  EXPECT_EQ(estimator.observe(LocalTime(milliseconds(1)), Vec3(5, 0, 0)), v);
  EXPECT_NEAR(estimator.observe(LocalTime(milliseconds(2)), Vec3(3e-3, 0, 0)).x(), 2, 1e-12);
}

double end_fit(const std::vector<Motion>& newest_first, int axis, double resolution) {
  const Motion& now = newest_first.front();
  double velocity = 0;
  const auto rate = [&](std::size_t i) { return 1e9 / static_cast<double>((now.at - newest_first[i].at).count()); };
  const auto slope = [&](std::size_t i) { return (now.position[axis] - newest_first[i].position[axis]) * rate(i); };
  for (std::size_t n = 1; n < newest_first.size() && n <= VelocityEstimator::kWindow; ++n) {
    const double v = slope(n);
    for (std::size_t i = 1; i < n; ++i) {
      if (v < slope(i) - resolution * rate(i) || v > slope(i) + resolution * rate(i)) return velocity;
    }
    velocity = v;
  }
  return velocity;
}

TEST(VelocityEstimator, IsTheLongestEndFitToTheLastBit) {
  std::mt19937_64 random(1);
  for (const double count : {0.0, 30e-6, 1e-3}) {
    VelocityEstimator estimator(count);
    std::vector<Motion> newest_first;
    Motion hand{.at = LocalTime{}, .position = Vec3::Zero(), .velocity = Vec3::Zero()};
    for (int step = 0; step < 3000; ++step) {
      hand.at += Duration(500'000 + random() % 1'000'000);
      for (int axis = 0; axis < 3; ++axis) {
        const double fast = step % 1000 < 500 ? 1e-3 : 1e-5;
        hand.velocity[axis] += fast * (static_cast<double>(random() % 2001) - 1000);
        hand.velocity[axis] *= 0.99;
        hand.position[axis] += 1e-3 * hand.velocity[axis];
      }
      Motion seen = hand;
      if (count > 0) seen.position = count * (hand.position / count).array().round().matrix();
      if (step % 300 < 60) seen.position.z() = step % 7 == 0 ? -0.0 : 0.0;  // at rest, with both signed zeros
      newest_first.insert(newest_first.begin(), seen);
      if (newest_first.size() > 20) newest_first.pop_back();
      const Vec3 velocity = estimator.observe(seen.at, seen.position);
      for (int axis = 0; axis < 3; ++axis) {
        const double expected = end_fit(newest_first, axis, count);
        ASSERT_EQ(std::bit_cast<std::uint64_t>(velocity[axis]), std::bit_cast<std::uint64_t>(expected)) << step;
      }
    }
  }
}

TEST(VelocityEstimator, RefusesANegativeResolution) {
  EXPECT_THROW(VelocityEstimator(-1e-6), std::invalid_argument);
  EXPECT_THROW(VelocityEstimator(std::nan("")), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::velocity_estimator_test
