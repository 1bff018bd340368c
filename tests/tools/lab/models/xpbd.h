// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "clients/softbody/effects/effects.h"
#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/model.h"

namespace tendon::softbody::compared {

/// Extended position based dynamics with the stable Neo-Hookean constraints (Macklin, Müller & Chentanez 2016; Macklin
/// & Müller 2021). In every time step each tetrahedron in turn is moved towards
///
///     |F| = 0 with the compliance 1/(µV),   det F = 1 + µ/(λ + µ) with 1/((λ + µ)V)
///
/// and then the patch to its tool. It is never unstable and never converges: the stiffness depends on the time step and
/// the iterations, and is wrong by −90 % to +200 %. It is here for comparison.
class XpbdModel : public Model {
 public:
  /// Throws std::invalid_argument when the mesh is not of tetrahedra, when iterations < 1, without `effects.inertia`,
  /// or with viscosity. The solid must outlive this.
  XpbdModel(const Solid& solid, const TouchSurface& surface, int iterations, const EffectsConfig& effects);

  Reaction press(const Patch& patch, Given given, double value) override;
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
    double lambda_shape;                   ///< multipliers that the two constraints have gathered in this step
    double lambda_volume;
  };
  void relax(Tet& tet);

  Vec3 normal_;
  double dt_;
  int iterations_;
  double slowing_;  ///< 1/(1 + rate dt); 1 without damping
  std::vector<Tet> tets_;
  VectorXd per_mass_;  ///< 1/kg, all nodes; 0 where they are held
  VectorXd u_;         ///< m, all nodes
  VectorXd velocity_;  ///< m/s
  VectorXd fall_;      ///< m/s, the velocity that the weight adds in a step; empty without gravity
  VectorXd rest_;      ///< m, the shape at rest under the weight; empty without gravity
};

}  // namespace tendon::softbody::compared
