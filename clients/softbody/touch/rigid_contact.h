// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "clients/softbody/models/pairs.h"
#include "clients/softbody/models/quasi_static.h"
#include "clients/softbody/touch/layer.h"

namespace tendon::softbody {

/// One or several rigid tools (RigidShape) on a nonlinear body at rest. The body minimizes Π(u, p) = W(u) + Ψ(u, p),
/// with the elastic energy W, the energy Ψ of the layer (layer.h) and the poses p of the tools. Each hand receives the
/// derivatives with respect to its own pose:
///
///     force and torque = −∂Π/∂p,   K = Π_pp − Π_pu Π_uu⁻¹ Π_up
///
/// Without friction, a closed path of all tools gives no energy. K includes the curvatures of the tools and of the
/// surface. In each step, the contact is solved exactly. The compliance of the nodes near the tools is computed with
/// the factor of the model, one solve for each new unknown, and is corrected by the last steps (Pairs). Newton's method
/// finds the minimum for these unknowns, and one solve moves the other nodes. A line search reduces Π. K is computed by
/// conjugate gradients and finite differences, with an error of 0.2 %.
///
/// Between two answers, the tools move in steps of at most half a facet and an eighth of the thickness of the thinnest
/// tool, so that no tool passes through the body. A tool that would need more than kMostSteps steps is moved out of the
/// body and approaches again.
///
/// Thread-safe: no. Realtime-safe: no.
class RigidContact {
 public:
  struct Config {
    Layer::Config layer;      ///< `tools` is ignored
    double tolerance = 1e-6;  ///< relative error of the force
    int max_iterations = 30;
    bool turns = true;
  };
  /// `elastic` is the mesh of `body`; both must remain valid for the lifetime of this object. The effects of the body
  /// must not include time or self-collision. Throws std::invalid_argument.
  RigidContact(QuasiStaticModel& body, const Elastic& elastic, const TouchSurface& surface, std::vector<HeldTool> tools,
               const Config& config);

  /// Returns an answer for each hand (body frame); an empty pose is an absent hand. If a pose is not finite, there is
  /// no force and the tool does not move. Throws std::invalid_argument if the number of poses is wrong.
  std::vector<Feel> press(std::span<const std::optional<Pose>> handles);

  int iterations() const noexcept { return iterations_; }
  const Layer::Dissipated& dissipated() const noexcept { return dissipated_; }

  std::size_t bytes() const noexcept;

  static constexpr int kMostSteps = 64;

 private:
  struct Local;
  void renew(Local& local);
  void put_down(std::size_t tool, const Pose& handle);
  void settle(Local& local, bool arrives);
  void look(Local& local);
  VectorXd meet(const Local& local, const VectorXd& free, double enough) const;
  VectorXd by_near(const Local& local, const VectorXd& forces) const;
  VectorXd solve(const Local& local, const VectorXd& b, const VectorXd& by_factor) const;
  bool go(const VectorXd& step, double slope, Local& local);
  double stiffest(const Local& local, std::size_t tool) const;
  double longest_step() const;
  Layer::Mat6 curve(const Local& local, std::size_t tool);
  VectorXd needed(const Local& local, const VectorXd& shape);
  Feel feel(const Local& local, std::size_t tool);

  QuasiStaticModel& body_;
  const Elastic& elastic_;
  std::vector<HeldTool> tools_;
  Config config_;
  Layer layer_;
  Vec3 from_;
  VectorXd rest_;  ///< m, all nodes
  std::vector<Layer::Placed> placed_;
  Pairs pairs_;
  int factors_ = 0;             ///< value of QuasiStaticModel::factors() for the columns below
  std::vector<int> column_of_;  ///< −1 if there is no column
  MatrixXd follows_;            ///< K₀⁻¹ of unit forces
  int columns_ = 0;
  int iterations_ = 0;
  int in_vain_ = 0;
  double error_ = 0;  ///< N
  Layer::Dissipated dissipated_;
};

}  // namespace tendon::softbody
