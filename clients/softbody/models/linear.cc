// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/models/linear.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "clients/softbody/effects/cutting.h"

namespace tendon::softbody {
namespace {

constexpr double kSlopesAlike = 0.1;  ///< relative change of W for which the glide is used again

constexpr double kSteepest = 10;  ///< steeper surfaces are outside the range of linear elasticity

constexpr Eigen::Index kAtOnce = 64;  // makes CHOLMOD use products of matrices

SymmetricMatrix stiffness_of(const Solid& solid, const Effects& effects) {
  if (solid.law() != Law::kLinear) throw std::invalid_argument("a linear model requires the linear law");
  SymmetricMatrix stiffness = solid.exact_stiffness(VectorXd::Zero(solid.size()));
  for (const auto& effect : effects) effect->add_stiffness(stiffness);
  return stiffness;
}

VectorXd depth_of(const Solid& solid, const Vec3& normal, const Patch& patch, const VectorXd& displacements) {
  VectorXd all = VectorXd::Zero(solid.size());
  solid.add_free(displacements, all);
  VectorXd depth(patch.weights.size());
  for (Eigen::Index i = 0; i < depth.size(); ++i) {
    depth[i] = -normal.dot(all.segment<3>(3 * patch.nodes[static_cast<std::size_t>(i)]));
  }
  return depth;
}

}  // namespace

Reaction linear_reaction(const Patch& patch, const VectorXd& depth_per_newton, Prescribed given, double value) {
  const double compliance = patch.weights.dot(depth_per_newton);
  Reaction reaction;
  reaction.stiffness = 1 / compliance;
  reaction.force = constrained_force(given, value, 0, compliance);
  reaction.depth = given == Prescribed::kDepth ? value : reaction.force * compliance;
  reaction.slope = reaction.force * (patch.slopes * depth_per_newton);
  return reaction;
}

void add_glide(const Patch& patch, const VectorXd& depth_per_newton, const Mat2& giving, Reaction& to) {
  const Vec2 tilt = patch.slopes * depth_per_newton;
  if (to.slope.norm() > kSteepest) return;
  const Vec3 curve = to.force * (patch.curvatures * depth_per_newton);
  to.glide = {.tilting = to.stiffness * tilt,
              .curving = (Mat2() << curve[0], curve[1], curve[1], curve[2]).finished(),
              .giving = giving - to.stiffness * tilt * tilt.transpose()};
  to.knows_glide = true;
}

LinearModel::LinearModel(const Solid& solid, const TouchSurface& surface, const EffectsConfig& effects, bool glides)
    : solid_(solid),
      normal_(surface.normal()),
      factor_(factor_of(stiffness_of(solid, {}))),
      step_(effects.has_time() ? effects.step : 0),
      glides_(glides),
      effects_(effects_at_rest(effects, solid)) {
  if (effects.has_time()) {
    const VectorXd rest = untouched();
    rest_ = VectorXd::Zero(solid.size());
    solid.add_free(rest, rest_);
    add_effects_of_time(effects_, effects, solid, rest);
    factor_ = factor_of(stiffness_of(solid, effects_));
  }
}

void LinearModel::cut(const Division& division, const EffectsConfig& effects) {
  effects_ = effects_at_rest(effects, solid_);
  slopes_.resize(0, 0);
  const SymmetricMatrix stiffness = stiffness_of(solid_, effects_);
  if (division.lost > 0 || !factor_.split(stiffness, twins(solid_, division))) factor_ = factor_of(stiffness);
}

VectorXd LinearModel::displacements(const Patch& patch) const {
  return factor_.solve(solid_.to_free(patch_load(solid_, normal_, patch)));
}

Mat2 LinearModel::giving(const Patch& patch) {
  const auto alike = [&] {
    double common = 0;
    for (Eigen::Index i = 0; i < patch.slopes.cols(); ++i) {
      common += slopes_.row(patch.nodes[static_cast<std::size_t>(i)]).dot(patch.slopes.col(i));
    }
    const double size = slopes_.squaredNorm();
    return patch.slopes.squaredNorm() - 2 * common + size <= kSlopesAlike * kSlopesAlike * size;
  };
  if (slopes_.size() == 0 || !alike()) glide_from(patch);
  // 2 WᵀY − YᵀAY has its maximum at the exact Y, so an error of Y is squared.
  Mat2 across = Mat2::Zero();
  for (Eigen::Index i = 0; i < patch.slopes.cols(); ++i) {
    across += patch.slopes.col(i) * given_way_.row(patch.nodes[static_cast<std::size_t>(i)]);
  }
  return across + across.transpose() - given_;
}

void LinearModel::glide_from(const Patch& patch) {
  const MatrixXd loads = patch_load_slopes(solid_, normal_, patch);
  const auto nodes = static_cast<Eigen::Index>(solid_.mesh().nodes.size());
  slopes_ = MatrixXd::Zero(nodes, 2);
  given_way_.resize(nodes, 2);
  for (Eigen::Index i = 0; i < patch.slopes.cols(); ++i) {
    slopes_.row(patch.nodes[static_cast<std::size_t>(i)]) = patch.slopes.col(i).transpose();
  }
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    VectorXd all = VectorXd::Zero(solid_.size());
    solid_.add_free(factor_.solve(solid_.to_free(loads.col(axis))), all);
    given_way_.col(axis) = -all.reshaped(3, nodes).transpose() * normal_;
  }
  given_ = slopes_.transpose() * given_way_;
}

