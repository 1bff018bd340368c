// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/quasi_static.h"

namespace tendon::softbody::compared {

/// A spring along every edge of a tetrahedral mesh, with stiffness from the volume around the edge (van Gelder 1998,
/// with the factor that makes a stretched tetrahedron correct). V are the volumes of the tetrahedra at the edge, L its
/// rest length, l its current length:
///
///     energy ½ k (l − L)²,   k = Σ E V / L²
///
/// It has no Poisson ratio and does not resist flattening of a tetrahedron.
class SpringNet : public Elastic {
 public:
  /// `factors`: ratio of each tetrahedron's modulus to `young`; empty: 1. Throws std::invalid_argument if the mesh is
  /// not tetrahedral.
  SpringNet(const Mesh& at_rest, double young, const Fixed& fixed, const std::vector<double>& factors = {});

  double energy(const VectorXd& u) const override;
  Forces forces(const VectorXd& u) const override;
  void stiffness(const VectorXd& u, Curvature curvature, SymmetricMatrix& to) const override;
  std::size_t bytes() const noexcept override;

  std::size_t springs() const noexcept { return springs_.size(); }

 private:
  struct Spring {
    int a;
    int b;
    double length;     ///< m, at rest
    double stiffness;  ///< N/m
  };
  Vec3 along(const Spring& spring, const VectorXd& u) const;

  std::vector<Spring> springs_;
  std::vector<int> slots_;  ///< target of each entry of a spring's 6 × 6 matrix; −1: none
};

/// Quasi-static or dynamic, by the Newton method of the finite elements.
class MassSpringModel : public Model {
 public:
  MassSpringModel(const Solid& solid, const TouchSurface& surface, const QuasiStaticModel::Config& config,
                  const EffectsConfig& effects = {});

  Reaction press(const Patch& patch, Prescribed given, double value) override {
    return newton_.press(patch, given, value);
  }
  double step() const noexcept override { return newton_.step(); }
  bool still() const noexcept override { return newton_.still(); }
  bool glides() const noexcept override { return newton_.glides(); }
  std::size_t bytes() const noexcept override { return springs_.bytes() + newton_.bytes(); }

 private:
  SpringNet springs_;
  QuasiStaticModel newton_;
};

}  // namespace tendon::softbody::compared
