// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "clients/softbody/effects/effects.h"
#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/model.h"

namespace tendon::softbody::compared {

/// Symplectic Euler with lumped masses m. The tool's force F acts on its patch with weights w and keeps the patch at
/// the tool:
///
///     v ← (v + dt (F w − ∂energy/∂u + weight) / m) / (1 + rate dt),   u ← u + dt v
///
/// Solves no system. Stable for dt < 2/ω, where ω is the highest natural frequency at rest; compression raises it.
/// Stores the tensors between nodes for the linear law (tensor-mass method; Cotin, Delingette & Ayache 2000), the shape
/// function gradients at rest for others (TLED; Miller et al. 2007).
class ExplicitModel : public Model {
 public:
  /// Throws std::invalid_argument without `effects.inertia`, with viscosity (which would raise ω; damping does not),
  /// and for a step above `largest_step`. The solid must outlive this object. Starts at rest under gravity, if set.
  ExplicitModel(const Solid& solid, const TouchSurface& surface, const EffectsConfig& effects);

  Reaction press(const Patch& patch, Prescribed given, double value) override;
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
  VectorXd per_mass_;                       ///< 1/kg, all nodes; 0 at fixed nodes
  VectorXd weight_;                         ///< N, for all nodes; empty if there is no gravity
  VectorXd u_;                              ///< m, all nodes
  VectorXd velocity_;                       ///< m/s
  VectorXd rest_;                           ///< m, the shape at rest under gravity, if any
};

/// The stability limit 2/ω at rest, s.
double largest_step(const Elastic& elastic, double density);

}  // namespace tendon::softbody::compared
