// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "clients/softbody/effects/effects.h"
#include "clients/softbody/effects/self_collision.h"
#include "clients/softbody/models/model.h"
#include "clients/softbody/models/pairs.h"

namespace tendon::softbody {

/// Newton's method on the elastic energy, for large rotations and strains, from the shape of the last answer. The depth
/// of the tool is a constraint. With inertia this is implicit Euler; otherwise there is no velocity and no mass.
///
/// The factor is used for several answers and is corrected by the last eight steps (Pairs), because a new factor needs
/// the time of thirty steps. If the stiffness is not positive definite, the negative eigenvalues are removed at each
/// quadrature point. Each step reduces the energy, so an inverted body returns to its shape (kCorotational), or to a
/// shape without inverted elements (kNeoHookean, whose energy has other minima).
class QuasiStaticModel : public Model {
 public:
  struct Config {
    int max_iterations = 30;  ///< for each answer; Reaction::error contains the rest
    /// The relative error of the force at which an answer is complete. Force, depth and slope then include one more
    /// step, which does not change the shape.
    double tolerance = 1e-6;
    std::optional<double> self_collision = {};  ///< Pa/m, c of SelfCollision
    bool glides = true;
    double tangent = 0.02;  ///< accepted relative uncertainty of the stiffness, whose error is usually the square of it
  };
  /// The initial shape is the shape at rest with gravity. `elastic` must outlive this object.
  QuasiStaticModel(const Elastic& elastic, const TouchSurface& surface, const Config& config,
                   const EffectsConfig& effects = {});

  Reaction press(const Patch& patch, Prescribed given, double value) override;
  void cut(const Division& division, const EffectsConfig& effects) override;
  void go_on_from(const Model& before, std::span<const int> node_before) override;
  double step() const noexcept override { return step_; }
  bool still() const noexcept override { return effects_.empty(); }
  bool glides() const noexcept override { return step_ == 0 && config_.glides; }
  std::size_t bytes() const noexcept override;

  int iterations() const noexcept { return iterations_; }  ///< in the last answer
  int factors() const noexcept { return factors_; }
  const VectorXd& displacements() const noexcept { return u_; }
  const SelfCollision* self_collision() const noexcept { return self_collision_.get(); }
  void set_max_iterations(int count) { config_.max_iterations = count; }
  /// Sets the displacements of all nodes (m), including fixed ones.
  void set_displacements(const VectorXd& u) {
    u_ = u;
    stale_ = true;
    glided_.reset();
    forget_forces();
  }
  void forget_forces() { known_.reset(); }  ///< must be called if `elastic` has changed
  double release();  ///< removes the tool and finds rest, or takes one time step; returns the remaining energy (J)

  // For RigidContact: the energy and the free forces without a tool.
  Elastic::Forces forces() const;
  /// The factor may belong to an earlier shape. renew_factor() returns false if the stiffness is not positive definite;
  /// the factor is then that of a modified stiffness.
  const Factor& factor() const noexcept { return factor_; }
  bool renew_factor() {
    forget_forces();
    return factorize();
  }
  void move(const VectorXd& free);  ///< m, free displacements

 private:
  struct Step {
    VectorXd by_itself;  ///< H (−internal force)
    VectorXd by_tool;    ///< H w
  };
  void stiffness(Elastic::Curvature curvature);
  bool factorize();
  /// Returns true if two sides of the body will be in contact.
  bool foresee(const VectorXd& internal, const VectorXd& load, Prescribed given, double value);
  Step step_among_sides(const VectorXd& internal, const VectorXd& load) const;
  VectorXd solve(const VectorXd& b, bool among_sides) const;
  VectorXd solve_at_depth(const VectorXd& b, bool among_sides, const VectorXd& load, const VectorXd& by_tool) const;
  /// The line search. Returns false if the energy does not decrease. `now` is updated to the new shape.
  bool go(const VectorXd& step, const VectorXd& load, double force, double slope, Elastic::Forces& now);
  VectorXd needed(const VectorXd& shape, const Elastic::Forces& now);
  struct Tangent;
  void find_shapes(const VectorXd& load, const MatrixXd& slopes, const Tangent& tangent);
  void find_tangent(const VectorXd& load, const Patch* patch, const Tangent& tangent, Reaction& reaction);
  /// Solves for fixed pairs of sides. Returns the error (N).
  double newton(const VectorXd& load, const Patch* patch, Prescribed given, double value, Reaction& reaction);
  /// Solves and updates the pairs of sides until they do not change. Returns the error (N).
  double part_sides(const VectorXd& load, const Patch* patch, Prescribed given, double value, Reaction& reaction);

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
  /// The last response to a sliding patch at constant depth.
  struct Glided {
    VectorXd load;
    double force = 0;
    MatrixXd shapes;
    Mat2 giving;
  };
  std::optional<Glided> glided_;
  VectorXd rest_;  ///< m; empty for a body without time
  /// The forces at the end of the last answer.
  struct Known {
    Elastic::Forces forces;
    VectorXd solved;
  };
  std::optional<Known> known_;
  int iterations_ = 0;
  int factors_ = 0;
  int in_vain_ = 0;  ///< iterations without an accurate answer
  bool stale_ = true;
};

}  // namespace tendon::softbody
