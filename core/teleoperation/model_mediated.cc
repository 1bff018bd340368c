// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/model_mediated.h"

#include <algorithm>
#include <cmath>

#include "core/base/expect.h"
#include "core/base/portable_math.h"

namespace tendon {

template <int N>
double SurfaceModel<N>::depth(const Vec<N>& x) const noexcept {
  return std::max(offset - normal.dot(x), 0.0);
}

template <int N>
double SurfaceModel<N>::energy(const Vec<N>& x) const noexcept {
  const double inside = depth(x);
  return stiffness / 2 * inside * inside;
}

template <int N>
SurfaceEstimator<N>::SurfaceEstimator(const Config& config) : config_(config) {
  expect_above_zero(config.contact_force, "contact_force");
  expect_above_zero(config.first_stiffness, "first_stiffness");
  expect_above_zero(config.max_stiffness, "max_stiffness");
  expect_above_zero(config.least_travel, "least_travel");
  expect_above_zero(config.memory, "memory");
  expect(config.max_stiffness >= config.first_stiffness, "max_stiffness", config.max_stiffness,
         "no less than first_stiffness, " + shortest(config.first_stiffness) + " N/m");
}

template <int N>
SurfaceModel<N> SurfaceEstimator<N>::observe(const Vec<N>& position, const Vec<N>& force) noexcept {
  ++model_.sequence;
  const double size = force.norm();
  if (!position.allFinite() || !std::isfinite(size)) return model_;
  if (size < config_.contact_force) {
    touching_ = false;
    return model_;
  }
  if (!touching_) {
    touching_ = true;
    weight_ = mean_along_ = mean_force_ = variance_ = covariance_ = 0;
    model_.stiffness = config_.first_stiffness;
  }
  model_.normal = force / size;
  const double along = model_.normal.dot(position);

  // Means and moments about them, with weights that fade: nothing cancels however far from the origin.
  weight_ = weight_ * portable::exp(-1 / config_.memory) + 1;
  const double share = 1 / weight_;
  const double from_mean = along - mean_along_;
  const double force_from_mean = size - mean_force_;
  mean_along_ += share * from_mean;
  mean_force_ += share * force_from_mean;
  variance_ = (1 - share) * (variance_ + share * from_mean * from_mean);
  covariance_ = (1 - share) * (covariance_ + share * from_mean * force_from_mean);

  if (variance_ >= config_.least_travel * config_.least_travel) {
    model_.stiffness = std::clamp(-covariance_ / variance_, 0.0, config_.max_stiffness);
  }
  // Through the newest sample, which is what the hand is to feel now.
  if (model_.stiffness > 0) model_.offset = along + size / model_.stiffness;
  return model_;
}

template <int N>
void SurfaceRenderer<N>::receive(const SurfaceModel<N>& message) noexcept {
  if (message.sequence <= newest_.sequence) return;
  if (!(std::abs(message.normal.norm() - 1) < 1e-6) || !std::isfinite(message.offset)) return;
  if (!(message.stiffness >= 0) || !std::isfinite(message.stiffness)) return;
  newest_ = message;
}

template <int N>
auto SurfaceRenderer<N>::command(const Vec<N>& position, double budget) noexcept -> Rendered {
  if (!position.allFinite()) return {{position}, 0};
  const double before = used_.energy(position);
  const double allowed = before + (budget > 0 ? budget : 0.0);
  used_ = newest_;
  if (used_.energy(position) > allowed) {
    used_.offset = used_.normal.dot(position) + std::sqrt(2 * allowed / used_.stiffness);
  }
  const double depth = used_.depth(position);
  Rendered rendered{{used_.stiffness * depth * used_.normal}, std::max(used_.energy(position) - before, 0.0)};
  if (depth > 0) rendered.demand.stiffness = used_.stiffness * used_.normal * used_.normal.transpose();
  return rendered;
}

template struct SurfaceModel<1>;
template struct SurfaceModel<3>;
template class SurfaceEstimator<1>;
template class SurfaceEstimator<3>;
template class SurfaceRenderer<1>;
template class SurfaceRenderer<3>;

}  // namespace tendon