VectorXd LinearModel::untouched() const {
  const VectorXd zero = VectorXd::Zero(solid_.free_count());
  VectorXd force = zero;
  for (const auto& effect : effects_) effect->add_force(zero, force);
  return factor_.solve(force);
}

Reaction LinearModel::press(const Patch& patch, Prescribed given, double value) {
  if (!effects_.empty()) return press_among_effects(patch, given, value);
  if (patch.curvatures.size() == 0) {
    return linear_reaction(patch, depth_of(solid_, normal_, patch, displacements(patch)), given, value);
  }
  const VectorXd depth = depth_of(solid_, normal_, patch, displacements(patch));
  Reaction reaction = linear_reaction(patch, depth, given, value);
  add_glide(patch, depth, giving(patch), reaction);
  return reaction;
}

Reaction LinearModel::press_among_effects(const Patch& patch, Prescribed given, double value) {
  const VectorXd per_newton = displacements(patch);
  VectorXd u = untouched();
  const VectorXd load = solid_.to_free(patch_load(solid_, normal_, patch));
  const double compliance = load.dot(per_newton);
  Reaction reaction;
  reaction.force = constrained_force(given, value, load.dot(u), compliance);
  u += reaction.force * per_newton;
  for (const auto& effect : effects_) effect->advance(u);

  VectorXd all = VectorXd::Zero(solid_.size());
  solid_.add_free(u, all);
  reaction.depth = depth_below(patch, normal_, all);
  reaction.slope = slope_below(patch, normal_, all);
  reaction.stiffness = step_ > 0 ? secant(reaction, depth_below(patch, normal_, rest_)) : 1 / compliance;
  if (patch.curvatures.size() > 0) {
    add_glide(patch, depth_of(solid_, normal_, patch, per_newton), giving(patch), reaction);
    reaction.glide.curving = curve_below(patch, normal_, all);  // including gravity
  }
  return reaction;
}

std::size_t LinearModel::bytes() const noexcept {
  return factor_.bytes() + softbody::bytes(effects_) +
         static_cast<std::size_t>(rest_.size() + slopes_.size() + given_way_.size()) * sizeof(double);
}

MatrixXd compliance_of(const Solid& solid, const std::vector<int>& nodes) {
  const Factor factor = factor_of(stiffness_of(solid, {}));
  const auto count = 3 * static_cast<Eigen::Index>(nodes.size());
  const auto row_of = [&](Eigen::Index i) { return 3 * nodes[static_cast<std::size_t>(i / 3)] + i % 3; };
  MatrixXd compliance(count, count);
  for (Eigen::Index first = 0; first < count; first += kAtOnce) {
    const Eigen::Index some = std::min(kAtOnce, count - first);
    MatrixXd loads(solid.free_count(), some);
    for (Eigen::Index j = 0; j < some; ++j) {
      loads.col(j) = solid.to_free(VectorXd::Unit(solid.size(), row_of(first + j)));
    }
    const MatrixXd solution = factor.solve(loads);
    for (Eigen::Index j = 0; j < some; ++j) {
      VectorXd all = VectorXd::Zero(solid.size());
      solid.add_free(solution.col(j), all);
      for (Eigen::Index i = 0; i < count; ++i) compliance(i, first + j) = all[row_of(i)];
    }
  }
  return 0.5 * (compliance + compliance.transpose());
}

namespace {

class FactorSolver : public Solver {
 public:
  explicit FactorSolver(const Solid& solid) : factor_(factor_of(stiffness_of(solid, {}))) {}
  MatrixXd solve(const MatrixXd& loads) const override { return factor_.solve(loads); }

 private:
  Factor factor_;
};

}  // namespace

std::unique_ptr<Solver> with_factor(const Solid& solid) { return std::make_unique<FactorSolver>(solid); }

MatrixXd surface_compliance(const Solid& solid, const Vec3& normal, const std::vector<int>& nodes,
                            const Solver& solver) {
  const auto count = static_cast<Eigen::Index>(nodes.size());
  MatrixXd table(count, count);
  for (Eigen::Index first = 0; first < count; first += kAtOnce) {
    const Eigen::Index some = std::min(kAtOnce, count - first);
    MatrixXd loads(solid.free_count(), some);
    for (Eigen::Index j = 0; j < some; ++j) {
      Patch alone;
      alone.nodes = {nodes[static_cast<std::size_t>(first + j)]};
      alone.weights = VectorXd::Ones(1);
      loads.col(j) = solid.to_free(patch_load(solid, normal, alone));
    }
    // The table is symmetric, because the load and the depth have the same weights.
    const MatrixXd solution = solver.solve(loads);
    for (Eigen::Index j = 0; j < some; ++j) {
      VectorXd all = VectorXd::Zero(solid.size());
      solid.add_free(solution.col(j), all);
      for (Eigen::Index i = 0; i < count; ++i) {
        table(i, first + j) = -normal.dot(all.segment<3>(3 * nodes[static_cast<std::size_t>(i)]));
      }
    }
  }
  return 0.5 * (table + table.transpose());
}

