// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "clients/softbody/effects/effects.h"
#include "clients/softbody/effects/self_collision.h"
#include "clients/softbody/models/model.h"
#include "clients/softbody/models/pairs.h"

namespace tendon::softbody {

/// Large rotations and strains, at rest at every instant: Newton's method on the elastic energy, with the tool's depth
/// as a constraint. It begins with the shape of the last answer. Without the effect inertia there is no velocity and no
/// mass. Effects that act on the whole body add their energies; with inertia this is the implicit Euler method, solved
/// to convergence.
///
/// The factor is kept from step to step and from answer to answer, and brought along by what the last eight steps taught
/// (Pairs). It is made anew only when it no longer serves: a factor costs as much as thirty steps. It is the factor of
/// the exact second derivative; where that is not positive definite, the negative eigenvalues are removed at every point
/// of integration. A line search makes the energy fall in every step. So a body that was turned inside out returns to its shape
/// (Law::kCorotational), or at least comes to rest with no element inverted (kNeoHookean): the neo-Hookean energy has
/// further minima, in which an edge of the body is wound around itself.
class QuasiStaticModel : public Model {
 public:
  struct Config {
    int max_iterations = 30;  ///< for an answer; the rest is in Reaction::error, and the next answer goes on
    /// Of the force, relative: an answer ends when its error is at most so large. Force, depth and tilt are then those of
    /// the step that it does not take any more.
    double tolerance = 1e-6;
    std::optional<double> self_collision = {};  ///< Pa/m: the bed c of SelfCollision
    bool glides = true;                         ///< an answer at rest has its Glide
    /// By how large a share of itself the stiffness of an answer may be doubtful, and its glide by half of this. The answer
    /// is then mostly right to the square of it. A smaller share costs solutions with the factor.
    double tangent = 0.02;
  };
  /// `elastic` must outlive this. It begins at rest, under its weight if it has any.
  QuasiStaticModel(const Elastic& elastic, const TouchSurface& surface, const Config& config,
                   const EffectsConfig& effects = {});

  Reaction press(const Patch& patch, Given given, double value) override;
  void cut(const Division& division, const EffectsConfig& effects) override;
  /// Keeps its own factor, and what steps taught is learned anew.
  void go_on_from(const Model& before, std::span<const int> node_before) override;
  double step() const noexcept override { return step_; }
  bool still() const noexcept override { return effects_.empty(); }
  bool glides() const noexcept override { return step_ == 0 && config_.glides; }
  std::size_t bytes() const noexcept override;

  int iterations() const noexcept { return iterations_; }  ///< in the last answer
  int factors() const noexcept { return factors_; }        ///< made since construction
  const VectorXd& displacements() const noexcept { return u_; }
  const SelfCollision* self_collision() const noexcept { return self_collision_.get(); }  ///< null: not simulated
  /// For the answers from now on.
  void set_max_iterations(int count) { config_.max_iterations = count; }
  /// Puts the nodes elsewhere, m; the fixed ones too.
  void set_displacements(const VectorXd& u) {
    u_ = u;
    stale_ = true;
    glided_.reset();
    forget_forces();
  }
  /// For an Elastic that changes without moving: the forces are summed anew in the next answer.
  void forget_forces() { known_.reset(); }
  /// Takes the tool away and finds the shape at rest, or after one step of time. Returns the remaining energy, J.
  double release();

  // For a contact that solves for itself (RigidContact): the body as it lies, without a tool.
  /// Energy, and the forces on free displacements, effects included.
  Elastic::Forces forces() const;
  /// The stiffness with which `factor` was made is an earlier shape's; renew_factor() makes it that of this shape. False
  /// where that is not positive definite, and another stands in for it.
  const Factor& factor() const noexcept { return factor_; }
  bool renew_factor() {
    forget_forces();  // what the older factor made of them is forgotten with them
    return factorize();
  }
  void move(const VectorXd& free);  ///< by so much, m

 private:
  struct Step {
    VectorXd by_itself;  ///< H(−internal force), with H the inverse of the stiffness, nearly
    VectorXd by_tool;    ///< H w
  };
  void stiffness(Elastic::Curvature curvature);
  bool factorize();
  /// Whether sides will push each other, or do.
  bool foresee(const VectorXd& internal, const VectorXd& load, Given given, double value);
  Step step_among_sides(const VectorXd& internal, const VectorXd& load) const;
  /// H b, and what of it keeps the tool's depth, by H w.
  VectorXd solve(const VectorXd& b, bool among_sides) const;
  VectorXd solve_at_depth(const VectorXd& b, bool among_sides, const VectorXd& load, const VectorXd& by_tool) const;
  /// Goes along `step` as far as the energy minus the tool's work falls. False when it does not fall. `now` has the
  /// forces before the call, and those of the new shape after it.
  bool go(const VectorXd& step, const VectorXd& load, double force, double slope, Elastic::Forces& now);
  /// The stiffness times `shape`, N.
  VectorXd needed(const VectorXd& shape, const Elastic::Forces& now);
  struct Tangent;
  void find_shapes(const VectorXd& load, const MatrixXd& slopes, const Tangent& tangent);
  void find_tangent(const VectorXd& load, const Patch* patch, const Tangent& tangent, Reaction& reaction);
  /// Solves with the neighbouring sides of the body as they were last looked up. Returns the error, N. With a patch
  /// that has its curvatures the reaction has its glide.
  double newton(const VectorXd& load, const Patch* patch, Given given, double value, Reaction& reaction);
  /// Looks up the neighbouring sides and solves again, until they stay the same. Returns the error, N.
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
  /// How the body gives way to a patch that glides at a held depth, as it was last found: the load then, the force, and
  /// a shape (m) for each column of the load's slopes.
  struct Glided {
    VectorXd load;
    double force = 0;
    MatrixXd shapes;
    Mat2 giving;
  };
  std::optional<Glided> glided_;
  VectorXd rest_;  ///< m, all nodes: the shape at rest; empty without time
  /// The forces where the last answer ended, and what the factor makes of them; empty where they do not last.
  struct Known {
    Elastic::Forces forces;
    VectorXd solved;
  };
  std::optional<Known> known_;
  int iterations_ = 0;
  int factors_ = 0;
  int in_vain_ = 0;    ///< iterations since an answer was good enough, or the factor new
  bool stale_ = true;  ///< the factor no longer serves
};

}  // namespace tendon::softbody
