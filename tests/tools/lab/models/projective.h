// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "clients/softbody/effects/effects.h"
#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/model.h"

namespace tendon::softbody::compared {

/// Projective dynamics (Bouaziz et al. 2014) of elements that are as rigid as possible: energy µ V |F − R|², with R the
/// rotation nearest to F. A round finds the rotation at every point of integration, and then all displacements by one
/// solution. The matrix never changes, because |F − R|² with R fixed is the same quadratic for each axis. A round
/// removes only part of the error; an answer is a few rounds, which continue from the last answer.
///
/// The material is that of Law::kCorotational with λ = 0: it has no Poisson ratio. It is here for comparison.
class ProjectiveModel : public Model {
 public:
  /// Throws std::invalid_argument when iterations < 1 or with viscosity, which would tie the axes together. The solid
  /// must outlive this. It begins at rest, under its weight if it has any.
  ProjectiveModel(const Solid& solid, const TouchSurface& surface, int iterations, const EffectsConfig& effects = {});

  Reaction press(const Patch& patch, Given given, double value) override;
  double step() const noexcept override { return step_; }
  bool still() const noexcept override { return effects_.empty(); }
  std::size_t bytes() const noexcept override;

 private:
  VectorXd rotation_force() const;  ///< N, free: the forces of the present shape's rotations

  const Solid& solid_;
  Vec3 normal_;
  int iterations_;
  double step_;
  Effects effects_;
  Factor factor_;
  VectorXd u_;     ///< m, all nodes
  VectorXd rest_;  ///< m, the shape at rest; empty without effects
};

}  // namespace tendon::softbody::compared
