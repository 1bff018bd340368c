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

/// Rigid tools that press a nonlinear body at rest: any RigidShape, one or several at once. With the elastic
/// energy W, the layer's energy Ψ (layer.h) and the poses p of all tools, the body takes the shape of least
///
///     Π(u, p) = W(u) + Ψ(u, p)
///
/// and each hand is sent the slopes and the curvature of that one energy by its own pose:
///
///     force and torque = −∂Π/∂p,   K = Π_pp − Π_pu Π_uu⁻¹ Π_up
///
/// so a closed way of all tools together gives out no energy, and the curvatures of tool and surface are in K. Friction
/// takes energy (layer.h).
///
/// Each step solves exactly who touches: the body's stiffness is known among the nodes near the tools by the model's
/// kept factor, one solution for each unknown of a new near node, and by what the last steps taught (Pairs). On these
/// few unknowns Newton's method finds the least of the stiff layer's energy and that of a body with this stiffness; the
/// rest of the body follows by one solution. A line search makes Π fall. K comes by conjugate gradients with the same
/// inverse, and differences of the forces, to 0.2 %.
///
/// Between two answers the tools go in steps of at most half a facet, and an eighth of what the thinnest tool is thick,
/// so that a fast one does not come out on the other side. One that jumps by more than kMostSteps of these is put down
/// anew: it comes back from where the model's surface is touched from.
///
/// Thread-safe: no. Realtime-safe: no.
class RigidContact {
 public:
  struct Config {
    Layer::Config layer;      ///< `tools` is set here
    double tolerance = 1e-6;  ///< of the force, relative: an answer ends when its error is at most so large
    int max_iterations = 30;  ///< for each step of the way
    bool turns = true;        ///< torques and their stiffness are wanted
  };
  /// `body`, of the mesh `elastic`, is moved by this; both must outlive it. Its effects may have no time and no
  /// self-collision. Throws std::invalid_argument.
  RigidContact(QuasiStaticModel& body, const Elastic& elastic, const TouchSurface& surface, std::vector<HeldTool> tools,
               const Config& config);

  /// What each hand feels with the handles there (body frame); empty: that hand is nowhere. One solution for all. A
  /// pose that is not finite changes nothing: that hand gets no force, and its tool stays where it was. Throws
  /// std::invalid_argument when there are not as many as tools.
  std::vector<Feel> press(std::span<const std::optional<Pose>> handles);

  int iterations() const noexcept { return iterations_; }  ///< steps of Newton's method in the last answer
  const Layer::Dissipated& dissipated() const noexcept { return dissipated_; }  ///< by friction, in the last answer

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
  Vec3 from_;      ///< the way to where tools come from
  VectorXd rest_;  ///< m, all nodes: the shape that nothing touches
  std::vector<Layer::Placed> placed_;
  Pairs pairs_;
  int factors_ = 0;             ///< that the body had made when the next three were filled
  std::vector<int> column_of_;  ///< by free unknown, in the next; −1: not there
  MatrixXd follows_;            ///< K₀⁻¹ of unit forces, a column for each
  int columns_ = 0;             ///< of these, filled
  int iterations_ = 0;
  int in_vain_ = 0;
  double error_ = 0;  ///< N
  Layer::Dissipated dissipated_;
};

}  // namespace tendon::softbody
