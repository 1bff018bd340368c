// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "clients/softbody/fem/elastic.h"
#include "clients/softbody/touch/contact.h"
#include "clients/softbody/touch/rigid_shape.h"

namespace tendon::softbody {

/// A rigid tool as its handle holds it.
struct HeldTool {
  RigidShape shape;
  Vec3 offset = Vec3::Zero();  ///< m, handle frame, from the handle's position to the tool's middle

  Vec3 middle(const Pose& handle) const { return handle.position + handle.turn * offset; }
  /// From a point x of the body to the tool's surface; all in the frame of `handle`.position.
  Distance distance(const Pose& handle, const Vec3& x) const;
  double value(const Pose& handle, const Vec3& x) const { return shape.value(in_tool(handle, x)); }  ///< φ alone
  Vec3 in_tool(const Pose& handle, const Vec3& x) const {
    return handle.turn.transpose() * (x - handle.position) - offset;
  }
};

/// A thin elastic layer on the surface of a body, which rigid tools press: contact as an energy. With the pose p of a
/// tool, its distance φ (RigidShape) from each of many points on the facets, and the area that a point stands for,
///
///     Ψ(u, p) = Σ area · ψ(ℓ − φ(x(u); p)),   ψ″(g) = E/ℓ · clamp(g/ε, 0, 1),   ε = ℓ/10
///
/// so a tool that would reach ℓ below the surface presses there with about Young's modulus, and Ψ has two continuous
/// derivatives wherever φ has. Points and not nodes press, so the force grows without steps on facets that are wider
/// than the contact.
///
/// Points must be closer than the tool is thin. An edge that rests on a single row of them slips off it: the row snaps
/// into the tool, and what that frees is lost to the hand. A blade 2.6 mm thick (spoon.off end on, B1 in cells of 10 mm,
/// 3 mm deep and 3 mm across) lost 81 to 88 % of the work put in with points 1.4 mm apart, 3 to 4 % with 0.8 mm, and less
/// than 0.1 % from 0.6 mm on. Body takes a quarter of the tool's thinnest part. A facet that is wider than 32 such pieces
/// has too few points for it.
///
/// Friction for each point: where an answer ends, a point that is pressed is tied to the tool by a spring of shear
/// modulus over ℓ, along the surface. It pulls with at most µ times the pressure. With more, the tie slides on the tool,
/// along the pull, and what the spring loses is gone: `dissipated`. Within a solution the pressure and the normal that
/// bound the spring are those of the last iteration (hold()), so that friction too is an energy there.
///
/// Thread-safe: no. Realtime-safe: no.
class Layer {
 public:
  struct Config {
    double thickness = 1e-4;  ///< ℓ, m, above 0
    double young = 0;         ///< E, Pa, above 0
    double friction = 0;      ///< µ, 0 or more
    double shear = 0;         ///< Pa, above 0 with friction
    double piece = 0;         ///< m, above 0: the points of a facet are about as far apart; 4 × 4 to 32 × 32 of them
    std::size_t tools = 1;    ///< how many may press
  };
  /// All of the surface of `elastic` that can move. Throws std::invalid_argument. `elastic` must outlive this.
  Layer(const Elastic& elastic, const Config& config);

  /// A tool where it is now; empty: it is nowhere.
  struct Placed {
    const HeldTool* tool;
    std::optional<Pose> handle;
  };

  /// The facets that tools press or may press soon, and the nodes that move them.
  struct Near {
    struct Site {
      std::size_t tool;
      int facet;
      std::vector<int> nodes;  ///< as indices of the next
    };
    std::vector<int> nodes;  ///< of the mesh, ascending
    std::vector<Site> sites;
  };
  /// With the nodes' displacements u: the facets with a point that is nearer to a tool than `margin` of their size.
  Near near(std::span<const Placed> tools, const VectorXd& u, double margin) const;