Solver::Rough Solver::solve_roughly(const VectorXd& load) const {
  Rough rough{.displacements = solve(load)};
  rough.compliance = load.dot(rough.displacements);
  return rough;
}

SolvedModel::SolvedModel(const Solid& solid, const TouchSurface& surface, const Patch& middle,
                         std::unique_ptr<Solver> solver)
    : solid_(solid), normal_(surface.normal()), solver_(std::move(solver)), slope_factor_(0) {
  if (solid.law() != Law::kLinear) throw std::invalid_argument("a linear model requires the linear law");
  MatrixXd loads(solid.free_count(), 2);
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    Patch reads = middle;
    reads.weights = middle.slopes.row(axis).transpose();
    loads.col(axis) = solid.to_free(patch_load(solid, normal_, reads));
  }
  constexpr double kOtherPlaces = 1.2;
  slope_factor_ = kOtherPlaces * std::sqrt(loads.cwiseProduct(solver_->solve(loads)).sum());
}

Reaction SolvedModel::press(const Patch& patch, Prescribed given, double value) {
  const Solver::Rough rough = solver_->solve_roughly(solid_.to_free(patch_load(solid_, normal_, patch)));
  const VectorXd depth = depth_of(solid_, normal_, patch, rough.displacements);
  Reaction reaction = linear_reaction(patch, depth, given, value);
  reaction.stiffness = 1 / rough.compliance;
  reaction.force = constrained_force(given, value, 0, rough.compliance);
  reaction.depth = given == Prescribed::kDepth ? value : reaction.force * rough.compliance;
  const double force = std::abs(reaction.force);
  const double along = force * rough.missing / (rough.compliance + rough.missing);
  const double aside = force * force * slope_factor_ * std::sqrt(rough.missing);
  reaction.error = std::hypot(along, along * reaction.slope.norm(), aside);
  return reaction;
}

CondensedModel::CondensedModel(const Solid& solid, const TouchSurface& surface, const std::vector<int>& nodes,
                               bool glides)
    : CondensedModel(solid.mesh().nodes.size(), nodes,
                     surface_compliance(solid, surface.normal(), nodes, *with_factor(solid)), glides) {}

CondensedModel::CondensedModel(std::size_t mesh_nodes, std::vector<int> nodes, MatrixXd table, bool glides)
    : nodes_(std::move(nodes)), row_of_(mesh_nodes, -1), table_(std::move(table)), glides_(glides) {
  for (std::size_t i = 0; i < nodes_.size(); ++i) row_of_.at(at(nodes_[i])) = static_cast<int>(i);
}

Reaction CondensedModel::press(const Patch& patch, Prescribed given, double value) {
  rows_.clear();
  for (const int node : patch.nodes) {
    const int row = row_of_.at(at(node));
    if (row < 0) throw std::out_of_range("the patch leaves the condensed part of the body");
    rows_.push_back(row);
  }
  const auto size = patch.weights.size();
  VectorXd depth = VectorXd::Zero(size);
  for (Eigen::Index j = 0; j < size; ++j) {
    const double weight = patch.weights[j];
    const double* const column = table_.col(rows_[static_cast<std::size_t>(j)]).data();
    for (Eigen::Index i = 0; i < size; ++i) depth[i] += weight * column[rows_[static_cast<std::size_t>(i)]];
  }
  Reaction reaction = linear_reaction(patch, depth, given, value);
  if (patch.curvatures.size() > 0) add_glide(patch, depth, giving(patch), reaction);
  return reaction;
}

Mat2 CondensedModel::giving(const Patch& patch) const {
  Mat2 half = Mat2::Zero();
  for (Eigen::Index j = 0; j < patch.slopes.cols(); ++j) {
    const double* const column = table_.col(rows_[static_cast<std::size_t>(j)]).data();
    Vec2 below = 0.5 * column[rows_[static_cast<std::size_t>(j)]] * patch.slopes.col(j);
    for (Eigen::Index i = 0; i < j; ++i) below += column[rows_[static_cast<std::size_t>(i)]] * patch.slopes.col(i);
    half += below * patch.slopes.col(j).transpose();
  }
  return half + half.transpose();
}

std::size_t CondensedModel::bytes() const noexcept {
  return static_cast<std::size_t>(table_.size()) * sizeof(double) + (nodes_.size() + row_of_.size()) * sizeof(int);
}

}  // namespace tendon::softbody
