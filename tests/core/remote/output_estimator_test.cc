// SPDX-License-Identifier: Apache-2.0
#include "core/remote/output_estimator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "tests/support/dice.h"

namespace tendon::output_estimator_test {
namespace {

using std::chrono::milliseconds;
using Model = OutputEstimator::Model;

constexpr int kSteps = 12'000;  // of 1 ms
constexpr int kAnswerEvery = 40;
constexpr int kDelay = 40;
constexpr int kSettled = 1000;

LocalTime at(int k) { return LocalTime(milliseconds(k)); }

RemoteForce answer_to(LocalTime motion, const Vec3& force) {
  RemoteForce answer;
  answer.answers = motion;
  answer.force = force;
  return answer;
}

/// Returns the position of the hand (m), which is the sum of 12 mm at 0.7 Hz and 3 mm at 2.3 Hz.
double hand(int k) {
  const double t = k * 1e-3;
  return 0.012 * std::sin(2 * std::numbers::pi * 0.7 * t) + 0.003 * std::sin(2 * std::numbers::pi * 2.3 * t);
}

/// The force on the hand of a hardening spring whose stiffness steps from 300 to 700 to 400 N/m.
double environment(int k) {
  const double stiffness = k < 4000 ? 300 : k < 8000 ? 700 : 400;
  const double x = hand(k);
  return -(stiffness * x + 1.5e4 * x * std::abs(x));
}

struct Errors {
  double rms = 0;
  double worst = 0;
  double largest = 0;  ///< largest prediction
};

/// Plays the sequence along x. The answer to motion k arrives `delay(k)` steps later.
template <class Delay>
Errors play(OutputEstimator& estimator, const Delay& delay) {
  std::vector<std::pair<int, int>> on_their_way;  // arrival, motion
  Errors errors;
  double squares = 0;
  for (int k = 1; k < kSteps; ++k) {
    const Motion now{at(k), Vec3(hand(k), 0, 0), Vec3::Zero()};
    estimator.observe(now);
    if (k % kAnswerEvery == 0) on_their_way.emplace_back(k + delay(k), k);
    for (const auto& [arrival, motion] : on_their_way) {
      if (arrival != k) continue;
      EXPECT_TRUE(estimator.correct(answer_to(at(motion), Vec3(environment(motion), 0, 0))));
    }
    const std::optional<Prediction> prediction = estimator.predict(now);
    if (k < kSettled) continue;
    const double error = prediction->force.x() - environment(k);
    squares += error * error;
    errors.worst = std::max(errors.worst, std::abs(error));
    errors.largest = std::max(errors.largest, std::abs(prediction->force.x()));
  }
  errors.rms = std::sqrt(squares / (kSteps - kSettled));
  return errors;
}
constexpr auto kAlways = [](int) { return kDelay; };

double rms_of_hold() {
  double squares = 0;
  double held = 0;
  for (int k = 1; k < kSteps; ++k) {
    if (k >= 2 * kDelay && (k - kDelay) % kAnswerEvery == 0) held = environment(k - kDelay);
    if (k >= kSettled) squares += (held - environment(k)) * (held - environment(k));
  }
  return std::sqrt(squares / (kSteps - kSettled));
}

TEST(OutputEstimator, IsWithinAQuarterNewtonWhereHoldingTheForceIsOffByTwo) {
  EXPECT_NEAR(rms_of_hold(), 2.0, 0.05);
  OutputEstimator estimator({});
  const Errors errors = play(estimator, kAlways);
  EXPECT_LE(errors.rms, 0.27);
  EXPECT_EQ(estimator.counts().corrections, kSteps / kAnswerEvery - 1 - kDelay / kAnswerEvery);
  EXPECT_NEAR(estimator.parameters(0)[0], 400, 1);
  EXPECT_NEAR(estimator.parameters(0)[1], 150, 1);  // 1.5e4 N/m² · 0.01 m
}

TEST(OutputEstimator, IsAsGoodWithAnEncoderAsWithExactPositions) {
  OutputEstimator estimator({.resolution = 30e-6});
  EXPECT_LE(play(estimator, kAlways).rms, 0.27);
}

TEST(OutputEstimator, LearnsTheSameWhateverTheDelay) {
  Dice dice(11);
  OutputEstimator steady({});
  OutputEstimator jittery({});
  play(steady, [](int k) { return k + 2 * kDelay < kSteps ? kDelay : 1; });
  play(jittery, [&](int k) { return k + 2 * kDelay < kSteps ? 2 + static_cast<int>(37 * dice.uniform()) : 1; });
  EXPECT_EQ(steady.counts().corrections, jittery.counts().corrections);
  EXPECT_EQ(steady.parameters(0), jittery.parameters(0));
}

TEST(OutputEstimator, DoesNotMindTheOrderInWhichAnswersArrive) {
  const OutputEstimator::Config config{.forgetting = 1, .reset_error = 1e9};
  OutputEstimator in_order(config);
  OutputEstimator shuffled(config);
  std::vector<RemoteForce> answers;
  for (int k = 1; k <= 800; ++k) {
    const Motion now{at(k), Vec3(hand(k), 0, 0), Vec3::Zero()};
    in_order.observe(now);
    shuffled.observe(now);
    if (k % kAnswerEvery != 0) continue;
    answers.push_back(answer_to(at(k), Vec3(environment(k) + 1e-3 * std::sin(k), 0, 0)));
  }
  for (const RemoteForce& answer : answers) EXPECT_TRUE(in_order.correct(answer));
  Dice dice(4);
  for (std::size_t i = answers.size(); i > 1; --i) std::swap(answers[i - 1], answers[dice.bits() % i]);
  for (const RemoteForce& answer : answers) EXPECT_TRUE(shuffled.correct(answer));
  const Motion now{at(801), Vec3(hand(801), 0, 0), Vec3::Zero()};
  EXPECT_NEAR(in_order.predict(now)->force.x(), shuffled.predict(now)->force.x(), 1e-5);
  EXPECT_LT((in_order.parameters(0) - shuffled.parameters(0)).norm(), 1e-3);
}

TEST(OutputEstimator, IgnoresAndCountsOldUnknownRepeatedAndNanAnswers) {
  OutputEstimator estimator({});
  const auto answer = [&](int k, double force) { return estimator.correct(answer_to(at(k), Vec3(force, 0, 0))); };
  EXPECT_FALSE(answer(0, 1));  // before any observation
  for (int k = 1; k <= 2000; ++k) estimator.observe({at(k), Vec3(hand(k), 0, 0), Vec3::Zero()});
  EXPECT_FALSE(answer(2000 - static_cast<int>(OutputEstimator::kSlots), 1));
  EXPECT_FALSE(answer(2001, 1));
  EXPECT_FALSE(estimator.correct(answer_to(at(1999) + Duration(1), Vec3(1, 0, 0))));
  EXPECT_FALSE(answer(1999, std::numeric_limits<double>::quiet_NaN()));
  EXPECT_FALSE(estimator.predict({at(2001), Vec3::Zero(), Vec3::Zero()}).has_value());
  EXPECT_TRUE(answer(2001 - static_cast<int>(OutputEstimator::kSlots), 1));
  EXPECT_TRUE(answer(1999, 1));
  EXPECT_FALSE(answer(1999, 1));
  EXPECT_EQ(estimator.counts().ignored, 6U);
  EXPECT_EQ(estimator.counts().corrections, 2U);
}

TEST(OutputEstimator, PassesThroughTheNewestAnswer) {
  OutputEstimator estimator({.model = Model::kSpringAndBias, .forgetting = 1, .reset_error = 1e9});
  Dice dice(2);
  for (int k = 1; k <= 500; ++k) {
    estimator.observe({at(k), Vec3(hand(k), hand(k + 9), 0), Vec3::Zero()});
    if (k % kAnswerEvery != 0) continue;
    const Vec3 force(dice.within(-5, 5), dice.within(-5, 5), 1);  // not consistent with a spring
    ASSERT_TRUE(estimator.correct(answer_to(at(k), force)));
    EXPECT_LT((estimator.predict({at(k), Vec3(hand(k), hand(k + 9), 0), Vec3::Zero()})->force - force).norm(), 1e-9);
  }
}

TEST(OutputEstimator, ALateAnswerDoesNotTakeTheAnchorFromTheNewest) {
  for (const Model model : {Model::kPolynomial, Model::kSpringAndBias, Model::kOutputError}) {
    OutputEstimator estimator({.model = model});
    for (int k = 1; k <= 100; ++k) estimator.observe({at(k), Vec3(hand(k), 0, 0), Vec3::Zero()});
    ASSERT_TRUE(estimator.correct(answer_to(at(100), Vec3(-3, 0, 0))));
    ASSERT_TRUE(estimator.correct(answer_to(at(60), Vec3(2, 0, 0))));
    const Prediction prediction = *estimator.predict({at(101), Vec3(hand(100), 0, 0), Vec3::Zero()});
    if (model != Model::kOutputError) {
      EXPECT_NEAR(prediction.force.x(), -3, 1e-9);
    } else {
      const Eigen::Vector2d theta = estimator.parameters(0);
      EXPECT_NEAR(prediction.force.x(), theta[0] * -3 - theta[1] * hand(100), 1e-9);
    }
  }
}

TEST(OutputEstimator, SaysThePhysicalStiffnessOfEachAxisAndPushesTheHandBack) {
  OutputEstimator estimator({.origin = Vec3(0.01, 0, 0)});
  const Vec3 stiffness(200, 900, 0);
  for (int k = 1; k <= 2000; ++k) {
    const Vec3 x(hand(k), hand(k + 300), hand(k + 700));
    estimator.observe({at(k), x, Vec3::Zero()});
    if (k % 10 == 0) estimator.correct(answer_to(at(k), -stiffness.cwiseProduct(x - Vec3(0.01, 0, 0))));
  }
  const Vec3 here(0.02, 0.004, -0.003);
  const Prediction prediction = *estimator.predict({at(2001), here, Vec3::Zero()});
  EXPECT_LT((prediction.force - Vec3(-2, -3.6, 0)).norm(), 1e-3);
  EXPECT_LT((prediction.stiffness - Mat3(stiffness.asDiagonal())).norm(), 0.5);
}

TEST(OutputEstimator, ItsStiffnessIsTheSlopeOfItsForce) {
  for (const Model model : {Model::kPolynomial, Model::kSpringAndBias, Model::kOutputError}) {
    OutputEstimator estimator({.model = model});
    play(estimator, kAlways);
    constexpr double kStep = 1e-6;
    const Vec3 here(0.006, 0, 0);
    const Prediction from = *estimator.predict({at(kSteps - 1), here, Vec3::Zero()});
    const Prediction to = *estimator.predict({at(kSteps - 1), here + Vec3(kStep, 0, 0), Vec3::Zero()});
    EXPECT_NEAR((from.force - to.force).x() / kStep, from.stiffness(0, 0), 0.05);
  }
}

TEST(OutputEstimator, AnAxisThatHardlyMovesIsReAnchoredAndLearnsNothing) {
  constexpr double kCount = 30e-6;
  OutputEstimator estimator({.resolution = kCount});
  for (int k = 1; k <= 1000; ++k) {
    estimator.observe({at(k), Vec3(hand(k), 0, 0), Vec3::Zero()});
    if (k % kAnswerEvery == 0) estimator.correct(answer_to(at(k), Vec3(environment(k), 0, 0)));
  }
  const double rest = 0.005;
  const auto stay = [&](int k, double counts, double force) {
    const Motion now{at(k), Vec3(rest + counts * kCount, 0, 0), Vec3::Zero()};
    estimator.observe(now);
    estimator.correct(answer_to(at(k), Vec3(force, 0, 0)));
    EXPECT_NEAR(estimator.predict(now)->force.x(), force, 1e-9);
  };
  stay(1001, 0, -1.9);
  const Eigen::Vector2d learned = estimator.parameters(0);
  const std::uint64_t frozen = estimator.counts().frozen;
  Dice dice(8);
  for (int k = 1002; k < 1502; ++k) stay(k, std::floor(dice.within(-2, 3)), dice.within(-4, 0));
  EXPECT_EQ(estimator.parameters(0), learned);
  EXPECT_EQ(estimator.counts().frozen - frozen, 500U * 3);
}

TEST(OutputEstimator, CooldownEndsConstantResettingWhenTheModelCannotFit) {
  const auto resets = [](int cooldown) {
    OutputEstimator estimator({.model = Model::kSpringAndBias, .reset_cooldown = cooldown});
    const Errors errors = play(estimator, kAlways);
    EXPECT_LT(errors.rms, 0.6);
    return estimator.counts().resets;
  };
  EXPECT_GT(resets(1), 70U);
  EXPECT_LT(resets(3), 40U);
  EXPECT_LT(resets(25), 13U);
}

TEST(OutputEstimator, AnOutputRecursiveModelRunsAwayOnlyWithAFreePole) {
  // The same estimator with a free pole. It is used at 1 kHz, although the answers arrive at 25 Hz.
  UdLeastSquares<2> raw({.forgetting = 0.95, .prior_variance = 1e8});
  std::vector<double> output(kSteps, 0.0);
  double largest_raw = 0;
  for (int k = 1; k < kSteps && largest_raw < 1e6; ++k) {
    const auto now = static_cast<std::size_t>(k);
    const auto run = [&](std::size_t j) {
      const Eigen::Vector2d phi(1e-3 * output[j - 1], hand(static_cast<int>(j)));
      output[j] = phi.dot(raw.estimate());
    };
    if (k > kDelay && k % kAnswerEvery == 0) {
      const std::size_t answered = now - kDelay;
      const double truth = -environment(k - kDelay);
      raw.observe({1e-3 * output[answered - 1], hand(k - kDelay)}, truth);
      output[answered] = truth;
      for (std::size_t j = answered + 1; j < now; ++j) run(j);
    }
    run(now);
    largest_raw = std::max(largest_raw, std::abs(output[now]));
  }
  EXPECT_GE(largest_raw, 1e6);

  OutputEstimator estimator({.model = Model::kOutputError});
  const Errors errors = play(estimator, kAlways);
  EXPECT_LE(errors.largest, 30);
  EXPECT_LT(errors.rms, 2.0);
  EXPECT_LE(std::abs(estimator.parameters(0)[0]), OutputEstimator::kMaxPole + 1e-12);
}

TEST(OutputEstimator, ParametersAndPredictionsStayWithinBoundsForAnyForce) {
  Dice dice(21);
  for (const Model model : {Model::kPolynomial, Model::kSpringAndBias, Model::kOutputError}) {
    OutputEstimator estimator({.model = model, .max_stiffness = 800, .max_force = 12});
    for (int k = 1; k < 4000; ++k) {
      const Motion now{at(k), 0.05 * dice.direction(), Vec3::Zero()};
      estimator.observe(now);
      if (k % 7 == 0) estimator.correct(answer_to(at(k), dice.decades(-2, 6) * dice.direction()));
      const std::optional<Prediction> prediction = estimator.predict(now);
      if (!prediction) continue;
      ASSERT_LE(prediction->force.cwiseAbs().maxCoeff(), 12);
      ASSERT_GE(prediction->stiffness.diagonal().minCoeff(), 0);
      ASSERT_LE(prediction->stiffness.diagonal().maxCoeff(), 800);
    }
  }
}

TEST(OutputEstimator, RefusesAConfigThatCannotBeMeant) {
  EXPECT_THROW(OutputEstimator({.scale = 0}), std::invalid_argument);
  EXPECT_THROW(OutputEstimator({.forgetting = 2}), std::invalid_argument);
  EXPECT_THROW(OutputEstimator({.reset_error = -1}), std::invalid_argument);
  EXPECT_THROW(OutputEstimator({.reset_cooldown = 0}), std::invalid_argument);
  EXPECT_THROW(OutputEstimator({.max_stiffness = 0}), std::invalid_argument);
  EXPECT_THROW(OutputEstimator({.max_force = 0}), std::invalid_argument);
  EXPECT_THROW(OutputEstimator({.resolution = -1}), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::output_estimator_test
