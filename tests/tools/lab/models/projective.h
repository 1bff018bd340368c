// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "clients/softbody/effects/effects.h"
#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/model.h"

namespace tendon::softbody::compared {

/// Projective dynamics (Bouaziz et al. 2014) with as-rigid-as-possible elements: energy µ V |F − R|², R the rotation
/// nearest to F. An iteration finds R at every integration point, then solves for all displacements. The matrix is
/// constant and block-diagonal by axis, because |F − R|² with fixed R is the same quadratic for each axis. An answer is
/// a few iterations from the previous one, which reduce the error only partly. The material is Law::kCorotational with
/// λ = 0, without a Poisson ratio.
class ProjectiveModel : public Model {
 public:
  /// Throws std::invalid_argument if iterations < 1, or with viscosity, which would couple the axes. The solid must
  /// outlive this object. Starts at rest under gravity, if set.
  ProjectiveModel(const Solid& solid, const TouchSurface& surface, int iterations, const EffectsConfig& effects = {});

  Reaction press(const Patch& patch, Prescribed given, double value) override;
  double step() const noexcept override { return step_; }
  bool still() const noexcept override { return effects_.empty(); }
  std::size_t bytes() const noexcept override;

 private:
  VectorXd rotation_force() const;  ///< N, free displacements; forces of the current rotations

  const Solid& solid_;
  Vec3 normal_;
  int iterations_;
  double step_;
  Effects effects_;
  Factor factor_;
  VectorXd u_;     ///< m, all nodes
  VectorXd rest_;  ///< m, the shape at rest, if there are effects
};

}  // namespace tendon::softbody::compared
