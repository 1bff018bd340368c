// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "clients/softbody/effects/effects.h"
#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/model.h"

namespace tendon::softbody::compared {

/// Extended position based dynamics with stable Neo-Hookean constraints (Macklin, Müller & Chentanez 2016; Macklin &
/// Müller 2021). Each time step moves the tetrahedra one by one towards
///
///     |F| = 0 with the compliance 1/(µV),   det F = 1 + µ/(λ + µ) with 1/((λ + µ)V)
///
/// and then the patch to its tool. Unconditionally stable but not convergent; the stiffness depends on time step and
/// iterations, with errors from −90 % to +200 %.
class XpbdModel : public Model {
 public:
  /// Throws std::invalid_argument if the mesh is not tetrahedral, if iterations < 1, or if `effects` has no inertia or
  /// has viscosity. The solid must outlive this object.
  XpbdModel(const Solid& solid, const TouchSurface& surface, int iterations, const EffectsConfig& effects);

  Reaction press(const Patch& patch, Prescribed given, double value) override;
  double step() const noexcept override { return dt_; }
  bool still() const noexcept override { return false; }
  std::size_t bytes() const noexcept override;

  const VectorXd& displacements() const noexcept { return u_; }

 private:
  struct Tet {
    std::array<int, 4> nodes;
    Eigen::Matrix<double, 3, 4> gradient;  ///< ∂N/∂X, 1/m
    double volume;                         ///< m³
    double mu;                             ///< Pa
    double both;                           ///< λ + µ, Pa
    double lambda_shape;                   ///< accumulated multipliers of both constraints in this step
    double lambda_volume;
  };
  void relax(Tet& tet);

  Vec3 normal_;
  double dt_;
  int iterations_;
  double slowing_;  ///< 1/(1 + rate dt); 1 without damping
  std::vector<Tet> tets_;
  VectorXd per_mass_;  ///< 1/kg, all nodes; 0 at fixed nodes
  VectorXd u_;         ///< m, all nodes
  VectorXd velocity_;  ///< m/s
  VectorXd fall_;      ///< m/s, the change of the velocity by gravity in a step, if any
  VectorXd rest_;      ///< m, the shape at rest under gravity, if any
};

}  // namespace tendon::softbody::compared
