// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/models/explicit.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

#include "tests/tools/lab/models/spectrum.h"
#include "tests/tools/lab/models/steps.h"

namespace tendon::softbody::compared {
namespace {

SymmetricMatrix stiffness_at_rest(const Elastic& elastic) {
  SymmetricMatrix stiffness = elastic.pattern();
  elastic.stiffness(VectorXd::Zero(elastic.size()), Elastic::Curvature::kExact, stiffness);
  return stiffness;
}

VectorXd all_of(const Elastic& elastic, const VectorXd& free) {
  VectorXd all = VectorXd::Zero(elastic.size());
  elastic.add_free(free, all);
  return all;
}

}  // namespace

double largest_step(const Elastic& elastic, double density) {
  return 2 / fastest_swing(stiffness_at_rest(elastic), lumped_mass(elastic, density));
}

ExplicitModel::ExplicitModel(const Solid& solid, const TouchSurface& surface, const EffectsConfig& effects)
    : solid_(solid),
      normal_(surface.normal()),
      dt_(effects.step),
      slowing_(1 / (1 + effects.damping.value_or(0) * effects.step)),
      u_(VectorXd::Zero(solid.size())),
      velocity_(VectorXd::Zero(solid.size())) {
  check_only_with_inertia(effects);
  const double limit = largest_step(solid, effects.density);
  if (!(dt_ <= limit)) {
    std::ostringstream text;
    text << "an explicit step of " << 1e3 * dt_ << " ms is not stable: this mesh and material require at most "
         << 1e3 * limit << " ms";
    throw std::invalid_argument(text.str());
  }
  const VectorXd mass = lumped_mass(solid, effects.density);
  per_mass_ = all_of(solid, mass.cwiseInverse());
  if (solid.law() == Law::kLinear) tensors_ = stiffness_at_rest(solid);
  if (effects.gravity) {
    weight_ = all_of(solid, mass).cwiseProduct(effects.gravity->replicate(solid.size() / 3, 1));
    rest_ = shape_at_rest(solid, surface, effects);
    u_ = rest_;
  }
}

VectorXd ExplicitModel::internal() const {
  return tensors_ ? all_of(solid_, tensors_->times(solid_.to_free(u_))) : solid_.forces(u_).force;
}

Reaction ExplicitModel::press(const Patch& patch, Prescribed given, double value) {
  VectorXd force = -internal();
  if (weight_.size() > 0) force += weight_;
  velocity_ += dt_ * per_mass_.cwiseProduct(force);
  if (slowing_ < 1) velocity_ *= slowing_;

  // The tool is a constraint on the patch; this is the change of depth (m/N) within this step.
  double compliance = 0;
  for (Eigen::Index i = 0; i < patch.weights.size(); ++i) {
    const int node = patch.nodes[static_cast<std::size_t>(i)];
    compliance += patch.weights[i] * patch.weights[i] * normal_.cwiseAbs2().dot(per_mass_.segment<3>(3 * node));
  }
  compliance *= slowing_ * dt_ * dt_;
  const double untouched = depth_below(patch, normal_, u_) + dt_ * depth_below(patch, normal_, velocity_);
  Reaction reaction;
  reaction.force = constrained_force(given, value, untouched, compliance);
  for (Eigen::Index i = 0; i < patch.weights.size(); ++i) {
    const int node = patch.nodes[static_cast<std::size_t>(i)];
    velocity_.segment<3>(3 * node) -=
        slowing_ * dt_ * reaction.force * patch.weights[i] * per_mass_.segment<3>(3 * node).cwiseProduct(normal_);
  }
  u_ += dt_ * velocity_;
  reaction.depth = depth_below(patch, normal_, u_);
  reaction.slope = slope_below(patch, normal_, u_);
  reaction.stiffness = secant(reaction, rest_.size() > 0 ? depth_below(patch, normal_, rest_) : 0);
  return reaction;
}

std::size_t ExplicitModel::bytes() const noexcept {
  const auto numbers = per_mass_.size() + weight_.size() + u_.size() + velocity_.size() + rest_.size();
  return static_cast<std::size_t>(numbers) * sizeof(double) + (tensors_ ? tensors_->bytes() : solid_.bytes());
}

}  // namespace tendon::softbody::compared
