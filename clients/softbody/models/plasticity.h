// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/quasi_static.h"

namespace tendon::softbody {

/// The stress at which a material begins to keep a dent: von Mises' yield with linear kinematic hardening (Prager). A
/// stretched bar has the modulus E up to `stress` and E·H/(E + H) beyond it. When it is released it has E again, and
/// after 2·`stress` it yields the other way.
struct Yield {
  double stress = 0;     ///< σ, Pa, above 0: yield stress of a bar in tension or compression
  double hardening = 0;  ///< H, Pa, above 0: stress that each unit of plastic strain adds
};

/// Throws std::invalid_argument that names the field.
void check(const Yield& yield);

/// A solid that keeps a plastic strain p, symmetric and traceless, at every point of integration. With the strain ε of
/// its law (linear: sym(F − I); corotational: RᵀF − I, so that p turns with the material) its stress is that of ε − p.
/// A step from the plastic strain p₀ has the energy
///
///     min over p:  Ψ(ε − p) + ⅓ H |p|² + √⅔ σ |p − p₀|
///
/// The three terms are stored elastically, stored by hardening, and lost. The minimum is the radial return (Wilkins
/// 1964; Simo & Hughes 1998, box 3.1). Because a step has an energy (Ortiz & Stainier 1999), Newton's method can search
/// along a line as it does in an elastic body. Until the first yield the forces are bit for bit those of the solid that
/// it was made from.
///
/// Thread-safe: no. Realtime-safe: no.
class PlasticSolid : public Solid {
 public:
  /// Throws std::invalid_argument when the law is neither linear nor corotational, and whatever check() throws.
  PlasticSolid(const Solid& solid, const Yield& yield);

  /// The energy of a step that begins at the u of the last advance().
  double energy(const VectorXd& u) const override { return forces(u).energy; }
  Forces forces(const VectorXd& u) const override;
  void stiffness(const VectorXd& u, Curvature curvature, SymmetricMatrix& to) const override;

  void advance(const VectorXd& u);                    ///< a step ends at u; the next begins there
  bool yielded() const noexcept { return yielded_; }  ///< at any point, at any time
  const Mat3& plastic_strain(int element, int point) const {
    return plastic_[at(element * points_per_element() + point)];
  }

  std::size_t bytes() const noexcept override;

 private:
  struct Flow;
  Flow flow(int element, int point, const Mat3& strain) const;
  Stress flow_at(int element, int point, const Mat3& f) const;  ///< what plastic strain adds to the elastic stress
  Mat9 tangent_at(int element, int point, const Mat3& f) const;

  Yield yield_;
  std::vector<Mat3> plastic_;  ///< p₀ of each point; 0 where only the volumetric part is integrated
  bool yielded_ = false;
};

/// Newton's method on a body that keeps its dents: an answer is a step of loading, of whatever length; where the hand
/// goes on in one direction it does not matter how many there are, to first order of their length where it turns. The
/// stiffness of an answer in which the material yields is that of pressing on; a hand that goes back meets the elastic
/// one, which is stiffer. On a closed way the hand never gets back more than it gave.
///
/// A step that ends after Config::max_iterations leaves its plastic strains where it ended.
class PlasticModel : public Model {
 public:
  /// Throws what PlasticSolid and QuasiStaticModel do. It begins at rest, under its weight if it has any.
  PlasticModel(const Solid& solid, const TouchSurface& surface, const QuasiStaticModel::Config& config,
               const EffectsConfig& effects, const Yield& yield);

  Reaction press(const Patch& patch, Given given, double value) override;
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
