// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "clients/softbody/effects/effects.h"
#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/model.h"

namespace tendon::softbody::compared {

/// Newton's second law in explicit time steps: no system is solved, and an answer is one evaluation of the forces. With
/// lumped masses m, and a force F of the tool on its patch w that keeps the patch at the tool:
///
///     v ← (v + dt (F w − ∂energy/∂u + weight) / m) / (1 + rate dt),   u ← u + dt v
///
/// (symplectic Euler). Stable for dt < 2/ω, where ω is the highest natural frequency of the body at rest; a compressed
/// body has higher ones. For the linear law the model stores the tensors between nodes, which is the tensor-mass method
/// (Cotin, Delingette & Ayache 2000); for the other laws it stores the shape functions' gradients at rest, which is
/// TLED (Miller et al. 2007).
class ExplicitModel : public Model {
 public:
  /// Throws std::invalid_argument without `effects.inertia`, with viscosity (it would make ω larger; damping does not),
  /// and with a step above `largest_step`, naming both. The solid must outlive this. It begins at rest, under its
  /// weight if it has any.
  ExplicitModel(const Solid& solid, const TouchSurface& surface, const EffectsConfig& effects);

  Reaction press(const Patch& patch, Given given, double value) override;
  double step() const noexcept override { return dt_; }
  bool still() const noexcept override { return false; }
  std::size_t bytes() const noexcept override;

  const VectorXd& displacements() const noexcept { return u_; }

 private:
  VectorXd internal() const;  ///< N, ∂energy/∂u, all nodes

  const Solid& solid_;
  Vec3 normal_;
  double dt_;
  double slowing_;                          ///< 1/(1 + rate dt); 1 without damping
  std::optional<SymmetricMatrix> tensors_;  ///< for the linear law only
  VectorXd per_mass_;                       ///< 1/kg, all nodes; 0 where they are held
  VectorXd weight_;                         ///< N, all nodes; empty without gravity
  VectorXd u_;                              ///< m, all nodes
  VectorXd velocity_;                       ///< m/s
  VectorXd rest_;                           ///< m, the shape at rest under the weight; empty without gravity
};

/// 2/ω of the body at rest, s: a longer explicit step is not stable.
double largest_step(const Elastic& elastic, double density);

}  // namespace tendon::softbody::compared
