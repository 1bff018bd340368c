// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "clients/softbody/effects/effects.h"
#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/model.h"

namespace tendon::softbody {

/// Projective dynamics (Bouaziz et al. 2014) of elements that are as rigid as possible: energy µ V |F − R|², R the
/// rotation next to F. A round finds the rotation of every point of the mesh, and then all displacements by one
/// solution with a matrix that never changes, because |F − R|² with R held is the same quadratic for each axis. A round
/// takes a part of what is left; an answer is a few rounds, on from the last one.
///
/// The material is that of Law::kCorotational with λ = 0: it knows no Poisson ratio. For comparison.
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
  VectorXd rotation_force() const;  ///< N, free: what the rotations of the present shape pull with

  const Solid& solid_;
  Vec3 normal_;
  int iterations_;
  double step_;
  Effects effects_;
  Factor factor_;
  VectorXd u_;     ///< m, all nodes
  VectorXd rest_;  ///< m, the shape at rest; empty without effects
};

}  // namespace tendon::softbody
