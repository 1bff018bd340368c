// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "clients/softbody/effects/effects.h"
#include "clients/softbody/effects/self_collision.h"
#include "clients/softbody/models/model.h"

namespace tendon::softbody {

/// Large rotations and strains, at rest at every instant: Newton's method on the elastic energy, with the tool's depth
/// as a constraint. It begins where the last answer ended. Without inertia: no velocity, no mass. Effects that act on
/// all of the body add their energies; with inertia that is the implicit Euler method, solved to the end.
///
/// A step solves with a factor that is kept from step to step and from answer to answer, and made anew where it no
/// longer serves: a hand moves little between two answers, and a factor costs as much as twenty steps. It is made of
/// the exact second derivative; where that is not positive definite, of the one whose negative eigenvalues are taken
/// out of every point of integration. A line search keeps the energy going down, so that a body that was turned inside
/// out finds its way back (Law::kCorotational), or at least to a rest with every element the right way round: the
/// neo-Hookean energy has others, in which an edge of the body is wound around itself (kNeoHookean).
class QuasiStaticModel : public Model {
 public:
  struct Config {
    int max_iterations = 30;                    ///< of an answer; what is then missing is Reaction::error
    double tolerance = 1e-6;                    ///< of the force, relative
    std::optional<double> self_collision = {};  ///< Pa/m, see there
  };
  /// `elastic` must outlive this. It begins at rest, under its weight if it has any.
  QuasiStaticModel(const Elastic& elastic, const TouchSurface& surface, const Config& config,
                   const EffectsConfig& effects = {});

  Reaction press(const Patch& patch, Given given, double value) override;
  void cut(const Division& division, const EffectsConfig& effects) override;
  double step() const noexcept override { return step_; }
  bool still() const noexcept override { return effects_.empty(); }
  std::size_t bytes() const noexcept override;

  int iterations() const noexcept { return iterations_; }  ///< of the last answer
  int factors() const noexcept { return factors_; }        ///< made since the beginning
  const VectorXd& displacements() const noexcept { return u_; }
  const SelfCollision* self_collision() const noexcept { return self_collision_.get(); }  ///< null: not simulated
  /// Puts the nodes elsewhere, m; the fixed ones too.
  void set_displacements(const VectorXd& u) {
    u_ = u;
    stale_ = true;
  }
  /// Lets go of the tool and finds the shape at rest, or after a step of time. The energy that is left, J.
  double release();

 private:
  struct Step {
    VectorXd by_itself;  ///< K⁻¹(−internal force)
    VectorXd by_tool;    ///< K⁻¹ w
  };
  Elastic::Forces forces() const;
  void stiffness(Elastic::Curvature curvature);
  void factorize();
  void foresee(const VectorXd& internal, const VectorXd& load, Given given, double value);
  MatrixXd solve(const MatrixXd& forces) const;
  Step solve(const VectorXd& internal, const VectorXd& load) const;
  /// Goes along `step` as far as the energy less the tool's work goes down. False when it does not. `now` is what acts
  /// before and after.
  bool go(const VectorXd& step, const VectorXd& load, double force, double slope, Elastic::Forces& now);
  double tangent(const VectorXd& load, const VectorXd& by_tool, const Elastic::Forces& now);
  /// The error, N; with the sides of the body that are next to each other as they were last looked up.
  double newton(const VectorXd& load, Given given, double value, Reaction& reaction);
  /// Looks them up, and goes on until they stay the same. The error, N.
  double part_sides(const VectorXd& load, Given given, double value, Reaction& reaction);

  const Elastic& elastic_;
  Vec3 normal_;
  Config config_;
  SymmetricMatrix stiffness_;
  Factor factor_;
  VectorXd u_;
  double step_;
  Effects effects_;
  std::unique_ptr<SelfCollision> self_collision_;
  VectorXd rest_;  ///< m, all nodes: the shape at rest; empty without time
  int iterations_ = 0;
  int factors_ = 0;
  bool stale_ = true;  ///< the factor no longer serves
};

/// Where a body that nothing touches is at rest, m, all nodes: `loads` counts, what has time does not.
VectorXd shape_at_rest(const Elastic& elastic, const TouchSurface& surface, EffectsConfig loads);

}  // namespace tendon::softbody
