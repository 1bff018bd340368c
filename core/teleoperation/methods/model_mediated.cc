// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/methods/model_mediated.h"

#include <Eigen/Eigenvalues>
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
  expect_above_zero(config.least_spread, "least_spread");
  expect_not_negative(config.position_noise, "position_noise");
  expect_above_zero(config.memory, "memory");
  expect(config.max_stiffness >= config.first_stiffness, "max_stiffness", config.max_stiffness,
         "at least first_stiffness, " + shortest(config.first_stiffness) + " N/m");
}

template <int N>
void SurfaceEstimator<N>::Moments::add(double share, const Vec<N>& y, const Vec<N>& f) noexcept {
  const Vec<N> from_place = y - place;
  const Vec<N> from_force = f - force;
  place += share * from_place;
  force += share * from_force;
  places = (1 - share) * (places + share * from_place * from_place.transpose());
  forces = (1 - share) * (forces + share * from_force * from_force.transpose());
  both = (1 - share) * (both + share * from_place * from_force.transpose());
}

// Moves the previous normal towards the mean force with a time constant of four times the memory. Removes the
// components along the directions in which the points of the undeformed surface under the tool spread.
template <int N>
Vec<N> SurfaceEstimator<N>::find_normal() const noexcept {
  const double size = moments_.force.norm();
  if (!(size > 0)) return model_.normal;
  const Vec<N> mean = moments_.force / size;
  const double share = 1 / std::min(samples_, 4 * config_.memory + 1);
  Vec<N> normal = model_.normal + share * (mean - model_.normal);
  if constexpr (N > 1) {
    const bool known = model_.stiffness > least_stiffness();
    const double compliance = 1 / (known ? model_.stiffness : config_.first_stiffness);
    const Mat<N> cross = compliance * moments_.both;
    const Mat<N> surface = moments_.places + cross + cross.transpose() + compliance * compliance * moments_.forces;
    const Eigen::SelfAdjointEigenSolver<Mat<N>> axes(surface);
    for (int i = 1; i < N; ++i) {  // the axis with the smallest one is the normal
      const Vec<N> axis = axes.eigenvectors().col(i);
      const bool spread = axes.eigenvalues()[i] >= config_.least_spread * config_.least_spread;
      const double along = mean.dot(axis);
      if (spread && along * along <= 0.5) normal -= normal.dot(axis) * axis;
    }
  }
  const double left = normal.norm();
  constexpr double kWidest = 0.8;  // cosine for a friction coefficient of 0.75
  return left > 0.1 && normal.dot(mean) > kWidest * left ? Vec<N>(normal / left) : mean;
}

// Returns the maximum depth (m) of the tool in the surface without a measurable force.
template <int N>
double SurfaceEstimator<N>::unseen() const noexcept {
  return 2 * config_.contact_force / std::max(model_.stiffness, least_stiffness()) + config_.position_noise;
}

template <int N>
SurfaceModel<N> SurfaceEstimator<N>::observe(const Vec<N>& position, const Vec<N>& force) noexcept {
  ++model_.sequence;
  const double size = force.norm();
  if (!position.allFinite() || !std::isfinite(size)) return model_;
  if (size < config_.contact_force) {
    touching_ = false;
    // A contact at this depth would have been measured.
    if (model_.depth(position) > unseen()) {
      model_.stiffness = 0;
      known_ = false;
    }
    return model_;
  }
  if (!touching_) {
    touching_ = true;
    weight_ = samples_ = 0;
    origin_ = position;
    moments_ = Moments{};
    const double off = std::abs(model_.normal.dot(position) - model_.offset);
    const bool expected = known_ && off <= unseen() + config_.least_spread;
    if (!expected) model_.stiffness = config_.first_stiffness;
    known_ = true;
  }
  ++samples_;
  weight_ = weight_ * portable::exp(-1 / config_.memory) + 1;
  moments_.add(1 / weight_, position - origin_, force);
  model_.normal = find_normal();

  const double variance = model_.normal.dot(moments_.places * model_.normal);
  if (variance >= config_.least_travel * config_.least_travel) {
    const double covariance = model_.normal.dot(moments_.both * model_.normal);
    model_.stiffness = std::clamp(-covariance / variance, least_stiffness(), config_.max_stiffness);
  }
  // The surface contains the newest sample, which the hand feels next.
  const double push = std::max(model_.normal.dot(force), 0.0);
  model_.offset = model_.normal.dot(position) + push / model_.stiffness;
  return model_;
}

template <int N>
double SurfaceEstimator<N>::friction() const noexcept {
  const double push = model_.normal.dot(moments_.force);
  const Mat<N> squares = moments_.forces + moments_.force * moments_.force.transpose();
  const double along = model_.normal.dot(squares * model_.normal);
  return push > 0 && along > 0 ? std::sqrt(std::max(squares.trace() - along, 0.0) / along) : 0;
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
