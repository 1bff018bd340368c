// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "clients/softbody/model.h"
#include "clients/softbody/solid.h"

namespace tendon::softbody {

/// Large rotations and strains, at rest at every instant: Newton's method on the elastic energy, with the tool's depth
/// as a constraint. It begins where the last answer ended. Without inertia: no velocity, no mass.
///
/// Each step solves with the exact second derivative; where that is not positive definite, with the one whose negative
/// eigenvalues are taken out of every point of integration. A line search keeps the energy going down, so that a body
/// that was turned inside out (Law::kNeoHookean, kCorotational) finds its way back.
class QuasiStaticModel : public Model {
 public:
  struct Config {
    int max_iterations = 30;  ///< of an answer; what is then missing is Reaction::error
    double tolerance = 1e-6;  ///< of the force, relative
  };
  QuasiStaticModel(const Solid& solid, const TouchSurface& surface, const Config& config);

  Reaction press(const Patch& patch, Given given, double value) override;
  std::size_t bytes() const noexcept override;

  int iterations() const noexcept { return iterations_; }  ///< of the last answer
  const VectorXd& displacements() const noexcept { return u_; }
  /// Puts the nodes elsewhere, m; the fixed ones too.
  void set_displacements(const VectorXd& u) { u_ = u; }
  /// Lets go of the tool and finds the shape at rest. The energy that is left, J.
  double release();

 private:
  struct Step {
    VectorXd by_itself;  ///< K⁻¹(−internal force)
    VectorXd by_tool;    ///< K⁻¹ w
  };
  Step solve(const VectorXd& internal, const VectorXd& load);
  /// Goes along `step` as far as the energy less the tool's work goes down. False when it does not.
  bool go(const VectorXd& step, const VectorXd& load, double force, double slope, double energy);
  double newton(const VectorXd& load, Given given, double value, Reaction& reaction);

  const Solid& solid_;
  Vec3 normal_;
  Config config_;
  SymmetricMatrix stiffness_;
  Factor factor_;
  VectorXd u_;
  int iterations_ = 0;
};

}  // namespace tendon::softbody
