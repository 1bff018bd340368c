// SPDX-License-Identifier: Apache-2.0
#include "core/estimation/recursive_least_squares.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/core/estimation/regressors.h"
#include "tests/support/dice.h"

namespace tendon::recursive_least_squares_test {
namespace {

/// The library does not use this form because it loses definiteness.
template <int M, class Scalar>
struct Textbook {
  using Vector = Eigen::Matrix<Scalar, M, 1>;
  using Matrix = Eigen::Matrix<Scalar, M, M>;
  Matrix p;
  Scalar forgetting;
  Vector estimate = Vector::Zero();

  void observe(const Vector& phi, Scalar y) {
    const Vector p_phi = p * phi;
    const Vector gain = p_phi / (forgetting + phi.dot(p_phi));
    estimate += gain * (y - phi.dot(estimate));
    p = ((p - gain * p_phi.transpose()) / forgetting).eval();
  }
  bool definite() const {
    if (!p.allFinite()) return false;
    const Eigen::Matrix<double, M, M> symmetric = (p + p.transpose()).template cast<double>() / 2;
    return Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, M, M>>(symmetric).eigenvalues().minCoeff() >= 0;
  }
};

const Vec3 kTruth(1, -2, 0.5);

void expect_equals_batch(std::uint64_t seed) {
  constexpr int kSamples = 300;
  constexpr double kForgetting = 0.97;
  constexpr double kPrior = 1e3;
  Dice dice(seed);
  UdLeastSquares<3> estimator({.forgetting = kForgetting, .prior_variance = kPrior});
  Eigen::Matrix<double, kSamples, 3> regressors;
  Eigen::Matrix<double, kSamples, 1> outputs;
  Eigen::Matrix<double, kSamples, 1> forgotten;
  for (int i = 0; i < kSamples; ++i) {
    const Vec3 phi(gaussian(dice), gaussian(dice), gaussian(dice));
    regressors.row(i) = phi;
    outputs[i] = phi.dot(kTruth) + 0.1 * gaussian(dice);
    // The limit on forgetting (recursive_least_squares.h) is active during the first samples.
    forgotten[i] = std::max(kForgetting, std::min(1.0, estimator.trace() / (3 * kPrior)));
    ASSERT_TRUE(estimator.observe(phi, outputs[i]));
  }
  EXPECT_LT((forgotten.array() > kForgetting).count(), 5);
  Mat3 information = forgotten.prod() / kPrior * Mat3::Identity();
  Vec3 moment = Vec3::Zero();
  double weight = 1;
  for (int i = kSamples - 1; i >= 0; --i) {
    information += weight * regressors.row(i).transpose() * regressors.row(i);
    moment += weight * outputs[i] * regressors.row(i).transpose();
    weight *= forgotten[i];
  }
  EXPECT_LT((estimator.estimate() - information.llt().solve(moment)).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((estimator.covariance() * information - Mat3::Identity()).norm(), 1e-10);
}

TEST(RecursiveLeastSquares, EqualsBatchWeightedLeastSquares) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) expect_equals_batch(seed);
}

struct Information {
  LeastSquaresConfig config;
  Mat3 inverse = Mat3::Identity() / config.prior_variance;
  Vec3 estimate = Vec3::Zero();

