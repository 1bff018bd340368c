// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>

#include "clients/softbody/effects/effects.h"
#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/model.h"

namespace tendon::softbody {

/// Linear elasticity, K u = f, at rest: the factor of K is kept, and an answer is one solve. Effects on the whole body
/// add to K and f; an answer is then two solves. Valid for small strains and rotations.
class LinearModel : public Model {
 public:
  /// Starts at rest, under its weight if gravity is simulated. The solid must outlive this object. With `glides`,
  /// answers at rest include Reaction::glide, at the cost of two more solves whenever the patch has moved far enough.
  /// Throws std::invalid_argument if the solid's law is not linear, and std::runtime_error if the solid is not held.
  LinearModel(const Solid& solid, const TouchSurface& surface, const EffectsConfig& effects = {}, bool glides = false);

  Reaction press(const Patch& patch, Given given, double value) override;
  void cut(const Division& division, const EffectsConfig& effects) override;
  void go_on_from(const Model&, std::span<const int>) override {}  // the shape depends on the tool alone
  double step() const noexcept override { return step_; }
  bool still() const noexcept override { return effects_.empty(); }
  bool glides() const noexcept override { return glides_ && step_ == 0; }
  std::size_t bytes() const noexcept override;

  /// Free displacements (m) per newton on the patch.
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
  VectorXd rest_;  ///< m, all nodes: shape at rest; empty without time
  /// For the last patch position at which they were computed, by node: W and the resulting displacements A⁻¹ W. Empty
  /// before.
  MatrixXd slopes_;
  MatrixXd given_way_;
  Mat2 given_ = Mat2::Zero();  ///< Wᵀ A⁻¹ W at that position
};

/// Compliance of a linear solid at `nodes`, m/N: three rows and columns (x, y, z) per node, symmetric, zero for fixed
/// nodes. Costs a factor and three solves per node.
MatrixXd compliance_of(const Solid& solid, const std::vector<int>& nodes);

/// Reaction of a linear body, from the depth of each node of the patch under 1 N on the patch.
Reaction linear_reaction(const Patch& patch, const VectorXd& depth_per_newton, Given given, double value);

/// Adds Reaction::glide, for a patch with curvatures. `giving` is Wᵀ A⁻¹ W without a held depth.
void add_glide(const Patch& patch, const VectorXd& depth_per_newton, const Mat2& giving, Reaction& to);

/// Solves K u = f for a linear body: free forces (N), one column each, to displacements (m).
class Solver {
 public:
  Solver() = default;
  virtual ~Solver() = default;
  Solver(const Solver&) = delete;
  Solver& operator=(const Solver&) = delete;

  virtual MatrixXd solve(const MatrixXd& loads) const = 0;

  /// An approximate solution, with the compliance loadᵀ K⁻¹ load ∈ [compliance, compliance + missing].
  struct Rough {
    VectorXd displacements;  ///< m
    double compliance = 0;   ///< load · displacements plus the residual correction
    double missing = 0;      ///< upper bound
  };
  /// Solves for one load (N). Iterative solvers stop when the force of a press is known to about a thousandth.
  virtual Rough solve_roughly(const VectorXd& load) const;
};
using SolverOf = std::function<std::unique_ptr<Solver>(const Solid&)>;

/// By a Cholesky factor on this machine. Throws std::runtime_error if the solid is not held.
std::unique_ptr<Solver> with_factor(const Solid& solid);

/// G of CondensedModel, m/N, symmetric, in the order of `nodes`. One solve per node.
MatrixXd surface_compliance(const Solid& solid, const Vec3& normal, const std::vector<int>& nodes,
                            const Solver& solver);

/// LinearModel with any Solver, one approximate solve per answer, for bodies that are too large for one machine.
/// Without effects.
///
/// Reaction::error bounds the effect of the approximation on the force F. With compliance c and its uncertainty m, F is
/// at most F m / (c + m) too large, and by Cauchy–Schwarz the slope is off by at most F q √m, where q² = sᵀ K⁻¹ s for
/// the loads s that read the slope. q is computed at `middle`, plus a fifth for other positions.
class SolvedModel : public Model {
 public:
  /// `middle` is a typical patch. The solid must outlive this object.
  SolvedModel(const Solid& solid, const TouchSurface& surface, const Patch& middle, std::unique_ptr<Solver> solver);

  Reaction press(const Patch& patch, Given given, double value) override;
  std::size_t bytes() const noexcept override { return 0; }  // the solver's memory may be on other machines

 private:
  const Solid& solid_;
  Vec3 normal_;
  std::unique_ptr<Solver> solver_;
  double slope_factor_;  ///< q, 1/√(N m)
};

/// LinearModel from a table G of the normal displacement of each touchable node per newton on another (a discrete
/// Green's function; James & Pai 1999). An answer is wᵀ G w over the patch, independent of the size of the body's
/// interior.
class CondensedModel : public Model {
 public:
  /// Computes the table of `nodes` (TouchSurface::nodes_of_patches), one solve per node. Does not keep the solid or the
  /// surface. With `glides`, answers include Reaction::glide.
  CondensedModel(const Solid& solid, const TouchSurface& surface, const std::vector<int>& nodes, bool glides = false);
  /// From a stored table (SurfaceTable) of a mesh with `mesh_nodes` nodes.
  CondensedModel(std::size_t mesh_nodes, std::vector<int> nodes, MatrixXd table, bool glides = false);

  /// Throws std::out_of_range if the patch has a node that is not in the table.
  Reaction press(const Patch& patch, Given given, double value) override;
  bool glides() const noexcept override { return glides_; }
  std::size_t bytes() const noexcept override;

  /// m/N, symmetric, in the order of nodes().
  const MatrixXd& table() const noexcept { return table_; }
  const std::vector<int>& nodes() const noexcept { return nodes_; }

 private:
  /// Wᵀ A⁻¹ W of Reaction::Glide, without a held depth, for the patch of rows_.
  Mat2 giving(const Patch& patch) const;

  std::vector<int> nodes_;
  std::vector<int> row_of_;  ///< by node; −1: not in the table
  MatrixXd table_;
  bool glides_;
  std::vector<int> rows_;  ///< table rows of the current patch
};

}  // namespace tendon::softbody
