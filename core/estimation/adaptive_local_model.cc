// SPDX-License-Identifier: Apache-2.0
#include "core/estimation/adaptive_local_model.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace tendon {
namespace {

/// The nearest stiffness that stores energy and loses none.
Mat3 conservative(const Mat3& stiffness, double max) noexcept {
  const Mat3 symmetric = (stiffness + stiffness.transpose()) / 2;
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(symmetric);
  const Vec3 bounded = solver.eigenvalues().cwiseMax(0).cwiseMin(max);
  if (bounded == solver.eigenvalues()) return symmetric;  // exactly what was sent
  return solver.eigenvectors() * bounded.asDiagonal() * solver.eigenvectors().transpose();
}

}  // namespace

AdaptiveLocalModel::AdaptiveLocalModel(const Config& config) : config_(config) {
  if (!(config.share > 0 && config.share <= 1)) {
    throw std::invalid_argument("share must be in (0, 1], got " + std::to_string(config.share));
  }
  if (!(std::isfinite(config.max_stiffness) && config.max_stiffness > 0)) {
    throw std::invalid_argument("max_stiffness must be finite and positive, got " +
                                std::to_string(config.max_stiffness));
  }
  if (config.max_blend < Duration::zero()) {
    throw std::invalid_argument("max_blend must not be negative, got " + std::to_string(config.max_blend.count()) +
                                " ns");
  }
}

bool AdaptiveLocalModel::observe(const RemoteForce& force) noexcept {
  if (has_answer_ && force.answers <= answers_) return false;
  if (!force.force.allFinite()) return false;
  Line line{force.force, Mat3::Zero()};
  if (force.model) {
    if (!force.model->at.allFinite() || !force.model->stiffness.allFinite()) return false;
    line.stiffness = config_.share * conservative(force.model->stiffness, config_.max_stiffness);
    line.at_origin += line.stiffness * force.model->at;
  }
  if (has_answer_) {
    old_ = shown(force.received);
    blend_ = std::min(force.answers - answers_, config_.max_blend);
  } else {
    old_ = line;
  }
  new_ = line;
  answers_ = force.answers;
  received_ = force.received;
  has_answer_ = true;
  return true;
}

std::optional<Prediction> AdaptiveLocalModel::predict(const Motion& hand) const noexcept {
  if (!has_answer_ || !hand.position.allFinite()) return std::nullopt;
  const Line line = shown(hand.at);
  return Prediction{line.at_origin - line.stiffness * hand.position, line.stiffness};
}

AdaptiveLocalModel::Line AdaptiveLocalModel::shown(LocalTime at) const noexcept {
  const Duration elapsed = at - received_;
  if (elapsed >= blend_) return new_;
  const double share = std::max(0.0, seconds(elapsed) / seconds(blend_));
  return {old_.at_origin + share * (new_.at_origin - old_.at_origin),
          old_.stiffness + share * (new_.stiffness - old_.stiffness)};
}

}  // namespace tendon
