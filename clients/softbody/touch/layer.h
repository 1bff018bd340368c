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

/// A rigid tool with its offset from the handle.
struct HeldTool {
  RigidShape shape;
  Vec3 offset = Vec3::Zero();  ///< m, handle frame, from the handle's position to the tool's center

  Vec3 middle(const Pose& handle) const { return handle.position + handle.turn * offset; }
  /// Distance from the tool's surface to a point x of the body, in the frame of `handle`.position.
  Distance distance(const Pose& handle, const Vec3& x) const;
  double value(const Pose& handle, const Vec3& x) const { return shape.value(in_tool(handle, x)); }  ///< φ only
  Vec3 in_tool(const Pose& handle, const Vec3& x) const {
    return handle.turn.transpose() * (x - handle.position) - offset;
  }
};

/// A thin elastic layer on the surface of a body, pressed by rigid tools: contact as an energy. With the pose p of a
/// tool, its distance φ (RigidShape) from each of many points on the facets, and the area of each point,
///
///     Ψ(u, p) = Σ area · ψ(ℓ − φ(x(u); p)),   ψ″(g) = E/ℓ · clamp(g/ε, 0, 1),   ε = ℓ/10
///
/// A tool that would reach ℓ below the surface presses there with about Young's modulus. Ψ has two continuous
/// derivatives wherever φ has. Points are used instead of nodes so that the force grows smoothly on facets wider than
/// the contact.
///
/// The point spacing must be smaller than the tool is thick. A thin edge on a single row of points slips off: the row
/// snaps into the tool, and the released energy is lost to the hand. A blade 2.6 mm thick (spoon.off end on, B1 with
/// cells of 10 mm, 3 mm deep and 3 mm across) lost 81 to 88 % of the work with points 1.4 mm apart, 3 to 4 % with 0.8
/// mm, and less than 0.1 % from 0.6 mm on. Body uses a quarter of the tool's minimum thickness. A facet wider than 32
/// such pieces has too few points.
///
/// Friction at each point: at the end of an answer a pressed point is tied to the tool by a tangential spring with the
/// shear modulus over ℓ. Its force is at most µ times the pressure; beyond that the tie slides along the tool and
/// dissipates energy (`dissipated`). Within a solution the bounding pressure and normal are those of the last iteration
/// (hold()), so that friction also has an energy.
///
/// Thread-safe: no. Realtime-safe: no.
class Layer {
 public:
  struct Config {
    double thickness = 1e-4;  ///< ℓ, m, above 0
    double young = 0;         ///< E, Pa, above 0
    double friction = 0;      ///< µ, 0 or more
    double shear = 0;         ///< Pa, above 0 with friction
    double piece = 0;         ///< m, positive: approximate spacing of points on a facet; 4 × 4 to 32 × 32 points
    std::size_t tools = 1;    ///< number of tools
  };
  /// Covers the movable part of the surface of `elastic`, which must outlive this object. Throws std::invalid_argument.
  Layer(const Elastic& elastic, const Config& config);

  /// A tool at its present pose; empty: absent.
  struct Placed {
    const HeldTool* tool;
    std::optional<Pose> handle;
  };

  /// The facets close to a tool, and the nodes that move them.
  struct Near {
    struct Site {
      std::size_t tool;
      int facet;
      std::vector<int> nodes;  ///< indices into Near::nodes
    };
    std::vector<int> nodes;  ///< of the mesh, ascending
    std::vector<Site> sites;
  };
  /// The facets with a point closer to a tool than `margin` times the facet size, at displacements u.
  Near near(std::span<const Placed> tools, const VectorXd& u, double margin) const;

  using Vec6 = Eigen::Matrix<double, 6, 1>;
  using Mat6 = Eigen::Matrix<double, 6, 6>;
  /// Derivatives of Ψ with respect to a tool's pose: handle position and small rotations about it.
  struct Felt {
    Vec6 slope = Vec6::Zero();   ///< ∂Ψ/∂p: minus the force and torque on the hand
    Mat6 curve = Mat6::Zero();   ///< ∂²Ψ/∂p²
    MatrixXd mixed;              ///< ∂²Ψ/∂u∂p; three rows per node, a column per pose component
    double area = 0;             ///< m², pressed
    Vec3 middle = Vec3::Zero();  ///< m, area-weighted mean of the pressed points
    double spread = 0;           ///< m, from `middle` to the farthest pressed point
  };
  struct Press {
    double energy = 0;       ///< Ψ, J
    VectorXd slope;          ///< ∂Ψ/∂u, N, for Near::nodes
    MatrixXd curve;          ///< ∂²Ψ/∂u², N/m, for Near::nodes
    std::vector<Felt> felt;  ///< per tool
  };
  enum class Order { kEnergy, kCurve, kFelt };  ///< energy and slope; and curve; and felt
  /// With the nodes of `near` at `places`, m, one column each.
  Press press(const Near& near, std::span<const Placed> tools, const Eigen::Matrix3Xd& places, Order order) const;

  /// Positions of Near::nodes at displacements u.
  Eigen::Matrix3Xd places(const Near& near, const VectorXd& u) const;

  /// Sets the pressures and normals that bound friction from `places`.
  void hold(const Near& near, std::span<const Placed> tools, const Eigen::Matrix3Xd& places);
  /// Ends an answer: ties slide back to their bound, pressed points are tied, others released. Returns the smallest
  /// single loss and the total loss of the ties, J.
  struct Dissipated {
    double least = 0;
    double sum = 0;
    int slid = 0;  ///< number of ties
  };
  Dissipated advance(const Near& near, std::span<const Placed> tools, const Eigen::Matrix3Xd& places);
  bool rubs() const noexcept { return config_.friction > 0; }

  /// The minimum distance of the body from a tool, with the outward normal of the body there; ∞ if the tool is absent.
  struct Gap {
    double value;
    Vec3 normal;  ///< unit vector towards the tool
  };
  Gap gap(const Placed& tool, const VectorXd& u) const;

  double thickness() const noexcept { return config_.thickness; }
  double least_facet() const noexcept { return least_facet_; }  ///< m, square root of the smallest facet area
  std::size_t bytes() const noexcept;

 private:
  struct FacetOfPoints {
    std::vector<int> nodes;
    double size;        ///< m, square root of its area at rest
    double reach;       ///< m, from the mean of its nodes to the farthest node, at rest
    std::size_t first;  ///< bunch
    std::size_t count;
  };
  using Shares = Eigen::Matrix<double, 1, Eigen::Dynamic, 1, 1, 9>;  ///< weights of a facet's nodes
  struct PointOfFacet {
    double area;  ///< m², at rest
    Shares shares;
  };
  /// A cluster of points, to skip those far from a tool.
  struct Bunch {
    std::size_t first;  ///< point
    std::size_t count;
    Shares middle;
    /// Bound on the distance of a point from `middle`, relative to the distance from the mean of the facet's nodes to
    /// the farthest node, in any shape.
    double spread;
  };
  /// Friction tie between a point and a tool.
  struct Tie {
    bool tied = false;
    Vec3 at = Vec3::Zero();      ///< m, handle frame
    double most = 0;             ///< Pa, bound of its force per area
    Vec3 normal = Vec3::Zero();  ///< of the tool at the point, body frame
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
  std::vector<std::vector<Tie>> ties_;  ///< per tool, by point; empty without friction
  double least_facet_ = 0;
};

}  // namespace tendon::softbody
