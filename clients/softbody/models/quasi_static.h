// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "clients/softbody/effects/effects.h"
#include "clients/softbody/effects/self_collision.h"
#include "clients/softbody/models/model.h"
#include "clients/softbody/models/pairs.h"

namespace tendon::softbody {

/// Large rotations and strains at rest: Newton's method on the elastic energy with the tool's depth as a constraint,
/// starting from the previous shape. Effects on the whole body add their energies. Without inertia there is no velocity
/// and no mass; with it this is implicit Euler, solved to convergence.
///
/// The factor is kept between steps and answers and corrected by the last eight steps (Pairs). It is recomputed only
/// when it no longer serves, because a factor costs as much as thirty steps. It factors the exact second derivative; if
/// that is not positive definite, negative eigenvalues are removed at every quadrature point. A line search makes every
/// step reduce the energy. An inverted body therefore returns to its shape (Law::kCorotational), or at least comes to
/// rest without inverted elements (kNeoHookean): the neo-Hookean energy has further minima, in which an edge of the
/// body is wound around itself.
class QuasiStaticModel : public Model {
 public:
  struct Config {
    int max_iterations = 30;  ///< per answer; what remains is in Reaction::error, and the next answer continues
    /// Relative to the force: an answer ends when its error is at most this. Force, depth and tilt then include the
    /// step that is no longer taken.
    double tolerance = 1e-6;
    std::optional<double> self_collision = {};  ///< Pa/m: the bed c of SelfCollision
    bool glides = true;                         ///< answers at rest include Reaction::glide
    /// Accepted relative uncertainty of an answer's stiffness, and half of it for the glide. The result is mostly
    /// accurate to its square. Smaller values cost more solves.
    double tangent = 0.02;
  };
  /// Starts at rest, under its weight if gravity is simulated. `elastic` must outlive this object.
  QuasiStaticModel(const Elastic& elastic, const TouchSurface& surface, const Config& config,
                   const EffectsConfig& effects = {});

  Reaction press(const Patch& patch, Given given, double value) override;
  void cut(const Division& division, const EffectsConfig& effects) override;
  /// Keeps its own factor; Pairs starts empty.
  void go_on_from(const Model& before, std::span<const int> node_before) override;
  double step() const noexcept override { return step_; }
  bool still() const noexcept override { return effects_.empty(); }
  bool glides() const noexcept override { return step_ == 0 && config_.glides; }
  std::size_t bytes() const noexcept override;

  int iterations() const noexcept { return iterations_; }  ///< Newton steps in the last answer
  int factors() const noexcept { return factors_; }        ///< made since construction
  const VectorXd& displacements() const noexcept { return u_; }
  const SelfCollision* self_collision() const noexcept { return self_collision_.get(); }  ///< null: not simulated
  /// Takes effect with the next answer.
  void set_max_iterations(int count) { config_.max_iterations = count; }
  /// Sets the displacements of all nodes, including fixed ones, m.
  void set_displacements(const VectorXd& u) {
    u_ = u;
    stale_ = true;
    glided_.reset();
    forget_forces();
  }
  /// For an Elastic whose energy changes at fixed displacements: the next answer sums the forces again.
  void forget_forces() { known_.reset(); }
  /// Removes the tool and finds the shape at rest, or advances one time step. Returns the remaining energy, J.
  double release();

  // For a contact that runs its own solver (RigidContact): the present body without a tool.
  /// Energy and free forces, effects included.
  Elastic::Forces forces() const;
  /// The factor may be that of an earlier shape; renew_factor() factorizes the stiffness of the present one. It returns
  /// false if that is not positive definite and a modified one was used.
  const Factor& factor() const noexcept { return factor_; }
  bool renew_factor() {
    forget_forces();  // they include results of the old factor
    return factorize();
  }
  void move(const VectorXd& free);  ///< free displacements, m

 private:
  struct Step {
    VectorXd by_itself;  ///< H (−internal force), H ≈ inverse stiffness
    VectorXd by_tool;    ///< H w
  };
  void stiffness(Elastic::Curvature curvature);
  bool factorize();
  /// Returns whether sides of the body are, or will be, in contact.
  bool foresee(const VectorXd& internal, const VectorXd& load, Given given, double value);
  Step step_among_sides(const VectorXd& internal, const VectorXd& load) const;
  /// H b; and its part at constant tool depth, by H w.
  VectorXd solve(const VectorXd& b, bool among_sides) const;
  VectorXd solve_at_depth(const VectorXd& b, bool among_sides, const VectorXd& load, const VectorXd& by_tool) const;
  /// Line search along `step` on energy minus tool work. Returns false if there is no decrease. `now` holds the forces
  /// before the call, and those of the new shape after it.
  bool go(const VectorXd& step, const VectorXd& load, double force, double slope, Elastic::Forces& now);
  /// Stiffness times `shape`, N.
  VectorXd needed(const VectorXd& shape, const Elastic::Forces& now);
  struct Tangent;
  void find_shapes(const VectorXd& load, const MatrixXd& slopes, const Tangent& tangent);
  void find_tangent(const VectorXd& load, const Patch* patch, const Tangent& tangent, Reaction& reaction);
  /// Solves with fixed self-contact pairs. Returns the error, N. If the patch has curvatures, sets reaction.glide.
  double newton(const VectorXd& load, const Patch* patch, Given given, double value, Reaction& reaction);
  /// Updates the self-contact pairs and solves again until they no longer change. Returns the error, N.
  double part_sides(const VectorXd& load, const Patch* patch, Given given, double value, Reaction& reaction);

  const Elastic& elastic_;
  Vec3 normal_;
  Config config_;
  SymmetricMatrix stiffness_;
  Factor factor_;
  Pairs pairs_;
  VectorXd u_;
  double step_;
  Effects effects_;
  std::unique_ptr<SelfCollision> self_collision_;
  /// The last computed response to a patch that slides at constant depth: load, force, and a shape (m) for each column
  /// of the load slopes.
  struct Glided {
    VectorXd load;
    double force = 0;
    MatrixXd shapes;
    Mat2 giving;
  };
  std::optional<Glided> glided_;
  VectorXd rest_;  ///< m, all nodes: shape at rest; empty without time
  /// Forces at the end of the last answer, and K₀⁻¹ times them; empty if they are no longer valid.
  struct Known {
    Elastic::Forces forces;
    VectorXd solved;
  };
  std::optional<Known> known_;
  int iterations_ = 0;
  int factors_ = 0;
  int in_vain_ = 0;    ///< iterations since the last accurate answer or new factor
  bool stale_ = true;  ///< the factor is to be recomputed
};

}  // namespace tendon::softbody
