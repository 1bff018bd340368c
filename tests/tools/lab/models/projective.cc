// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/models/projective.h"

#include <stdexcept>

#include "protocol/expect.h"

namespace tendon::softbody::compared {
namespace {

/// Returns Σ 2µV ∇N ∇Nᵀ for each axis; the axes are not coupled.
SymmetricMatrix matrix_of(const Solid& solid) {
  const SymmetricMatrix& all = solid.pattern();
  std::vector<int> axis_of(static_cast<std::size_t>(all.size));
  for (int i = 0; i < solid.size(); ++i) {
    if (solid.free_of(i) >= 0) axis_of[at(solid.free_of(i))] = i % 3;
  }
  SymmetricMatrix some;
  some.size = all.size;
  some.column_starts.push_back(0);
  for (int column = 0; column < all.size; ++column) {
    for (int i = all.column_starts[at(column)]; i < all.column_starts[at(column + 1)]; ++i) {
      if (axis_of[at(all.rows[at(i)])] == axis_of[at(column)]) some.rows.push_back(all.rows[at(i)]);
    }
    some.column_starts.push_back(static_cast<int>(some.rows.size()));
  }
  some.values.assign(some.rows.size(), 0);

  const auto nodes_per_element = nodes_of(solid.mesh().shape);
  for (int e = 0; e < solid.mesh().element_count(); ++e) {
    const auto nodes = solid.mesh().element(e);
    MatrixXd k = MatrixXd::Zero(nodes_per_element, nodes_per_element);
    for (int q = 0; q < solid.points_per_element(); ++q) {
      const Solid::Point& point = solid.point(e, q);
      k += 2 * point.mu * point.volume * solid.gradient(e, q).transpose() * solid.gradient(e, q);
    }
    for (int j = 0; j < 3 * nodes_per_element; ++j) {
      for (int i = j % 3; i < 3 * nodes_per_element; i += 3) {
        const int row = solid.free_of(3 * nodes[at(i / 3)] + i % 3);
        const int column = solid.free_of(3 * nodes[at(j / 3)] + j % 3);
        if (column >= 0 && row >= column) some.values[at(some.slot(row, column))] += k(i / 3, j / 3);
      }
    }
  }
  return some;
}

Factor factor_of(const Solid& solid, const Effects& effects) {
  SymmetricMatrix matrix = matrix_of(solid);
  for (const auto& effect : effects) effect->add_stiffness(matrix);
  Factor factor(matrix);
  if (!factor.factorize(matrix)) {
    throw std::runtime_error("the body can still move as a whole: expected more fixed nodes");
  }
  return factor;
}

/// Reaches a relative error of 1e-6 for the README's block.
constexpr int kRoundsToRest = 1000;

}  // namespace

ProjectiveModel::ProjectiveModel(const Solid& solid, const TouchSurface& surface, int iterations,
                                 const EffectsConfig& effects)
    : solid_(solid),
      normal_(surface.normal()),
      iterations_(iterations),
      step_(effects.has_time() ? effects.step : 0),
      effects_(effects_at_rest(effects, solid)),
      factor_(factor_of(solid, effects_)),
      u_(VectorXd::Zero(solid.size())) {
  expect(iterations >= 1, "iterations", iterations, "1 or more");
  if (effects.viscosity) throw std::invalid_argument("this model does not simulate viscosity");
  const bool among_effects = effects.gravity || effects.has_time();
  if (!among_effects) return;
  for (int i = 0; i < kRoundsToRest && !effects_.empty(); ++i) press({}, Prescribed::kForce, 0);
  rest_ = u_;
  if (!effects.has_time()) return;
  add_effects_of_time(effects_, effects, solid, solid.to_free(u_));
  factor_ = factor_of(solid, effects_);
}

VectorXd ProjectiveModel::rotation_force() const {
  VectorXd all = VectorXd::Zero(solid_.size());
  for (int e = 0; e < solid_.mesh().element_count(); ++e) {
    const Solid::Nodal local = solid_.displacements(u_, e);
    Solid::Nodal force = Solid::Nodal::Zero(3, local.cols());
    for (int q = 0; q < solid_.points_per_element(); ++q) {
      const Solid::Point& point = solid_.point(e, q);
      if (point.mu == 0) continue;
      // Node by node, because the components of a gradient are not contiguous (kernel.h).
      const auto gradient = solid_.gradient(e, q);
      Mat3 change = Mat3::Zero();
      for (int i = 0; i < local.cols(); ++i) change += local.col(i) * Vec3(gradient.col(i)).transpose();
      const Mat3 rotation = nearest_rotation(Mat3::Identity() + change);
      const Mat3 pull = 2 * point.mu * point.volume * (rotation - Mat3::Identity());
      for (int i = 0; i < local.cols(); ++i) force.col(i) += pull * Vec3(gradient.col(i));
    }
    const auto nodes = solid_.mesh().element(e);
    for (int i = 0; i < local.cols(); ++i) all.segment<3>(3 * nodes[at(i)]) += force.col(i);
  }
  return solid_.to_free(all);
}

Reaction ProjectiveModel::press(const Patch& patch, Prescribed given, double value) {
  const VectorXd zero = VectorXd::Zero(solid_.free_count());
  VectorXd constant = zero;
  for (const auto& effect : effects_) effect->add_force(zero, constant);
  const VectorXd load = solid_.to_free(patch_load(solid_, normal_, patch));
  const VectorXd by_tool = factor_.solve(load);
  const double compliance = load.dot(by_tool);
  Reaction reaction;
  double before = 0;
  for (int i = 0; i < iterations_; ++i) {
    VectorXd u = factor_.solve(constant + rotation_force());
    before = reaction.force;
    reaction.force = constrained_force(given, value, load.dot(u), compliance);
    u += reaction.force * by_tool;
    u_.setZero();
    solid_.add_free(u, u_);
  }
  for (const auto& effect : effects_) effect->advance(solid_.to_free(u_));
  reaction.depth = depth_below(patch, normal_, u_);
  reaction.slope = slope_below(patch, normal_, u_);
  reaction.stiffness = secant(reaction, rest_.size() > 0 ? depth_below(patch, normal_, rest_) : 0);
  reaction.error = std::abs(reaction.force - before);
  return reaction;
}

std::size_t ProjectiveModel::bytes() const noexcept {
  return factor_.bytes() + softbody::bytes(effects_) +
         static_cast<std::size_t>(u_.size() + rest_.size()) * sizeof(double);
}

}  // namespace tendon::softbody::compared
