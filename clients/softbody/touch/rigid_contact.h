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

/// One or several rigid tools (RigidShape) on a nonlinear body at rest. With elastic energy W, layer energy Ψ (layer.h)
/// and the poses p of all tools, the body takes the shape that minimizes
///
///     Π(u, p) = W(u) + Ψ(u, p)
///
/// and each hand receives the derivatives of this energy with respect to its own pose:
///
///     force and torque = −∂Π/∂p,   K = Π_pp − Π_pu Π_uu⁻¹ Π_up
///
/// so a closed path of all tools generates no energy, and K includes the curvatures of tool and surface. Friction
/// dissipates energy (layer.h).
///
/// Each step solves for the contact set exactly. The body's stiffness at the nodes near the tools is known from the
/// model's kept factor, one solve per unknown of a new near node, and from the last steps (Pairs). Newton's method on
/// these few unknowns minimizes the stiff layer energy plus that of a body with this stiffness; one solve then gives
/// the rest of the body. A line search reduces Π. K is computed by conjugate gradients with the same inverse and finite
/// differences of the forces, to 0.2 %.
///
/// Between two answers the tools move in steps of at most half a facet and an eighth of the thinnest tool's thickness,
/// so that a fast tool does not pass through. A jump of more than kMostSteps steps places the tool anew, approaching
/// from the side from which the surface is touched.
///
/// Thread-safe: no. Realtime-safe: no.
class RigidContact {
 public:
  struct Config {
    Layer::Config layer;      ///< `tools` is ignored
    double tolerance = 1e-6;  ///< relative error of the force
    int max_iterations = 30;  ///< for each step of the tools
    bool turns = true;        ///< compute torques
  };
  /// `elastic` is the mesh of `body`; both must outlive this object. The effects of the body must not include time or
  /// self-collision. Throws std::invalid_argument.
  RigidContact(QuasiStaticModel& body, const Elastic& elastic, const TouchSurface& surface, std::vector<HeldTool> tools,
               const Config& config);

  /// Returns an answer for each hand (body frame). An empty pose means that the hand is absent. If a pose is not
  /// finite, there is no force and the tool does not move. Throws std::invalid_argument if the number of poses is
  /// wrong.
  std::vector<Feel> press(std::span<const std::optional<Pose>> handles);

  int iterations() const noexcept { return iterations_; }                       ///< in the last answer
  const Layer::Dissipated& dissipated() const noexcept { return dissipated_; }  ///< in the last answer

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
  Vec3 from_;      ///< direction to the tools
  VectorXd rest_;  ///< m, all nodes
  std::vector<Layer::Placed> placed_;
  Pairs pairs_;
  int factors_ = 0;             ///< value of QuasiStaticModel::factors() for the columns below
  std::vector<int> column_of_;  ///< of follows_, by free unknown, or −1
  MatrixXd follows_;            ///< K₀⁻¹ of unit forces
  int columns_ = 0;
  int iterations_ = 0;
  int in_vain_ = 0;
  double error_ = 0;  ///< N
  Layer::Dissipated dissipated_;
};

}  // namespace tendon::softbody
