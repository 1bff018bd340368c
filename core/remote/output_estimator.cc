// SPDX-License-Identifier: Apache-2.0
#include "core/remote/output_estimator.h"

#include <algorithm>
#include <cmath>

#include "core/base/expect.h"

namespace tendon {
namespace {

/// m/N. Scales F(k−1) so that pole and stiffness have the same prior. For p0 = 1e8 (N/m)², the error of the pole is 10.
constexpr double kPoleScale = 1e-3;

LeastSquaresConfig checked(const OutputEstimator::Config& config) {
  expect_finite(config.origin, "origin");
  expect_above_zero(config.scale, "scale");
  expect_above_zero(config.reset_error, "reset_error");
  expect_above_zero(config.max_stiffness, "max_stiffness");
  expect_above_zero(config.max_force, "max_force");
  expect(config.reset_cooldown >= 1, "reset_cooldown", config.reset_cooldown, "1 or more");
  expect_not_negative(config.resolution, "resolution");
  return {.forgetting = config.forgetting, .prior_variance = config.prior_variance, .dead_zone = config.dead_zone};
}

}  // namespace

OutputEstimator::OutputEstimator(const Config& config)
    : config_(config),
      axes_{Axis{UdLeastSquares<2>(checked(config))}, Axis{UdLeastSquares<2>(checked(config))},
            Axis{UdLeastSquares<2>(checked(config))}} {}

void OutputEstimator::observe(const Motion& hand) noexcept {
  if (!hand.position.allFinite()) return;
  if (next_ > 0 && hand.at <= step(next_ - 1).at) return;
  const Vec3 before = next_ > 0 ? step(next_ - 1).output : Vec3::Zero();
  Step& now = step(next_);
  now = {hand.at, hand.position, before, Vec3::Zero(), false};
  for (int i = 0; i < 3; ++i) now.output[i] = output(i, hand.position[i], before[i]);
  ++next_;
}

bool OutputEstimator::correct(const RemoteForce& force) noexcept {
  const std::optional<std::uint64_t> number = find(force.answers);
  if (!number || !force.force.allFinite() || step(*number).answered) {
    ++counts_.ignored;
    return false;
  }
  ++counts_.corrections;
  Step& answered = step(*number);
  answered.answered = true;
  for (int i = 0; i < 3; ++i) {
    learn(axes_[static_cast<std::size_t>(i)], answered.position[i] - config_.origin[i], answered.before[i],
          -force.force[i]);
  }
  if (!anchor_ || *number > anchor_->step) anchor_ = Anchor{*number, -force.force};
  anchor();
  return true;
}

std::optional<Prediction> OutputEstimator::predict(const Motion& hand) const noexcept {
  if (!anchor_ || !hand.position.allFinite()) return std::nullopt;
  const Step& newest = step(next_ - 1);
  const Vec3& before = hand.at == newest.at ? newest.before : newest.output;
  Prediction prediction;
  for (int i = 0; i < 3; ++i) {
    const double wanted = output(i, hand.position[i], before[i]);
    prediction.force[i] = -wanted;
    if (std::abs(wanted) >= config_.max_force) continue;
    const Eigen::Vector2d& theta = axes_[static_cast<std::size_t>(i)].fit.estimate();
    double stiffness = theta[0];
    if (config_.model == Model::kPolynomial) {
      stiffness += 2 * theta[1] * std::abs(hand.position[i] - config_.origin[i]) / config_.scale;
    } else if (config_.model == Model::kOutputError) {
      stiffness = theta[1];
    }
    prediction.stiffness(i, i) = std::clamp(stiffness, 0.0, config_.max_stiffness);
  }
  return prediction;
}

Eigen::Vector2d OutputEstimator::parameters(int axis) const noexcept {
  Eigen::Vector2d theta = axes_[static_cast<std::size_t>(axis)].fit.estimate();
  if (config_.model == Model::kOutputError) theta[0] *= kPoleScale;
  return theta;
}

/// Binary search, because the time stamps in the ring increase.
std::optional<std::uint64_t> OutputEstimator::find(LocalTime at) const noexcept {
  std::uint64_t low = next_ > kSlots ? next_ - kSlots : 0;
  std::uint64_t high = next_;
  while (low < high) {
    const std::uint64_t middle = low + (high - low) / 2;
    if (step(middle).at < at) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  if (low == next_ || step(low).at != at) return std::nullopt;
  return low;
}

Eigen::Vector2d OutputEstimator::regressor(double displacement, double before) const noexcept {
  switch (config_.model) {
    case Model::kPolynomial:
      return {displacement, displacement * std::abs(displacement) / config_.scale};
    case Model::kSpringAndBias:
      return {displacement, config_.scale};
    case Model::kOutputError:
      break;
  }
  return {before * kPoleScale, displacement};
}

void OutputEstimator::learn(Axis& axis, double displacement, double before, double output) noexcept {
  if (axis.has_learned && std::abs(displacement - axis.learned_at) < kFreezeCounts * config_.resolution) {
    ++counts_.frozen;
    return;
  }
  const Eigen::Vector2d phi = regressor(displacement, before);
  ++axis.since_reset;
  if (std::abs(output - phi.dot(axis.fit.estimate())) > config_.reset_error &&
      axis.since_reset >= config_.reset_cooldown) {
    axis.fit.reset();
    axis.since_reset = 0;
    ++counts_.resets;
  }
  if (axis.fit.observe(phi, output)) axis.fit.set_estimate(bounded(axis.fit.estimate()));
  axis.learned_at = displacement;
  axis.has_learned = true;
}

Eigen::Vector2d OutputEstimator::bounded(const Eigen::Vector2d& estimate) const noexcept {
  const double max = config_.max_stiffness;
  switch (config_.model) {
    case Model::kPolynomial:
    case Model::kSpringAndBias:  // hardening and bias can have either sign
      return {std::clamp(estimate[0], 0.0, max), std::clamp(estimate[1], -max, max)};
    case Model::kOutputError:
      break;
  }
  constexpr double kPole = kMaxPole / kPoleScale;
  return {std::clamp(estimate[0], -kPole, kPole), std::clamp(estimate[1], 0.0, max)};
}

double OutputEstimator::output(int axis, double position, double before) const noexcept {
  const Axis& model = axes_[static_cast<std::size_t>(axis)];
  const double free = regressor(position - config_.origin[axis], before).dot(model.fit.estimate()) + model.offset;
  return std::clamp(free, -config_.max_force, config_.max_force);
}

/// Sets the force for the newest answered motion to the answer, and recomputes all later forces.
void OutputEstimator::anchor() noexcept {
  Step& known = step(anchor_->step);
  if (config_.model != Model::kOutputError) {
    for (int i = 0; i < 3; ++i) {
      Axis& axis = axes_[static_cast<std::size_t>(i)];
      const Eigen::Vector2d phi = regressor(known.position[i] - config_.origin[i], 0);
      axis.offset = anchor_->output[i] - phi.dot(axis.fit.estimate());
    }
    return;
  }
  known.output = anchor_->output;
  for (std::uint64_t number = anchor_->step + 1; number < next_; ++number) {
    Step& later = step(number);
    later.before = step(number - 1).output;
    for (int i = 0; i < 3; ++i) later.output[i] = output(i, later.position[i], later.before[i]);
  }
}

}  // namespace tendon
