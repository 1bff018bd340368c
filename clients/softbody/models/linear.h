// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>

#include "clients/softbody/effects/effects.h"
#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/model.h"

namespace tendon::softbody {

/// Linear elasticity, K u = f, for small strains and rotations. An answer is one solve with the factor of K. Effects on
/// the whole body change K and f, and an answer is then two solves.
class LinearModel : public Model {
 public:
  /// Starts at rest with gravity. If `glides` is true, answers at rest contain Reaction::glide. `solid` must outlive
  /// this object. Throws std::invalid_argument if its law is not linear, and std::runtime_error if it is not held.
  LinearModel(const Solid& solid, const TouchSurface& surface, const EffectsConfig& effects = {}, bool glides = false);

  Reaction press(const Patch& patch, Prescribed given, double value) override;
  void cut(const Division& division, const EffectsConfig& effects) override;
  void go_on_from(const Model&, std::span<const int>) override {}
  double step() const noexcept override { return step_; }
  bool still() const noexcept override { return effects_.empty(); }
  bool glides() const noexcept override { return glides_ && step_ == 0; }
  std::size_t bytes() const noexcept override;

  VectorXd displacements(const Patch& patch) const;  ///< free displacements (m) for 1 N on the patch

 private:
  Mat2 giving(const Patch& patch);
  void glide_from(const Patch& patch);
  Reaction press_among_effects(const Patch& patch, Prescribed given, double value);
  VectorXd untouched() const;

  const Solid& solid_;
  Vec3 normal_;
  Factor factor_;
  double step_;
  bool glides_;
  Effects effects_;
  VectorXd rest_;  ///< m, all nodes
  /// W and A⁻¹ W by node, for the last patch position for which they were computed.
  MatrixXd slopes_;
  MatrixXd given_way_;
  Mat2 given_ = Mat2::Zero();  ///< Wᵀ A⁻¹ W
};

/// Returns the compliance of `nodes` (m/N), with three rows and columns for each node. It is symmetric, and zero for
/// fixed nodes. This needs a factor, and three solves for each node.
MatrixXd compliance_of(const Solid& solid, const std::vector<int>& nodes);

/// Returns the reaction of a linear body. `depth_per_newton` is the depth of each node for 1 N on the patch.
Reaction linear_reaction(const Patch& patch, const VectorXd& depth_per_newton, Prescribed given, double value);

/// Adds Reaction::glide. The patch must have curvatures.
void add_glide(const Patch& patch, const VectorXd& depth_per_newton, const Mat2& giving, Reaction& to);

/// Solves K u = f for free forces (N, one column each) and returns the displacements (m).
class Solver {
 public:
  Solver() = default;
  virtual ~Solver() = default;
  Solver(const Solver&) = delete;
  Solver& operator=(const Solver&) = delete;

  virtual MatrixXd solve(const MatrixXd& loads) const = 0;

  /// The compliance loadᵀ K⁻¹ load is between `compliance` and `compliance + missing`.
  struct Rough {
    VectorXd displacements;  ///< m
    double compliance = 0;
    double missing = 0;
  };
  /// Solves for one load (N). An iterative solver stops when the relative error of the force is about 1e-3.
  virtual Rough solve_roughly(const VectorXd& load) const;
};
using SolverOf = std::function<std::unique_ptr<Solver>(const Solid&)>;

std::unique_ptr<Solver> with_factor(const Solid& solid);  ///< throws std::runtime_error if the solid is not held

/// Returns the table G of CondensedModel (m/N) with one solve for each node.
MatrixXd surface_compliance(const Solid& solid, const Vec3& normal, const std::vector<int>& nodes,
                            const Solver& solver);

/// A linear model without effects that uses a Solver: each answer is one approximate solve. Reaction::error covers the
/// error of the solve. If the compliance c has the uncertainty m, the force F is too large by at most F m / (c + m). By
/// the Cauchy–Schwarz inequality, the error of the slope is at most F q √m, where q² = sᵀ K⁻¹ s for the loads s that
/// read the slope. q is computed at `middle` and increased by a fifth for other positions.
class SolvedModel : public Model {
 public:
  /// The solid must outlive this object.
  SolvedModel(const Solid& solid, const TouchSurface& surface, const Patch& middle, std::unique_ptr<Solver> solver);

  Reaction press(const Patch& patch, Prescribed given, double value) override;
  std::size_t bytes() const noexcept override { return 0; }

 private:
  const Solid& solid_;
  Vec3 normal_;
  std::unique_ptr<Solver> solver_;
  double slope_factor_;  ///< q, 1/√(N m)
};

/// A linear model that uses a table G: the normal displacement of each touchable node for 1 N on each other node (a
/// discrete Green's function; James & Pai 1999). An answer is wᵀ G w over the patch.
class CondensedModel : public Model {
 public:
  /// Computes the table with one solve for each node. If `glides` is true, an answer contains Reaction::glide.
  CondensedModel(const Solid& solid, const TouchSurface& surface, const std::vector<int>& nodes, bool glides = false);
  /// Uses a stored table (SurfaceTable).
  CondensedModel(std::size_t mesh_nodes, std::vector<int> nodes, MatrixXd table, bool glides = false);

  /// Throws std::out_of_range if a node of the patch is not in the table.
  Reaction press(const Patch& patch, Prescribed given, double value) override;
  bool glides() const noexcept override { return glides_; }
  std::size_t bytes() const noexcept override;

  const MatrixXd& table() const noexcept { return table_; }  ///< m/N, symmetric, in the order of nodes()
  const std::vector<int>& nodes() const noexcept { return nodes_; }

 private:
  Mat2 giving(const Patch& patch) const;

  std::vector<int> nodes_;
  std::vector<int> row_of_;
  MatrixXd table_;
  bool glides_;
  std::vector<int> rows_;
};

}  // namespace tendon::softbody
