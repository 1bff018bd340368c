// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/models/quasi_static.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "clients/softbody/effects/cutting.h"
#include "protocol/expect.h"

namespace tendon::softbody {
namespace {

constexpr double kDecrease = 1e-4;      ///< Armijo's parameter
constexpr double kShortest = 1.0 / 64;  ///< the shortest step

/// The factor is computed again after kPatience steps without an accurate answer. If sides of the body are in contact,
/// it is computed again if a step leaves more than kSlow of the remaining energy, because the contact changes.
constexpr int kPatience = 16;
constexpr double kSlow = 1.0 / 16;

/// The energy of a shape from H has an error of second order, so it is accepted if it differs from the first-order
/// value by less than Config::tangent, and if H predicts only a small improvement. Both conditions are needed, because
/// two values can be equal by accident. kOfTangentForGlide is the part of Config::tangent for the glide.
constexpr double kOfTangentForGlide = 0.5;
constexpr int kTangentRounds = 5;

constexpr double kAtRest = 0.1;  ///< larger relative errors of the force: not at rest, and no glide

constexpr double kGlidesAlike = 0.04;  ///< relative change of the load and the force for which the glide is used again

constexpr double kNudge = 1e-7;  ///< m, step of finite differences; in a body of some mm its relative error is 1e-4

constexpr int kLooks = 10;        ///< maximum number of searches for neighbors
constexpr double kParted = 1e-3;  ///< they end at this relative change of forces

constexpr double kHeard = 1e-8;  ///< smaller relative changes are rounding errors

constexpr double kUnseen = 1e-12;  ///< an error that corresponds to a smaller depth (m) is ignored

}  // namespace

QuasiStaticModel::QuasiStaticModel(const Elastic& elastic, const TouchSurface& surface, const Config& config,
                                   const EffectsConfig& effects)
    : elastic_(elastic),
      normal_(surface.normal()),
      config_(config),
      stiffness_(elastic.pattern()),
      factor_(stiffness_),
      u_(elastic.beginning()),
      step_(effects.has_time() ? effects.step : 0),
      effects_(effects_at_rest(effects, elastic)) {
  expect(config.max_iterations >= 1, "max_iterations", config.max_iterations, "1 or more");
  expect_above_zero(config.tolerance, "tolerance");
  expect_above_zero(config.tangent, "tangent");
  if (config.self_collision) self_collision_ = std::make_unique<SelfCollision>(elastic, *config.self_collision, u_);
  stiffness(Elastic::Curvature::kExact);
  stale_ = !factor_.factorize(stiffness_);
  if (stale_) {
    throw std::runtime_error("the body can still move as a whole: expected more fixed nodes");
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

void QuasiStaticModel::move(const VectorXd& free) {
  elastic_.add_free(free, u_);
  glided_.reset();
  forget_forces();
}

void QuasiStaticModel::stiffness(Elastic::Curvature curvature) {
  elastic_.stiffness(u_, curvature, stiffness_);
  for (const auto& effect : effects_) effect->add_stiffness(stiffness_);
}

bool QuasiStaticModel::factorize() {
  ++factors_;
  stale_ = false;
  in_vain_ = 0;
  pairs_.clear();
  stiffness(Elastic::Curvature::kExact);
  if (factor_.factorize(stiffness_)) return true;
  stiffness(Elastic::Curvature::kWithoutNegative);
  // If elements are flat, the stiffness can be singular. A small number is added to the diagonal.
  for (double shift = 0; !factor_.factorize(stiffness_);) {
    double largest = 0;
    for (const double value : stiffness_.values) largest = std::max(largest, std::abs(value));
    shift = shift == 0 ? 1e-6 * largest : 9 * shift;
    for (int i = 0; i < stiffness_.size; ++i) {
      stiffness_.values[static_cast<std::size_t>(stiffness_.column_starts[static_cast<std::size_t>(i)])] += shift;
    }
    if (!std::isfinite(shift)) throw std::runtime_error("the stiffness of the body is not finite");
  }
  return false;
}

VectorXd QuasiStaticModel::solve(const VectorXd& b, bool among_sides) const {
  return among_sides ? VectorXd(self_collision_->solve(factor_, b)) : pairs_.times(b, factor_.solve(b));
}

VectorXd QuasiStaticModel::solve_at_depth(const VectorXd& b, bool among_sides, const VectorXd& load,
                                          const VectorXd& by_tool) const {
  const VectorXd x = solve(b, among_sides);
  return x - load.dot(x) / load.dot(by_tool) * by_tool;
}

bool QuasiStaticModel::foresee(const VectorXd& internal, const VectorXd& load, Prescribed given, double value) {
  const VectorXd b = self_collision_->free_forces(u_) - internal;
  if (given == Prescribed::kForce) {
    self_collision_->foresee(factor_, u_, b + value * load, nullptr, 0);
  } else {
    const double by = value - load.dot(elastic_.to_free(u_));
    const bool pulls = self_collision_->foresee(factor_, u_, b, &load, by) < 0 && given == Prescribed::kLeastDepth;
    if (pulls) {
      self_collision_->foresee(factor_, u_, b, nullptr, 0);
    }
  }
  return self_collision_->pushes(u_);
}

QuasiStaticModel::Step QuasiStaticModel::step_among_sides(const VectorXd& internal, const VectorXd& load) const {
  MatrixXd right(internal.size(), 2);
  right << -internal - self_collision_->foreseen_forces(u_), load;
  const MatrixXd solution = self_collision_->solve(factor_, right);
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

VectorXd QuasiStaticModel::needed(const VectorXd& shape, const Elastic::Forces& now) {
  const double nudge = kNudge / shape.lpNorm<Eigen::Infinity>();
  if (!std::isfinite(nudge)) return VectorXd::Zero(shape.size());
  const VectorXd start = u_;
  elastic_.add_free(nudge * shape, u_);
  VectorXd change = (forces().force - now.force) / nudge;
  u_ = start;
  return change;
}

struct QuasiStaticModel::Tangent {  // the state at the last step of an answer
  const VectorXd& by_tool;          ///< H w
  const Elastic::Forces& now;
  bool among_sides;
};

/// Finds Y with A Y = W at constant depth. Y minimizes ½ YᵀAY − WᵀY over a growing space (Galerkin), so errors of the
/// space are squared. There is no result if the body is not stable.
void QuasiStaticModel::find_shapes(const VectorXd& load, const MatrixXd& slopes, const Tangent& tangent) {
  const auto products = [&](const MatrixXd& shapes) {
    MatrixXd all(shapes.rows(), shapes.cols());
    for (Eigen::Index i = 0; i < shapes.cols(); ++i) all.col(i) = needed(shapes.col(i), tangent.now);
    return all;
  };
  const auto solved = [&](const MatrixXd& loads) {
    MatrixXd all(loads.rows(), loads.cols());
    for (Eigen::Index i = 0; i < loads.cols(); ++i) {
      all.col(i) = solve_at_depth(loads.col(i), tangent.among_sides, load, tangent.by_tool);
    }
    return all;
  };
  MatrixXd space = solved(slopes);
  MatrixXd by_space = products(space);
  Glided found;
  glided_.reset();
  for (int round = 0;; ++round) {
    const MatrixXd gram = space.transpose() * by_space;
    const Eigen::LLT<MatrixXd> energies((gram + gram.transpose()) / 2);
    if (energies.info() != Eigen::Success || !gram.allFinite()) return;
    const MatrixXd shares = energies.solve(space.transpose() * slopes);
    found.shapes = space * shares;
    found.giving = slopes.transpose() * found.shapes;
    const MatrixXd by_shapes = by_space * shares;
    const MatrixXd left = slopes - by_shapes;
    const MatrixXd more = solved(left);
    const Mat2 missing = left.transpose() * more;
    if (round == kTangentRounds || missing.norm() <= kOfTangentForGlide * config_.tangent * found.giving.norm()) {
      found.shapes += more;
      found.giving += missing;
      break;
    }
    // Normalized for a good condition.
    space = (MatrixXd(space.rows(), 4) << found.shapes, more).finished();
    by_space = (MatrixXd(space.rows(), 4) << by_shapes, products(more)).finished();
    for (int i = 0; i < 4; ++i) {
      const double size = 1 / space.col(i).norm();
      space.col(i) *= size;
      by_space.col(i) *= size;
    }
  }
  found.giving = (found.giving + found.giving.transpose()).eval() / 2;
  glided_ = std::move(found);
}

/// Computes the stiffness and the glide with an older factor. The exact shape minimizes the stiffness (Rayleigh
/// quotient), so an error of the shape is squared. Each round adds one direction.
void QuasiStaticModel::find_tangent(const VectorXd& load, const Patch* patch, const Tangent& tangent,
                                    Reaction& reaction) {
  VectorXd shape = tangent.by_tool / load.dot(tangent.by_tool);
  VectorXd by_shape = needed(shape, tangent.now);
  double stiffness = shape.dot(by_shape);
  double guess = reaction.stiffness;
  for (int round = 0;; ++round) {
    const VectorXd back = solve_at_depth(by_shape, tangent.among_sides, load, tangent.by_tool);
    const double less = back.dot(by_shape);
    reaction.stiffness = stiffness - less;
    const double apart = std::max(std::abs(less), std::abs(guess - stiffness));
    if (apart <= config_.tangent * std::abs(stiffness) || round == kTangentRounds) break;
    const VectorXd by_back = needed(back, tangent.now);
    const double share = less / back.dot(by_back);
    shape -= share * back;
    by_shape -= share * by_back;
    guess = stiffness;
    stiffness = shape.dot(by_shape);
  }
  if (patch == nullptr || patch->curvatures.size() == 0) return;
  MatrixXd slopes(load.size(), 2);
  const MatrixXd all = patch_load_slopes(elastic_, normal_, *patch);
  for (int axis = 0; axis < 2; ++axis) slopes.col(axis) = elastic_.to_free(all.col(axis));
  const bool alike = glided_ && (glided_->load - load).norm() <= kGlidesAlike * load.norm() &&
                     std::abs(glided_->force - reaction.force) <= kGlidesAlike * std::abs(reaction.force);
  if (!alike) {
    find_shapes(load, slopes, tangent);
    if (!glided_) return;
    glided_->load = load;
    glided_->force = reaction.force;
  }
  // Corrects the first-order error of `shape`.
  reaction.glide = {.tilting = slopes.transpose() * shape - glided_->shapes.transpose() * by_shape,
                    .curving = curve_below(*patch, normal_, u_),
                    .giving = glided_->giving};
  reaction.knows_glide = true;
}

double QuasiStaticModel::newton(const VectorXd& load, const Patch* patch, Prescribed given, double value,
                                Reaction& reaction) {
  double error = std::numeric_limits<double>::infinity();
  double before = std::numeric_limits<double>::infinity();
  bool exact = false;
  bool among_sides = false;
  Step step;
  Elastic::Forces now = known_ ? std::move(known_->forces) : forces();
  VectorXd solved;  // K₀⁻¹ times the forces
  if (known_) solved = std::move(known_->solved);
  known_.reset();
  VectorXd solved_load;
  for (iterations_ = 0;;) {
    if (stale_) {
      factorize();
      exact = true;
    }
    if (exact || solved.size() == 0) solved = factor_.solve(now.force);
    if (exact || solved_load.size() == 0) solved_load = factor_.solve(load);
    step.by_itself = -pairs_.times(now.force, solved);
    step.by_tool = pairs_.times(load, solved_load);
    if (self_collision_) among_sides = foresee(now.force, load, given, value);
    if (among_sides) step = step_among_sides(now.force, load);
    const double compliance = load.dot(step.by_tool);
    const double depth = load.dot(elastic_.to_free(u_));
    reaction.stiffness = 1 / compliance;
    reaction.force = constrained_force(given, value, depth + load.dot(step.by_itself), compliance);
    const VectorXd move = step.by_itself + reaction.force * step.by_tool;
    // −slope = moveᵀ K move is twice the remaining energy. The error of the force follows from this energy.
    const double slope = (now.force - reaction.force * load).dot(move);
    error = std::sqrt(std::abs(slope * reaction.stiffness));
    const double enough = config_.tolerance * std::abs(reaction.force) + kUnseen * reaction.stiffness;
    if (error <= enough) in_vain_ = 0;
    if (error <= enough || iterations_ == config_.max_iterations) break;
    stale_ = !exact && in_vain_ >= kPatience;
    if (among_sides) stale_ = !exact && -slope > kSlow * before;
    if (stale_) continue;
    const VectorXd start = elastic_.to_free(u_);
    const VectorXd force_before = now.force;
    const bool moved = go(move, load, reaction.force, slope, now);
    stale_ = !moved && !exact;
    if (stale_) continue;
    if (!moved) break;
    before = -slope;
    ++iterations_;
    ++in_vain_;
    exact = false;
    const VectorXd there = factor_.solve(now.force);
    const VectorXd change = now.force - force_before;
    if (change.norm() > kHeard * now.force.norm()) {
      pairs_.add(elastic_.to_free(u_) - start, change, there - solved);
    }
    solved = there;
  }
  const bool lasts = effects_.empty() && self_collision_ == nullptr;
  if (lasts) known_ = Known{now, solved};
  const bool at_rest = error <= kAtRest * std::abs(reaction.force);
  if (step_ == 0 && patch != nullptr)
    find_tangent(load, at_rest ? patch : nullptr, {step.by_tool, now, among_sides}, reaction);
  if (patch != nullptr) {
    // Without the last step, the tangential force would not change with small motions.
    VectorXd there = u_;
    if (at_rest) elastic_.add_free(step.by_itself + reaction.force * step.by_tool, there);
    reaction.depth = depth_below(*patch, normal_, there);
    reaction.slope = slope_below(*patch, normal_, there);
  }
  return error;
}

double QuasiStaticModel::part_sides(const VectorXd& load, const Patch* patch, Prescribed given, double value,
                                    Reaction& reaction) {
  int iterations = iterations_;
  double error = reaction.error;
  for (int looks = 1;; ++looks) {
    const double changed = self_collision_->look(u_);
    if (changed <= kParted || looks == kLooks) {
      iterations_ = iterations;
      return changed <= kParted ? error : error + changed * std::abs(reaction.force);
    }
    error = newton(load, patch, given, value, reaction);
    iterations += iterations_;
  }
}

Reaction QuasiStaticModel::press(const Patch& patch, Prescribed given, double value) {
  Reaction reaction;
  if (patch.nodes.empty()) {
    release();
    return reaction;
  }
  const VectorXd load = elastic_.to_free(patch_load(elastic_, normal_, patch));
  reaction.error = newton(load, &patch, given, value, reaction);
  if (self_collision_) reaction.error = part_sides(load, &patch, given, value, reaction);
  for (const auto& effect : effects_) effect->advance(elastic_.to_free(u_));
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
  pairs_.clear();
  glided_.reset();
  known_.reset();
  factor_ = Factor(stiffness_);  // a split factor would be useless, because the shape changes at once
  stale_ = true;
}

void QuasiStaticModel::go_on_from(const Model& before, std::span<const int> node_before) {
  const VectorXd& u = static_cast<const QuasiStaticModel&>(before).u_;  // same kind by contract
  for (int i = 0; i < u_.size(); ++i) u_[i] = u[3 * node_before[at(i / 3)] + i % 3];
  if (self_collision_) self_collision_ = std::make_unique<SelfCollision>(elastic_, *config_.self_collision, u_);
  pairs_.clear();
  glided_.reset();
  known_.reset();
  in_vain_ = 0;
}

double QuasiStaticModel::release() {
  Reaction free;
  VectorXd nothing = VectorXd::Zero(elastic_.free_count());
  nothing[0] = 1;  // any direction
  free.error = newton(nothing, nullptr, Prescribed::kForce, 0, free);
  if (self_collision_) part_sides(nothing, nullptr, Prescribed::kForce, 0, free);
  for (const auto& effect : effects_) effect->advance(elastic_.to_free(u_));
  return forces().energy;
}

std::size_t QuasiStaticModel::bytes() const noexcept {
  return stiffness_.bytes() + factor_.bytes() + pairs_.bytes() + softbody::bytes(effects_) +
         (self_collision_ ? self_collision_->bytes() : 0) +
         static_cast<std::size_t>(u_.size() + rest_.size()) * sizeof(double);
}

}  // namespace tendon::softbody
