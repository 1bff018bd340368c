// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>

#include "clients/softbody/effects/effects.h"
#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/model.h"

namespace tendon::softbody {

/// Linear elasticity, K u = f, at rest at every instant: the factor of K is kept, and an answer is one solution with
/// it. Effects that act on the whole body add to K and f; an answer is then two solutions. Valid for small strains and
/// rotations.
class LinearModel : public Model {
 public:
  /// Throws std::invalid_argument when the solid's law is not linear, std::runtime_error when it is not held fast. The
  /// solid must outlive this. It begins at rest, under its weight if it has any. With `glides` an answer at rest has its
  /// Glide, by two more solutions in one answer of many.
  LinearModel(const Solid& solid, const TouchSurface& surface, const EffectsConfig& effects = {}, bool glides = false);

  Reaction press(const Patch& patch, Given given, double value) override;
  void cut(const Division& division, const EffectsConfig& effects) override;
  double step() const noexcept override { return step_; }
  bool still() const noexcept override { return effects_.empty(); }
  bool glides() const noexcept override { return glides_ && step_ == 0; }
  std::size_t bytes() const noexcept override;

  /// The displacements (m, free ones) that 1 N on the patch adds.
  VectorXd displacements(const Patch& patch) const;

 private:
  /// Wᵀ A⁻¹ W of Reaction::Glide, without a held depth.
  Mat2 giving(const Patch& patch);
  void glide_from(const Patch& patch);
  Reaction press_among_effects(const Patch& patch, Given given, double value);
  VectorXd untouched() const;

  const Solid& solid_;
  Vec3 normal_;
  Factor factor_;
  double step_;
  bool glides_;
  Effects effects_;
  VectorXd rest_;  ///< m, all nodes: the shape at rest; empty without time
  /// Of a place where the patch has been, by node: W, and what it makes the surface give way, A⁻¹ W. Empty where none are
  /// known.
  MatrixXd slopes_;
  MatrixXd given_way_;
  Mat2 given_ = Mat2::Zero();  ///< Wᵀ A⁻¹ W there
};

/// How a linear solid gives way where single nodes are pushed: the compliance (m/N) of `nodes`, three rows and columns
/// for each (x, y, z), symmetric; zeros where a node is held. It costs a factor and three solutions for each node.
MatrixXd compliance_of(const Solid& solid, const std::vector<int>& nodes);

/// The reaction of a linear body, from the depth of each node of the patch under 1 N on the patch.
Reaction linear_reaction(const Patch& patch, const VectorXd& depth_per_newton, Given given, double value);

/// The reaction's Glide, for a patch that has its curvatures; the same depths, and Wᵀ A⁻¹ W without a held depth.
void add_glide(const Patch& patch, const VectorXd& depth_per_newton, const Mat2& giving, Reaction& to);

/// K u = f of a linear body: forces on its free components (N; a column each) to their displacements (m).
class Solver {
 public:
  Solver() = default;
  virtual ~Solver() = default;
  Solver(const Solver&) = delete;
  Solver& operator=(const Solver&) = delete;

  virtual MatrixXd solve(const MatrixXd& loads) const = 0;

  /// A solution that may be rough. The compliance under `load` is loadᵀ K⁻¹ load ∈ [compliance, compliance + missing].
  struct Rough {
    VectorXd displacements;  ///< m
    double compliance = 0;   ///< load · displacements, and what the residual says of the rest
    double missing = 0;      ///< a bound
  };
  /// One load (N). A solver that iterates stops when the force of a press is known to about a thousandth.
  virtual Rough solve_roughly(const VectorXd& load) const;
};
using SolverOf = std::function<std::unique_ptr<Solver>(const Solid&)>;

/// By a Cholesky factor on this machine. Throws std::runtime_error when the solid is not held fast.
std::unique_ptr<Solver> with_factor(const Solid& solid);

/// G of CondensedModel, m/N, symmetric: rows and columns in the order of `nodes`. One solution for each node.
MatrixXd surface_compliance(const Solid& solid, const Vec3& normal, const std::vector<int>& nodes,
                            const Solver& solver);

/// The answers of LinearModel by a Solver, one rough solution each, for a body that is too large for one machine. No
/// effects.
///
/// Reaction::error covers what the roughness leaves of the force F. With c the compliance and m what may be missing of
/// it, F is at most F m / (c + m) too large, and by Cauchy and Schwarz the slope is off by at most F q √m, where q² is
/// sᵀ K⁻¹ s for the loads s that read the slope: taken at the middle, a fifth more for other places.
class SolvedModel : public Model {
 public:
  /// `middle` is a patch like those to come. The solid must outlive this.
  SolvedModel(const Solid& solid, const TouchSurface& surface, const Patch& middle, std::unique_ptr<Solver> solver);

  Reaction press(const Patch& patch, Given given, double value) override;
  std::size_t bytes() const noexcept override { return 0; }  // the solver's, which may be elsewhere

 private:
  const Solid& solid_;
  Vec3 normal_;
  std::unique_ptr<Solver> solver_;
  double slope_factor_;  ///< q, 1/√(N m)
};

/// The same answers from a table G: how far each touchable node gives way along the normal when another node is pushed
/// with 1 N (a discrete Green's function; James & Pai 1999). An answer is wᵀ G w over the patch, so the inside of the
/// body costs no time.
class CondensedModel : public Model {
 public:
  /// Makes the table of `nodes` (TouchSurface::nodes_of_patches), by one solution for each. Keeps neither the solid nor
  /// the surface. With `glides` an answer has its Glide.
  CondensedModel(const Solid& solid, const TouchSurface& surface, const std::vector<int>& nodes, bool glides = false);
  /// From a table that was made before, of a mesh with so many nodes (SurfaceTable).
  CondensedModel(std::size_t mesh_nodes, std::vector<int> nodes, MatrixXd table, bool glides = false);

  /// Throws std::out_of_range when the patch has a node that is not in the table.
  Reaction press(const Patch& patch, Given given, double value) override;
  bool glides() const noexcept override { return glides_; }
  std::size_t bytes() const noexcept override;

  /// m/N, symmetric: rows and columns in the order of `nodes`.
  const MatrixXd& table() const noexcept { return table_; }
  const std::vector<int>& nodes() const noexcept { return nodes_; }

 private:
  /// Wᵀ A⁻¹ W of Reaction::Glide for the patch whose rows are known, without a held depth.
  Mat2 giving(const Patch& patch) const;

  std::vector<int> nodes_;
  std::vector<int> row_of_;  ///< by node; −1 = not in the table
  MatrixXd table_;
  bool glides_;
  std::vector<int> rows_;  ///< rows of the present patch
};

}  // namespace tendon::softbody