  using Vec6 = Eigen::Matrix<double, 6, 1>;
  using Mat6 = Eigen::Matrix<double, 6, 6>;
  /// What a tool feels: Ψ by its pose, the place of the handle and small turns about it.
  struct Felt {
    Vec6 slope = Vec6::Zero();   ///< ∂Ψ/∂p: minus force and torque on the hand
    Mat6 curve = Mat6::Zero();   ///< ∂²Ψ/∂p²
    MatrixXd mixed;              ///< ∂²Ψ/∂u∂p, three rows for each node, a column for each motion
    double area = 0;             ///< m², of what is pressed
    Vec3 middle = Vec3::Zero();  ///< m, of the pressed points, by their area
    double spread = 0;           ///< m, from there to the farthest of them
  };
  struct Press {
    double energy = 0;       ///< Ψ, J
    VectorXd slope;          ///< ∂Ψ/∂u, N, of Near::nodes
    MatrixXd curve;          ///< ∂²Ψ/∂u², N/m, of the same
    std::vector<Felt> felt;  ///< of each tool
  };
  enum class Order { kEnergy, kCurve, kFelt };  ///< what is computed: energy and slope; curve too; all
  /// With the nodes of `near` at `places`, m, a column for each.
  Press press(const Near& near, std::span<const Placed> tools, const Eigen::Matrix3Xd& places, Order order) const;

  /// The places of Near::nodes with the displacements u.
  Eigen::Matrix3Xd places(const Near& near, const VectorXd& u) const;

  /// Takes pressures and normals from the present places, for the bounds of friction.
  void hold(const Near& near, std::span<const Placed> tools, const Eigen::Matrix3Xd& places);
  /// An answer ends here: ties slide back to their bound, points that are pressed are tied, others let go. Returns the
  /// least and the sum of what single ties have lost, J.
  struct Dissipated {
    double least = 0;
    double sum = 0;
    int slid = 0;  ///< ties
  };
  Dissipated advance(const Near& near, std::span<const Placed> tools, const Eigen::Matrix3Xd& places);
  bool rubs() const noexcept { return config_.friction > 0; }

  /// The least distance of the body from a tool, and the way out of the body there; ∞ without a tool.
  struct Gap {
    double value;
    Vec3 normal;  ///< a unit vector towards the tool
  };
  Gap gap(const Placed& tool, const VectorXd& u) const;

  double thickness() const noexcept { return config_.thickness; }
  double least_facet() const noexcept { return least_facet_; }  ///< m, the root of the least area of a facet
  std::size_t bytes() const noexcept;

 private:
  struct FacetOfPoints {
    std::vector<int> nodes;
    double size;        ///< m, the root of its area at rest
    double reach;       ///< m, from the mean of its nodes to the farthest of them, at rest
    std::size_t first;  ///< of its bunches
    std::size_t count;
  };
  using Shares = Eigen::Matrix<double, 1, Eigen::Dynamic, 1, 1, 9>;  ///< of a facet's nodes
  struct PointOfFacet {
    double area;  ///< m², at rest
    Shares shares;
  };
  /// Points that lie together: where their middle is far from a tool, they all are.
  struct Bunch {
    std::size_t first;  ///< of its points
    std::size_t count;
    Shares middle;
    /// No point is farther from the middle than this times the way from the mean of the facet's nodes to the farthest
    /// of them, in any shape.
    double spread;
  };
  /// A point that is tied to a tool.
  struct Tie {
    bool tied = false;
    Vec3 at = Vec3::Zero();      ///< m, handle frame
    double most = 0;             ///< Pa, the bound of its pull
    Vec3 normal = Vec3::Zero();  ///< of the tool there, in the body's frame
  };
  double pressure(double overlap, double& stiffness, double& energy) const;
  void add_bunch(FacetOfPoints& facet, std::size_t first);
  Eigen::Matrix3Xd corners(const FacetOfPoints& facet, const VectorXd& u) const;
  bool tied(const Bunch& bunch, std::size_t tool) const;
  template <class Visit>
  void each_point(const Near& near, std::span<const Placed> tools, const Eigen::Matrix3Xd& places,
                  const Visit& visit) const;
  Vec3 stretch(const Tie& tie, const Pose& handle, const Vec3& x) const;

  const Elastic& elastic_;
  Config config_;
  std::vector<FacetOfPoints> facets_;
  std::vector<Bunch> bunches_;
  std::vector<PointOfFacet> points_;
  std::vector<std::vector<Tie>> ties_;  ///< of each tool, by point; empty without friction
  double least_facet_ = 0;
};

}  // namespace tendon::softbody
