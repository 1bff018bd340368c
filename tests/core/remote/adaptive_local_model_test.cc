// SPDX-License-Identifier: Apache-2.0
#include "core/remote/adaptive_local_model.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/dice.h"

namespace tendon::adaptive_local_model_test {
namespace {

using std::chrono::milliseconds;

LocalTime at(int k) { return LocalTime(milliseconds(k)); }

RemoteForce spring(int answers, int received, const Vec3& x, const Mat3& stiffness) {
  return {.answers = at(answers),
          .received = at(received),
          .force = -stiffness * x,
          .model = LocalModel{.at = x, .stiffness = stiffness}};
}

RemoteForce without_model(int answers, int received, const Vec3& force) {
  return {.answers = at(answers), .received = at(received), .force = force, .model = std::nullopt};
}

Vec3 hand(int k) { return {0.01 * std::sin(0.005 * k), 0.004 * std::cos(0.009 * k), 0.001}; }

TEST(AdaptiveLocalModel, IsExactForASpringWhateverTheRateAndTheDelay) {
  const Vec3 normal = Vec3(1, 2, 0.5).normalized();
  const Mat3 stiffness = 300 * normal * normal.transpose();
  AdaptiveLocalModel model({});
  for (int k = 0; k < 2000; ++k) {
    if (k >= 40 && k % 40 == 0) {
      ASSERT_TRUE(model.observe(spring(k - 40, k, hand(k - 40), stiffness)));
    }
    const std::optional<Prediction> prediction = model.predict({at(k), hand(k), Vec3::Zero()});
    ASSERT_EQ(prediction.has_value(), k >= 40);
    if (!prediction) continue;
    ASSERT_LT((prediction->force + stiffness * hand(k)).norm(), 1e-12);
    ASSERT_LT((prediction->stiffness - stiffness).norm(), 1e-9);
  }
}

TEST(AdaptiveLocalModel, SpreadsAJumpOfForceOverTheNextSlowPeriod) {
  AdaptiveLocalModel model({});
  const Vec3 x(0.01, 0, 0);
  model.observe(spring(0, 10, x, 200 * Mat3::Identity()));
  model.observe(spring(40, 50, x, 600 * Mat3::Identity()));
  double before = -2;
  for (int k = 50; k <= 100; ++k) {
    const Prediction prediction = *model.predict({at(k), x, Vec3::Zero()});
    EXPECT_NEAR(prediction.force.x(), k < 90 ? -2 - 4.0 * (k - 50) / 40 : -6, 1e-12);
    EXPECT_LE(std::abs(prediction.force.x() - before), 4.0 / 40 + 1e-12);
    EXPECT_NEAR(prediction.stiffness(0, 0), k < 90 ? 200 + 10.0 * (k - 50) : 600, 1e-9);
    before = prediction.force.x();
  }
}

TEST(AdaptiveLocalModel, NothingJumpsWhenAnAnswerArrivesEvenInABlend) {
  AdaptiveLocalModel model({});
  Dice dice(6);
  const Motion somewhere{at(0), Vec3(0.01, -0.02, 0.005), Vec3::Zero()};
  model.observe(without_model(0, 0, Vec3(5, 0, 0)));
  for (int k = 1; k < 5000; ++k) {
    Motion now = somewhere;
    now.at = at(k);
    const Vec3 before = model.predict(now)->force;
    if (dice.chance(0.05)) model.observe(without_model(k, k, 5 * dice.direction()));
    EXPECT_LT((model.predict(now)->force - before).norm(), 1e-12);
    EXPECT_LE(before.norm(), 5 + 1e-9);
  }
}

/// Returns the energy (J) that a hand can extract by moving 1 mm in the worse of two springs at each reversal.
double handed_out(const AdaptiveLocalModel::Config& config) {
  AdaptiveLocalModel model(config);
  double energy = 0;
  Vec3 before(0.01, 0, 0);
  model.observe(spring(0, 0, before, 100 * Mat3::Identity()));
  for (int k = 1; k < 4000; ++k) {
    if (k % 40 == 0) {
      model.observe(spring(k, k, before, (k / 40 % 2 == 1 ? 600 : 100) * Mat3::Identity()));
    }
    const int phase = k % 80;
    const double x = 0.010 + 0.001 * (phase < 40 ? phase / 40.0 : 2 - phase / 40.0);
    const Vec3 now(x, 0, 0);
    energy += model.predict({at(k), before, Vec3::Zero()})->force.dot(now - before);
    before = now;
  }
  return energy;
}

TEST(AdaptiveLocalModel, ABlendHandsOutHalfOfWhatASwapDoes) {
  const double swapped = handed_out({.max_blend = Duration::zero()});
  const double blended = handed_out({});
  EXPECT_GT(swapped, 0);
  EXPECT_LT(blended, 0.55 * swapped);
}

TEST(AdaptiveLocalModel, HoldsTheForceWhenTheEngineSendsNoStiffness) {
  AdaptiveLocalModel model({});
  model.observe(without_model(0, 5, Vec3(1, 2, 3)));
  for (int k = 0; k < 100; ++k) {  // includes motions sampled just before the arrival
    const Prediction prediction = *model.predict({at(k), hand(k), Vec3::Zero()});
    EXPECT_EQ(prediction.force, Vec3(1, 2, 3));
    EXPECT_EQ(prediction.stiffness, Mat3::Zero());
  }
}

TEST(AdaptiveLocalModel, FollowsNoMoreThanItsShareOfTheStiffness) {
  AdaptiveLocalModel model({.share = 0.8});
  model.observe(spring(0, 0, Vec3(0.01, 0, 0), 500 * Mat3::Identity()));
  const Prediction there = *model.predict({at(0), Vec3(0.02, 0, 0), Vec3::Zero()});
  EXPECT_NEAR(there.force.x(), -5 - 400 * 0.01, 1e-12);
  EXPECT_EQ(there.stiffness(0, 0), 400);
}

TEST(AdaptiveLocalModel, BeyondTheValidRadiusTheForceStaysWhatItIsAtItsEdge) {
  RemoteForce near = spring(0, 0, Vec3(0.01, 0, 0), 500 * Mat3::Identity());
  near.model->valid_radius = 0.002;
  AdaptiveLocalModel model({});
  model.observe(near);
  const Prediction far = *model.predict({at(0), Vec3(0.03, 0, 0), Vec3::Zero()});
  EXPECT_NEAR(far.force.x(), -5 - 500 * 0.002, 1e-12);
  EXPECT_EQ(far.stiffness, Mat3::Zero());
  // The previous model uses its own edge while it is faded out.
  model.observe(spring(40, 45, Vec3(0.02, 0, 0), 500 * Mat3::Identity()));
  EXPECT_NEAR(model.predict({at(45), Vec3(0.03, 0, 0), Vec3::Zero()})->force.x(), far.force.x(), 1e-12);
}

TEST(AdaptiveLocalModel, IgnoresAnswersToOlderMotionsAndWhatIsNotANumber) {
  AdaptiveLocalModel model({});
  const Motion there{at(100), Vec3(0.01, 0, 0), Vec3::Zero()};
  EXPECT_FALSE(model.predict(there).has_value());
  ASSERT_TRUE(model.observe(spring(40, 50, Vec3(0.01, 0, 0), 200 * Mat3::Identity())));
  EXPECT_FALSE(model.observe(spring(40, 55, Vec3(0.02, 0, 0), 300 * Mat3::Identity())));
  EXPECT_FALSE(model.observe(spring(20, 60, Vec3(0.02, 0, 0), 300 * Mat3::Identity())));
  const Vec3 nan = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(model.observe(without_model(80, 90, nan)));
  EXPECT_FALSE(model.observe(spring(80, 90, nan, Mat3::Identity())));
  EXPECT_EQ(model.predict(there)->force, Vec3(-2, 0, 0));
  EXPECT_FALSE(model.predict({at(100), nan, Vec3::Zero()}).has_value());
}

TEST(AdaptiveLocalModel, RefusesAConfigThatCannotBeMeant) {
  EXPECT_THROW(AdaptiveLocalModel({.share = 0}), std::invalid_argument);
  EXPECT_THROW(AdaptiveLocalModel({.share = 1.1}), std::invalid_argument);
  EXPECT_THROW(AdaptiveLocalModel({.max_blend = Duration(-1)}), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::adaptive_local_model_test
