// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/quasi_static.h"

#include <cmath>
#include <limits>
#include <stdexcept>

namespace tendon::softbody {
namespace {

/// Armijo's share of the predicted decrease that a step must bring, and the shortest step tried.
constexpr double kDecrease = 1e-4;
constexpr double kShortest = 1.0 / 1024;

}  // namespace

QuasiStaticModel::QuasiStaticModel(const Solid& solid, const TouchSurface& surface, const Config& config)
    : solid_(solid),
      normal_(surface.normal()),
      config_(config),
      stiffness_(solid.pattern()),
      factor_(stiffness_),
      u_(VectorXd::Zero(solid.size())) {
  if (config.max_iterations < 1) throw std::invalid_argument("`max_iterations`: expected 1 or more");
  if (!(config.tolerance > 0)) throw std::invalid_argument("`tolerance`: expected more than 0");
  solid_.stiffness(u_, Solid::Curvature::kExact, stiffness_);
  if (!factor_.factorize(stiffness_)) {
    throw std::runtime_error("the body can still move as a whole: more of its nodes must be fixed");
  }
}

QuasiStaticModel::Step QuasiStaticModel::solve(const VectorXd& internal, const VectorXd& load) {
  solid_.stiffness(u_, Solid::Curvature::kExact, stiffness_);
  if (!factor_.factorize(stiffness_)) {
    solid_.stiffness(u_, Solid::Curvature::kWithoutNegative, stiffness_);
    // Where points are crushed flat nothing may be left in some direction: a millionth of the largest entry is.
    for (double shift = 0; !factor_.factorize(stiffness_);) {
      double largest = 0;
      for (const double value : stiffness_.values) largest = std::max(largest, std::abs(value));
      shift = shift == 0 ? 1e-6 * largest : 9 * shift;
      for (int i = 0; i < stiffness_.size; ++i) {
        stiffness_.values[static_cast<std::size_t>(stiffness_.column_starts[static_cast<std::size_t>(i)])] += shift;
      }
      if (!std::isfinite(shift)) throw std::runtime_error("the stiffness of the body is not finite");
    }
  }
  MatrixXd right(internal.size(), 2);
  right << -internal, load;
  const MatrixXd solution = factor_.solve(right);
  return {solution.col(0), solution.col(1)};
}

bool QuasiStaticModel::go(const VectorXd& step, const VectorXd& load, double force, double slope, double energy) {
  const VectorXd start = u_;
  const double work = force * load.dot(step);
  for (double share = 1; share >= kShortest; share /= 2) {
    u_ = start;
    solid_.add_free(share * step, u_);
    const double change = solid_.energy(u_) - energy - share * work;
    if (change <= kDecrease * share * slope + 1e-14 * std::abs(energy)) return true;
  }
  u_ = start;
  return false;
}

double QuasiStaticModel::newton(const VectorXd& load, Given given, double value, Reaction& reaction) {
  double error = std::numeric_limits<double>::infinity();
  for (iterations_ = 0; iterations_ < config_.max_iterations;) {
    ++iterations_;
    const Solid::Forces now = solid_.forces(u_);
    const VectorXd internal = solid_.to_free(now.force);
    const Step step = solve(internal, load);
    const double compliance = load.dot(step.by_tool);
    const double depth = load.dot(solid_.to_free(u_));
    reaction.stiffness = 1 / compliance;
    reaction.force = given == Given::kForce ? value : (value - depth - load.dot(step.by_itself)) / compliance;
    const VectorXd move = step.by_itself + reaction.force * step.by_tool;
    // −slope = moveᵀ K move: twice the energy that is still to be lost, which a force error of √(… K) would explain.
    const double slope = (internal - reaction.force * load).dot(move);
    error = std::sqrt(std::max(0.0, -slope) * reaction.stiffness);
    const bool moved = go(move, load, reaction.force, slope, now.energy);
    if (!moved || error <= config_.tolerance * std::abs(reaction.force)) break;
  }
  return error;
}

Reaction QuasiStaticModel::press(const Patch& patch, Given given, double value) {
  VectorXd all = VectorXd::Zero(solid_.size());
  for (Eigen::Index i = 0; i < patch.weights.size(); ++i) {
    all.segment<3>(3 * patch.nodes[static_cast<std::size_t>(i)]) = -patch.weights[i] * normal_;
  }
  Reaction reaction;
  reaction.error = newton(solid_.to_free(all), given, value, reaction);
  reaction.depth = all.dot(u_);
  for (Eigen::Index i = 0; i < patch.weights.size(); ++i) {
    const int node = patch.nodes[static_cast<std::size_t>(i)];
    reaction.slope -= patch.slopes.col(i) * normal_.dot(u_.segment<3>(3 * node));
  }
  return reaction;
}

double QuasiStaticModel::release() {
  Reaction free;
  VectorXd nothing = VectorXd::Zero(solid_.free_count());
  nothing[0] = 1;  // any direction, with no force along it
  newton(nothing, Given::kForce, 0, free);
  return solid_.energy(u_);
}

std::size_t QuasiStaticModel::bytes() const noexcept {
  return stiffness_.bytes() + factor_.bytes() + static_cast<std::size_t>(u_.size()) * sizeof(double);
}

}  // namespace tendon::softbody
