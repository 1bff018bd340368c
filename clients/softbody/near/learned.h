// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "clients/softbody/fem/kernel.h"
#include "clients/softbody/near/press_grid.h"
#include "clients/softbody/near/rung.h"

namespace tendon::softbody {

/// What a nonlinear body's shapes under a patch have in common, as plain values: few shapes Φ, so that u = Φ q, and few
/// elements with weights ω > 0. The reduced energy is
///
///     E(q) = ½ qᵀq + Σ_e ω_e [W_e(Φ_e q) − ½ (Φ_e q)ᵀ K₀ₑ (Φ_e q)],     Φᵀ K₀ Φ = 1
///
/// Its linear part is that of all elements, and only what the law adds to it is summed over few (An, Kim & James 2008;
/// Farhat, Chapman & Avery 2015, for all of the force).
struct LearnedShapes {
  PressGrid grid;
  std::vector<int> elements{};  ///< ascending
  VectorXd weights{};           ///< ω
  MatrixXd shapes{};    ///< Φ: three rows for each node of the elements, ascending; √m/√N, displacements for √J
  MatrixXd depths{};    ///< a row for each shape, a column for each touchable node, ascending: how deep it makes it
  MatrixXd linear{};    ///< 1 − Σ_e ω_e Φ_eᵀ K₀ₑ Φ_e
  MatrixXd knots{};     ///< a column q for each knot of the grid
  MatrixXd inverses{};  ///< for each knot r columns: the inverse of E's second derivative there
  std::vector<double> errors{};  ///< Trust::errors()
};

/// Learns from `presses`. A shape whose solution is not good enough is left out; so is a knot where E is not stable at a
/// held depth (its second derivative there has an eigenvalue that is not above 0).
LearnedShapes learn_shapes(const Solid& solid, const TouchSurface& surface, const SolvedPresses& presses,
                           const Tell& tell);

/// The body as these shapes have it: Newton's method on E, with the depth held. It begins at the cubic between the shapes at
/// the knots around, with the inverse of the stiffness between theirs, which steps improve (BFGS), and a line search makes
/// the energy fall in every step. The stiffness is exact to the second order of what is wrong in that inverse.
///
/// Thread-safe: yes, once built. Realtime-safe: no.
class LearnedBody {
 public:
  LearnedBody(const Solid& solid, const TouchSurface& surface, const LearnedShapes& shapes);

  /// Empty where Newton's method does not come to the share `tolerance` of the force, or E is not stable there.
  std::optional<Reaction> press(const Patch& patch, double depth, const PressGrid::Point& point,
                                double tolerance) const;

  /// ½ … of above, J, and its derivative.
  double energy(const VectorXd& q, VectorXd& slope) const;
  /// How deep q's units make the patch: its load on q.
  VectorXd load(const Patch& patch) const;

  int shapes() const noexcept { return static_cast<int>(shapes_.cols()); }
  std::size_t elements() const noexcept { return static_cast<std::size_t>(kernel_.elements()); }
  std::size_t bytes() const noexcept;

 private:
  MatrixXd depths_below(const Patch& patch) const;

  PressGrid grid_;
  Kernel kernel_;  ///< of the elements, ω times as stiff
  MatrixXd shapes_;
  MatrixXd depths_;
  std::vector<int> column_of_;  ///< of `depths_`, by node of the mesh
  MatrixXd linear_;
  MatrixXd knots_;
  MatrixXd inverses_;
};

/// LearnedBody where its errors allow it.
class LearnedRung : public Rung {
 public:
  /// `tolerance`: by how large a share of the force an answer may be wrong.
  LearnedRung(const Solid& solid, const TouchSurface& surface, const LearnedShapes& shapes, double tolerance);

  std::optional<Answer> press(const Patch& patch, double depth) const override;
  double room(const Vec2& middle, double depth) const override;
  Size size() const override;

 private:
  LearnedBody body_;
  Trust trust_;
  Trust::Allowed allowed_;
  double tolerance_;
};

}  // namespace tendon::softbody
