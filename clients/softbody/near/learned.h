// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "clients/softbody/fem/kernel.h"
#include "clients/softbody/near/fallback_level.h"
#include "clients/softbody/near/press_grid.h"

namespace tendon::softbody {

/// A reduced model of a nonlinear body under a patch: u = Φ q with shapes Φ, and weights ω > 0 of elements. Energy:
///
///     E(q) = ½ qᵀq + Σ_e ω_e [W_e(Φ_e q) − ½ (Φ_e q)ᵀ K₀ₑ (Φ_e q)],     Φᵀ K₀ Φ = 1
///
/// The linear part is exact, the rest a sum over some elements (An, Kim & James 2008; Farhat, Chapman & Avery 2015).
struct LearnedShapes {
  PressGrid grid;
  std::vector<int> elements{};  ///< ascending
  VectorXd weights{};           ///< ω
  MatrixXd shapes{};    ///< Φ: three rows for each node of the elements; displacements in √m/√N for q in √J
  MatrixXd depths{};    ///< depth per q: a row for each shape, a column for each touchable node
  MatrixXd linear{};    ///< 1 − Σ_e ω_e Φ_eᵀ K₀ₑ Φ_e
  MatrixXd knots{};     ///< q, a column for each knot
  MatrixXd inverses{};  ///< inverse of ∂²E/∂q² for each knot
  std::vector<double> errors{};
};

/// Ignores inaccurate solutions and unstable knots, where ∂²E/∂q² at constant depth is not positive definite.
LearnedShapes learn_shapes(const Solid& solid, const TouchSurface& surface, const SolvedPresses& presses,
                           const Tell& tell);

/// Newton's method for E at constant depth. The initial shape and the inverse of the stiffness, which BFGS updates, are
/// cubic interpolations between knots. The error of the stiffness is the square of the error of the inverse.
/// Thread-safe: yes, after construction. Realtime-safe: no.
class LearnedBody {
 public:
  LearnedBody(const Solid& solid, const TouchSurface& surface, const LearnedShapes& shapes);

  /// The result is empty if Newton's method does not reach the relative error `tolerance`, or if E is not stable.
  std::optional<Reaction> press(const Patch& patch, double depth, const PressGrid::Point& point,
                                double tolerance) const;

  double energy(const VectorXd& q, VectorXd& slope) const;  ///< energy E (J) and its derivative in `slope`
  VectorXd load(const Patch& patch) const;                  ///< depth of the patch per q

  int shapes() const noexcept { return static_cast<int>(shapes_.cols()); }
  std::size_t elements() const noexcept { return static_cast<std::size_t>(kernel_.elements()); }
  std::size_t bytes() const noexcept;

 private:
  MatrixXd depths_below(const Patch& patch) const;

  PressGrid grid_;
  Kernel kernel_;  ///< with moduli times ω
  MatrixXd shapes_;
  MatrixXd depths_;
  std::vector<int> column_of_;
  MatrixXd linear_;
  MatrixXd knots_;
  MatrixXd inverses_;
};

class LearnedLevel : public FallbackLevel {
 public:
  /// `tolerance` is the accepted relative error of the force.
  LearnedLevel(const Solid& solid, const TouchSurface& surface, const LearnedShapes& shapes, double tolerance);

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
