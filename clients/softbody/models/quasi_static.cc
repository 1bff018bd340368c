// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/models/quasi_static.h"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "clients/softbody/effects/cutting.h"
#include "protocol/expect.h"

namespace tendon::softbody {
namespace {

/// Armijo's share of the predicted decrease that a step must bring, and the shortest step tried.
constexpr double kDecrease = 1e-4;
constexpr double kShortest = 1.0 / 1024;

/// A factor serves while each step with it leaves at most this share of the energy that has still to be lost, which is
/// a quarter of the error.
constexpr double kSlow = 1.0 / 16;

/// The rounds for an answer's stiffness end when one lowers it by at most this share; another would remove only a part
/// of that.
constexpr double kTangentPrecision = 2e-3;
constexpr int kTangentRounds = 5;

/// m, the step with which a slope of the force is measured: for a body of some mm the next derivative adds 1e-4 of it.
constexpr double kNudge = 1e-7;

/// How often at most the neighbouring sides are looked up for one answer, and the relative change of their forces that
/// ends this.
constexpr int kLooks = 10;
constexpr double kParted = 1e-3;

/// m: an error of the force that so small a change of depth explains counts as zero, even when there is no force to
/// compare it with.
constexpr double kUnseen = 1e-12;

}  // namespace

QuasiStaticModel::QuasiStaticModel(const Elastic& elastic, const TouchSurface& surface, const Config& config,
                                   const EffectsConfig& effects)
    : elastic_(elastic),
      normal_(surface.normal()),
      config_(config),
      stiffness_(elastic.pattern()),
      factor_(stiffness_),
      u_(VectorXd::Zero(elastic.size())),
      step_(effects.has_time() ? effects.step : 0),
      effects_(effects_at_rest(effects, elastic)) {
  expect(config.max_iterations >= 1, "max_iterations", config.max_iterations, "1 or more");
  expect_above_zero(config.tolerance, "tolerance");
  if (config.self_collision) self_collision_ = std::make_unique<SelfCollision>(elastic, *config.self_collision, u_);
  stiffness(Elastic::Curvature::kExact);
  stale_ = !factor_.factorize(stiffness_);
  if (stale_) {
    throw std::runtime_error("the body can still move as a whole: more of its nodes must be fixed");
  }
  if (!effects_.empty()) release();
  if (effects.has_time()) rest_ = u_;
  add_effects_of_time(effects_, effects, elastic, elastic.to_free(u_));
}

Elastic::Forces QuasiStaticModel::forces() const {
  Elastic::Forces all = elastic_.forces(u_);
  all.force = elastic_.to_free(all.force);
  if (!effects_.empty()) add_forces(effects_, elastic_, u_, all);
  if (self_collision_) self_collision_->add_forces(u_, all);
  return all;
}

void QuasiStaticModel::stiffness(Elastic::Curvature curvature) {
  elastic_.stiffness(u_, curvature, stiffness_);
  for (const auto& effect : effects_) effect->add_stiffness(stiffness_);
}

void QuasiStaticModel::factorize() {
  ++factors_;
  stale_ = false;
  stiffness(Elastic::Curvature::kExact);
  if (factor_.factorize(stiffness_)) return;
  stiffness(Elastic::Curvature::kWithoutNegative);
  // Where points are crushed flat, no stiffness may be left in some direction; a millionth of the largest entry is then
  // added.
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

MatrixXd QuasiStaticModel::solve(const MatrixXd& forces) const {
  if (self_collision_) return self_collision_->solve(factor_, forces);
  return factor_.solve(forces);
}

void QuasiStaticModel::foresee(const VectorXd& internal, const VectorXd& load, Given given, double value) {
  const VectorXd b = self_collision_->free_forces(u_) - internal;
  if (given == Given::kForce) {
    self_collision_->foresee(factor_, u_, b + value * load, nullptr, 0);
    return;
  }
  const double by = value - load.dot(elastic_.to_free(u_));
  const double force = self_collision_->foresee(factor_, u_, b, &load, by);
  if (given != Given::kLeastDepth || force >= 0) return;
  self_collision_->foresee(factor_, u_, b, nullptr, 0);
}

QuasiStaticModel::Step QuasiStaticModel::solve(const VectorXd& internal, const VectorXd& load) const {
  MatrixXd right(internal.size(), 2);
  right << -internal, load;
  if (self_collision_) right.col(0) -= self_collision_->foreseen_forces(u_);
  const MatrixXd solution = solve(right);
  return {solution.col(0), solution.col(1)};
}

bool QuasiStaticModel::go(const VectorXd& step, const VectorXd& load, double force, double slope,
                          Elastic::Forces& now) {
  const VectorXd start = u_;
  const double work = force * load.dot(step);
  for (double share = 1; share >= kShortest; share /= 2) {
    u_ = start;
    elastic_.add_free(share * step, u_);
    Elastic::Forces there = forces();
    const double change = there.energy - now.energy - share * work;
    if (change <= kDecrease * share * slope + 1e-14 * std::abs(now.energy)) {
      now = std::move(there);
      return true;
    }
  }
  u_ = start;
  return false;
}

/// ∂force/∂depth of the present shape, by the factor of an older one. Rayleigh quotient: the body's own shape minimises
/// the stiffness over all shapes with unit depth, so a first-order error of the shape (the factor is old) is only a
/// second-order error of the stiffness. Every round removes the same share of the rest.
double QuasiStaticModel::tangent(const VectorXd& load, const VectorXd& by_tool, const Elastic::Forces& now) {
  const double compliance = load.dot(by_tool);
  const VectorXd start = u_;
  VectorXd shape = by_tool / compliance;
  double stiffness = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kTangentRounds; ++i) {
    u_ = start;
    elastic_.add_free(kNudge * shape, u_);
    const VectorXd needed = (forces().force - now.force) / kNudge;
    const double before = stiffness;
    stiffness = shape.dot(needed);
    if (before - stiffness <= kTangentPrecision * stiffness) break;
    const VectorXd back = solve(needed);
    shape -= back - load.dot(back) / compliance * by_tool;
  }
  u_ = start;
  return stiffness;
}

double QuasiStaticModel::newton(const VectorXd& load, Given given, double value, Reaction& reaction) {
  double error = std::numeric_limits<double>::infinity();
  double before = std::numeric_limits<double>::infinity();
  double enough = 0;
  bool exact = false;  // true when the factor is that of the present shape
  VectorXd by_tool;
  Elastic::Forces now = forces();
  for (iterations_ = 0; iterations_ < config_.max_iterations;) {
    ++iterations_;
    if (stale_) {
      factorize();
      exact = true;
    }
    if (self_collision_) foresee(now.force, load, given, value);
    const Step step = solve(now.force, load);
    const double compliance = load.dot(step.by_tool);
    const double depth = load.dot(elastic_.to_free(u_));
    reaction.stiffness = 1 / compliance;
    reaction.force = constrained_force(given, value, depth + load.dot(step.by_itself), compliance);
    by_tool = step.by_tool;
    const VectorXd move = step.by_itself + reaction.force * step.by_tool;
    // −slope = moveᵀ K move is twice the energy that has still to be lost; a force error of √(… K) would explain it.
    const double slope = (now.force - reaction.force * load).dot(move);
    error = std::sqrt(std::max(0.0, -slope) * reaction.stiffness);
    enough = config_.tolerance * std::abs(reaction.force) + kUnseen * reaction.stiffness;
    stale_ = !exact && -slope > kSlow * before;
    if (stale_) continue;
    const bool moved = go(move, load, reaction.force, slope, now);
    stale_ = !moved && !exact;
    if (stale_) continue;
    before = -slope;
    if (!moved || error <= enough) break;
    exact = false;
  }
  if (error > enough) stale_ = true;
  if (step_ == 0 && !exact && !stale_) reaction.stiffness = tangent(load, by_tool, now);
  return error;
}

double QuasiStaticModel::part_sides(const VectorXd& load, Given given, double value, Reaction& reaction) {
  int iterations = iterations_;
  double error = reaction.error;
  for (int looks = 1;; ++looks) {
    const double changed = self_collision_->look(u_);
    if (changed <= kParted || looks == kLooks) {
      iterations_ = iterations;
      return changed <= kParted ? error : error + changed * std::abs(reaction.force);
    }
    error = newton(load, given, value, reaction);
    iterations += iterations_;
  }
}

Reaction QuasiStaticModel::press(const Patch& patch, Given given, double value) {
  Reaction reaction;
  if (patch.nodes.empty()) {
    release();
    return reaction;
  }
  const VectorXd load = elastic_.to_free(patch_load(elastic_, normal_, patch));
  reaction.error = newton(load, given, value, reaction);
  if (self_collision_) reaction.error = part_sides(load, given, value, reaction);
  for (const auto& effect : effects_) effect->advance(elastic_.to_free(u_));
  reaction.depth = depth_below(patch, normal_, u_);
  reaction.slope = slope_below(patch, normal_, u_);
  if (step_ > 0) reaction.stiffness = secant(reaction, depth_below(patch, normal_, rest_));
  return reaction;
}

void QuasiStaticModel::cut(const Division& division, const EffectsConfig& effects) {
  const VectorXd before = std::move(u_);
  u_.resize(elastic_.size());
  for (int i = 0; i < u_.size(); ++i) u_[i] = before[3 * division.node_before[at(i / 3)] + i % 3];
  effects_ = effects_at_rest(effects, elastic_);
  if (self_collision_) self_collision_ = std::make_unique<SelfCollision>(elastic_, *config_.self_collision, u_);
  stiffness_ = elastic_.pattern();
  factor_ = Factor(stiffness_);  // a split factor would not serve: under load the shape changes in the first step
  stale_ = true;
}

double QuasiStaticModel::release() {
  Reaction free;
  VectorXd nothing = VectorXd::Zero(elastic_.free_count());
  nothing[0] = 1;  // any direction, with no force along it
  free.error = newton(nothing, Given::kForce, 0, free);
  if (self_collision_) part_sides(nothing, Given::kForce, 0, free);
  for (const auto& effect : effects_) effect->advance(elastic_.to_free(u_));
  return forces().energy;
}

std::size_t QuasiStaticModel::bytes() const noexcept {
  return stiffness_.bytes() + factor_.bytes() + softbody::bytes(effects_) +
         (self_collision_ ? self_collision_->bytes() : 0) +
         static_cast<std::size_t>(u_.size() + rest_.size()) * sizeof(double);
}

VectorXd shape_at_rest(const Elastic& elastic, const TouchSurface& surface, EffectsConfig loads) {
  loads.inertia = false;
  loads.damping.reset();
  loads.viscosity.reset();
  return QuasiStaticModel(elastic, surface, {}, loads).displacements();
}

}  // namespace tendon::softbody
