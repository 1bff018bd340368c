// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/models/xpbd.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <stdexcept>

#include "protocol/expect.h"
#include "tests/tools/lab/models/steps.h"

namespace tendon::softbody::compared {

XpbdModel::XpbdModel(const Solid& solid, const TouchSurface& surface, int iterations, const EffectsConfig& effects)
    : normal_(surface.normal()),
      dt_(effects.step),
      iterations_(iterations),
      slowing_(1 / (1 + effects.damping.value_or(0) * effects.step)),
      per_mass_(VectorXd::Zero(solid.size())),
      u_(VectorXd::Zero(solid.size())),
      velocity_(VectorXd::Zero(solid.size())) {
  check_only_with_inertia(effects);
  if (solid.mesh().shape != Shape::kTet4) throw std::invalid_argument("xpbd requires a mesh of tetrahedra");
  expect(iterations >= 1, "iterations", iterations, "1 or more");
  for (int e = 0; e < solid.mesh().element_count(); ++e) {
    const auto nodes = solid.mesh().element(e);
    const Material& material = solid.material(e);
    tets_.push_back({.nodes = {nodes[0], nodes[1], nodes[2], nodes[3]},
                     .gradient = solid.gradient(e, 0),
                     .volume = solid.point(e, 0).volume,
                     .mu = material.mu(),
                     .both = material.lambda() + material.mu(),
                     .lambda_shape = 0,
                     .lambda_volume = 0});
  }
  solid.add_free(lumped_mass(solid, effects.density).cwiseInverse(), per_mass_);
  if (effects.gravity) {
    fall_ = dt_ * effects.gravity->replicate(solid.size() / 3, 1);
    fall_ = (per_mass_.array() > 0).select(fall_, 0);
    rest_ = shape_at_rest(solid, surface, effects);
    u_ = rest_;
  }
}

void XpbdModel::relax(Tet& tet) {
  Eigen::Matrix<double, 3, 4> local;
  Eigen::Matrix<double, 3, 4> per_mass;
  for (int i = 0; i < 4; ++i) {
    local.col(i) = u_.segment<3>(3 * tet.nodes[at(i)]);
    per_mass.col(i) = per_mass_.segment<3>(3 * tet.nodes[at(i)]);
  }
  const auto correct = [&](double constraint, const Mat3& slope, double modulus, double& multiplier) {
    const Eigen::Matrix<double, 3, 4> by_node = slope * tet.gradient;
    const double compliance = 1 / (modulus * tet.volume * dt_ * dt_);
    const double change =
        (-constraint - compliance * multiplier) / (by_node.cwiseAbs2().cwiseProduct(per_mass).sum() + compliance);
    multiplier += change;
    local += change * per_mass.cwiseProduct(by_node);
  };
  Mat3 f = Mat3::Identity() + local * tet.gradient.transpose();
  const double size = f.norm();
  if (size > 0) correct(size, f / size, tet.mu, tet.lambda_shape);
  f = Mat3::Identity() + local * tet.gradient.transpose();
  Mat3 cofactor;
  cofactor << f.col(1).cross(f.col(2)), f.col(2).cross(f.col(0)), f.col(0).cross(f.col(1));
  correct(f.determinant() - 1 - tet.mu / tet.both, cofactor, tet.both, tet.lambda_volume);
  for (int i = 0; i < 4; ++i) u_.segment<3>(3 * tet.nodes[at(i)]) = local.col(i);
}

Reaction XpbdModel::press(const Patch& patch, Prescribed given, double value) {
  const VectorXd start = u_;
  const auto push = [&](double force) {
    for (Eigen::Index i = 0; i < patch.weights.size(); ++i) {
      const int node = patch.nodes[static_cast<std::size_t>(i)];
      u_.segment<3>(3 * node) -=
          dt_ * dt_ * force * patch.weights[i] * per_mass_.segment<3>(3 * node).cwiseProduct(normal_);
    }
  };
  double compliance = 0;  // m/N, of the patch within this step
  for (Eigen::Index i = 0; i < patch.weights.size(); ++i) {
    const int node = patch.nodes[static_cast<std::size_t>(i)];
    compliance +=
        dt_ * dt_ * patch.weights[i] * patch.weights[i] * normal_.cwiseAbs2().dot(per_mass_.segment<3>(3 * node));
  }

  if (fall_.size() > 0) velocity_ += fall_;
  if (slowing_ < 1) velocity_ *= slowing_;
  u_ += dt_ * velocity_;
  Reaction reaction;
  if (given == Prescribed::kForce) {
    reaction.force = value;
    push(value);
  }
  for (Tet& tet : tets_) tet.lambda_shape = tet.lambda_volume = 0;
  for (int i = 0; i < iterations_; ++i) {
    for (Tet& tet : tets_) relax(tet);
    if (given == Prescribed::kForce) continue;
    // The tool may take back impulses of earlier iterations of this step.
    const double untouched = depth_below(patch, normal_, u_) - reaction.force * compliance;
    const double force = constrained_force(given, value, untouched, compliance);
    push(force - reaction.force);
    reaction.force = force;
  }
  velocity_ = (u_ - start) / dt_;
  reaction.depth = depth_below(patch, normal_, u_);
  reaction.slope = slope_below(patch, normal_, u_);
  reaction.stiffness = secant(reaction, rest_.size() > 0 ? depth_below(patch, normal_, rest_) : 0);
  return reaction;
}

std::size_t XpbdModel::bytes() const noexcept {
  return tets_.size() * sizeof(Tet) +
         static_cast<std::size_t>(per_mass_.size() + u_.size() + velocity_.size() + fall_.size() + rest_.size()) *
             sizeof(double);
}

}  // namespace tendon::softbody::compared
