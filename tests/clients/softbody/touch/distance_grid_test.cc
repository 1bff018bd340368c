// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/touch/distance_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "tests/support/dice.h"
#include "tests/support/refusal.h"

namespace tendon::softbody::distance_grid_test {
namespace {

constexpr double kRadius = 0.01;  // m

double ball_distance(const Vec3& x) { return x.norm() - kRadius; }

DistanceGrid ball_grid(double cell) { return {ball_distance, Vec3::Constant(-0.014), Vec3::Constant(0.014), cell}; }

TEST(DistanceGrid, MeetsASmoothDistanceToTheFourthOrder) {
  const auto errors = [](double cell) {
    const DistanceGrid grid = ball_grid(cell);
    Dice dice(11);
    std::array<double, 3> worst{};
    for (int i = 0; i < 4000; ++i) {
      const Vec3 way = Vec3(dice.within(-1, 1), dice.within(-1, 1), dice.within(-1, 1)).normalized();
      const double r = dice.within(0.007, 0.013);
      const Distance found = grid.at(r * way);
      worst[0] = std::max(worst[0], std::abs(found.value - (r - kRadius)));
      worst[1] = std::max(worst[1], (found.gradient - way).norm());
      worst[2] = std::max(worst[2], (found.curvature - (Mat3::Identity() - way * way.transpose()) / r).norm());
    }
    return worst;
  };
  const auto coarse = errors(0.001);
  const auto fine = errors(0.0005);
  EXPECT_LT(fine[0], 1e-7);  // m; 1/5000 of a cell
  EXPECT_GT(std::log2(coarse[0] / fine[0]), 3.6);
  EXPECT_GT(std::log2(coarse[1] / fine[1]), 2.6);
  EXPECT_GT(std::log2(coarse[2] / fine[2]), 1.6);
}

/// The distance of a plate, which has kinks halfway between two faces and at the edges.
double plate_distance(const Vec3& x) {
  const Vec3 beyond = x.cwiseAbs() - Vec3(0.006, 0.006, 0.002);
  return beyond.cwiseMax(0.0).norm() + std::min(0.0, beyond.maxCoeff());
}

TEST(DistanceGrid, ItsDerivativesAreThoseOfItsValueAndNoneJumps) {
  constexpr double kStep = 1e-6;  // m
  constexpr double kCell = 0.0005;
  const DistanceGrid grid(plate_distance, Vec3::Constant(-0.008), Vec3::Constant(0.008), kCell);
  Dice dice(12);
  for (int i = 0; i < 3000; ++i) {
    Vec3 x(dice.within(-0.0077, 0.0077), dice.within(-0.0077, 0.0077), dice.within(-0.0077, 0.0077));
    if (i % 2 == 0) x[i / 2 % 3] = -0.008 + kCell * std::round((x[i / 2 % 3] + 0.008) / kCell);
    const Distance here = grid.at(x);
    for (int axis = 0; axis < 3; ++axis) {
      const Distance ahead = grid.at(x + kStep * Vec3::Unit(axis));
      const Distance behind = grid.at(x - kStep * Vec3::Unit(axis));
      EXPECT_NEAR((ahead.value - behind.value) / (2 * kStep), here.gradient[axis], 1e-4);
      EXPECT_LT(((ahead.gradient - behind.gradient) / (2 * kStep) - here.curvature.col(axis)).norm(), 0.01 / kCell);
      EXPECT_LT((ahead.curvature - behind.curvature).norm(), 0.02 / kCell);
    }
    EXPECT_NEAR(here.value, plate_distance(x), 0.2 * kCell);
    EXPECT_NEAR(grid.value(x), here.value, 1e-15);
    EXPECT_EQ(here.curvature, here.curvature.transpose());
  }
}

TEST(DistanceGrid, OverTheBordersOfItsBoxValueAndDirectionGoOn) {
  const DistanceGrid grid = ball_grid(0.001);
  Dice dice(13);
  for (int i = 0; i < 500; ++i) {
    Vec3 x(dice.within(-0.014, 0.014), dice.within(-0.014, 0.014), dice.within(-0.014, 0.014));
    const int axis = i % 3;
    x[axis] = 0.014;
    const Distance inside = grid.at(x - 1e-9 * Vec3::Unit(axis));
    const Distance outside = grid.at(x + 1e-9 * Vec3::Unit(axis));
    EXPECT_NEAR(outside.value, inside.value, 5e-9);
    EXPECT_LT((outside.gradient - inside.gradient).norm(), 1e-3);
    const Vec3 far = x + dice.within(0, 0.1) * Vec3::Unit(axis);
    EXPECT_GT(grid.at(far).value, ball_distance(far) - 1e-7);
    EXPECT_LT(grid.at(far).value, ball_distance(far) * 1.02);
    EXPECT_GT(grid.at(far).gradient.dot(far.normalized()), 0.995);
    EXPECT_NEAR(grid.at(far).gradient.norm(), 1, 1e-12);
    EXPECT_EQ(grid.value(far), grid.at(far).value);
  }
  EXPECT_NEAR(grid.at(Vec3(1000, 0, 0)).value, 999.99, 1e-3);
  EXPECT_NEAR(grid.at(Vec3(1e150, 0, 0)).gradient.x(), 1, 1e-12);
}

TEST(DistanceGrid, APlaceThatIsNotFiniteHasNoDistance) {
  const DistanceGrid grid = ball_grid(0.001);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_TRUE(std::isnan(grid.at(bad * Vec3::Unit(axis)).value));
      EXPECT_TRUE(std::isnan(grid.value(bad * Vec3::Unit(axis))));
    }
  }
}

TEST(DistanceGrid, RefusesWhatIsNoDistanceOrTooLarge) {
  const auto refusal = [](const auto& distance, double cell) {
    return thrown_by([&] { DistanceGrid(distance, Vec3::Constant(-0.014), Vec3::Constant(0.014), cell); });
  };
  for (const double bad : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_NE(refusal(ball_distance, bad), "") << bad;
  }
  EXPECT_PRED2(says, refusal(ball_distance, 1e-5), "grid points, expected at most");
  EXPECT_PRED2(says, refusal(ball_distance, 1e-300), "grid points, expected at most");
  const auto inverted_beyond = [](const Vec3& x) { return x.y() > 0.005 ? -ball_distance(x) : ball_distance(x); };
  const std::string jumps = refusal(inverted_beyond, 0.001);
  EXPECT_PRED2(says, jumps, "the distance jumps");
}

}  // namespace
}  // namespace tendon::softbody::distance_grid_test
