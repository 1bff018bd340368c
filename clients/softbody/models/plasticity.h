// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/quasi_static.h"

namespace tendon::softbody {

/// Von Mises plasticity with linear kinematic hardening (Prager). The modulus of a bar is E up to `stress`, and E·H/(E
/// + H) above it. If the bar is released, the modulus is E again up to a change of 2·`stress`.
struct Yield {
  double stress = 0;     ///< σ, Pa
  double hardening = 0;  ///< H, Pa
};

void check(const Yield& yield);  ///< throws std::invalid_argument with the name of an invalid field

/// A solid with a plastic strain p, symmetric and traceless, at every quadrature point. With ε the strain of its law
/// (linear: sym(F − I); corotational: RᵀF − I, so p rotates with the material) its stress is that of ε − p. A step from
/// the plastic strain p₀ has the energy
///
///     min over p:  Ψ(ε − p) + ⅓ H |p|² + √⅔ σ |p − p₀|
///
/// The terms are elasticity, hardening and dissipation. The minimum is the radial return (Wilkins 1964; Simo & Hughes
/// 1998, box 3.1). Because a step has an energy (Ortiz & Stainier 1999), Newton's method can use a line search as for
/// an elastic body. Before the first yield the forces are bit-identical to those of the original solid.
///
/// Thread-safe: no. Realtime-safe: no.
class PlasticSolid : public Solid {
 public:
  /// Throws std::invalid_argument if the law is neither linear nor corotational, and the errors of check().
  PlasticSolid(const Solid& solid, const Yield& yield);

  double energy(const VectorXd& u) const override { return forces(u).energy; }
  Forces forces(const VectorXd& u) const override;
  void stiffness(const VectorXd& u, Curvature curvature, SymmetricMatrix& to) const override;

  void advance(const VectorXd& u);  ///< ends the step at u
  bool yielded() const noexcept { return yielded_; }
  const Mat3& plastic_strain(int element, int point) const {
    return plastic_[at(element * points_per_element() + point)];
  }

  std::size_t bytes() const noexcept override;

 private:
  struct Flow;
  Flow flow(int element, int point, const Mat3& strain) const;
  Stress flow_at(int element, int point, const Mat3& f) const;
  Mat9 tangent_at(int element, int point, const Mat3& f) const;

  Yield yield_;
  std::vector<Mat3> plastic_;  ///< p₀ of each point
  bool yielded_ = false;
};

/// Newton's method on a plastic body. Each answer is one load step, and its plastic strains are kept even if it does
/// not converge. The stiffness of a yielding body is that of loading. On a closed path the hand never gains energy.
class PlasticModel : public Model {
 public:
  /// The initial shape is the shape at rest with gravity. Throws the errors of PlasticSolid and QuasiStaticModel.
  PlasticModel(const Solid& solid, const TouchSurface& surface, const QuasiStaticModel::Config& config,
               const EffectsConfig& effects, const Yield& yield);

  Reaction press(const Patch& patch, Prescribed given, double value) override;
  bool still() const noexcept override { return model_.still() && !solid_.yielded(); }
  bool glides() const noexcept override { return model_.glides(); }
  std::size_t bytes() const noexcept override { return solid_.bytes() + model_.bytes(); }

  const PlasticSolid& solid() const noexcept { return solid_; }
  const VectorXd& displacements() const noexcept { return model_.displacements(); }

 private:
  PlasticSolid solid_;
  QuasiStaticModel model_;
};

}  // namespace tendon::softbody