  bool observe(const Vec3& phi, double y) {
    if (std::abs(y - phi.dot(estimate)) < config.dead_zone) return false;
    const double trace = inverse.llt().solve(Mat3::Identity()).trace();
    const double forgetting = std::max(config.forgetting, std::min(1.0, trace / (3 * config.prior_variance)));
    const Vec3 moment = forgetting * inverse * estimate + y * phi;
    inverse = (forgetting * inverse + phi * phi.transpose()).eval();
    estimate = inverse.llt().solve(moment);
    return true;
  }
};

TEST(RecursiveLeastSquares, EqualsTheInformationForm) {
  const LeastSquaresConfig config{.forgetting = 0.95, .prior_variance = 1e4, .dead_zone = 0.02};
  UdLeastSquares<3> ud(config);
  Information expected{.config = config};
  Dice dice(3);
  int taught = 0;
  for (int i = 0; i < 5000; ++i) {
    if (dice.chance(0.01)) {
      ud.reset();
      expected.inverse = Mat3::Identity() / config.prior_variance;
    }
    if (dice.chance(0.01)) {
      expected.estimate = ud.estimate().cwiseMax(0);
      ud.set_estimate(expected.estimate);
    }
    const Vec3 phi(gaussian(dice), gaussian(dice), 1);
    const double y = phi.dot(kTruth) + 0.05 * gaussian(dice);
    const bool learned = ud.observe(phi, y);
    ASSERT_EQ(expected.observe(phi, y), learned);
    taught += learned;
    ASSERT_LT((ud.estimate() - expected.estimate).norm(), 1e-9);
    ASSERT_LT((ud.covariance() * expected.inverse - Mat3::Identity()).norm(), 1e-8);
    ASSERT_GT(ud.pivots().minCoeff(), 0);
  }
  EXPECT_GT(taught, 2000);
  EXPECT_LT(taught, 4900);
}

TEST(RecursiveLeastSquares, OnlyTheTextbookUpdateIsIndefiniteInFloat32) {
  constexpr int kSamples = 20000;
  Textbook<3, float> textbook{1e6F * Eigen::Matrix3f::Identity(), 0.999F};
  UdLeastSquares<3, float> ud({.forgetting = 0.999, .prior_variance = 1e6});
  Dice dice(1);
  int indefinite = 0;
  for (int i = 0; i < kSamples; ++i) {
    const Eigen::Vector3f phi = nearly_collinear<float>(dice);
    const float y = phi.dot(kTruth.cast<float>()) + 1e-3F * static_cast<float>(gaussian(dice));
    textbook.observe(phi, y);
    indefinite += !textbook.definite();
    ASSERT_TRUE(ud.observe(phi, y));
    ASSERT_GT(ud.pivots().minCoeff(), 0);
  }
  EXPECT_GT(indefinite, kSamples / 2);
  // Such regressors determine only the sum of the two parameters.
  EXPECT_NEAR(ud.estimate()[0] + ud.estimate()[1], -1, 2e-3);
}

template <class Scalar>
void expect_definite() {
  UdLeastSquares<3, Scalar> estimator({.forgetting = 0.999, .prior_variance = 1e6});
  Dice dice(7);
  for (int i = 0; i < 200'000; ++i) {
    const Eigen::Matrix<Scalar, 3, 1> phi = nearly_collinear<Scalar>(dice);
    ASSERT_TRUE(estimator.observe(phi, phi.dot(kTruth.cast<Scalar>()))) << i;
    ASSERT_GT(estimator.pivots().minCoeff(), 0) << i;
    ASSERT_LE(estimator.trace(), Scalar(3e6 * (1 + 1e-3))) << i;
  }
}

TEST(RecursiveLeastSquares, UdStaysDefiniteInFloat32) { expect_definite<float>(); }
TEST(RecursiveLeastSquares, UdStaysDefiniteInFloat64) { expect_definite<double>(); }

/// In 1200 of 2000 samples, only one of two directions is excited. `error` is the maximum error of θ when both are
/// excited again.
struct Return {
  double trace;
  double error;
};
template <class Estimator, class Trace>
Return wind_up(Estimator estimator, Trace trace, std::uint64_t seed) {
  const Eigen::Vector2d truth(500, 20);
  Dice dice(seed);
  Return result{};
  for (int i = 0; i < 2000; ++i) {
    const bool rich = i < 300 || i >= 1500;
    const Eigen::Vector2d phi = rich ? Eigen::Vector2d(gaussian(dice), gaussian(dice)) : Eigen::Vector2d(1, 0);
    if (i == 1500) result.trace = trace(estimator);
    estimator.observe(phi, phi.dot(truth) + 5 * gaussian(dice));
    if (i >= 1500) {
      const Eigen::Vector2d theta = estimator.estimate;
      result.error = std::max(result.error, (theta - truth).cwiseAbs().maxCoeff());
    }
  }
  return result;
}

struct Capped {
  UdLeastSquares<2> fit{{.forgetting = 0.98, .prior_variance = 100}};
  Eigen::Vector2d estimate = Eigen::Vector2d::Zero();
  void observe(const Eigen::Vector2d& phi, double y) {
    fit.observe(phi, y);
    estimate = fit.estimate();
  }
};

TEST(RecursiveLeastSquares, TheCapOnForgettingEndsCovarianceWindUp) {
  std::vector<double> plain;
  std::vector<double> capped;
  for (std::uint64_t seed = 0; seed < 101; ++seed) {
    const Return wound = wind_up(
        Textbook<2, double>{100 * Eigen::Matrix2d::Identity(), 0.98}, [](const auto& t) { return t.p.trace(); }, seed);
    const Return bounded = wind_up(
        Capped(), [](const auto& c) { return c.fit.trace(); }, seed);
    EXPECT_GT(wound.trace, 1e7);
    EXPECT_LE(bounded.trace, 200 * (1 + 1e-9));
    plain.push_back(wound.error);
    capped.push_back(bounded.error);
  }
  std::sort(plain.begin(), plain.end());
  std::sort(capped.begin(), capped.end());
  EXPECT_GT(plain[50], 500);  // the parameter is 500
  EXPECT_LT(capped[50], 8);
  EXPECT_LT(capped[100], 60);  // the gain is at most √(tr P)/2, and the noise is 5
}

TEST(RecursiveLeastSquares, AResetKeepsTheEstimateAndBelievesWhatComesNext) {
  UdLeastSquares<2> ud({.forgetting = 1, .prior_variance = 1e8});
  Dice dice(5);
  const auto teach = [&](const Eigen::Vector2d& truth, int samples) {
    for (int i = 0; i < samples; ++i) {
      const Eigen::Vector2d phi(gaussian(dice), gaussian(dice));
      ud.observe(phi, phi.dot(truth));
    }
  };
  teach({300, 150}, 200);
  const Eigen::Vector2d before = ud.estimate();
  ud.reset();
  EXPECT_EQ(ud.estimate(), before);
  teach({700, 150}, 3);
  EXPECT_NEAR(ud.estimate()[0], 700, 1e-3);
}

TEST(RecursiveLeastSquares, WhatIsNotANumberOrTooLargeChangesNothing) {
  UdLeastSquares<2, float> ud;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto refuse = [&ud](const Eigen::Vector2f& phi, float y) {
    const Eigen::Vector2f theta = ud.estimate();
    const Eigen::Vector2f pivots = ud.pivots();
    EXPECT_FALSE(ud.observe(phi, y));
    EXPECT_EQ(ud.estimate(), theta);
    EXPECT_EQ(ud.pivots(), pivots);
  };
  EXPECT_TRUE(ud.observe({1, 2}, 3));
  refuse({nan, 1}, 1);
  refuse({1, 1}, nan);
  refuse({3e38F, 3e38F}, 1);
}

TEST(RecursiveLeastSquares, RefusesAConfigThatCannotBeMeant) {
  EXPECT_THROW(UdLeastSquares<2>({.forgetting = 0}), std::invalid_argument);
  EXPECT_THROW(UdLeastSquares<2>({.forgetting = 1.01}), std::invalid_argument);
  EXPECT_THROW(UdLeastSquares<2>({.prior_variance = 0}), std::invalid_argument);
  EXPECT_THROW(UdLeastSquares<2>({.dead_zone = -1}), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::recursive_least_squares_test
