// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/quasi_static.h"

namespace tendon::softbody::compared {

/// A spring along every edge of a mesh of tetrahedra. Its stiffness follows the volume around the edge (van Gelder
/// 1998, with the factor that makes a stretched tetrahedron correct). V are the volumes of the tetrahedra that share
/// the edge, L is its length at rest, l its present length:
///
///     energy ½ k (l − L)²,   k = Σ E V / L²
///
/// It has no Poisson ratio, and nothing keeps a tetrahedron from being pressed flat. It is here for comparison.
class SpringNet : public Elastic {
 public:
  /// `factors`: by how much the modulus of each tetrahedron is larger than `young`; empty: 1. Throws
  /// std::invalid_argument when the mesh is not of tetrahedra.
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
  std::vector<int> slots_;  ///< where each entry of a spring's 6 × 6 matrix goes; −1: nowhere
};

/// The springs, at rest at every instant or with effects, solved by the same Newton's method as the finite elements.
class MassSpringModel : public Model {
 public:
  /// Takes the mesh and Young's modulus from the solid; does not keep the solid.
  MassSpringModel(const Solid& solid, const TouchSurface& surface, const QuasiStaticModel::Config& config,
                  const EffectsConfig& effects = {});

  Reaction press(const Patch& patch, Given given, double value) override { return newton_.press(patch, given, value); }
  double step() const noexcept override { return newton_.step(); }
  bool still() const noexcept override { return newton_.still(); }
  bool glides() const noexcept override { return newton_.glides(); }
  std::size_t bytes() const noexcept override { return springs_.bytes() + newton_.bytes(); }

 private:
  SpringNet springs_;
  QuasiStaticModel newton_;
};

}  // namespace tendon::softbody::compared
